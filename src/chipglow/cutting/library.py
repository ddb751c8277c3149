"""Materials as data files, each number with its unit and its source."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from chipglow.cutting import laws as _laws  # noqa: F401  (registers the laws)
from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.flow_stress import FLOW_LAWS
from chipglow.cutting.material import RateTable, TemperatureTable, ToolMaterial, WorkpieceMaterial
from chipglow.cutting.nonlocal_viscosity import NonlocalViscosity
from chipglow.quantities import Parameter, of_other_packages
from chipglow.quantities.units import KELVINS, STRAIN_RATE
from chipglow.text import read_yaml

FOLDER: Final = Path(__file__).with_name("materials")
_FOLDERS: Final = {"workpiece": FOLDER / "workpieces", "tool": FOLDER / "tools"}
_OWN: Final = {
    kind: {path.stem: path for path in folder.glob("*.yaml")} for kind, folder in _FOLDERS.items()
}


class MaterialError(ValueError):
    """A material that cannot be used: the message names file, field, value and expectation."""


class Property(NamedTuple):
    """A number of a material as its file gives it.

    The field (``flow_stress.ozel.hardening``), its value as text with the unit, and its source.
    """

    field: str
    text: str
    source: str


@dataclass(frozen=True)
class MaterialFile:
    """What a file of the library says.

    Parameters
    ----------
    name, description : str
        Of the material, for readers.
    properties : tuple of Property
        All numbers, in the file's order.
    workpieces : mapping of str to WorkpieceMaterial
        The workpiece's material by the set of its flow stress, the default first; empty for a tool.
    tool : ToolMaterial or None
        The tool's material.
    """

    name: str
    description: str
    properties: tuple[Property, ...]
    workpieces: Mapping[str, WorkpieceMaterial]
    tool: ToolMaterial | None


_RATE: Final = Parameter("Strain rate.", STRAIN_RATE, over=0.0)
_TEMPERATURE: Final = Parameter("Temperature.", KELVINS)
_CONSTANT_OR_TABLE: Final = ("density", "young_modulus", "poisson_ratio")
_TABLES: Final = ("conductivity", "heat_capacity")
_GROUP: Final = "chipglow.material"
_HEADER: Final = ("kind", "name", "description")
_WORKPIECE_PARTS: Final = (*_CONSTANT_OR_TABLE, "taylor_quinney", *_TABLES, "flow_stress", "damage")
_OPTIONAL: Final = ("fitted_damage", "nonlocal_viscosity")
_OWN_FILE: Final = re.compile(r"(.+\.ya?ml)(?:/([^/]+))?")


def material_names(kind: str | None = None) -> list[str]:
    """Names of the library's materials, with those of other packages.

    A package adds its own by entry points in the group ``chipglow.material``: the path of a file.

    Parameters
    ----------
    kind : {'workpiece', 'tool'}, optional
        Only these.
    """
    own = {name for one, names in _OWN.items() if kind in (None, one) for name in names}
    others = of_other_packages(_GROUP).keys()
    return sorted(own | {n for n in others if kind in (None, _kind(material_file(n)))})


def is_own_file(name: str) -> bool:
    """Whether a name is the path of a file of one's own, with or without a set."""
    return _OWN_FILE.fullmatch(name) is not None


def workpiece(name: str) -> WorkpieceMaterial:
    """Material of a workpiece.

    Parameters
    ----------
    name : str
        A name of the library (``aisi-1045``), or the path of a file of one's own that ends in
        .yaml; with a set of the flow stress after a slash (``aisi-1045/ozel``) or with the file's
        first.

    Raises
    ------
    MaterialError
        If there is no such material, or its file is not as it should be.
    OSError
        If a file of one's own cannot be read.
    """
    own = _OWN_FILE.fullmatch(name)
    file, chosen = (own[1], own[2]) if own else (name.split("/")[0], _after_slash(name))
    material = read_material(Path(file)) if own else _in_library(file)
    if material is None or (material.tool and not own):
        known = ", ".join(material_names("workpiece"))
        raise MaterialError(f"{name!r} is unknown, expected one of {known}, or a file like my.yaml")
    sets = material.workpieces
    if not sets:
        raise MaterialError(f"{file}: kind: 'tool', expected workpiece")
    if chosen is None:
        return next(iter(sets.values()))
    if chosen not in sets:
        raise MaterialError(f"{file}: {chosen!r} is no set, expected one of {', '.join(sets)}")
    return sets[chosen]


