"""Cubic convolution: how a small map is enlarged smoothly."""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray


def cubic_convolution(distance: ArrayLike) -> NDArray[np.float64]:
    """Return the kernel of Keys (1981), a = −1/2: a node's weight by its distance in nodes."""
    u = np.abs(np.asarray(distance, dtype=np.float64))
    near = (1.5 * u - 2.5) * u**2 + 1.0
    far = ((-0.5 * u + 2.5) * u - 4.0) * u + 2.0
    return np.where(u <= 1.0, near, np.where(u < 2.0, far, 0.0))


def autocorrelation() -> NDArray[np.float64]:
    """Return the overlap of the kernel with itself, for lags of −3 to 3 nodes."""
    # Between nodes the product is a polynomial of degree 6: four Gauss points are exact.
    node, weight = np.polynomial.legendre.leggauss(4)
    pieces = np.arange(-2.0, 2.0)[:, None] + (node + 1.0) / 2.0
    kernel = cubic_convolution(pieces)
    return np.array(
        [(kernel * cubic_convolution(pieces + lag) * weight / 2.0).sum() for lag in range(-3, 4)]
    )


ENLARGED_VARIANCE: Final = float(autocorrelation()[3]) ** 2
"""Variance over an enlarged map of independent deviates of variance 1: (57/70)²."""
