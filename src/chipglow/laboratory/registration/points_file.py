"""Points that were seen in an infrared image and in a visible picture, from a table."""

import csv
import os
from pathlib import Path
from typing import Final

import numpy as np

from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.text import read_small_text

_VISIBLE: Final = ["visible_column", "visible_row"]
_BY_LENGTH: Final = ["x_um", "y_um", *_VISIBLE]
_BY_PIXEL: Final = ["infrared_column", "infrared_row", *_VISIBLE]
_HALF: Final = 0.5


def read_points(
    path: str | os.PathLike[str], raster: Raster, shape: tuple[int, int]
) -> tuple[Array, Array]:
    """Read points from a CSV file."""
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
    points: Array,
    positions: Array,
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
