"""The settings of a part, one by one: for comments, tables, controls and options."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from pydantic import ValidationError

from chipglow.quantities.parameter import Parameter
from chipglow.quantities.part import Part, PartType, adapter, families, first_sentence, problem
from chipglow.quantities.units import Quantity


@dataclass(frozen=True)
class Setting:
    """A field of a part by its path, such as ``camera.psf.fwhm``, with its value in SI units."""

    path: str
    parameter: Parameter
    kind: Any
    value: Any
    plain: Any  # as YAML has it
    default: Any = None  # None if it must be given
    examples: str = ""  # a line for each kind of part that may be chosen

    @property
    def name(self) -> str:
        return self.path.rpartition(".")[2]

    @property
    def meaning(self) -> str:
        return self.parameter.meaning

    @property
    def allowed(self) -> str:
        """Which values are allowed, in words; empty if anything of its type is."""
        return self.parameter.words(self.kind)

    @property
    def unit(self) -> str:
        """Unit in which it is written; empty for none."""
        return self.parameter.quantity.unit if self.parameter.quantity else ""

    @property
    def is_section(self) -> bool:
        return isinstance(self.value, Part)


def settings(part: Part) -> dict[str, Setting]:
    """Return all settings of a part and of those within it, by their paths."""
    found = {}
    for one in own_settings(part):
        found[one.path] = one
        if one.is_section:
            for path, inner in settings(one.value).items():
                found[f"{one.path}.{path}"] = replace(inner, path=f"{one.path}.{path}")
    return found


def own_settings(part: Part) -> Iterator[Setting]:
    """Yield the settings of a part itself, in their order."""
    plain, defaults = adapter(type(part)).dump_python(part, mode="json"), part.defaults()
    for name in plain:
        value = getattr(part, name)
        if name not in part._annotations:
            yield Setting(name, Parameter(first_sentence(type(part))), str, value, value, value)
            continue
        annotation, default = part._annotations[name], defaults.get(name)
        examples = next((family.examples for family in families(annotation)), "")
        of = annotation.__origin__
        yield Setting(name, part.parameter(name), of, value, plain[name], default, examples)


def value_at(part: Any, path: str) -> Any:
    """Return a setting's value by its path; a LookupError if it does not exist."""
    for key in path.split("."):
        if isinstance(part, tuple):
            part = dict(enumerate(part))[int(key) if key.isdigit() else -1]
        elif isinstance(part, Mapping):
            part = part[key]
        elif isinstance(part, Part) and (key in part.declared() or (key == "kind" and part.kind)):
            part = getattr(part, key)
        else:
            raise LookupError(path)
    return part


def setting_at(part: Part, path: str) -> Setting:
    """Return a setting by its path; one in a list or a mapping has unit and type of the whole."""
    keys, owner, at = path.split("."), part, 0
    for count in range(1, len(keys)):
        inner = value_at(part, ".".join(keys[:count]))
        if isinstance(inner, Part):
            owner, at = inner, count
    found = {one.name: one for one in own_settings(owner)}[keys[at]]
    return replace(found, path=path, value=value_at(part, path))


def value_text(value: object, quantity: Quantity | None) -> str:
    """Return the value of a setting in its unit."""
    if isinstance(value, str):
        return value
    if value is None or value != value:
        return "none"
    return quantity.text(value) if quantity and isinstance(value, float) else f"{value}"


def changed(part: PartType, changes: Mapping[str, object]) -> PartType:
    """Return a copy with other values by their paths, all checked; a ValueError if impossible."""
    for section in (path.rpartition(".")[0] for path in changes):
        if section:
            value_at(part, section)  # a LookupError if it does not exist
    try:
        made: PartType = adapter(type(part)).validate_python(placed(part, changes))
    except ValidationError as error:
        raise ValueError(problem(error)) from None
    return made


def placed(stated: Any, changes: Mapping[str, object]) -> Any:
    """Return what a description states, with other values by their paths; sections may be new.

    It is a part, or the mapping, the list or the value that a YAML file holds.
    """
    data = _entries(stated)
    inner: dict[str, dict[str, object]] = {}
    for path, value in changes.items():
        name, dot, rest = path.partition(".")
        if dot:
            inner.setdefault(name, {})[rest] = value
        else:
            data[name] = value
    for name, one in inner.items():
        default = getattr(stated, name) if isinstance(stated, Part) else None
        data[name] = placed(data.get(name, default), one)
    if not isinstance(stated, list | tuple):
        return data
    if list(data) != [str(number) for number in range(len(data))]:
        raise ValueError(f"{', '.join(changes)}: expected a position in a list, from 0")
    return type(stated)(data.values())


def _entries(stated: Any) -> dict[str, Any]:
    """Return the entries of a part, a mapping or a list by their names; none of all else."""
    if isinstance(stated, Part):
        return stated.stated()
    if isinstance(stated, list | tuple):
        return {str(number): one for number, one in enumerate(stated)}
    return dict(stated) if isinstance(stated, Mapping) else {}
