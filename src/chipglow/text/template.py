"""Parts as commented YAML and JSON schemas."""

import json
import re
from collections.abc import Collection, Iterator, Mapping
from textwrap import wrap
from typing import Any, Final

import yaml

from chipglow.quantities import Part, adapter, own_settings

_WIDTH: Final = 90
"""Letters in a line of comment."""


def commented_yaml(header: str, section: Part, unused: Collection[str] = ()) -> str:
    """Write a part as YAML, every field with a comment."""
    return "\n".join([header, *_section_lines(section, "", unused)]) + "\n"


def json_schema(kind: type) -> str:
    """Return the JSON schema of a part, by which editors check and complete YAML."""
    dialect = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps(dialect | adapter(kind).json_schema(), indent=1) + "\n"


def _section_lines(section: Part, indent: str, unused: Collection[str] = ()) -> Iterator[str]:
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
    if isinstance(value, Part):
        yield f"{indent}{yaml_line(name)}:"
        yield from _section_lines(value, indent + "  ")
    elif isinstance(value, Mapping) and value:
        yield f"{indent}{yaml_line(name)}:"
        for key, item in value.items():
            yield from _entry_lines(key, item, plain[key], indent + "  ")
    else:
        yield f"{indent}{yaml_line(name)}: {yaml_line(plain)}"


def _wrapped(text: str) -> list[str]:
    """Return lines of a text; a number stays with its unit."""
    joined = re.sub(r"(?<=\d) (?=[a-z])", "\xa0", text)
    lines = [wrap(one, _WIDTH, break_on_hyphens=False) for one in joined.splitlines()]
    return [one.replace("\xa0", " ") for each in lines for one in each]


def yaml_line(value: Any) -> str:
    """Return a value as YAML in one line."""
    text: str = yaml.safe_dump(
        value, default_flow_style=True, allow_unicode=True, width=float("inf"), sort_keys=False
    )
    return text.removesuffix("\n").removesuffix("\n...")
