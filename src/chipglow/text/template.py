"""Sections as commented YAML."""

import json
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import yaml
from pydantic import BaseModel

from chipglow.quantities import Section, allowed


def commented_yaml(header: str, section: Section, unused: Collection[str] = ()) -> str:
    """A section as YAML, every field with a comment."""
    values = section.model_dump(mode="json")
    return "\n".join([header, *_section_lines(section, values, "", unused)]) + "\n"


def json_schema(model: type[BaseModel]) -> str:
    """JSON schema of a model, by which editors check and complete YAML."""
    dialect = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps(dialect | model.model_json_schema(), indent=1) + "\n"


def _section_lines(
    section: Section, values: Mapping[str, Any], indent: str, unused: Collection[str] = ()
) -> Iterator[str]:
    for name, field in type(section).model_fields.items():
        if name in unused:
            continue
        value = getattr(section, name)
        if not indent and isinstance(value, BaseModel):
            yield ""
        for line in (field.description or "").splitlines():
            yield f"{indent}# {line}"
        if may_be := allowed(field):
            yield from (f"{indent}# {line}" for line in f"Allowed: {may_be}.".splitlines())
        yield from _entry_lines(name, value, values[name], indent)


def _entry_lines(name: str, value: object, plain: Any, indent: str) -> Iterator[str]:
    if isinstance(value, Section):
        yield f"{indent}{_scalar(name)}:"
        yield from _section_lines(value, plain, indent + "  ")
    elif isinstance(value, Mapping) and value:
        yield f"{indent}{_scalar(name)}:"
        for key, item in value.items():
            yield from _entry_lines(key, item, plain[key], indent + "  ")
    else:
        yield f"{indent}{_scalar(name)}: {_scalar(plain)}"


def _scalar(value: Any) -> str:
    text: str = yaml.safe_dump(
        value, default_flow_style=True, allow_unicode=True, width=float("inf"), sort_keys=False
    )
    return text.removesuffix("\n").removesuffix("\n...")
