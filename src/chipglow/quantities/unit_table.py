"""Units by name: their scale to SI, the zero of a temperature scale, and powers of base units."""

import re
from collections.abc import Mapping
from decimal import Decimal
from functools import cache
from typing import Final, NamedTuple

# Decimals make 10 us exactly the float 1e-5; binary floats would miss by a rounding.
_ONE: Final = Decimal(1)
_PI: Final = Decimal("3.1415926535897932384626433832795028841971693993751")
_BASES: Final = ("m", "kg", "s", "K", "mol", "A")
_ZERO_POWERS: Final = (0,) * len(_BASES)


class KnownUnit(NamedTuple):
    """A unit: a value in SI is ``scale * value + offset``; `powers` are those of the base units."""

    scale: Decimal
    powers: tuple[int, ...]
    offset: Decimal = Decimal(0)


_PREFIXES: Final[Mapping[str, tuple[str, int]]] = {
    "f": ("femto", -15), "p": ("pico", -12), "n": ("nano", -9), "u": ("micro", -6),
    "m": ("milli", -3), "c": ("centi", -2), "d": ("deci", -1), "da": ("deca", 1),
    "h": ("hecto", 2), "k": ("kilo", 3), "M": ("mega", 6), "G": ("giga", 9), "T": ("tera", 12),
}  # fmt: skip

_PREFIXED: Final[Mapping[str, tuple[str, str]]] = {
    "m": ("1", "m"), "g": ("1e-3", "kg"), "s": ("1", "s"), "K": ("1", "K"), "A": ("1", "A"),
    "mol": ("1", "mol"), "rad": ("1", ""), "sr": ("1", ""), "Hz": ("1", "s-1"),
    "N": ("1", "kg m s-2"), "Pa": ("1", "kg m-1 s-2"), "J": ("1", "kg m2 s-2"),
    "W": ("1", "kg m2 s-3"), "V": ("1", "kg m2 s-3 A-1"), "ohm": ("1", "kg m2 s-3 A-2"),
    "bar": ("1e5", "kg m-1 s-2"), "cal": ("4.184", "kg m2 s-2"), "L": ("1e-3", "m3"),
    "eV": ("1.602176634e-19", "kg m2 s-2"),
}  # fmt: skip
"""Number and base units of the units that take a prefix."""

_WITHOUT_PREFIX: Final[Mapping[str, tuple[str, str]]] = {
    "min": ("60", "s"), "h": ("3600", "s"), "day": ("86400", "s"), "t": ("1e3", "kg"),
    "micron": ("1e-6", "m"), "angstrom": ("1e-10", "m"), "inch": ("0.0254", "m"),
    "ft": ("0.3048", "m"), "thou": ("2.54e-5", "m"), "lb": ("0.45359237", "kg"),
    "lbf": ("4.4482216152605", "kg m s-2"), "kgf": ("9.80665", "kg m s-2"),
    "dyn": ("1e-5", "kg m s-2"), "erg": ("1e-7", "kg m2 s-2"), "atm": ("101325", "kg m-1 s-2"),
    "BTU": ("1055.056", "kg m2 s-2"), "poise": ("0.1", "kg m-1 s-1"),
    "percent": ("0.01", ""), "ppm": ("1e-6", ""),
}  # fmt: skip

_NAMES: Final[Mapping[str, str]] = {
    "meter": "m", "metre": "m", "gram": "g", "second": "s", "sec": "s", "kelvin": "K",
    "ampere": "A", "mole": "mol", "radian": "rad", "steradian": "sr", "hertz": "Hz",
    "newton": "N", "pascal": "Pa", "joule": "J", "watt": "W", "volt": "V", "liter": "L",
    "litre": "L", "electron_volt": "eV", "calorie": "cal",
}  # fmt: skip
"""Names that take the name of a prefix, and an s for more than one."""

