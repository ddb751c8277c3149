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

_MOST_NODES: Final = 10_000
"""Keys and values of a YAML text, those of aliases counted each time; ours have up to 700."""

_MOST_LEVELS: Final = 50
"""Sections within sections, through aliases too; ours have up to 7."""

_LARGEST_WHOLE: Final = 10**300
"""Largest absolute whole number; it is less than the largest double."""

_UNFIT: Final = (LookupError, AttributeError, TypeError, ArithmeticError)
"""Errors that the loader raises for values such as !!int "" or !!timestamp x."""


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
    """Parse YAML with the safe loader, up to a number of nodes and levels."""
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
        problem = getattr(error, "problem", None) or "is not YAML"
        raise DescriptionError(f"{place}{problem}, expected YAML") from None
    except ValueError as error:
        raise DescriptionError(f"{error}, expected YAML") from None
    except _UNFIT:
        raise DescriptionError("a value does not fit its tag, expected YAML") from None


class _Loader(yaml.SafeLoader):
    """Loader with limits that refuses duplicate keys and reads numbers as YAML 1.2: 4:8 is not 248.

    Nodes and levels are counted while the text is parsed, so that nothing is expanded before.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._nodes = 0
        self._open: list[int] = []
        """Levels below each node that is not complete."""
        self._sizes: dict[Any, tuple[int, int]] = {}
        """Nodes of each complete node, itself included, and levels below it."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        event: Any = self.peek_event()  # type: ignore[no-untyped-call]
        mark, before = event.start_mark, self._nodes
        if len(self._open) > _MOST_LEVELS:
            raise _refused(f"has over {_MOST_LEVELS} levels of sections", mark)
        if self.check_event(yaml.AliasEvent):
            node = super().compose_node(parent, index)
            if node not in self._sizes:
                raise _refused("contains itself", mark)
            nodes, levels = self._sizes[node]
            self._nodes += nodes
        else:
            self._nodes += 1
            self._open.append(0)
            node = super().compose_node(parent, index)
            levels = self._open.pop()
            self._sizes[node] = self._nodes - before, levels
        if self._open:
            self._open[-1] = max(self._open[-1], levels + 1)
        if len(self._open) + levels > _MOST_LEVELS:
            raise _refused(f"has over {_MOST_LEVELS} levels of sections", mark)
        if self._nodes > _MOST_NODES:
            raise _refused(f"has over {_MOST_NODES} keys and values", mark)
        return node

    def compose_scalar_node(self, anchor: Any) -> Any:
        node = super().compose_scalar_node(anchor)
        if any("\ud800" <= character <= "\udfff" for character in node.value):
            raise _refused("has half a character", node.start_mark)
        return node

    def compose_mapping_node(self, anchor: Any) -> Any:
        node = super().compose_mapping_node(anchor)
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise _refused(f"duplicate key {key.value!r}", key.start_mark)
            seen.add(key.value)
        return node

    def construct_number(self, node: Any) -> Any:
        if ":" in node.value:
            return node.value
        if node.tag != _WHOLE:
            return self.construct_yaml_float(node)
        number = self.construct_yaml_int(node)
        if abs(number) > _LARGEST_WHOLE:
            raise _refused("the number is too large", node.start_mark)
        return number


def _refused(problem: str, mark: Any) -> yaml.YAMLError:
    return yaml.MarkedYAMLError(problem=problem, problem_mark=mark)


for _tag in (_WHOLE, _FRACTION):
    _Loader.add_constructor(_tag, _Loader.construct_number)
_Loader.add_implicit_resolver(_FRACTION, re.compile(r"[-+]?\d+[eE][-+]?\d+$"), list("-+0123456789"))
