"""Pixels outside a camera's range: one rule for every answer.

A pixel below the lower range limit, or saturated, is flagged, and a real camera shows no
temperature there. The virtual camera's reading of it is the temperature of its radiance, in every
answer: tables, lines, attribution, budget, design and sweep. Each place has the fractions of its
pixels below the limit and saturated, and a warning if one of them exceeds `MOST_OUTSIDE`.
"""

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.places import Place
from chipglow.camera import Flag
from chipglow.quantities import Array
from chipglow.scene import Raster

MOST_OUTSIDE: Final = 0.05
"""Fraction of a place below the lower range limit, or saturated, above which there is a warning."""

_STATES: Final = {Flag.UNDER_RANGE: "below the lower range limit", Flag.SATURATED: "saturated"}


def fractions_outside(
    place: Place, flags: NDArray[np.uint8], image: Array, raster: Raster
) -> tuple[float, float]:
    """Return the fractions of a place's pixels that are below the range limit, and saturated.

    Pixels count where the measured `image` is finite.
    """
    below, saturated = (place.covered(flags & flag != 0, image, raster) for flag in _STATES)
    return below, saturated


def outside_texts(below: float, saturated: float, most: float = MOST_OUTSIDE) -> Iterator[str]:
    """Yield a statement for each fraction of a place or an image that exceeds `most`."""
    for fraction, state in zip((below, saturated), _STATES.values(), strict=True):
        if fraction > most:
            percent = 100 * fraction
            yield f"{percent:.0f} % of the pixels there are {state}: a camera shows no temperature"


def outside_warnings(
    title: str, below: float, saturated: float, most: float = MOST_OUTSIDE
) -> Iterator[str]:
    """Yield these statements as sentences."""
    for text in outside_texts(below, saturated, most):
        yield f"{title}: {text}."
