"""Materials as data files, each number with its unit and its source."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from chipglow.cutting import laws as _laws  # noqa: F401  (registers the laws)
from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.flow_stress import FLOW_LAWS
from chipglow.cutting.material import (
    NonlocalViscosity,
    RateTable,
    TemperatureTable,
    ToolMaterial,
    WorkpieceMaterial,
)
from chipglow.quantities import Parameter, of_other_packages
from chipglow.quantities.units import KELVINS, STRAIN_RATE
from chipglow.text import read_yaml

FOLDER: Final = Path(__file__).with_name("materials")
_OWN: Final = {
    kind: {path.stem: path for path in (FOLDER / f"{kind}s").glob("*.yaml")}
    for kind in ("workpiece", "tool")
}
_GROUP: Final = "chipglow.material"
_NAME: Final = re.compile(r"(.+\.ya?ml|[^/]*)(?:/(.*))?")
_HEADER: Final = ("kind", "name", "description")
_GROUPS: Final = ("flow_stress", "damage")
_OPTIONAL: Final = ("fitted_damage", "nonlocal_viscosity")
_TABLES_ONLY: Final = ("conductivity", "heat_capacity")
_RATE: Final = Parameter("Strain rate.", STRAIN_RATE, over=0.0)
_TEMPERATURE: Final = Parameter("Temperature.", KELVINS)


class MaterialError(ValueError):
    """A material that cannot be used: the message names file, field, value and expectation."""


class Property(NamedTuple):
    """A number of a material as its file gives it, with unit and source."""

    field: str
    """Such as ``flow_stress.ozel.hardening``."""
    text: str
    source: str


@dataclass(frozen=True)
class MaterialFile:
    """A material as its file describes it."""

    name: str
    description: str
    properties: tuple[Property, ...]
    """All numbers, in the file's order."""
    workpieces: Mapping[str, WorkpieceMaterial]
    """Material by the set of its flow stress, the default first; empty for a tool."""
    tool: ToolMaterial | None

    @property
    def kind(self) -> str:
        """``workpiece`` or ``tool``."""
        return "tool" if self.tool else "workpiece"


def material_names(kind: str | None = None) -> list[str]:
    """Return the names of the library's materials (of one kind), with those of other packages."""
    own = {name for one, names in _OWN.items() if kind in (None, one) for name in names}
    others = of_other_packages(_GROUP).keys()
    return sorted(own | {name for name in others if kind in (None, material_file(name).kind)})


def is_own_file(name: str) -> bool:
    """Return whether a name is the path of a file of one's own, with or without a set."""
    match = _NAME.fullmatch(name)
    return match is not None and match[1].endswith((".yaml", ".yml"))


def workpiece(name: str) -> WorkpieceMaterial:
    """Return a workpiece's material by its name or the path of a .yaml file, and a ``/set``.

    Without a set it is the file's first one.
    """
    match = _NAME.fullmatch(name)
    file, chosen = (match[1], match[2]) if match else (name, None)
    sets = material_file(file, "workpiece").workpieces
    if chosen is None:
        return next(iter(sets.values()))
    if chosen not in sets:
        raise MaterialError(f"{file}: {chosen!r} is no set, expected one of {', '.join(sets)}")
    return sets[chosen]


def tool_material(name: str) -> ToolMaterial:
    """Return a tool's material by its name in the library, such as ``carbide``."""
    tool = material_file(name, "tool").tool
    assert tool is not None
    return tool


def material_file(name: str, kind: str | None = None) -> MaterialFile:
    """Return a material (of a kind) by its name in the library or by a path that ends in .yaml."""
    own = is_own_file(name) and kind != "tool"
    material = read_material(Path(name)) if own else _in_library(name)
    if material is None:
        known = [*material_names(kind), *(() if kind == "tool" else ("or a file like my.yaml",))]
        raise MaterialError(f"{name!r} is unknown, expected one of {', '.join(known)}")
    if kind not in (None, material.kind):
        raise MaterialError(f"{name}: kind: {material.kind!r}, expected {kind}")
    return material


@cache
def _in_library(name: str) -> MaterialFile | None:
    """Return one of the library's own, or else of other packages: those load only if needed."""
    own = {name: path for paths in _OWN.values() for name, path in paths.items()}
    path = own.get(name) or of_other_packages(_GROUP).get(name)
    return None if path is None else read_material(Path(path))


def read_material(path: Path) -> MaterialFile:
    """Read a material from a YAML file."""
    try:
        data = read_yaml(path)
    except ValueError as error:
        raise MaterialError(str(error)) from None
    try:
        return _material(data)
    except ValueError as error:
        raise MaterialError(f"{path.name}: {error}") from None


def _material(data: Any) -> MaterialFile:
    kind = data.get("kind") if isinstance(data, Mapping) else None
    if kind not in _OWN:
        raise ValueError(f"kind: {kind!r}, expected workpiece or tool")
    is_tool = kind == "tool"
    declared = ToolMaterial.declared() if is_tool else WorkpieceMaterial.declared()
    groups, optional = ((), ()) if is_tool else (_GROUPS, _OPTIONAL)
    _check_keys("", data, (*_HEADER, *declared, *groups), optional)
    name, description = (_text(key, data[key]) for key in ("name", "description"))
    values = {key: _property(key, data[key], one) for key, one in declared.items()}
    tool = _called("tool", ToolMaterial, name=name, **values) if is_tool else None
    workpieces = {} if is_tool else _workpieces(name, data, values)
    return MaterialFile(name, description, tuple(_numbers("", data)), workpieces, tool)


