"""YAML that people write: safe, no key twice, one line for whatever is wrong with it."""

import re
from pathlib import Path
from typing import Any, Final

import yaml

from chipglow.text.small_file import read_small_text

_WHOLE: Final = "tag:yaml.org,2002:int"
_FRACTION: Final = "tag:yaml.org,2002:float"


def read_yaml(path: Path) -> Any:
    """What a YAML file holds."""
    text = read_small_text(path)
    try:
        return parse_yaml(text)
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from None


def parse_yaml(text: str) -> Any:
    """What a text in YAML holds, read with the safe loader."""
    try:
        return yaml.load(text, Loader=_Loader)
    except ValueError as error:  # Such as an impossible date.
        raise ValueError(f"{error}, expected YAML") from None
    except (yaml.YAMLError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or "is no YAML"
        raise ValueError(f"{place}{problem}, expected YAML") from None


class _Loader(yaml.SafeLoader):
    """YAML with no key twice in a mapping, and with the numbers of YAML 1.2.

    So 1e-3 is one, and 4:8 is not 248: YAML 1.1 reads it in base 60, as hours and minutes.
    """

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key.value!r} is there twice", key.start_mark
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
