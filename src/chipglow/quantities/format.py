"""A number with its unit, as the tables print it."""

import re
from math import floor, isfinite, isnan, log10
from typing import Final


def quantity_text(value: float | None, unit: str, decimals: int, sign: str = "") -> str:
    """Return a number with its unit, or a dash for None."""
    if value is None:
        return "–"
    rounded = round(value, decimals) + 0.0  # no negative zero
    number = f"{rounded:{sign},.{max(decimals, 0)}f}"
    return f"{number.replace(',', ' ').replace('-', '−')} {unit}".strip()


_MOST_DECIMALS: Final = 9
"""Most decimals of a number, with which `_FINEST` shows its first digit."""

_PLAIN_POWERS: Final = (-5, 12)
"""Powers of ten of the smallest and largest numbers without an exponent."""

_FINEST: Final = 1e-9
"""Uncertainty below which a number is exact but for the rounding of the computation."""


def uncertain_text(value: float, uncertainty: float) -> str:
    """Return a number and its standard uncertainty, which has two significant digits."""
    if not isfinite(uncertainty) or uncertainty < _FINEST:
        return f"{value:.4g}"
    decimals = uncertain_decimals(uncertainty)
    return f"{value:.{decimals}f} ± {uncertainty:.{decimals}f}"


def uncertain_decimals(uncertainty: float) -> int:
    """Return the number of decimals with which two digits of a standard uncertainty are shown."""
    return min(max(0, 1 - floor(log10(uncertainty))), _MOST_DECIMALS)


def uncertainty_text(uncertainty: float) -> str:
    """Return an uncertainty, with two digits if it is below 10."""
    if not isfinite(uncertainty) or uncertainty < _FINEST:
        return f"{uncertainty:.0f}"
    return f"{uncertainty:.{uncertain_decimals(uncertainty)}f}"


def rounded_text(value: float, unit: str = "") -> str:
    """Return a number to four digits that count, with its unit."""
    if isnan(value):
        return quantity_text(None, unit, 0)
    if value == 0.0:
        return quantity_text(0.0, unit, 0)
    size = floor(log10(abs(value)))
    if not _PLAIN_POWERS[0] <= size <= _PLAIN_POWERS[1]:
        return f"{value:.3e} {unit}".strip()
    return quantity_text(value, unit, max(3 - size, 0))  # four digits


def readable(text: str) -> str:
    """Return a text with µm, µs and °C for the spellings of YAML files."""
    for word, unit in ((" um", " µm"), (" us", " µs"), (" degC", " °C")):
        text = re.sub(rf"(?<=\d){word}\b", unit, text)
    return text
