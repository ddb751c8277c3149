"""Images read along lines."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from chipglow.quantities import Brief
from chipglow.scene.raster import Raster, check_shape


@dataclass(frozen=True, repr=False)
class Line(Brief):
    """Points along a line or curve."""

    distance: NDArray[np.float64]
    """Distance along it in m, shape (n,), ascending; what it counts from is up to its maker."""
    points: NDArray[np.float64]
    """x and y in m, shape (n, 2)."""

    def __post_init__(self) -> None:
        check_shape("line: points", self.points.shape, (self.distance.size, 2))
        if (np.diff(self.distance) <= 0).any():
            raise ValueError("line: distance must ascend")


def straight_line(origin: ArrayLike, direction: ArrayLike, distance: ArrayLike) -> Line:
    """Return the line through a point along a unit vector, at ascending distances from it in m."""
    distances = np.asarray(distance, dtype=np.float64)
    direction = np.asarray(direction, dtype=np.float64)
    points = np.asarray(origin, dtype=np.float64) + distances[:, None] * direction
    return Line(distances, points)


def polyline(corners: NDArray[np.float64], pitch: float) -> Line:
    """Return points every half pixel from corner to corner, shape (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    distance = np.linspace(0.0, along[-1], max(round(2 * along[-1] / pitch), 1) + 1)
    points = [np.interp(distance, along, coordinate) for coordinate in corners.T]
    return Line(distance, np.stack(points, axis=1))


def sample(image: ArrayLike, raster: Raster, points: ArrayLike) -> NDArray[np.float64]:
    """Return an image (y, x) at points (..., 2) in m, bilinear between its samples' centres.

    NaN outside the outermost centres and beside a NaN.
    """
    values, index = np.asarray(image, dtype=np.float64), raster.index(points)
    read = map_coordinates(values, index, order=1, mode="constant", cval=np.nan)
    return np.asarray(read, dtype=np.float64)


def nearest(image: ArrayLike, raster: Raster, points: ArrayLike) -> NDArray[np.float64]:
    """Return an image (y, x) at points (..., 2) in m: the sample that holds each; NaN outside."""
    row, column = nearest_sample(raster, points)
    inside = (column >= 0) & (column < raster.columns) & (row >= 0) & (row < raster.rows)
    values = np.full(inside.shape, np.nan)
    values[inside] = np.asarray(image)[row[inside], column[inside]]
    return values


def nearest_sample(
    raster: Raster, points: ArrayLike
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return row and column of the samples that hold points (..., 2) in m, each of shape (...)."""
    places = np.asarray(points, dtype=np.float64)
    column = np.floor((places[..., 0] - raster.left) / raster.spacing).astype(np.int64)
    row = np.floor((raster.top - places[..., 1]) / raster.spacing).astype(np.int64)
    return row, column
