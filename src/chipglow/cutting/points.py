"""Material points: their state, and keeping them sorted by cell."""

from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

POINT: Final = np.dtype(
    [
        (name, np.float64)
        for name in (
            "x", "y", "vx", "vy", "own_vx", "own_vy",
            "cxx", "cxy", "cyx", "cyy",
            "dxx", "dyy", "dxy",
            "strain", "increment", "strain_before", "damage", "temperature",
            "elastic_temperature",
            "volume", "free_volume", "rise_x", "rise_y",
            "material_x", "material_y", "contact_time",
            "averaged_strain", "mean_rate",
        )
    ]
)  # fmt: skip
"""Position, velocity of the grid there, velocity that the point carries, velocity gradient,
deviator of the Cauchy stress that the elastic strain makes at room temperature; plastic strain,
what the last step added to it and what it was at the last record; damage, temperature, that of the
moduli in the last step, volume per width and what it would be without stress (at the temperature of
the last step), rise of the temperature over a cell, position before the cut, time in contact since
the last exchange of heat; plastic strain when its rates were last averaged, and the mean rate
around the point then; SI units."""

Points: TypeAlias = NDArray[np.void]


class Grid(NamedTuple):
    """The background grid: node (i, j) is at left + i·cell, bottom + j·cell."""

    left: float
    bottom: float
    cell: float
    columns: int
    rows: int


def block_of_points(
    x: NDArray[np.float64], y: NDArray[np.float64], spacing: float, temperature: float, speed: float
) -> Points:
    """Points on the lattice of columns x and rows y (m), moving along x at `speed` (m/s)."""
    points = np.zeros(x.size * y.size, POINT)
    points["x"] = np.repeat(x, y.size)
    points["y"] = np.tile(y, x.size)
    points["vx"] = points["own_vx"] = speed
    points["volume"] = points["free_volume"] = spacing**2
    points["temperature"] = points["elastic_temperature"] = temperature
    points["material_x"], points["material_y"] = points["x"], points["y"]
    return points


@njit(cache=True)
def sort_by_cell(points, count, grid, right, top, target, starts):  # type: ignore[no-untyped-def]
    """Copy the points within the region into `target`, cell by cell; return how many.

    `starts` (columns·rows + 1) says where each cell's points begin; a point whose position is not
    finite makes the result negative.
    """
    cells = np.empty(count, np.int64)
    starts[:] = 0
    for i in range(count):
        p = points[i]
        if not (np.isfinite(p.x) and np.isfinite(p.y)):
            return -1 - i
        column = int((p.x - grid.left) / grid.cell)
        row = int((p.y - grid.bottom) / grid.cell)
        inside = 2 <= column < grid.columns - 3 and 2 <= row < grid.rows - 3
        cells[i] = column * grid.rows + row if inside and p.x < right and p.y < top else -1
        if cells[i] >= 0:
            starts[cells[i] + 1] += 1
    for cell in range(starts.size - 1):
        starts[cell + 1] += starts[cell]
    cursor = starts[:-1].copy()
    for i in range(count):
        if cells[i] >= 0:
            target[cursor[cells[i]]] = points[i]
            cursor[cells[i]] += 1
    return starts[-1]
