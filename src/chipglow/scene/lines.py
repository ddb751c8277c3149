"""Images read along lines."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import map_coordinates

from chipglow.scene.raster import Raster


@dataclass(frozen=True)
class Line:
    """Points along a line or curve.

    Parameters
    ----------
    distance : ndarray
        Distance along it in m, shape (n,), ascending; what it counts from is up to its maker.
    points : ndarray
        x and y in m, shape (n, 2).

    Raises
    ------
    ValueError
        If the shapes do not fit, or the distance does not ascend.
    """

    distance: NDArray[np.float64]
    points: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.points.shape != (self.distance.size, 2):
            raise ValueError(
                f"line: points have shape {self.points.shape}, "
                f"expected ({self.distance.size}, 2) as there are distances"
            )
        if (np.diff(self.distance) <= 0).any():
            raise ValueError("line: distance must ascend")


def straight_line(origin: ArrayLike, direction: ArrayLike, distance: ArrayLike) -> Line:
    """Line through a point.

    Parameters
    ----------
    origin : array_like
        x and y in m where the distance is 0.
    direction : array_like
        Unit vector along which the distance grows.
    distance : array_like
        Distances in m, ascending, shape (n,).
    """
    distances = np.asarray(distance, dtype=np.float64)
    direction = np.asarray(direction, dtype=np.float64)
    points = np.asarray(origin, dtype=np.float64) + distances[:, None] * direction
    return Line(distances, points)


def sample(image: ArrayLike, raster: Raster, points: ArrayLike) -> NDArray[np.float64]:
    """Image read at points by bilinear interpolation between its samples' centres.

    Parameters
    ----------
    image : array_like
        Values on the raster, shape (y, x); NaN where there are none.
    raster : Raster
        Where the image's samples are.
    points : array_like
        x and y in m, shape (..., 2).

    Returns
    -------
    ndarray
        Values, shape (...); NaN outside the outermost centres and beside a NaN.
    """
    places = np.asarray(points, dtype=np.float64)
    column = (places[..., 0] - raster.left) / raster.spacing - 0.5
    row = (raster.top - places[..., 1]) / raster.spacing - 0.5
    return np.asarray(
        map_coordinates(
            np.asarray(image, dtype=np.float64),
            [row, column],
            order=1,
            mode="constant",
            cval=np.nan,
        ),
        dtype=np.float64,
    )


def nearest(image: ArrayLike, raster: Raster, points: ArrayLike) -> NDArray[np.float64]:
    """Image read at points from the sample that holds each.

    Parameters
    ----------
    image : array_like
        Values on the raster, shape (y, x).
    raster : Raster
        Where the image's samples are.
    points : array_like
        x and y in m, shape (..., 2).

    Returns
    -------
    ndarray
        Values, shape (...); NaN outside the raster.
    """
    places = np.asarray(points, dtype=np.float64)
    column = np.floor((places[..., 0] - raster.left) / raster.spacing).astype(np.int64)
    row = np.floor((raster.top - places[..., 1]) / raster.spacing).astype(np.int64)
    inside = (column >= 0) & (column < raster.columns) & (row >= 0) & (row < raster.rows)
    values = np.full(inside.shape, np.nan)
    values[inside] = np.asarray(image)[row[inside], column[inside]]
    return values