def _workpieces(
    name: str, data: Mapping[str, Any], values: dict[str, Any]
) -> dict[str, WorkpieceMaterial]:
    for key in _TABLES_ONLY:
        if not isinstance(values[key], TemperatureTable):
            given = data[key]["value"]
            raise ValueError(f"{key}: {given!r}, expected rows of [temperature, value]")
    failure: dict[str, Any] = {"damage": None}
    if data["damage"] != "none":
        failure["damage"] = _group("damage", data["damage"], JohnsonCookDamage)
    if "fitted_damage" in data:
        failure["fitted_damage"] = _fitted("fitted_damage", data["fitted_damage"])
    if data.get("nonlocal_viscosity") is not None:
        place = "nonlocal_viscosity"
        values[place] = _group(place, data[place], NonlocalViscosity)
    laws = data["flow_stress"]
    if not isinstance(laws, Mapping) or not laws:
        raise ValueError(f"flow_stress: {laws!r}, expected one set or more by name")
    sets = {}
    for chosen, law in laws.items():
        numbers: Any = dict(law) if isinstance(law, Mapping) else {}
        named, damage = numbers.pop("law", "johnson-cook"), numbers.pop("damage", None)
        place, kind = f"flow_stress.{chosen}", FLOW_LAWS.find(named)
        if kind is None:
            known = ", ".join(sorted(FLOW_LAWS.kinds))
            raise ValueError(f"{place}.law: {named!r}, expected one of {known}")
        if damage not in (None, "none"):
            raise ValueError(f"{place}.damage: {damage!r}, expected none, or to be left out")
        values |= {"name": f"{name}, flow stress {chosen}", **failure}
        values["flow_stress"] = _group(place, numbers, kind)
        if damage is not None:
            values |= {"damage": None, "fitted_damage": None}
        sets[str(chosen)] = _called("workpiece", WorkpieceMaterial, **values)
    return sets


def _fitted(place: str, data: Any) -> Any:
    names = tuple(FittedDamage.declared())
    _check_keys(place, data, (*names, "source"))
    _text(f"{place}.source", data["source"])
    return _called(place, FittedDamage, **{name: data[name] for name in names})


def _group(place: str, data: Any, kind: Any) -> Any:
    """Return a part whose numbers share one source."""
    declared = kind.declared()
    _check_keys(place, data, (*declared, "source"))
    _text(f"{place}.source", data["source"])
    values = {
        key: _called(f"{place}.{key}", one.number, data[key]) for key, one in declared.items()
    }
    return _called(place, kind, **values)


def _property(place: str, data: Any, parameter: Parameter) -> Any:
    """Return a number, or a table of rows over the temperature or the strain rate."""
    _check_keys(place, data, ("value", "source"))
    _text(f"{place}.source", data["source"])
    rows = data["value"]
    if not isinstance(rows, list):
        return _called(place, parameter.number, rows)
    by_rate = place == "taylor_quinney"
    over, argument = ("strain rate", _RATE) if by_rate else ("temperature", _TEMPERATURE)
    if not rows:
        raise ValueError(f"{place}: [], expected rows of [{over}, value]")
    pairs = []
    for row in rows:
        if not isinstance(row, list) or len(row) != 2:
            raise ValueError(f"{place}: {row!r}, expected [{over}, value]")
        columns = zip((argument, parameter), row, strict=True)
        pairs.append([_called(place, column.number, value) for column, value in columns])
    return _called(place, RateTable if by_rate else TemperatureTable, *zip(*pairs, strict=True))


def _numbers(place: str, data: Mapping[str, Any]) -> Iterator[Property]:
    """Yield all numbers below a place: they stand beside a source."""
    for key, value in data.items():
        below = f"{place}.{key}".lstrip(".")
        source = str(data.get("source", "")).strip()
        if isinstance(value, Mapping):
            yield from _numbers(below, value)
        elif key == "relative_covariance":
            for name, row in zip(data["numbers"], value, strict=True):
                yield Property(f"{place}.{name}", str(row), source)
        elif key == "value":
            rows = value if isinstance(value, list) else []
            texts = [f"{row[1]} at {row[0]}" for row in rows] or [str(value)]
            yield from (Property(place, text, source) for text in texts)
        elif source and key not in ("source", "law", "damage", "numbers"):
            yield Property(below, str(value), source)


def _called(place: str, make: Callable[..., Any], *arguments: Any, **values: Any) -> Any:
    """Call, and put the place before the message of a ValueError."""
    try:
        return make(*arguments, **values)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _check_keys(
    place: str, data: object, keys: tuple[str, ...], optional: tuple[str, ...] = ()
) -> None:
    if not isinstance(data, Mapping):
        raise ValueError(f"{place}: {data!r}, expected keys {', '.join(keys)}")
    prefix = f"{place}." if place else ""
    for key in data:
        if key not in (*keys, *optional):
            expected = ", ".join((*keys, *optional))
            raise ValueError(f"{prefix}{key}: unknown, expected one of {expected}")
    for key in keys:
        if key not in data:
            raise ValueError(f"{prefix}{key}: is missing, expected a value")


def _text(place: str, text: object) -> str:
    if not isinstance(text, str) or not text.strip():
        raise ValueError(f"{place}: {text!r}, expected text")
    return text.strip()
