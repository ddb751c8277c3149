"""Units as other people's files write them: ``degC``, ``m s-1``, ``us since 2000-01-01``."""

import re
from functools import cache
from typing import TYPE_CHECKING, Final

from chipglow.io.sources.conventions import Unit

if TYPE_CHECKING:
    from pint import UnitRegistry

SI_UNITS: Final = {
    "time": "s",
    "x": "m",
    "y": "m",
    "z": "m",
    "temperature": "K",
    "plastic_strain": "",
    "plastic_strain_rate": "1/s",
    "velocity": "m/s",
    "velocity_x": "m/s",
    "velocity_y": "m/s",
    "material_x": "m",
    "material_y": "m",
}
"""SI unit of every field of a scene and of the coordinates; empty for a mere number."""

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
_NONE: Final = ("", "1", "-", "none", "dimensionless", "m/m", "mm/mm", "m m-1")
# One digit of exponent: pint would compute any power that a file asks for.
_TERM: Final = r"(?:1|[A-Za-z°µμ%_]{1,24}(?:(?:\^|\*\*)?[-+]?[1-9])?)"
_UNIT: Final = re.compile(rf"{_TERM}(?:\s*[*/.·]\s*{_TERM}|\s+{_TERM}){{0,5}}")
_EXPONENT: Final = re.compile(r"([A-Za-z°µμ%_])(?:\^|\*\*)?([-+]?[1-9])")


def parse_unit(field: str, text: str) -> Unit:
    """Unit of a field, of a coordinate or of ``time`` from its text in a file.

    Parameters
    ----------
    field : str
        A field by the names of a scene, or ``time``, ``x``, ``y``, ``z``.
    text : str
        The unit, as CF conventions, udunits or pint write it; a date after ``since`` is left out.

    Raises
    ------
    ValueError
        If it is no unit of such a quantity.
    """
    base = SI_UNITS[field]
    clean = text.split(" since ")[0].strip()
    if not base and clean.lower() in _NONE:
        return Unit(1.0)
    expected = f"expected a unit such as {base or '1'}"
    spelled = _SPELLINGS.get(clean.lower().replace(" ", "_"), clean)
    if not _UNIT.fullmatch(spelled):
        raise ValueError(f"unknown unit {text[:60]!r} of {field}, {expected}")
    written = _EXPONENT.sub(r"\1**\2", re.sub(r"(?<=[\w°%])[\s.·]+(?=[A-Za-z°µμ])", "*", spelled))
    try:
        unit = _registry().parse_units(written)
        zero, one = (
            float(_registry().Quantity(value, unit).to(base or "1").magnitude)
            for value in (0.0, 1.0)
        )
    # A malformed or foreign unit ends in pint as anything from AssertionError to TokenError.
    except Exception:
        raise ValueError(f"unknown unit {text[:60]!r} of {field}, {expected}") from None
    return Unit(one - zero, zero)


@cache
def _registry() -> "UnitRegistry[float]":
    import pint

    return pint.UnitRegistry()
