"""What can go wrong with the points of a simulation: which, where."""

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.cutting.material import TABLE_COLDEST, TABLE_HOTTEST
from chipglow.cutting.points import POINT, Grid, Points

_COLDEST: Final = TABLE_COLDEST - 1.0  # a workpiece of 200 K may round to less

Trouble: TypeAlias = tuple[str, int]
"""What is wrong, and the number of the point."""


def find_trouble(points: Points) -> Trouble | None:
    """Look for a point that is not finite, too cold or too hot."""
    with np.errstate(invalid="ignore", over="ignore"):
        values = points.view(np.float64).reshape(points.size, -1)
        total = values.sum()
    if not np.isfinite(total) and not (finite := np.isfinite(values)).all():
        # What spread furthest was the first.
        field = int((~finite).sum(axis=0).argmax())
        return f"{(POINT.names or ())[field]} is not finite", _innermost(points, ~finite[:, field])
    temperature = points["temperature"]
    for index in (int(temperature.argmin()), int(temperature.argmax())):
        if not _COLDEST <= temperature[index] <= TABLE_HOTTEST:
            return f"temperature out of {TABLE_COLDEST:g} K to {TABLE_HOTTEST:g} K", index
    return None


def _innermost(points: Points, marked: NDArray[np.bool_]) -> int:
    """Number of the marked point nearest to the middle of them: what spreads began there."""
    x, y = points["x"], points["y"]
    placed = marked & np.isfinite(x) & np.isfinite(y)
    if not placed.any():
        return int(marked.argmax())
    distance = np.hypot(x - x[placed].mean(), y - y[placed].mean())
    return int(np.where(placed, distance, np.inf).argmin())


def fastest_point(points: Points) -> tuple[float, int]:
    """Speed in m/s and number of the fastest point."""
    speed = np.hypot(points["vx"], points["vy"])
    index = int(speed.argmax())
    return float(speed[index]), index


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
    inside: NDArray[np.bool_] = (x >= 0.5) & (x < grid.columns - 1.5)
    inside &= (y >= 0.5) & (y < grid.rows - 1.5)
    return "a point left the grid", int(inside.argmin())
