"""Materials as data files, each number with its unit and its source."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from pydantic import ValidationError

from chipglow.cutting import laws as _laws  # noqa: F401  (registers the laws)
from chipglow.cutting.flow_stress import FLOW_LAWS
from chipglow.cutting.material import RateTable, TemperatureTable, ToolMaterial, WorkpieceMaterial
from chipglow.quantities import Parameter, adapter, of_other_packages, problem
from chipglow.quantities.units import KELVINS, STRAIN_RATE
from chipglow.text import read_yaml

FOLDER: Final = Path(__file__).with_name("materials")
_OWN: Final = {
    kind: {path.stem: path for path in (FOLDER / f"{kind}s").glob("*.yaml")}
    for kind in ("workpiece", "tool")
}
_GROUP: Final = "chipglow.material"
_NAME: Final = re.compile(r"(.+\.ya?ml|[^/]*)(?:/(.*))?")
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
    """Return the names of all materials (of one kind), also of other packages."""
    own = {name for one, names in _OWN.items() if kind in (None, one) for name in names}
    others = of_other_packages(_GROUP).keys()
    return sorted(own | {name for name in others if kind in (None, material_file(name).kind)})


def is_own_file(name: str) -> bool:
    """Return whether a name is the path of a user's file, with or without a set."""
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
        raise MaterialError(f"{file}: {chosen!r} is not a set, expected one of {', '.join(sets)}")
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
    values = _without_sources("", data)
    for key, value in values.items():
        if isinstance(value, list) and key in WorkpieceMaterial.declared():
            values[key] = _table(key, value)
    del values["kind"]
    name, description = (_text(key, values.get(key)) for key in ("name", "description"))
    del values["description"]
    is_tool = kind == "tool"
    workpieces = {} if is_tool else _workpieces(name, values)
    tool = _part("", ToolMaterial, values) if is_tool else None
    return MaterialFile(name, description, tuple(_numbers("", data)), workpieces, tool)


def _without_sources(place: str, data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the numbers of a file alone; a group without subgroups must state a source."""
    values = {}
    for key, value in data.items():
        below = f"{place}.{key}".lstrip(".")
        if key == "source":
            continue
        if isinstance(value, Mapping):
            if not all(isinstance(one, Mapping) for one in value.values()):
                _text(f"{below}.source", value.get("source"))
            value = _without_sources(below, value)
            if value.keys() == {"value"}:
                value = value["value"]
        values[key] = value
    return values


def _table(place: str, rows: list[Any]) -> RateTable | TemperatureTable:
    """Return a table of a property over the temperature or the strain rate."""
    by_rate = place == "taylor_quinney"
    over, argument = ("strain rate", _RATE) if by_rate else ("temperature", _TEMPERATURE)
    parameter = WorkpieceMaterial.declared()[place]
    for row in rows or [rows]:
        if not isinstance(row, list) or len(row) != 2:
            raise ValueError(f"{place}: {row!r}, expected [{over}, value]")
    try:
        pairs = [(argument.number(first), parameter.number(value)) for first, value in rows]
        columns = zip(*pairs, strict=True)
        return RateTable(*columns) if by_rate else TemperatureTable(*columns)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None


def _workpieces(name: str, values: dict[str, Any]) -> dict[str, WorkpieceMaterial]:
    """Return a material for each set of its flow stress."""
    for key in ("conductivity", "heat_capacity"):
        if key in values and not isinstance(values[key], TemperatureTable):
            raise ValueError(f"{key}: {values[key]!r}, expected rows of [temperature, value]")
    laws = values.get("flow_stress")
    if not isinstance(laws, Mapping) or not laws:
        raise ValueError(f"flow_stress: {laws!r}, name at least one set")
    sets = {}
    for chosen, law in laws.items():
        place, numbers = f"flow_stress.{chosen}", dict(law) if isinstance(law, Mapping) else {}
        named, damage = numbers.pop("law", "johnson-cook"), numbers.pop("damage", None)
        kind = FLOW_LAWS.find(named)
        if kind is None:
            known = ", ".join(sorted(FLOW_LAWS.kinds))
            raise ValueError(f"{place}.law: {named!r}, expected one of {known}")
        if damage not in (None, "none"):
            raise ValueError(f"{place}.damage: {damage!r}, must be none or omitted")
        own = {"name": f"{name}, flow stress {chosen}", "flow_stress": _part(place, kind, numbers)}
        if damage is not None:
            own |= {"damage": None, "fitted_damage": None}
        sets[str(chosen)] = _part("", WorkpieceMaterial, values | own)
    return sets


def _part(place: str, kind: Any, values: Any) -> Any:
    """Read a part; an error names its place in the file."""
    try:
        return adapter(kind).validate_python(values, context={"folder": Path()})
    except ValidationError as error:
        named = error.errors(include_url=False)[0]["loc"]
        separator = "." if named else ": "
        raise ValueError(f"{place}{separator if place else ''}{problem(error)}") from None


def _numbers(place: str, data: Mapping[str, Any]) -> Iterator[Property]:
    """Yield all numbers below a place, which need a source."""
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


def _text(place: str, text: object) -> str:
    if not isinstance(text, str) or not text.strip():
        shown = "is missing" if text is None else repr(text)
        raise ValueError(f"{place}: {shown}, expected text")
    return text.strip()
