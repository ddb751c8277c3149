"""Symmetry of an edge-spread function, which values that are not linear in radiance lack."""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from typing import Final

import numpy as np
import xarray as xr

from chipglow.quantities import Array

_REACH: Final = 3.0
"""Distance from the edge, in widths of the line-spread function, within which it is tested."""

_LEAST_REACH: Final = 1.0
"""Widths that both sides must show for a test; clipped edges show less."""

_LEAST_BINS: Final = 10
"""Bins on both sides together, twice the number of fitted parameters."""

_CLEARLY: Final = 4.0
"""Standard uncertainties of an asymmetry that is not noise: one linear edge in 16 000 has it."""

_MATTERS: Final = 0.01
"""Asymmetry, as a fraction of the step, that matters for a width."""

_LARGE: Final = 0.13
"""Asymmetry, as a fraction of the step, of a gamma of 2.2 from 0.1 to 0.9 of the range."""


@dataclass(frozen=True)
class Asymmetry:
    """Asymmetry of an edge-spread function, as values that are curved over the radiance have it."""

    value: float
    """Distance from a straight line at half of the step, as a fraction of the step.

    Positive if the values rise less where it is bright.
    """
    standard_uncertainty: float

    @property
    def is_clear(self) -> bool:
        """Whether noise does not explain it, and it matters."""
        return abs(self.value) > max(_CLEARLY * self.standard_uncertainty, _MATTERS)

    @property
    def is_hidden(self) -> bool:
        """Whether noise would hide even a gamma of 2.2."""
        return _CLEARLY * self.standard_uncertainty > _LARGE


def asymmetry(
    curves: xr.Dataset,
    spread: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    width: float,
) -> Asymmetry | None:
    """Return the asymmetry of an edge; None if it shows too little of one side.

    Parameters
    ----------
    curves : xarray.Dataset
        Residuals of the measured edge-spread function (`edge_curves`).
    spread, slope : callable
        Fitted edge-spread function from 0 to 1, and its derivative in 1/m, over the distance in m.
    width : float
        Full width at half maximum of the line-spread function in m.

    Notes
    -----
    Every point spread function that is the same after half a turn gives an edge-spread function E
    with E(u) + E(−u) = 1. Values that are curved over the radiance are, to second order,
    E + q 4 E (1 − E): the same change on both sides of the edge. A wrong model or width makes
    opposite changes, which leave q as it is on a range that is symmetric about the edge. A shift of
    the edge resembles q, so both are fitted, with background, step and width. The fitted q is a
    lower limit: curved values also look like a shifted edge.
    """
    distance = curves["distance"].values
    reach = min(-float(distance.min()), float(distance.max()), _REACH * width)
    near = np.abs(distance) < reach
    if reach < _LEAST_REACH * width or np.count_nonzero(near) < _LEAST_BINS:
        return None
    u, height = distance[near] / width, spread(distance[near])
    rise = slope(distance[near]) * width
    design = np.stack([4 * height * (1 - height), np.ones_like(u), height, rise, u * rise], axis=1)
    solve = np.linalg.pinv(design)
    residual = curves["esf_residual"].values[near]
    left = residual - design @ (solve @ residual)
    # Bins scatter by more than noise where no model fits.
    variance = np.maximum(curves["esf_uncertainty"].values[near] ** 2, left.var())
    return Asymmetry(float(solve[0] @ residual), sqrt(float(solve[0] ** 2 @ variance)))
