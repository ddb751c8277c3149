"""Logarithm and exponential that a compiler can apply to several points at once.

A call of the C library stops a loop from being vectorised; these are plain arithmetic. The series
are the coefficients of artanh and e^x on an interval of half a binary order.
"""

from typing import Any, Final

import numpy as np
from numba import njit

FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract", "arcp", "nsz"}}
"""How kernels are compiled: no checks for division by zero, and freedom to fuse and to divide by
multiplying; never the freedom to change the order of sums or to ignore what is not finite."""

INLINE: Final[Any] = {**FAST, "forceinline": True}
"""How functions that loops call for every point are compiled: a call would stop vectorisation."""

_LN2 = 0.6931471805599453
"""ln 2."""

_LN2_HIGH = 0.693147180369123816490
"""First 33 bits of ln 2: their products with the integers of `exponential` are exact."""

_LN2_LOW = 1.90821492927058770002e-10
"""ln 2 less `_LN2_HIGH`."""

_HALF_OF_TWO = 0x3FE6A09E667F3BCD
"""Bits of √½."""
_ROUND = 6755399441055744.0
"""1.5 · 2⁵²: adding it leaves an integer in the lowest bits of a float."""


@njit(**INLINE)
def logarithm(x):  # type: ignore[no-untyped-def]
    """Return ln x for a normal x > 0, within 4e-15 + 2 units in the last place."""
    bits = np.float64(x).view(np.int64)
    exponent = (bits - _HALF_OF_TWO) >> 52  # a double has 52 bits of fraction
    fraction = np.int64(bits - (exponent << 52)).view(np.float64)
    f = (fraction - 1.0) / (fraction + 1.0)
    s = f * f
    # ln x = 2 (f + f³/3 + f⁵/5 + …)
    series = 1 / 15 + s * (1 / 17)
    series = 1 / 13 + s * series
    series = 1 / 11 + s * series
    series = 1 / 9 + s * series
    series = 1 / 7 + s * series
    series = 1 / 5 + s * series
    series = 1 / 3 + s * series
    return exponent * _LN2 + 2.0 * (f + f * (s * series))


@njit(**INLINE)
def exponential(x):  # type: ignore[no-untyped-def]
    """Return e^x for |x| < 700, within 1e-14 of its value."""
    shifted = x * (1.0 / _LN2) + _ROUND
    n = shifted - _ROUND
    r = (x - n * _LN2_HIGH) - n * _LN2_LOW
    # The Taylor series to r¹²; the coefficient of rⁿ is 1/n!.
    series = 1 / 39916800 + r * (1 / 479001600)
    series = 1 / 3628800 + r * series
    series = 1 / 362880 + r * series
    series = 1 / 40320 + r * series
    series = 1 / 5040 + r * series
    series = 1 / 720 + r * series
    series = 1 / 120 + r * series
    series = 1 / 24 + r * series
    series = 1 / 6 + r * series
    series = 0.5 + r * series
    series = 1.0 + r * series
    series = 1.0 + r * series
    # 2ⁿ as a double: its exponent is stored with an offset of 1023.
    scale = np.int64((np.float64(shifted).view(np.int64) + 1023) << 52).view(np.float64)
    return series * scale
