"""Quantities with units at the border: text such as ``10 us`` or ``m s-1`` to SI and back."""

import re
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias, TypeGuard, get_origin

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

if TYPE_CHECKING:
    from pint import UnitRegistry

Array: TypeAlias = NDArray[np.float64]
SEED: Final = 2010
"""Seed of random numbers, unless another is set: the year of the paper."""

ZERO_CELSIUS: Final = 273.15
"""In K."""

ROUNDING: Final = 1e-9
"""Relative slack of comparisons: arithmetic changes equal decimal numbers by less."""

_NUMBER: Final = r"\d{1,40}(?:\.\d{0,40})?(?:[eE][+-]?\d{1,3})?|\.\d{1,40}(?:[eE][+-]?\d{1,3})?"
_FRACTION: Final = r"\d{1,3}/\d{1,3}"
# 1/s only after a space: 101/s is not 10 1/s.
_UNIT: Final = r"(?:(?<=\s)1/)?[A-Za-z°µμ][A-Za-z0-9°µμ/*^ ().-]{0,60}"
_QUANTITY: Final = re.compile(rf"\s*([-+−]?(?:{_FRACTION}|{_NUMBER}))\s*({_UNIT})\s*")
_RANGE: Final = re.compile(rf"\s*({_NUMBER})\s*[-–]\s*({_NUMBER})\s*({_UNIT})?\s*")
_MULTIPLE: Final = re.compile(rf"({_NUMBER})\s*\*?\s*([A-Za-z°µμ].*)")
_BARE: Final = re.compile(rf"\s*[-+−]?(?:{_NUMBER})\s*")

_MOST_DIGITS: Final = 21
"""Digits up to which a rounded number is searched: more than a double has."""

_LONGEST_NUMBER: Final = 12
"""Characters of a number beyond which a fraction is tried instead."""

_LARGEST_DENOMINATOR: Final = 99
"""Largest denominator of such a fraction."""

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
    "kelvin": "K",
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
    text: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if not (isfinite(self.scale) and self.scale > 0 and isfinite(self.offset)):
            raise ValueError(f"unit: scale {self.scale!r} must be finite and positive")

    def to_si(self, values: ArrayLike) -> NDArray[np.float32]:
        return np.asarray(np.asarray(values, np.float64) * self.scale + self.offset, np.float32)


SI: Final = Unit(1.0)
CELSIUS: Final = Unit(1.0, ZERO_CELSIUS)


def parse_unit(text: str, base: str, name: str) -> Unit:
    """Return the unit of a text (CF, udunits, pint); a date after ``since`` is left out.

    A number before the unit, as in ``0.01 K``, multiplies its scale.
    """
    clean = text.split(" since ")[0].strip()
    if base == "1" and clean.lower() in _NO_UNIT:
        return SI
    multiple = _MULTIPLE.fullmatch(clean)
    factor, single = multiple.groups() if multiple else ("1", clean)
    try:
        scale, offset = _scale_and_offset(single, base)
        return Unit(float(Decimal(factor) * scale), float(offset), text)
    except ValueError:
        expected = f"expected a unit such as {base}"
        raise ValueError(f"unknown unit {text[:60]!r} of {name}, {expected}") from None


