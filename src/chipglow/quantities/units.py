"""Quantities with units at the border: text such as ``10 us`` to SI numbers and back.

And units alone, as other people's files write them: ``degC``, ``m s-1``, ``us since 2000-01-01``.
"""

import re
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cache
from math import isfinite
from numbers import Real
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

if TYPE_CHECKING:
    from pint import UnitRegistry

Array: TypeAlias = NDArray[np.float64]
ZERO_CELSIUS: Final = 273.15
"""In K."""

_NUMBER: Final = r"\d{1,40}(?:\.\d{0,40})?(?:[eE][+-]?\d{1,3})?|\.\d{1,40}(?:[eE][+-]?\d{1,3})?"
_FRACTION: Final = r"\d{1,3}/\d{1,3}"
# 1/s only after a space: 101/s is not 10 1/s.
_UNIT: Final = r"(?:(?<=\s)1/)?[A-Za-z°µμ][A-Za-z0-9°µμ/*^ ().-]{0,60}"
_QUANTITY: Final = re.compile(rf"\s*([-+−]?(?:{_FRACTION}|{_NUMBER}))\s*({_UNIT})\s*")
_RANGE: Final = re.compile(rf"\s*({_NUMBER})\s*[-–]\s*({_NUMBER})\s*({_UNIT})?\s*")
_BARE: Final = re.compile(rf"\s*[-+−]?(?:{_NUMBER})\s*")
_MOST_DIGITS: Final = 21
_LONGEST_NUMBER: Final = 12
_LARGEST_DENOMINATOR: Final = 99

_SPELLINGS: Final = {
    "c": "degC",
    "celsius": "degC",
    "deg_c": "degC",
    "degree_c": "degC",
    "degrees_c": "degC",
    "°c": "degC",
    "degree_celsius": "degC",
    "degrees_celsius": "degC",
    "f": "degF",
    "°f": "degF",
    "microns": "micron",
    "k": "K",
    "%": "percent",
}
_NO_UNIT: Final = ("", "1", "-", "none", "dimensionless", "m/m", "mm/mm", "m m-1")
# One digit of exponent: pint would compute any power that a file asks for.
_TERM: Final = r"(?:1|[A-Za-z°µμ%_]{1,24}(?:(?:\^|\*\*)?[-+]?[1-9])?)"
_TERMS: Final = re.compile(rf"{_TERM}(?:\s*[*/.·]\s*{_TERM}|\s+{_TERM}){{0,5}}")
_BELOW: Final = re.compile(r"/\s*\(([^()]*)\)")
_EXPONENT: Final = re.compile(r"([A-Za-z°µμ%_])(?:\^|\*\*)?([-+]?[1-9])")


@dataclass(frozen=True)
class Unit:
    """A unit: a value in SI is ``scale * value + offset``."""

    scale: float
    offset: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.scale) and self.scale > 0 and isfinite(self.offset)):
            raise ValueError(f"unit: scale {self.scale!r} must be finite and over 0")

    def to_si(self, values: ArrayLike) -> NDArray[np.float32]:
        """Values in SI."""
        return np.asarray(np.asarray(values, np.float64) * self.scale + self.offset, np.float32)


SI: Final = Unit(1.0)
CELSIUS: Final = Unit(1.0, ZERO_CELSIUS)


def parse_unit(text: str, base: str, field: str) -> Unit:
    """A unit from its text in a file.

    Parameters
    ----------
    text : str
        The unit, as CF conventions, udunits or pint write it; a date after ``since`` is left out.
    base : str
        The SI unit of the same quantity; 1 for a mere number.
    field : str
        What has this unit, as errors call it.

    Raises
    ------
    ValueError
        If it is no unit of such a quantity.
    """
    clean = text.split(" since ")[0].strip()
    if base == "1" and clean.lower() in _NO_UNIT:
        return SI
    try:
        zero, one = (_in_base(Decimal(value), clean, base) for value in (0, 1))
    # A malformed or foreign unit ends in pint as anything from AssertionError to TokenError.
    except Exception:
        expected = f"expected a unit such as {base}"
        raise ValueError(f"unknown unit {text[:60]!r} of {field}, {expected}") from None
    return Unit(float(one - zero), float(zero))


