"""Parts from YAML files, with one line for whatever is wrong with them."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from chipglow.quantities import Part, Typed, adapter, placed, problem
from chipglow.text.yaml_file import DescriptionError, parse_yaml, read_yaml

Kind = TypeVar("Kind", bound=Part)


def validated(kind: type[Kind], data: Any, name: str, folder: Path) -> Kind:
    """Validate parsed YAML as a part; `folder` is where files that it names are looked up."""
    try:
        made: Kind = adapter(kind).validate_python(data, context={"folder": folder.resolve()})
    except ValidationError as error:
        raise DescriptionError(f"{name}: {problem(error)}") from None
    return made


def load_described(kind: type[Kind], path: str | Path) -> Kind:
    """Read a part from a YAML file; files that it names are looked up beside it."""
    path = Path(path)
    return validated(kind, read_yaml(path), path.name, path.parent)


def described_by(kind: type[Kind], path: Path, field: str, settings: Iterable[str]) -> Kind:
    """Read a part from a YAML file, or make one that names another file in a field.

    Files in `settings`, which were typed in a shell, are looked up in its folder.
    """
    data = read_yaml(path) if path.suffix.lower() in (".yaml", ".yml") else {field: path.name}
    for setting in settings:
        data = _with(data, setting)
    return validated(kind, data, path.name, path.parent)


def _with(data: Any, setting: str) -> Any:
    path, equals, value = setting.partition("=")
    path = path.strip()
    if not equals or not all(path.split(".")):
        raise DescriptionError(f"--set {setting}: expected FIELD=VALUE such as units.length=mm")
    try:
        return placed(data, {path: _typed(parse_yaml(value))})
    except ValueError as error:
        raise DescriptionError(f"--set {setting}: {error}") from None


def _typed(value: Any) -> Any:
    """Return data whose texts are marked as typed in a shell."""
    if isinstance(value, dict):
        return {name: _typed(part) for name, part in value.items()}
    if isinstance(value, list):
        return [_typed(part) for part in value]
    return Typed(value) if isinstance(value, str) else value
