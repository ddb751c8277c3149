"""Share of the plastic work that becomes heat, for kernels."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.material import RateTable


def heat_shares(share: float | RateTable) -> NDArray[np.float64]:
    """A material's `taylor_quinney` as `heat_share` takes it.

    Returns
    -------
    ndarray
        Plastic strain rates in 1/s and the shares at them, shape (2, n); a constant share is held
        from one rate, whichever.
    """
    table = share if isinstance(share, RateTable) else RateTable((1.0,), (share,))
    return np.array([table.rates, table.values], dtype=np.float64)


@njit
def heat_share(rate, shares):  # type: ignore[no-untyped-def]
    """Share of the plastic work that becomes heat at a plastic strain rate in 1/s."""
    last = shares.shape[1] - 1
    if rate <= shares[0, 0]:
        return shares[1, 0]
    for i in range(last):
        low, high = shares[0, i], shares[0, i + 1]
        if rate < high:
            way = np.log(rate / low) / np.log(high / low)
            return shares[1, i] + way * (shares[1, i + 1] - shares[1, i])
    return shares[1, last]