@dataclass(frozen=True)
class Quantity:
    """How a field of a study is written: which kind of quantity, and in which unit.

    An annotation of pydantic fields: they take text and hold SI floats.

    Parameters
    ----------
    kind : str
        Name of the quantity with its article, as errors call it.
    base : str
        The SI unit of the value.
    unit : str
        The unit in which the value is written.
    example : str
        A value as errors show it.
    positive : bool
        Whether the value in SI must be over 0.
    """

    kind: str
    base: str
    unit: str
    example: str
    positive: bool = True

    def parse(self, value: object) -> float:
        """SI number of a text such as ``10 us``.

        Raises
        ------
        ValueError
            If the text has no unit, another quantity's unit, or a value that is out of range.
        """
        if is_bare_number(value):
            raise ValueError(f"{value} has no unit, {self.expected}")
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            raise ValueError(self._not_this_kind(value))
        return self._to_base(str(value), match[1], match[2])

    def parse_range(self, value: object) -> tuple[float, float]:
        """SI limits of a text such as ``3.8-5.1 um``.

        Raises
        ------
        ValueError
            As `parse`, and if the lower limit does not come first.
        """
        match = _RANGE.fullmatch(value) if isinstance(value, str) else None
        if match is None or not match[3]:
            raise ValueError(
                f"{value} has no unit, {self.expected}" if match else self._not_this_kind(value)
            )
        lower, upper = (self._to_base(str(value), match[i], match[3]) for i in (1, 2))
        return self._ascending(str(value), lower, upper)

    def si(self, value: object) -> float:
        """SI number of a text with its unit, or of a number in SI units already.

        Raises
        ------
        ValueError
            As `parse`.
        """
        if isinstance(value, Real) and not isinstance(value, bool):
            return self._checked(f"{value} {self.base}", float(value))
        return self.parse(value)

    def si_range(self, value: object) -> tuple[float, float]:
        """SI limits of a text, or of a pair of numbers in SI units already; see `si`."""
        if not isinstance(value, tuple) or len(value) != 2:
            return self.parse_range(value)
        return self._ascending(str(value), self.si(value[0]), self.si(value[1]))

    def text(self, value: float) -> str:
        """Shortest text in this quantity's unit that is read back as the same number."""
        number = self._number(value)
        if len(number) > _LONGEST_NUMBER:
            number = self._fraction(value) or number
        return f"{number} {self.unit}"

    def range_text(self, limits: tuple[float, float]) -> str:
        """Text of a range that is read back as the same numbers."""
        return f"{self._number(limits[0])}-{self._number(limits[1])} {self.unit}"

    def written(self, value: float | tuple[float, float]) -> str:
        """Text of a value or of a range's limits."""
        return self.range_text(value) if isinstance(value, tuple) else self.text(value)

    @property
    def expected(self) -> str:
        """What a field of this quantity expects, as errors say it."""
        return f"expected {self.kind} such as {self.example}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema of a field with this annotation: one number, or a pair of limits.

        SI numbers pass from Python; what is read from a file, in a context, needs its unit.
        """
        pair = get_origin(source) is tuple
        parse, si, text = (
            (self.parse_range, self.si_range, self.range_text)
            if pair
            else (self.parse, self.si, self.text)
        )

        def read(value: object, info: core_schema.ValidationInfo) -> object:
            return si(value) if info.context is None else parse(value)

        return core_schema.with_info_plain_validator_function(
            read,
            serialization=core_schema.plain_serializer_function_ser_schema(text, when_used="json"),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema: a text with a unit."""
        return {"type": "string", "examples": [self.example]}

    def _to_base(self, value: str, number: str, unit: str) -> float:
        try:
            result = float(self._exact(_decimal(number.replace("−", "-")), unit))
        # 1/0, or a malformed or foreign unit: anything from AssertionError to TokenError.
        except Exception:
            raise ValueError(self._not_this_kind(value)) from None
        return self._checked(value, result)

    def _checked(self, value: str, result: float) -> float:
        if not isfinite(result):
            raise ValueError(f"{value} is not finite, {self.expected}")
        if self.positive and result <= 0:
            raise ValueError(f"{value} is not over 0{self._zero}, {self.expected}")
        return result

    def _ascending(self, value: str, lower: float, upper: float) -> tuple[float, float]:
        if not lower < upper:
            raise ValueError(f"{value} is reversed, {self.expected}, the lower limit first")
        return lower, upper

    def _exact(self, number: Decimal, unit: str) -> Decimal:
        return _in_base(number, unit, self.base)

    def _not_this_kind(self, value: object) -> str:
        return f"{value!r} is not {self.kind}, expected one such as {self.example}"

    @property
    def _zero(self) -> str:
        return " K" if self.base == "K" else ""

    def _fraction(self, value: float) -> str | None:
        """A fraction that is read back as the same number, if there is a simple one."""
        nearest = Fraction(self._in_unit(value)).limit_denominator(_LARGEST_DENOMINATOR)
        text = str(nearest)
        simple = re.fullmatch(f"-?{_FRACTION}", text) is not None
        return text if simple and self._reads_back(text, value) else None

    def _in_unit(self, value: float) -> Decimal:
        exact = _registry().Quantity(Decimal(repr(value)), self.base).to(self.unit).magnitude
        return Decimal(exact)

    def _number(self, value: float) -> str:
        exact = self._in_unit(value)
        if exact == 0:
            return "0"
        for digits in range(1, _MOST_DIGITS):
            rounded = Decimal(f"{exact:.{digits}g}")
            number = f"{rounded:f}" if -7 < rounded.adjusted() < 12 else f"{rounded:g}"
            if self._reads_back(number, value):
                return number
        raise ValueError(f"{value!r} {self.base} cannot be written in {self.unit}")

    def _reads_back(self, number: str, value: float) -> bool:
        return float(_in_base(_decimal(number), self.unit, self.base)) == value


