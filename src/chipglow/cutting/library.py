"""Materials as data files, each number with its unit and its source."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any, Final, NamedTuple

from chipglow.cutting import laws as _laws  # noqa: F401  (registers the laws)
from chipglow.cutting.damage import FittedDamage, JohnsonCookDamage
from chipglow.cutting.flow_stress import LAWS, comes_with_chipglow
from chipglow.cutting.material import RateTable, TemperatureTable, ToolMaterial, WorkpieceMaterial
from chipglow.text import read_yaml

FOLDER: Final = Path(__file__).with_name("materials")


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


class _Quantity(NamedTuple):
    expectation: str
    units: Mapping[str, tuple[str, str]]


def _quantity(**factors: str) -> Mapping[str, tuple[str, str]]:
    return {unit: (factor, "0") for unit, factor in factors.items()}


_STRESS: Final = _Quantity(
    "a stress such as 553.1 MPa or 205 GPa", _quantity(Pa="1", MPa="1e6", GPa="1e9")
)
_TEMPERATURE: Final = _Quantity(
    "a temperature such as 1733 K or 20 degC", {"K": ("1", "0"), "degC": ("1", "273.15")}
)
_RATE: Final = _Quantity("a strain rate such as 1 1/s", {"1/s": ("1", "0")})
_DENSITY: Final = _Quantity("a density such as 7850 kg/m3", {"kg/m3": ("1", "0")})
_CONDUCTIVITY: Final = _Quantity(
    "a conductivity such as 45 W/(m K)", {"W/(m K)": ("1", "0"), "W/m/K": ("1", "0")}
)
_HEAT_CAPACITY: Final = _Quantity(
    "a heat capacity such as 480 J/(kg K)", {"J/(kg K)": ("1", "0"), "J/kg/K": ("1", "0")}
)
_NUMBER: Final = _Quantity("a number without a unit", {"": ("1", "0")})

_PER_KELVIN: Final = _Quantity("a softening such as 7e-4 1/K", _quantity(**{"1/K": "1"}))
_FRACTURE_ENERGY: Final = _Quantity(
    "a fracture energy such as 15 kJ/m2", _quantity(**{"J/m2": "1", "kJ/m2": "1e3"})
)
_LAW_FIELDS: Final = {
    "yield_stress": _STRESS,
    "hardening": _STRESS,
    "athermal_stress": _STRESS,
    "thermal_stress": _STRESS,
    "melting_temperature": _TEMPERATURE,
    "reference_temperature": _TEMPERATURE,
    "reference_rate": _RATE,
    "thermal_softening": _PER_KELVIN,
    "rate_hardening": _PER_KELVIN,
}
_ANY: Final = _Quantity(
    "a number, or a stress, temperature or strain rate with its unit",
    {**_NUMBER.units, **_STRESS.units, **_TEMPERATURE.units, **_RATE.units},
)
"""Fields of laws that chipglow does not know: their class says what they are."""
_DAMAGE: Final = {
    **dict.fromkeys(("d1", "d2", "d3", "d4", "d5", "loss"), _NUMBER),
    "fracture_energy": _FRACTURE_ENERGY,
    "melting_temperature": _TEMPERATURE,
    "reference_temperature": _TEMPERATURE,
    "reference_rate": _RATE,
}
_TOOL: Final = {
    "density": _DENSITY,
    "conductivity": _CONDUCTIVITY,
    "heat_capacity": _HEAT_CAPACITY,
}
_TABLES: Final = {"conductivity": _CONDUCTIVITY, "heat_capacity": _HEAT_CAPACITY}
_CONSTANT_OR_TABLE: Final = {
    "density": _DENSITY,
    "young_modulus": _STRESS,
    "poisson_ratio": _NUMBER,
}
_HEADER: Final = ("kind", "name", "description")
_WORKPIECE_PARTS: Final = (*_CONSTANT_OR_TABLE, "taylor_quinney", *_TABLES, "flow_stress", "damage")
_VALUE: Final = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)(?:\s+(\S.*))?")
_OWN_FILE: Final = re.compile(r"(.+\.ya?ml)(?:/([^/]+))?")


def material_names(kind: str | None = None) -> list[str]:
    """Names of the library's materials.

    Parameters
    ----------
    kind : {'workpiece', 'tool'}, optional
        Only these.
    """
    names = sorted(path.stem for path in FOLDER.glob("*.yaml"))
    return [n for n in names if kind is None or _is_tool(n) == (kind == "tool")]


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
    if not own and file not in material_names("workpiece"):
        known = ", ".join(material_names("workpiece"))
        raise MaterialError(f"{name!r} is unknown, expected one of {known}, or a file like my.yaml")
    sets = material_file(file).workpieces
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
    known = material_names("tool")
    if name not in known:
        raise MaterialError(f"{name!r} is unknown, expected one of {', '.join(known)}")
    tool = material_file(name).tool
    assert tool is not None
    return tool


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
    if name not in material_names():
        raise MaterialError(f"{name!r} is unknown, expected one of {', '.join(material_names())}")
    return _of_library(name)


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
def _of_library(name: str) -> MaterialFile:
    return read_material(FOLDER / f"{name}.yaml")


def _is_tool(name: str) -> bool:
    return _of_library(name).tool is not None


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
        parts = tuple(_TOOL) if kind == "tool" else _WORKPIECE_PARTS
        if isinstance(data, Mapping) and kind == "workpiece" and "fitted_damage" in data:
            parts = (*parts, "fitted_damage")
        data = self._mapping("", data, (*_HEADER, *parts))
        name, description = self._text("name", data), self._text("description", data)
        sets: dict[str, WorkpieceMaterial] = {}
        tool: ToolMaterial | None = None
        if kind == "workpiece":
            sets = self._workpieces(name, data)
        else:
            numbers = {
                key: self._sourced(key, data[key], quantity) for key, quantity in _TOOL.items()
            }
            tool = self._build("tool", ToolMaterial, {"name": name, **numbers})
        return MaterialFile(name, description, tuple(self._properties), sets, tool)

    def _workpieces(self, name: str, data: Mapping[str, Any]) -> dict[str, WorkpieceMaterial]:
        constant_or_table = {
            key: self._constant_or_table(key, data[key], quantity)
            for key, quantity in _CONSTANT_OR_TABLE.items()
        }
        share = self._share("taylor_quinney", data["taylor_quinney"])
        tables = {key: self._table(key, data[key], quantity) for key, quantity in _TABLES.items()}
        damage = self._damage(data["damage"])
        fitted = self._fitted(data["fitted_damage"]) if "fitted_damage" in data else None
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
                "taylor_quinney": share,
                **constant_or_table,
                **tables,
            }
            sets[str(chosen)] = self._build("workpiece", WorkpieceMaterial, values)
        return sets

    def _damage(self, data: object) -> JohnsonCookDamage | None:
        if data == "none":
            return None
        damage: JohnsonCookDamage = self._build(
            "damage", JohnsonCookDamage, self._group("damage", data, _DAMAGE)
        )
        return damage

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
        if not isinstance(law, str) or law not in LAWS:
            raise self._wrong(f"{place}.law", law, f"one of {', '.join(sorted(LAWS))}")
        if damage not in (None, "none"):
            raise self._wrong(f"{place}.damage", damage, "none, or to be left out")
        kind = LAWS[law]
        known = comes_with_chipglow(kind)
        quantities = {
            f.name: _LAW_FIELDS.get(f.name, _NUMBER) if known else _ANY
            for f in fields(kind)  # type: ignore[arg-type]
        }
        return damage is None, self._build(place, kind, self._group(place, rest, quantities))

    def _build(self, place: str, kind: Any, values: Mapping[str, Any]) -> Any:
        try:
            return kind(**values)
        except ValueError as error:
            raise MaterialError(f"{self._file}: {place}: {error}") from None

    def _group(
        self, place: str, data: object, quantities: Mapping[str, _Quantity]
    ) -> dict[str, float]:
        """Numbers that share one source."""
        data = self._mapping(place, data, (*quantities, "source"))
        source = self._text(f"{place}.source", data)
        return {
            key: self._number(f"{place}.{key}", data[key], quantity, source)
            for key, quantity in quantities.items()
        }

    def _sourced(self, place: str, data: object, quantity: _Quantity) -> float:
        data = self._mapping(place, data, ("value", "source"))
        source = self._text(f"{place}.source", data)
        return self._number(place, data["value"], quantity, source)

    def _share(self, place: str, data: object) -> float | RateTable:
        """A constant share, or rows of [strain rate, share]."""
        if not _has_rows(data):
            return self._sourced(place, data, _NUMBER)
        rates, values = self._rows(place, data, ("strain rate", _RATE), _NUMBER)
        table: RateTable = self._build(place, RateTable, {"rates": rates, "values": values})
        return table

    def _constant_or_table(
        self, place: str, data: object, quantity: _Quantity
    ) -> float | TemperatureTable:
        if _has_rows(data):
            return self._table(place, data, quantity)
        return self._sourced(place, data, quantity)

    def _table(self, place: str, data: object, quantity: _Quantity) -> TemperatureTable:
        temperatures, values = self._rows(place, data, ("temperature", _TEMPERATURE), quantity)
        columns = {"temperatures": temperatures, "values": values}
        table: TemperatureTable = self._build(place, TemperatureTable, columns)
        return table

    def _rows(
        self, place: str, data: object, over: tuple[str, _Quantity], quantity: _Quantity
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
            pairs.append((self._si(place, row[0], over[1]), self._si(place, row[1], quantity)))
            self._properties.append(Property(place, f"{row[1]} at {row[0]}", source))
        first, second = zip(*pairs, strict=True)
        return first, second

    def _number(self, place: str, value: object, quantity: _Quantity, source: str) -> float:
        number = self._si(place, value, quantity)
        self._properties.append(Property(place, str(value), source))
        return number

    def _si(self, place: str, value: object, quantity: _Quantity) -> float:
        """Value in SI units, rounded once: 553.1 MPa is 553.1e6 to the last bit."""
        match = _VALUE.fullmatch(str(value).strip())
        if not match or (match[2] or "") not in quantity.units:
            raise self._wrong(place, value, quantity.expectation)
        factor, offset = quantity.units[match[2] or ""]
        return float(Decimal(match[1]) * Decimal(factor) + Decimal(offset))

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
