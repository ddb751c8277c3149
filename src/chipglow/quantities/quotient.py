"""Quotients of arrays whose divisor may be zero."""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from chipglow.quantities.units import Array

TINY: Final = 1e-300
"""Smaller than any quantity in SI units: the smallest divisor where 0 / 0 must be 0, not NaN."""


def quotient(part: Array, whole: ArrayLike) -> Array:
    """Return the quotient; NaN where the divisor is not positive."""
    divisor = np.asarray(whole, np.float64)
    unknown = np.full(np.broadcast_shapes(part.shape, divisor.shape), np.nan)
    return np.asarray(np.divide(part, divisor, out=unknown, where=divisor > 0))
