"""Fraction of the plastic work that becomes heat, for kernels."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.material import RateTable


def heat_fractions(fraction: float | RateTable) -> NDArray[np.float64]:
    """A material's `taylor_quinney` as `heat_fraction` takes it.

    Returns
    -------
    ndarray
        Plastic strain rates in 1/s and the fractions at them, shape (2, n); a constant one is held
        from one rate, whichever.
    """
    table = fraction if isinstance(fraction, RateTable) else RateTable((1.0,), (fraction,))
    return np.array([table.rates, table.values], dtype=np.float64)


@njit
def heat_fraction(rate, fractions):  # type: ignore[no-untyped-def]
    """Fraction of the plastic work that becomes heat at a plastic strain rate in 1/s."""
    last = fractions.shape[1] - 1
    if rate <= fractions[0, 0]:
        return fractions[1, 0]
    for i in range(last):
        low, high = fractions[0, i], fractions[0, i + 1]
        if rate < high:
            way = np.log(rate / low) / np.log(high / low)
            return fractions[1, i] + way * (fractions[1, i + 1] - fractions[1, i])
    return fractions[1, last]
