"""Sections as commented YAML and JSON schemas."""

import json
import re
from collections.abc import Collection, Iterator, Mapping
from textwrap import wrap
from typing import Any, Final

import yaml
from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue, NoDefault
from pydantic_core import SchemaSerializer, core_schema

from chipglow.quantities import Part, Section, adapter, own_settings

_WIDTH: Final = 90
"""Letters in a line of comment."""


def commented_yaml(header: str, section: Section | Part, unused: Collection[str] = ()) -> str:
    """Write a section as YAML, every field with a comment."""
    return "\n".join([header, *_section_lines(section, "", unused)]) + "\n"


class _TextDefaults(GenerateJsonSchema):
    """Defaults as YAML has them: text with a unit."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        """Schema of a field with its default."""
        json = self.generate_inner(schema["schema"])
        default = self.get_default_value(schema)
        if default is NoDefault:
            return json
        if default is None:
            return json | {"default": "none"}
        if isinstance(default, Section | Part):
            return json | {"default": adapter(type(default)).dump_python(default, mode="json")}
        text = SchemaSerializer(schema["schema"]).to_python(default, mode="json")
        return json | {"default": text}


def json_schema(kind: type) -> str:
    """JSON schema of a section, by which editors check and complete YAML."""
    dialect = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    schema = TypeAdapter(kind).json_schema(schema_generator=_TextDefaults)
    return json.dumps(dialect | schema, indent=1) + "\n"


def _section_lines(
    section: Section | Part, indent: str, unused: Collection[str] = ()
) -> Iterator[str]:
    for one in own_settings(section):
        if one.name in unused:
            continue
        if not indent and one.is_section:
            yield ""
        allowed = f"Allowed: {one.allowed}." if one.allowed else ""
        kinds = f"Kinds:\n{one.examples}" if one.examples else ""
        for line in (*_wrapped(one.meaning), *_wrapped(allowed), *kinds.splitlines()):
            yield f"{indent}# {line}"
        yield from _entry_lines(one.name, one.value, one.plain, indent)


def _entry_lines(name: str, value: object, plain: Any, indent: str) -> Iterator[str]:
    if isinstance(value, Section | Part):
        yield f"{indent}{_scalar(name)}:"
        yield from _section_lines(value, indent + "  ")
    elif isinstance(value, Mapping) and value:
        yield f"{indent}{_scalar(name)}:"
        for key, item in value.items():
            yield from _entry_lines(key, item, plain[key], indent + "  ")
    else:
        yield f"{indent}{_scalar(name)}: {_scalar(plain)}"


def _wrapped(text: str) -> list[str]:
    """Lines of a text; a number stays with its unit."""
    joined = re.sub(r"(?<=\d) (?=[a-z])", "\xa0", text)
    lines = [wrap(one, _WIDTH, break_on_hyphens=False) for one in joined.splitlines()]
    return [one.replace("\xa0", " ") for each in lines for one in each]


def _scalar(value: Any) -> str:
    text: str = yaml.safe_dump(
        value, default_flow_style=True, allow_unicode=True, width=float("inf"), sort_keys=False
    )
    return text.removesuffix("\n").removesuffix("\n...")
