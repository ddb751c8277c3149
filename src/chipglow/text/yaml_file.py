"""Small text files and YAML, with one line for whatever is wrong with them."""

import re
from pathlib import Path
from typing import Any, Final

import yaml

from chipglow.text.regular_file import check_regular

_WHOLE: Final = "tag:yaml.org,2002:int"
_FRACTION: Final = "tag:yaml.org,2002:float"


_LARGEST_FILE: Final = 1_000_000
"""Size limit of small text files, in bytes."""


class DescriptionError(ValueError):
    """An impossible description: names the file, the field and what was expected."""


def read_small_text(path: Path) -> str:
    """Read a text file in UTF-8, with or without a byte order mark."""
    check_regular(path)
    if path.stat().st_size > _LARGEST_FILE:
        most = f"{_LARGEST_FILE // 1000} kB"
        raise DescriptionError(f"{path}: is too large, expected a text of up to {most}")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise DescriptionError(f"{path}: expected text in UTF-8") from None


def read_yaml(path: Path) -> Any:
    """Read a YAML file; errors name the file."""
    text = read_small_text(path)
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise DescriptionError(f"{path.name}: {error}") from None


def parse_yaml(text: str) -> Any:
    """Parse YAML with the safe loader."""
    try:
        return yaml.load(text, Loader=_Loader)
    except ValueError as error:  # Such as an impossible date.
        raise DescriptionError(f"{error}, expected YAML") from None
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or "is not YAML"
        raise DescriptionError(f"{place}{problem}, expected YAML") from None


class _Loader(yaml.SafeLoader):
    """Loader that refuses duplicate keys and reads numbers as YAML 1.2: 4:8 is not 248."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"duplicate key {key.value!r}", key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep=deep)

    def construct_number(self, node: Any) -> Any:
        if ":" in node.value:
            return node.value
        whole = node.tag == _WHOLE
        return self.construct_yaml_int(node) if whole else self.construct_yaml_float(node)


for _tag in (_WHOLE, _FRACTION):
    _Loader.add_constructor(_tag, _Loader.construct_number)
_Loader.add_implicit_resolver(_FRACTION, re.compile(r"[-+]?\d+[eE][-+]?\d+$"), list("-+0123456789"))
