"""The nearest known sample, for those that are not known."""

from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

_REACH: Final = 8
"""Samples within which the nearest known one is looked for."""


def nearest(known: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> tuple[NDArray[np.intp], ...]:
    """Return rows and columns of the known samples nearest to the n wanted ones, shape (n,) each.

    It is quick where the known ones are near, as around holes and lines.
    """
    at = np.argwhere(wanted)
    found = np.full(at.shape, -1, np.intp)
    _search(known, at, found)
    far = found[:, 0] < 0
    if far.any():
        indices = distance_transform_edt(~known, return_distances=False, return_indices=True)
        found[far] = indices[:, at[far, 0], at[far, 1]].T
    return found[:, 0], found[:, 1]


def fill(values: NDArray[Any], known: NDArray[np.bool_], wanted: NDArray[np.bool_]) -> None:
    """Give wanted samples the value of the nearest known one in place."""
    if wanted.any() and known.any():
        values[wanted] = values[nearest(known, wanted)]


def extended(values: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Values with all that are not known taken from the nearest that is, shape (y, x).

    For wide regions it is quicker than `fill`.
    """
    if known.all() or not known.any():
        return np.where(known, values, np.float32(0.0))
    indices = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(indices)])


@njit(cache=True)
def _search(known, at, found):  # type: ignore[no-untyped-def]
    """Look for the nearest known sample in squares that grow."""
    height, width = known.shape
    for index in range(len(at)):
        row, column = at[index, 0], at[index, 1]
        best = np.inf
        side = 1
        while side <= _REACH and side * side < best:
            for other in range(max(row - side, 0), min(row + side, height - 1) + 1):
                whole = abs(other - row) == side
                step = 1 if whole else 2 * side
                for beside in range(column - side, column + side + 1, step):
                    apart = (other - row) ** 2 + (beside - column) ** 2
                    if 0 <= beside < width and apart < best and known[other, beside]:
                        best = apart
                        # A pair that is assigned takes Numba four times as long to compile.
                        found[index, 0], found[index, 1] = other, beside
            side += 1
        if best > _REACH**2:
            found[index, 0] = -1  # one beyond the last square may be nearer