def tool_material(name: str) -> ToolMaterial:
    """Material of a tool by its name in the library, such as ``carbide``.

    Raises
    ------
    MaterialError
        If there is none of that name.
    """
    material = _in_library(name)
    if material is None or material.tool is None:
        known = ", ".join(material_names("tool"))
        raise MaterialError(f"{name!r} is unknown, expected one of {known}")
    return material.tool


def material_file(name: str) -> MaterialFile:
    """Read a material's file, by its name in the library or by a path that ends in .yaml.

    Raises
    ------
    MaterialError
        If the name is unknown or the file is not as it should be.
    OSError
        If a file of one's own cannot be read.
    """
    if _OWN_FILE.fullmatch(name):
        return read_material(Path(name))
    material = _in_library(name)
    if material is None:
        raise MaterialError(f"{name!r} is unknown, expected one of {', '.join(material_names())}")
    return material


def read_material(path: Path) -> MaterialFile:
    """Read a material from a file.

    Raises
    ------
    MaterialError
        If the file is not as it should be: unknown or missing field, value without its unit.
    OSError
        If it cannot be read.
    """
    try:
        data = read_yaml(path)
    except ValueError as error:
        raise MaterialError(str(error)) from None
    return _Reader(path.name).material(data)


def _after_slash(name: str) -> str | None:
    _, slash, rest = name.partition("/")
    return rest if slash else None


@cache
def _in_library(name: str) -> MaterialFile | None:
    """Of the library's own, or else of other packages: those load only if they are needed."""
    own = {name: path for paths in _OWN.values() for name, path in paths.items()}
    path = own.get(name) or of_other_packages(_GROUP).get(name)
    return None if path is None else read_material(Path(path))


def _kind(material: MaterialFile) -> str:
    return "tool" if material.tool else "workpiece"


def _has_rows(data: object) -> bool:
    return isinstance(data, Mapping) and isinstance(data.get("value"), list)


