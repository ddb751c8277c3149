"""Light of a round point spread function on squares."""

from collections.abc import Callable
from math import ceil, hypot, sqrt
from typing import Any, Final

import numpy as np
from numba import njit

from chipglow.quantities import Array

_STEPS: Final = 64
"""Steps of the amplitude's table over which its fastest wave moves on by one radian."""

_KERNEL: Final[Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


def light_on_squares(
    amplitude: Callable[[Array], Array], side: float, rows: int, columns: int, nodes: int
) -> Array:
    """Integrate the square of an amplitude over squares, shape (rows + 1, columns + 1).

    The first square's middle is at radius 0; `nodes` are Gauss nodes along a side. The amplitude
    holds no wave shorter than 2π, as that of a pupil of radius 1 does not. It is evaluated at even
    radii only, and between them is the cubic through the four nearest: with a step h it is off by
    3 h⁴ / 128 of the waves' amplitude there, 1.4e-9.
    """
    node, weight = np.polynomial.legendre.leggauss(nodes)
    down, across = (side * (np.arange(n + 1)[:, None] + node / 2) for n in (rows, columns))
    last = ceil(_STEPS * hypot(down[-1, -1], across[-1, -1])) + 2
    table = amplitude(np.abs(np.arange(-1.0, last + 1)) / _STEPS)
    sums = np.empty((rows + 1, columns + 1))
    _add_light(table, down, across, weight, sums)
    return sums * (side / 2) ** 2


@njit(**_KERNEL)
def _add_light(table, down, across, weight, sums):  # type: ignore[no-untyped-def]
    """Sum the squared amplitude over the nodes of all squares, by weight."""
    for row in range(sums.shape[0]):
        for column in range(sums.shape[1]):
            total = 0.0
            for i in range(weight.size):
                for j in range(weight.size):
                    radius = _STEPS * sqrt(down[row, i] ** 2 + across[column, j] ** 2)
                    at = int(radius)
                    t = radius - at
                    value = _between(table[at], table[at + 1], table[at + 2], table[at + 3], t)
                    total += weight[i] * weight[j] * value * value
            sums[row, column] = total


@njit(inline="always")
def _between(before, first, last, after, t):  # type: ignore[no-untyped-def]
    """Return the value at 0 ≤ t ≤ 1 between the middle two of four even values, by their cubic."""
    near = before * t * (t - 1.0) * (2.0 - t) + after * t * (t - 1.0) * (t + 1.0)
    far = (first * (1.0 - t) + last * t) * 3.0 * (2.0 - t) * (t + 1.0)
    return (near + far) / 6.0
