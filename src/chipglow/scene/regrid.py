"""From one regular grid to another: mean over areas to coarser samples, bilinear to finer ones."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.quantities import ROUNDING, TINY
from chipglow.scene.frame import Material

Taps = tuple[NDArray[np.int64], NDArray[np.float64]]
_KINDS = len(Material)


def taps(centres: NDArray[np.float64], spacing: float, wanted: NDArray[np.float64]) -> Taps:
    """Return the first sample of each wanted one, and weights (wanted, taps), along one axis.

    A wanted sample larger than one of the grid is the mean over its area; a smaller one is
    interpolated linearly, constant in the outer half of the last sample; 0 off the grid.
    """
    step = (centres[-1] - centres[0]) / (centres.size - 1)
    place = (wanted - centres[0]) / step
    # A sample that is on the edge but for rounding is on the grid.
    inside = (place > -0.5 - ROUNDING) & (place < centres.size - 0.5 + ROUNDING)
    ratio = spacing / step
    if ratio <= 1.0 + ROUNDING:
        place = np.clip(place, 0.0, centres.size - 1.0)
        first = np.minimum(place.astype(np.int64), centres.size - 2)
        weights = np.stack([1.0 - (place - first), place - first], axis=1)
    else:
        low = np.clip(place - ratio / 2, -0.5, centres.size - 0.5)
        high = np.clip(place + ratio / 2, -0.5, centres.size - 0.5)
        first = np.clip(np.floor(low + 0.5).astype(np.int64), 0, centres.size - 1)
        number = first[:, None] + np.arange(min(int(np.ceil(ratio)) + 2, centres.size))
        covered = np.minimum(high[:, None], number + 0.5) - np.maximum(low[:, None], number - 0.5)
        weights = np.clip(covered, 0.0, None) / ratio
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), TINY)
    weights[~inside] = 0.0
    return first, weights


def regrid(
    values: NDArray[np.float32], material: NDArray[np.uint8], across: Taps, down: Taps
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return values (fields, y, x) and material of one grid on another, by the `taps` of its axes.

    A sample shows the material that has most of it, and the mean of that material alone.
    """
    return _regrid(values, material, *across, *down)  # type: ignore[no-any-return]


@njit(cache=True)
def _regrid(values, material, first_x, weights_x, first_y, weights_y):  # type: ignore[no-untyped-def]
    fields = values.shape[0]
    shape = (first_y.size, first_x.size)
    result = np.full((fields, *shape), np.nan, np.float32)
    kinds = np.zeros(shape, np.uint8)
    fraction = np.empty(_KINDS)
    total, known = np.empty(fields), np.empty(fields)
    for row in range(shape[0]):
        for column in range(shape[1]):
            fraction[:] = 0.0
            for a in range(weights_y.shape[1]):
                for b in range(weights_x.shape[1]):
                    weight = weights_y[row, a] * weights_x[column, b]
                    if weight > 0.0:
                        fraction[material[first_y[row] + a, first_x[column] + b]] += weight
            kind = np.argmax(fraction)
            kinds[row, column] = kind
            if kind == 0:
                continue
            total[:] = 0.0
            known[:] = 0.0
            for a in range(weights_y.shape[1]):
                for b in range(weights_x.shape[1]):
                    weight = weights_y[row, a] * weights_x[column, b]
                    if weight == 0.0:
                        continue
                    j, i = first_y[row] + a, first_x[column] + b
                    if material[j, i] != kind:
                        continue
                    for f in range(fields):
                        value = values[f, j, i]
                        if not np.isnan(value):
                            total[f] += weight * value
                            known[f] += weight
            for f in range(fields):
                if known[f] > 0.0:
                    result[f, row, column] = total[f] / known[f]
    return result, kinds
