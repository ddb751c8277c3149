"""Study files: YAML in, one clear line for whatever is wrong with it."""

import re
from pathlib import Path
from typing import Any, Final

import yaml
from pydantic import ValidationError

from chipglow.study.schema import Study

_LARGEST_FILE: Final = 1_000_000


class StudyError(ValueError):
    """A study that cannot be run: the message names the file, the field and what was expected."""


def load_study(path: str | Path) -> Study:
    """Read a study from a YAML file.

    Parameters
    ----------
    path : str or Path
        The file. Files that it names are looked up beside it.

    Raises
    ------
    StudyError
        If the file is no YAML or the study is not possible.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    if path.stat().st_size > _LARGEST_FILE:
        raise StudyError(f"{path.name}: expected a study of up to {_LARGEST_FILE // 1000} kB")
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Loader=_Loader)
    except UnicodeDecodeError:
        raise StudyError(f"{path.name}: expected text in UTF-8") from None
    except (yaml.YAMLError, RecursionError) as error:
        raise StudyError(f"{path.name}: {_yaml_problem(error)}") from None
    try:
        return Study.model_validate(data, context={"folder": path.parent.resolve()})
    except ValidationError as error:
        raise StudyError(f"{path.name}: {problem(error)}") from None


def problem(error: ValidationError) -> str:
    """One line for the first problem of a study: field, value and what was expected."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"] if part not in _PSF_KINDS)
    if first["type"] == "value_error":
        message = str(first["ctx"]["error"])
    elif first["type"] == "missing":
        message = "is missing, expected a value"
    elif first["type"] in ("union_tag_invalid", "union_tag_not_found"):
        message = f"{first['input']!r}, expected kind: {', '.join(_PSF_KINDS)}, or none"
    else:
        expectation = first["msg"].removeprefix("Input should be ").removeprefix("Value should be ")
        message = f"{first['input']!r}, expected {expectation}"
    message = message.removeprefix(f"{place.rpartition('.')[2]}: ")
    return f"{place}: {message}" if place else message


_PSF_KINDS: Final = ("annular-aperture", "gaussian", "measured")


class _Loader(yaml.SafeLoader):
    """YAML with no key twice in a mapping, and with numbers such as 1e-3 as YAML 1.2 has them."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key.value!r} is there twice", key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep=deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?\d+[eE][-+]?\d+$"), list("-+0123456789")
)


def _yaml_problem(error: Exception) -> str:
    mark = getattr(error, "problem_mark", None)
    place = f"line {mark.line + 1}, column {mark.column + 1}: " if mark else ""
    return f"{place}{getattr(error, 'problem', None) or 'is no YAML'}, expected YAML"
