"""Which points lie in a polygon."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray


def in_polygon(
    corners: Sequence[tuple[float, float]], x: ArrayLike, y: ArrayLike
) -> NDArray[np.bool_]:
    """Tell which points lie in a polygon; where it overlaps itself, those twice in it do not."""
    x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    inside = np.zeros(x.shape, np.bool_)
    for (x1, y1), (x2, y2) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if y1 != y2:
            crossed = (y1 > y) != (y2 > y)
            inside ^= crossed & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside
