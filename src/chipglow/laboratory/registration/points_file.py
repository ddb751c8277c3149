"""Points that were seen in an infrared image and in a visible picture, from a table."""

import csv
import os
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Raster
from chipglow.text import read_small_text

_VISIBLE: Final = ["visible_column", "visible_row"]
_BY_LENGTH: Final = ["x_um", "y_um", *_VISIBLE]
_BY_PIXEL: Final = ["infrared_column", "infrared_row", *_VISIBLE]
_HALF: Final = 0.5


def read_points(
    path: str | os.PathLike[str], raster: Raster, shape: tuple[int, int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read points from a CSV file.

    Parameters
    ----------
    path : path-like
        First line ``x_um,y_um,visible_column,visible_row`` or
        ``infrared_column,infrared_row,visible_column,visible_row``, then a point a line. Columns
        and rows count from 0 in the middle of the upper left pixel.
    raster : Raster
        The infrared pixels.
    shape : tuple of int
        Rows and columns of the visible picture.

    Returns
    -------
    positions, pixels : ndarray
        x and y in m, and visible columns and rows, each of shape (n, 2).

    Raises
    ------
    ValueError
        If the file is no such table or a point is outside an image; the message names the file
        and the line.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    lines = read_small_text(path).rstrip().splitlines()
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines)] or [[]]
    if rows[0] not in (_BY_LENGTH, _BY_PIXEL):
        raise ValueError(
            f"{path}, line 1: {','.join(rows[0])!r}, expected {','.join(_BY_LENGTH)!r} "
            f"or {','.join(_BY_PIXEL)!r}"
        )
    points = np.array([_point(path, i, row) for i, row in enumerate(rows[1:], 2)]).reshape(-1, 4)
    positions = points[:, :2] * 1e-6
    if rows[0] == _BY_PIXEL:
        corner = np.array([raster.left, raster.top])
        positions = corner + (points[:, :2] + _HALF) * raster.spacing * [1.0, -1.0]
    _check_inside(path, points, positions, raster, shape)
    return positions, points[:, 2:]


def _point(path: Path, line: int, row: list[str]) -> list[float]:
    try:
        values = [float(cell) for cell in row]
    except ValueError:
        values = []
    if len(values) != len(_BY_LENGTH) or not np.isfinite(values).all():
        raise ValueError(f"{path}, line {line}: {','.join(row)!r}, expected four numbers")
    return values


def _check_inside(
    path: Path,
    points: NDArray[np.float64],
    positions: NDArray[np.float64],
    raster: Raster,
    shape: tuple[int, int],
) -> None:
    left, right, bottom, top = raster.extent
    for line, (point, place) in enumerate(zip(points, positions, strict=True), 2):
        if not (left <= place[0] <= right and bottom <= place[1] <= top):
            raise ValueError(
                f"{path}, line {line}: {point[0]:g}, {point[1]:g} is outside the infrared image, "
                f"expected x {1e6 * left:.6g} to {1e6 * right:.6g} um and y {1e6 * bottom:.6g} to "
                f"{1e6 * top:.6g} um, or columns 0 to {raster.columns - 1} and rows 0 to "
                f"{raster.rows - 1}"
            )
        if not (-_HALF <= point[2] <= shape[1] - _HALF and -_HALF <= point[3] <= shape[0] - _HALF):
            raise ValueError(
                f"{path}, line {line}: {point[2]:g}, {point[3]:g} is outside the visible picture, "
                f"expected columns 0 to {shape[1] - 1} and rows 0 to {shape[0] - 1}"
            )
