"""Kernels on a grid of squares."""

from collections.abc import Callable
from math import ceil, hypot, pi, sqrt
from numbers import Real
from typing import Any, Final

import numpy as np
from numba import njit

from chipglow.quantities import Array

LARGEST_KERNEL: Final = 4097
"""Largest number of squares along a side of a kernel."""

_LONGEST: Final = 0.1
"""Longest length in m; a longer one is stated in another unit."""

_ROUNDING: Final = 1e-9
"""Relative difference of values that are equal but for rounding."""

_FAR_AWAY: Final = 1e9
"""Distance in widths of a point spread function that stands for infinity."""

_STEPS: Final = 64
"""Table steps per radian of the shortest wave of the amplitude."""

_KERNEL: Final[Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


def normalised(kernel: Array) -> Array:
    """Scale a kernel to a sum of 1."""
    return np.asarray(kernel / kernel.sum())


def folded(kernel: Array, rows: int, columns: int) -> Array:
    """Cut a kernel to a half size; its border squares contain the light beyond."""
    for axis, reach in enumerate((rows, columns)):
        line = np.moveaxis(kernel, axis, 0)
        beyond = line.shape[0] // 2 - reach
        if beyond > 0:
            inner = line[beyond:-beyond].copy()
            inner[0] += line[:beyond].sum(axis=0)
            inner[-1] += line[-beyond:].sum(axis=0)
            kernel = np.moveaxis(inner, 0, axis)
    return kernel


def resized(kernel: Array, rows: int, columns: int) -> Array:
    """Cut a kernel to a half size, or pad it with zeros."""
    for axis, reach in enumerate((rows, columns)):
        more = reach - kernel.shape[axis] // 2
        line = np.moveaxis(kernel, axis, 0)
        line = line[-more:more] if more < 0 else np.pad(line, ((more, more), (0, 0)))
        kernel = np.moveaxis(line, 0, axis)
    return kernel


def half_size(reach: float, spacing: float) -> int:
    """Return the number of squares on each side of the central one that cover `reach`."""
    check_length("spacing", spacing)
    # The tolerance absorbs rounding if a kernel ends on the edge of a square.
    half = max(0, ceil(reach / spacing - 0.5 - 1e-9))
    if 2 * half + 1 > LARGEST_KERNEL:
        raise ValueError(
            f"psf: spacing of {spacing:g} m is too fine for a kernel of {2 * reach:.3g} m; use "
            f"{2 * reach / LARGEST_KERNEL:.3g} m or more"
        )
    return half


def poisson_squares(
    spacing: float, rows: int, columns: int, tail: float, width: float, beyond: bool
) -> Array:
    """Return the fractions on squares of the transfer function (1 + 2π (b − a) f) exp(−2π b f).

    a is `tail` and b `width`; far away the light falls as a / (2π r³). The fraction of
    exp(−2π b f) within 0 to x and 0 to y is atan(x y / (b R)) / 2π with R² = x² + y² + b²; the
    factor f differentiates it with respect to b.
    """
    x, y = (spacing * (np.arange(-n, n + 2) - 0.5) for n in (columns, rows))
    if beyond:
        x[[0, -1]], y[[0, -1]] = ([-_FAR_AWAY * width, _FAR_AWAY * width],) * 2
    y = y[:, None]
    distance = np.sqrt(x**2 + y**2 + width**2)
    plain = np.arctan(x * y / (width * distance))
    change = x * y * (distance**2 + width**2) / (distance * (x**2 + width**2) * (y**2 + width**2))
    corner = plain + (width - tail) * change
    return np.asarray(np.diff(np.diff(corner, axis=0), axis=1) / (2 * pi))


def light_on_squares(
    amplitude: Callable[[Array], Array], side: float, rows: int, columns: int, nodes: int
) -> Array:
    """Integrate the square of an amplitude over squares from radius 0 on, by Gauss nodes.

    The amplitude contains no wave shorter than 2π, as for a pupil of radius 1. It is tabulated at
    steps h of the radius and interpolated by cubics, with a relative error of 3 h⁴ / 128 = 1.4e-9.
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
    """Interpolate between the middle two of four equidistant values, 0 ≤ t ≤ 1, by a cubic."""
    near = before * t * (t - 1.0) * (2.0 - t) + after * t * (t - 1.0) * (t + 1.0)
    far = (first * (1.0 - t) + last * t) * 3.0 * (2.0 - t) * (t + 1.0)
    return (near + far) / 6.0


def peak(weights: Array) -> tuple[int, int]:
    """Return row and column of the largest value; of equal values, the most central."""
    # Values that differ by rounding are equal: the top of a disc is flat.
    places = np.argwhere(weights >= weights.max() * (1 - _ROUNDING))
    from_middle = np.hypot(*(places - places.mean(axis=0)).T)
    row, column = places[int(np.argmin(from_middle))].tolist()
    return row, column


def kernel_fwhm(kernel: Array, spacing: float) -> float:
    """Return the mean full width at half maximum along row and column through the peak, in m."""
    row, column = peak(kernel)
    widths = [half_maximum_width(line) for line in (kernel[row], kernel[:, column])]
    return float(np.mean(widths)) * spacing


def half_maximum_width(line: Array) -> float:
    """Return the full width at half maximum of a line of samples, in samples."""
    padded = np.pad(line, 1)
    level = padded.max() / 2
    above = np.flatnonzero(padded >= level)
    first, last = int(above[0]), int(above[-1])
    rise = (padded[first] - level) / (padded[first] - padded[first - 1])
    fall = (padded[last] - level) / (padded[last] - padded[last + 1])
    return float(last - first + rise + fall)


def check_length(name: str, value: float) -> None:
    """Raise a ValueError unless a length is positive and at most `_LONGEST`."""
    if not (isinstance(value, Real) and 0.0 < value <= _LONGEST):
        raise ValueError(
            f"psf: {name} must be positive and at most {_LONGEST:g} m, not {value!r}; 8 um is 8e-6"
        )