class _Reader:
    """Takes a file's data apart and keeps all its numbers as text."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._properties: list[Property] = []

    def material(self, data: object) -> MaterialFile:
        kind = data.get("kind") if isinstance(data, Mapping) else None
        if kind not in ("workpiece", "tool"):
            raise self._wrong("kind", kind, "workpiece or tool")
        parts = tuple(ToolMaterial.declared()) if kind == "tool" else _WORKPIECE_PARTS
        if isinstance(data, Mapping) and kind == "workpiece":
            parts = (*parts, *(one for one in _OPTIONAL if one in data))
        data = self._mapping("", data, (*_HEADER, *parts))
        name, description = self._text("name", data), self._text("description", data)
        sets: dict[str, WorkpieceMaterial] = {}
        tool: ToolMaterial | None = None
        if kind == "workpiece":
            sets = self._workpieces(name, data)
        else:
            numbers = {
                key: self._sourced(key, data[key], one)
                for key, one in ToolMaterial.declared().items()
            }
            tool = self._build("tool", ToolMaterial, {"name": name, **numbers})
        return MaterialFile(name, description, tuple(self._properties), sets, tool)

    def _workpieces(self, name: str, data: Mapping[str, Any]) -> dict[str, WorkpieceMaterial]:
        declared = WorkpieceMaterial.declared()
        either = {
            key: self._constant_or_table(key, data[key], declared[key])
            for key in _CONSTANT_OR_TABLE
        }
        heat_fraction = self._heat_fraction(data["taylor_quinney"], declared["taylor_quinney"])
        tables = {key: self._table(key, data[key], declared[key]) for key in _TABLES}
        damage = self._damage(data["damage"])
        fitted = self._fitted(data["fitted_damage"]) if "fitted_damage" in data else None
        resists = self._nonlocal_viscosity(data.get("nonlocal_viscosity"))
        laws = data["flow_stress"]
        if not isinstance(laws, Mapping) or not laws:
            raise self._wrong("flow_stress", laws, "one set or more by name")
        sets = {}
        for chosen, law in laws.items():
            place = f"flow_stress.{chosen}"
            fails, flow_stress = self._flow_stress(place, law)
            values = {
                "name": f"{name}, flow stress {chosen}",
                "flow_stress": flow_stress,
                "damage": damage if fails else None,
                "fitted_damage": fitted if fails else None,
                "nonlocal_viscosity": resists,
                "taylor_quinney": heat_fraction,
                **either,
                **tables,
            }
            sets[str(chosen)] = self._build("workpiece", WorkpieceMaterial, values)
        return sets

    def _damage(self, data: object) -> JohnsonCookDamage | None:
        if data == "none":
            return None
        damage: JohnsonCookDamage = self._build(
            "damage", JohnsonCookDamage, self._group("damage", data, JohnsonCookDamage.declared())
        )
        return damage

    def _nonlocal_viscosity(self, data: object) -> NonlocalViscosity | None:
        if data is None:
            return None
        place = "nonlocal_viscosity"
        values = self._group(place, data, NonlocalViscosity.declared())
        made: NonlocalViscosity = self._build(place, NonlocalViscosity, values)
        return made

    def _fitted(self, data: object) -> FittedDamage:
        """How well the damage is known; a number that is no number is the class's to refuse."""
        keys = ("numbers", "relative_covariance", "source")
        data = self._mapping("fitted_damage", data, keys)
        source = self._text("fitted_damage.source", data)
        numbers, rows = data["numbers"], data["relative_covariance"]
        if not isinstance(numbers, list) or not all(isinstance(one, str) for one in numbers):
            raise self._wrong("fitted_damage.numbers", numbers, "names, such as [d1, loss]")
        if not isinstance(rows, list) or not all(
            isinstance(row, list) and all(isinstance(one, int | float) for one in row)
            for row in rows
        ):
            raise self._wrong("fitted_damage.relative_covariance", rows, "rows of numbers")
        for name, row in zip(numbers, rows, strict=False):
            self._properties.append(Property(f"fitted_damage.{name}", str(row), source))
        values = {"numbers": tuple(numbers), "relative_covariance": tuple(map(tuple, rows))}
        fitted: FittedDamage = self._build("fitted_damage", FittedDamage, values)
        return fitted

    def _flow_stress(self, place: str, data: object) -> tuple[bool, Any]:
        """Whether the damage of the file applies, and the law."""
        rest = dict(data) if isinstance(data, Mapping) else data
        law, damage = "johnson-cook", None
        if isinstance(rest, dict):
            law, damage = rest.pop("law", law), rest.pop("damage", None)
        kind = FLOW_LAWS.find(law)
        if kind is None:
            raise self._wrong(f"{place}.law", law, f"one of {', '.join(sorted(FLOW_LAWS.kinds))}")
        if damage not in (None, "none"):
            raise self._wrong(f"{place}.damage", damage, "none, or to be left out")
        values = self._group(place, rest, kind.declared())
        return damage is None, self._build(place, kind, values)

    def _build(self, place: str, kind: Any, values: Mapping[str, Any]) -> Any:
        try:
            return kind(**values)
        except ValueError as error:
            raise MaterialError(f"{self._file}: {place}: {error}") from None

    def _group(
        self, place: str, data: object, declared: Mapping[str, Parameter]
    ) -> dict[str, float]:
        """Numbers that share one source."""
        data = self._mapping(place, data, (*declared, "source"))
        source = self._text(f"{place}.source", data)
        return {
            key: self._number(f"{place}.{key}", data[key], one, source)
            for key, one in declared.items()
        }

    def _sourced(self, place: str, data: object, parameter: Parameter) -> float:
        data = self._mapping(place, data, ("value", "source"))
        source = self._text(f"{place}.source", data)
        return self._number(place, data["value"], parameter, source)

    def _heat_fraction(self, data: object, parameter: Parameter) -> float | RateTable:
        """A constant fraction, or rows of [strain rate, fraction]."""
        place = "taylor_quinney"
        if not _has_rows(data):
            return self._sourced(place, data, parameter)
        rates, values = self._rows(place, data, ("strain rate", _RATE), parameter)
        table: RateTable = self._build(place, RateTable, {"rates": rates, "values": values})
        return table

    def _constant_or_table(
        self, place: str, data: object, parameter: Parameter
    ) -> float | TemperatureTable:
        if _has_rows(data):
            return self._table(place, data, parameter)
        return self._sourced(place, data, parameter)

    def _table(self, place: str, data: object, parameter: Parameter) -> TemperatureTable:
        temperatures, values = self._rows(place, data, ("temperature", _TEMPERATURE), parameter)
        columns = {"temperatures": temperatures, "values": values}
        table: TemperatureTable = self._build(place, TemperatureTable, columns)
        return table

    def _rows(
        self, place: str, data: object, over: tuple[str, Parameter], parameter: Parameter
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Columns of a table whose rows are [what it is over, value]."""
        data = self._mapping(place, data, ("value", "source"))
        source, rows = self._text(f"{place}.source", data), data["value"]
        if not isinstance(rows, list) or not rows:
            raise self._wrong(place, rows, f"rows of [{over[0]}, value]")
        pairs = []
        for row in rows:
            if not isinstance(row, list) or len(row) != 2:
                raise self._wrong(place, row, f"[{over[0]}, value]")
            pairs.append((self._si(place, row[0], over[1]), self._si(place, row[1], parameter)))
            self._properties.append(Property(place, f"{row[1]} at {row[0]}", source))
        first, second = zip(*pairs, strict=True)
        return first, second

    def _number(self, place: str, value: object, parameter: Parameter, source: str) -> float:
        number = self._si(place, value, parameter)
        self._properties.append(Property(place, str(value), source))
        return number

    def _si(self, place: str, value: object, parameter: Parameter) -> float:
        try:
            return parameter.number(value)
        except ValueError as error:
            raise MaterialError(f"{self._file}: {place}: {error}") from None

    def _mapping(self, place: str, data: object, keys: tuple[str, ...]) -> Mapping[str, Any]:
        if not isinstance(data, Mapping):
            raise self._wrong(place, data, f"keys {', '.join(keys)}")
        prefix = f"{place}." if place else ""
        for key in data:
            if key not in keys:
                raise MaterialError(
                    f"{self._file}: {prefix}{key}: unknown, expected one of {', '.join(keys)}"
                )
        for key in keys:
            if key not in data:
                raise MaterialError(f"{self._file}: {prefix}{key}: is missing, expected a value")
        return data

    def _text(self, place: str, data: Mapping[str, Any]) -> str:
        text = data[place.rpartition(".")[2]]
        if not isinstance(text, str) or not text.strip():
            raise self._wrong(place, text, "text")
        return text.strip()

    def _wrong(self, place: str, value: object, expectation: str) -> MaterialError:
        return MaterialError(f"{self._file}: {place}: {value!r}, expected {expectation}")


AISI_1045: Final = workpiece("aisi-1045")
CARBIDE: Final = tool_material("carbide")