_OTHER_NAMES: Final[Mapping[str, str]] = {
    "minute": "min", "hour": "h", "hr": "h", "d": "day", "foot": "ft", "feet": "ft", "in": "inch",
    "inches": "inch", "pound": "lb", "tonne": "t", "pound_force": "lbf",
    "dyne": "dyn", "atmosphere": "atm", "Btu": "BTU", "btu": "BTU", "Å": "angstrom",
    "degree": "deg", "arcdeg": "deg", "°": "deg", "%": "percent", "l": "L", "degK": "K",
    "°C": "degC", "celsius": "degC", "°F": "degF", "fahrenheit": "degF", "degree_Celsius": "degC",
    "degree_Fahrenheit": "degF", "delta_degC": "K", "delta_degF": "degR", "rankine": "degR",
}  # fmt: skip

_KELVIN: Final = (*_ZERO_POWERS[:3], 1, *_ZERO_POWERS[4:])
_PSI: Final = Decimal("4.4482216152605") / Decimal("0.0254") ** 2
_COMPUTED: Final[Mapping[str, KnownUnit]] = {
    "1": KnownUnit(_ONE, _ZERO_POWERS),
    "deg": KnownUnit(_PI / 180, _ZERO_POWERS),
    "arcmin": KnownUnit(_PI / 180 / 60, _ZERO_POWERS),
    "arcsec": KnownUnit(_PI / 180 / 3600, _ZERO_POWERS),
    "degC": KnownUnit(_ONE, _KELVIN, Decimal("273.15")),
    "degR": KnownUnit(Decimal(5) / 9, _KELVIN),
    "degF": KnownUnit(Decimal(5) / 9, _KELVIN, Decimal("459.67") * 5 / 9),
    "psi": KnownUnit(_PSI, (-1, 1, -2, 0, 0, 0)),
    "ksi": KnownUnit(_PSI * 1000, (-1, 1, -2, 0, 0, 0)),
}


def product_of(factors: list[tuple[str, int]]) -> KnownUnit:
    """Return the product of units to some powers; a KeyError names what is no unit.

    The zero of a temperature scale counts if the scale is the only factor.
    """
    if len(factors) == 1 and factors[0][1] == 1:
        return _known(factors[0][0])
    scale, powers = _ONE, _ZERO_POWERS
    for name, power in factors:
        unit = _known(name)
        scale *= unit.scale**power
        powers = tuple(a + power * b for a, b in zip(powers, unit.powers, strict=True))
    return KnownUnit(scale, powers)


@cache
def _known(name: str) -> KnownUnit:
    """Return the unit of a name, which may have a prefix or a plural s; a KeyError if none."""
    name = re.sub("^[µμ]", "u", name)
    found = _of_symbol(name) or _with_prefix(name)
    if found is None and len(name) > 2:
        found = _of_symbol(name.removesuffix("s"))
    if found is None:
        raise KeyError(name)
    return found


def _with_prefix(name: str) -> KnownUnit | None:
    for short, (word, power) in _PREFIXES.items():
        symbol = _NAMES.get(name.removeprefix(word).removesuffix("s"))
        if symbol is None or not name.startswith(word):
            symbol = name[len(short) :] if name.startswith(short) else ""
        if symbol in _PREFIXED:
            unit = _defined(*_PREFIXED[symbol])
            return unit._replace(scale=unit.scale.scaleb(power))
    return None


def _of_symbol(name: str) -> KnownUnit | None:
    symbol = _OTHER_NAMES.get(name) or _NAMES.get(name, name)
    if symbol in _COMPUTED:
        return _COMPUTED[symbol]
    number = _PREFIXED.get(symbol) or _WITHOUT_PREFIX.get(symbol)
    return None if number is None else _defined(*number)


def _defined(number: str, bases: str) -> KnownUnit:
    """Return a unit of a number and base units, such as ``kg m s-2``."""
    powers = dict.fromkeys(_BASES, 0)
    for term in bases.split():
        base = term.rstrip("-0123456789")
        powers[base] = int(term[len(base) :] or 1)
    return KnownUnit(Decimal(number), tuple(powers.values()))