@dataclass(frozen=True)
class Quantity:
    """Kind and unit of a setting: an annotation of fields that read text and hold SI floats.

    Parameters
    ----------
    kind : str
        Name of the quantity with its article, as errors call it.
    base : str
        SI unit of the value.
    unit : str
        Unit in which the value is written.
    example : str
        A value as errors show it.
    positive : bool
        Whether the value in SI must be over 0.
    is_difference : bool
        Whether zeros of units do not count: 2 degC is then as much as 2 K.
    """

    kind: str
    base: str
    unit: str
    example: str
    positive: bool = True
    is_difference: bool = False

    def parse(self, value: object, si: bool = False) -> float:
        """Return the SI number of a text such as ``10 us``; if `si`, also of an SI number."""
        if si and is_number(value):
            return self._checked(f"{value} {self.base}", float(value))
        if is_bare_number(value):
            raise ValueError(f"{value} has no unit, {self.expected}")
        match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
        if match is None:
            raise ValueError(self._not_this_kind(value))
        return self._to_base(str(value), match[1], match[2])

    def parse_range(self, value: object, si: bool = False) -> tuple[float, float]:
        """Return the SI limits of ``3.8-5.1 um``; if `si`, also of two numbers in SI units."""
        if si and isinstance(value, tuple) and len(value) == 2:
            lower, upper = (self.parse(limit, si) for limit in value)
        else:
            match = _RANGE.fullmatch(value) if isinstance(value, str) else None
            if match is None:
                raise ValueError(self._not_this_kind(value))
            if not match[3]:
                raise ValueError(f"{value} has no unit, {self.expected}")
            lower, upper = (self._to_base(str(value), match[i], match[3]) for i in (1, 2))
        if not lower < upper:
            text = value if isinstance(value, str) else self.range_text((lower, upper))
            raise ValueError(f"{text} is reversed, {self.expected}, the lower limit first")
        return lower, upper

    def text(self, value: float) -> str:
        """Return the shortest text in this quantity's unit that is read back as the same number."""
        number = self._number(value)
        if len(number) > _LONGEST_NUMBER:
            scale, offset = self._unit(self.unit)
            exact = (Decimal(repr(value)) - offset) / scale
            fraction = str(Fraction(exact).limit_denominator(_LARGEST_DENOMINATOR))
            if re.fullmatch(f"-?{_FRACTION}", fraction) and self._si(fraction) == value:
                number = fraction
        return f"{number} {self.unit}"

    def range_text(self, limits: tuple[float, float]) -> str:
        """Return the text of a range that is read back as the same numbers."""
        return f"{self._number(limits[0])}-{self._number(limits[1])} {self.unit}"

    @property
    def expected(self) -> str:
        """The values that a field of this quantity accepts, as text for errors."""
        return f"expected {self.kind} such as {self.example}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        pair = get_origin(source) is tuple
        parse, text = (self.parse_range, self.range_text) if pair else (self.parse, self.text)
        return core_schema.with_info_plain_validator_function(
            lambda value, info: parse(value, si=info.context is None),
            serialization=core_schema.plain_serializer_function_ser_schema(text, when_used="json"),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"type": "string", "examples": [self.example]}

    def _unit(self, unit: str) -> tuple[Decimal, Decimal]:
        scale, offset = _scale_and_offset(unit, self.base)
        return scale, Decimal(0) if self.is_difference else offset

    def _si(self, number: str, unit: str = "") -> float:
        scale, offset = self._unit(unit or self.unit)
        numerator, _, denominator = number.partition("/")
        return float(Decimal(numerator) / Decimal(denominator or 1) * scale + offset)

    def _to_base(self, value: str, number: str, unit: str) -> float:
        try:
            result = self._si(number.replace("−", "-"), unit)
        except (ValueError, ArithmeticError):
            raise ValueError(self._not_this_kind(value)) from None
        return self._checked(value, result)

    def _checked(self, value: str, result: float) -> float:
        if not isfinite(result):
            raise ValueError(f"{value} is not finite, {self.expected}")
        if self.positive and result <= 0:
            zero = "0 K" if self.base == "K" else "0"
            raise ValueError(f"{value} must be more than {zero}, {self.expected}")
        return result

    def _not_this_kind(self, value: object) -> str:
        return f"{value!r} is not {self.kind}, expected a value such as {self.example}"

    def _number(self, value: float) -> str:
        scale, offset = self._unit(self.unit)
        exact = (Decimal(repr(float(value))) - offset) / scale
        if exact == 0:
            return "0"
        # Numbers of other sizes are shorter with an exponent.
        for digits in range(1, _MOST_DIGITS):
            rounded = Decimal(f"{exact:.{digits}g}")
            number = f"{rounded:f}" if -7 < rounded.adjusted() < 12 else f"{rounded:g}"
            if self._si(number) == value:
                return number
        raise ValueError(f"{value!r} {self.base} cannot be written in {self.unit}")


def is_bare_number(value: object) -> bool:
    """Return whether a value from a YAML file is a number without a unit."""
    if isinstance(value, str):
        return _BARE.fullmatch(value) is not None
    return is_number(value)


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a number; true and false are not."""
    return isinstance(value, int | float) and not isinstance(value, bool)


COLDEST: Final = 200.0
"""Lowest temperature in K of scenes, black bodies and radiance tables."""

HOTTEST: Final = 6000.0
"""Their highest temperature in K."""

POSITION: Final = Quantity("a position", "m", "um", "-420 um", positive=False)
Position = Annotated[float, POSITION]
LENGTH: Final = Quantity("a length", "m", "um", "6 um")
Length = Annotated[float, LENGTH]
CUT_LENGTH: Final = Quantity("a length", "m", "mm", "0.3 mm")
WAVELENGTH: Final = Quantity("a wavelength", "m", "um", "4.5 um")
Wavelength = Annotated[float, WAVELENGTH]
WAVELENGTHS: Final = Quantity("a band of wavelengths", "m", "um", "3.8-5.1 um")
TIME: Final = Quantity("a time", "s", "us", "10 us")
INSTANT: Final = Quantity("a time", "s", "us", "10 us", positive=False)
FREQUENCY: Final = Quantity("a frequency", "Hz", "Hz", "600 Hz")
SPEED: Final = Quantity("a speed", "m/s", "m/min", "250 m/min")
ANGLE: Final = Quantity("an angle", "rad", "deg", "-7 deg", positive=False)
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
TEMPERATURE_DIFFERENCE: Final = Quantity(
    "a difference of temperatures", "K", "K", "2 K", positive=False, is_difference=True
)


@cache
def _registry() -> "UnitRegistry[Decimal]":
    # Loading pint takes a third of a second: only who reads or writes quantities pays for it.
    # Decimals make 10 us exactly the float 1e-5; binary floats would miss by a rounding.
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


@cache
def _scale_and_offset(text: str, base: str) -> tuple[Decimal, Decimal]:
    """Return scale and offset of a unit to SI; a ValueError if it is another quantity's."""
    clean = text.strip()
    spelled = _SPELLINGS.get(clean.lower().replace(" ", "_"), clean)
    spelled = _BELOW.sub(lambda below: "/" + "/".join(below[1].split()), spelled)
    if not _TERMS.fullmatch(spelled):
        raise ValueError(f"{text!r} is not a unit")
    written = re.sub(r"(?<=[\w°%])[\s.·]+(?=[A-Za-z°µμ])", "*", spelled)
    try:
        unit = _registry().parse_units(_EXPONENT.sub(r"\1**\2", written))
        zero, one = (_registry().Quantity(Decimal(value), unit).to(base) for value in (0, 1))
    # A malformed or foreign unit ends in pint as anything from AssertionError to TokenError.
    except Exception:
        raise ValueError(f"{text!r} is not a unit such as {base}") from None
    return one.magnitude - zero.magnitude, zero.magnitude