class Difference(Quantity):
    """How a difference of temperatures is written: 2 degC is then as much as 2 K."""

    def _exact(self, number: Decimal, unit: str) -> Decimal:
        return super()._exact(number, unit) - super()._exact(Decimal(0), unit)


def is_bare_number(value: object) -> bool:
    """Whether a value from a YAML file is a number without a unit."""
    if isinstance(value, str):
        return _BARE.fullmatch(value) is not None
    return isinstance(value, int | float) and not isinstance(value, bool)


POSITION: Final = Quantity("a position", "m", "um", "-420 um", positive=False)
Position = Annotated[float, POSITION]
LENGTH: Final = Quantity("a length", "m", "um", "6 um")
Length = Annotated[float, LENGTH]
CUT_LENGTH: Final = Quantity("a length", "m", "mm", "0.3 mm")
CutLength = Annotated[float, CUT_LENGTH]
WAVELENGTH: Final = Quantity("a wavelength", "m", "um", "4.5 um")
Wavelength = Annotated[float, WAVELENGTH]
WAVELENGTHS: Final = Quantity("a band of wavelengths", "m", "um", "3.8-5.1 um")
WavelengthRange = Annotated[tuple[float, float], WAVELENGTHS]
TIME: Final = Quantity("a time", "s", "us", "10 us")
Time = Annotated[float, TIME]
INSTANT: Final = Quantity("a time", "s", "us", "10 us", positive=False)
FREQUENCY: Final = Quantity("a frequency", "Hz", "Hz", "600 Hz")
Frequency = Annotated[float, FREQUENCY]
SPEED: Final = Quantity("a speed", "m/s", "m/min", "250 m/min")
Speed = Annotated[float, SPEED]
ANGLE: Final = Quantity("an angle", "rad", "deg", "-7 deg", positive=False)
Angle = Annotated[float, ANGLE]
HEAT_TRANSFER: Final = Quantity(
    "a coefficient of heat transfer", "W/m^2/K", "W/m^2/K", "50 W/m^2/K", positive=False
)
RESISTIVITY: Final = Quantity("a resistivity", "ohm*m", "ohm*m", "1.6e-7 ohm*m")
TEMPERATURE_COEFFICIENT: Final = Quantity(
    "a temperature coefficient", "1/K", "K^-1", "0.005 K^-1", positive=False
)
OXIDATION_RATE: Final = Quantity("a rate of oxidation", "m^2/s", "m^2/s", "6.1e-4 m^2/s")
ACTIVATION_ENERGY: Final = Quantity("an activation energy", "J/mol", "kJ/mol", "169.5 kJ/mol")
TEMPERATURE: Final = Quantity("a temperature", "K", "degC", "300 degC")
Temperature = Annotated[float, TEMPERATURE]
KELVINS: Final = Quantity("a temperature", "K", "K", "1733 K")
STRESS: Final = Quantity("a stress", "Pa", "MPa", "553.1 MPa", positive=False)
STRAIN_RATE: Final = Quantity("a strain rate", "1/s", "1/s", "1 1/s", positive=False)
PER_KELVIN: Final = Quantity("a softening", "1/K", "1/K", "7e-4 1/K", positive=False)
VISCOSITY: Final = Quantity("a viscosity", "Pa*s", "kPa*s", "3 kPa s")
FRACTURE_ENERGY: Final = Quantity("a fracture energy", "J/m^2", "kJ/m^2", "15 kJ/m2")
DENSITY: Final = Quantity("a density", "kg/m^3", "kg/m^3", "7850 kg/m3")
CONDUCTIVITY: Final = Quantity("a conductivity", "W/m/K", "W/m/K", "45 W/(m K)")
HEAT_CAPACITY: Final = Quantity("a heat capacity", "J/kg/K", "J/kg/K", "480 J/(kg K)")
TEMPERATURE_DIFFERENCE: Final = Difference(
    "a difference of temperatures", "K", "K", "2 K", positive=False
)


def _decimal(number: str) -> Decimal:
    """A number, or a fraction such as 2/3."""
    numerator, _, denominator = number.partition("/")
    return Decimal(numerator) / Decimal(denominator or 1)


@cache
def _registry() -> "UnitRegistry[Decimal]":
    # Loading pint takes a third of a second: only who reads or writes quantities pays for it.
    # Decimals make 10 us exactly the float 1e-5; binary floats would miss by a rounding.
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


def _in_base(number: Decimal, unit: str, base: str) -> Decimal:
    magnitude: Decimal = _registry().Quantity(number, _unit(unit)).to(base).magnitude
    return magnitude


@cache
def _unit(text: str) -> Any:
    clean = text.strip()
    spelled = _SPELLINGS.get(clean.lower().replace(" ", "_"), clean)
    spelled = _BELOW.sub(lambda below: "/" + "/".join(below[1].split()), spelled)
    if not _TERMS.fullmatch(spelled):
        raise ValueError(f"{text!r} is no unit")
    written = re.sub(r"(?<=[\w°%])[\s.·]+(?=[A-Za-z°µμ])", "*", spelled)
    return _registry().parse_units(_EXPONENT.sub(r"\1**\2", written))
