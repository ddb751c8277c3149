"""The units in which a report shows values that are held in SI."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees
from types import MappingProxyType
from typing import Final

from chipglow.quantities import ZERO_CELSIUS


@dataclass(frozen=True)
class ShownUnit:
    """A unit: its number is ``per_si * (value - zero)`` of a value in SI."""

    per_si: float = 1.0
    zero: float = 0.0

    def number(self, value: float) -> float:
        """Return a value in SI as a number in this unit."""
        return self.per_si * (value - self.zero)

    def difference(self, value: float) -> float:
        """Return a difference in SI, such as an uncertainty, as a number in this unit."""
        return self.per_si * value


_MINUTE: Final = 60.0
"""In s."""

SHOWN_UNITS: Final[Mapping[str, ShownUnit]] = MappingProxyType(
    {
        "": ShownUnit(),
        "%": ShownUnit(per_si=100.0),
        "mm": ShownUnit(per_si=1e3),
        "µm": ShownUnit(per_si=1e6),
        "µs": ShownUnit(per_si=1e6),
        "kHz": ShownUnit(per_si=1e-3),
        "1/s": ShownUnit(),
        "m/s": ShownUnit(),
        "m/min": ShownUnit(per_si=_MINUTE),
        "N/mm": ShownUnit(per_si=1e-3),
        "°": ShownUnit(per_si=degrees(1.0)),
        "K": ShownUnit(),
        "°C": ShownUnit(zero=ZERO_CELSIUS),
    }
)
"""By the text of the unit."""


def in_unit(value: float, unit: str) -> float:
    """Return a value in SI as a number in a unit of `SHOWN_UNITS`."""
    return SHOWN_UNITS[unit].number(float(value))
