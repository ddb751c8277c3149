"""Limits of plausible scenes and measurements, shared by all readers."""

from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import SourceError
from chipglow.quantities.units import COLDEST, HOTTEST

MOST_ON_A_SIDE: Final = 1_000_000
"""Maximum number of samples along an axis other than time."""

LARGEST_WITHOUT_UNIT: Final = 1.0
"""Maximum length in m of an image whose file states no unit of length."""

_HOTTEST_SURROUNDINGS: Final = 2000.0
"""Temperature in K that the coldest sample of an image hardly exceeds: 200 K in tenths."""

_USUAL_SIZES: Final = (5e-6, 0.05)
"""Smallest and largest usual size of an image in m."""


def check_temperatures(label: str, lowest: float, highest: float, remedy: str) -> None:
    """Refuse a range in K beyond that of scenes, or without a number."""
    if not isfinite(highest):
        raise SourceError(f"{label}: every value is missing")
    if not COLDEST <= lowest <= highest <= HOTTEST:
        wrong = lowest if lowest < COLDEST else highest
        raise SourceError(
            f"{label}: temperature {wrong:.6g} K, expected {COLDEST:g} to {HOTTEST:g} K; {remedy}"
        )


def check_tenths(label: str, kelvins: NDArray[Any]) -> None:
    """Refuse whole numbers, taken as kelvins for want of a scale, that look like tenths of them."""
    known = kelvins[np.isfinite(kelvins)]
    lowest, highest = known.min(initial=HOTTEST), known.max(initial=0.0)
    is_hot = _HOTTEST_SURROUNDINGS < lowest <= highest <= HOTTEST
    if is_hot and (known == np.rint(known)).all():
        raise SourceError(
            f"{label}: whole numbers from {lowest:g} to {highest:g} look like tenths of kelvins, "
            "expected the unit dK, or scale: 1 if they are kelvins"
        )


def check_sides(label: object, rows: int, columns: int) -> None:
    """Refuse an image of one row or column, and one of absurdly many."""
    for axis, length in (("y", rows), ("x", columns)):
        if not 2 <= length <= MOST_ON_A_SIDE:
            raise SourceError(
                f"{label}: has {length} samples along {axis}, expected 2 to {MOST_ON_A_SIDE}"
            )


def doubt_of_size(subject: str, size: float, setting: str) -> list[str]:
    """Return a warning if the size of an image in m is unusual."""
    smallest, largest = _USUAL_SIZES
    if smallest <= size <= largest:
        return []
    return [f"{subject} is {size:.3g} m large by {setting}; a chip is about 1 mm."]
