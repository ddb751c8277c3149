"""Material points: their state, and keeping them sorted by cell."""

from typing import Final, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.material import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.quantities import Array

_COLDEST: Final = TABLE_COLDEST - 1.0  # a workpiece of 200 K may round to less

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
Trouble: TypeAlias = tuple[str, int]
"""Return the kind of fault, and the index of the point."""


class Grid(NamedTuple):
    """The background grid: node (i, j) is at left + i·cell, bottom + j·cell."""

    left: float
    bottom: float
    cell: float
    columns: int
    rows: int

    @property
    def axes(self) -> tuple[Array, Array]:
        """Places of the nodes along x and y in m."""
        x = self.left + self.cell * np.arange(self.columns, dtype=np.float64)
        return x, self.bottom + self.cell * np.arange(self.rows, dtype=np.float64)


def block_of_points(x: Array, y: Array, spacing: float, temperature: float, speed: float) -> Points:
    """Return points on the lattice of columns x and rows y (m), moving along x at `speed` (m/s)."""
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
        # A spline of a point in these cells has all its nodes on the grid, after a drift too.
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


def find_trouble(points: Points) -> Trouble | None:
    """Look for a point that is not finite, too cold or too hot."""
    with np.errstate(invalid="ignore", over="ignore"):
        values = points.view(np.float64).reshape(points.size, -1)
        total = values.sum()
    if not np.isfinite(total) and not (finite := np.isfinite(values)).all():
        # The farthest point was the first.
        field = int((~finite).sum(axis=0).argmax())
        return f"{(POINT.names or ())[field]} is not finite", _innermost(points, ~finite[:, field])
    temperature = points["temperature"]
    for index in (int(temperature.argmin()), int(temperature.argmax())):
        if not _COLDEST <= temperature[index] <= TABLE_HOTTEST:
            return f"temperature out of {TABLE_COLDEST:g} K to {TABLE_HOTTEST:g} K", index
    return None


def _innermost(points: Points, marked: NDArray[np.bool_]) -> int:
    """Return the number of the marked point in the middle of them: what spreads began there."""
    x, y = points["x"], points["y"]
    placed = marked & np.isfinite(x) & np.isfinite(y)
    if not placed.any():
        return int(marked.argmax())
    distance = np.hypot(x - x[placed].mean(), y - y[placed].mean())
    return int(np.where(placed, distance, np.inf).argmin())


def find_lost(points: Points, grid: Grid, ceiling: float) -> Trouble | None:
    """Look for a point about to be dropped under the workpiece or, below `ceiling`, before it."""
    left, bottom = grid.left + 2 * grid.cell, grid.bottom + 2 * grid.cell
    # The lowest layer may begin below the region, and points enter at its left edge.
    lost = (points["y"] < bottom) & (points["material_y"] >= bottom)
    lost |= (points["x"] < left) & (points["vx"] <= 0) & (points["y"] < ceiling)
    return ("a point left the workpiece's edge", int(lost.argmax())) if lost.any() else None


def find_off_grid(points: Points, grid: Grid) -> Trouble:
    """Find the point for which a step was given up."""
    x, y = ((points[name] - edge) / grid.cell for name, edge in zip("xy", grid[:2], strict=True))
    # A quadratic spline has the nodes from half a cell before a point to a cell and a half behind.
    inside: NDArray[np.bool_] = (x >= 0.5) & (x < grid.columns - 1.5)
    inside &= (y >= 0.5) & (y < grid.rows - 1.5)
    return "a point left the grid", int(inside.argmin())
