"""From material points to fields on a regular raster, smooth across free surfaces.

Each field is the quadratic B-spline on the grid that fits the points: a weighted mean to start
with, then corrections by the residual at the points. A sample shows the workpiece where the
smoothed fraction of the area that chip and tool fill is over one half: on a straight surface
that is the surface. The samples belong to a `SplineFrame`, which the frame keeps.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.cutting.momentum import spline, spline_weights
from chipglow.cutting.points import Grid, Points
from chipglow.scene import Frame, Raster, Tool
from chipglow.scene.splines import FILLED_SPLINE, SPLINE_FIELDS, Lattice, SplineFrame

_FIELDS: Final = SPLINE_FIELDS[:FILLED_SPLINE]

_CORRECTIONS: Final = 2
"""Repetitions of the fit of splines to points, on its residuals."""

_FILL_PASSES: Final = 3
"""Nodes beyond the material to which values are extended: as many as a quadratic spline has."""


class Picture:
    """Maker of a scene's frames from points and the tool's temperature.

    The grid must cover the lattice's raster. `filled_by_tool` is the fraction of each node's
    square, shape (columns, rows).
    """

    def __init__(self, grid: Grid, lattice: Lattice, filled_by_tool: NDArray[np.float64]) -> None:
        self._grid, self._lattice, self._filled_by_tool = grid, lattice, filled_by_tool
        across = round((lattice.left - grid.left) / grid.cell)
        highest = round((lattice.top - grid.bottom) / grid.cell)
        rows = slice(highest - lattice.rows + 1, highest + 1)
        self._seen_nodes = slice(across, across + lattice.columns), rows
        margin = 3 * grid.cell  # more than the 1.5 cells that a spline reaches
        left, right, bottom, top = lattice.raster.extent
        self._view = (left - margin, right + margin, bottom - margin, top + margin)

    def frame(
        self,
        time: float,
        points: Points,
        values: Mapping[str, NDArray[np.float64]],
        tool_temperature: NDArray[np.float64],
    ) -> Frame:
        """Return the fields at a time in s, of values at the points by the names of a `Frame`."""
        left, right, bottom, top = self._view
        seen = (points["x"] > left) & (points["x"] < right)
        seen &= (points["y"] > bottom) & (points["y"] < top)
        fx = (points["x"][seen] - self._grid.left) / self._grid.cell
        fy = (points["y"][seen] - self._grid.bottom) / self._grid.cell
        at_points = np.stack([values[name][seen] for name in _FIELDS], axis=1)
        area = points["volume"][seen] / self._grid.cell**2
        shape = (self._grid.columns, self._grid.rows)
        coefficients, filled, known = _fit(fx, fy, at_points, area, *shape, _CORRECTIONS)
        # With no point near, the tool alone may fill half a sample on its face: a speck of chip.
        filled = np.where(known, np.minimum(filled, 1.0) + self._filled_by_tool, 0.0)
        _fill(coefficients, known, _FILL_PASSES)
        tool = tool_temperature[..., None].copy()
        _fill(tool, self._filled_by_tool > 0.0, _FILL_PASSES)
        nodes = np.concatenate([coefficients, filled[..., None], tool], axis=2)
        limits = np.stack([at_points.min(axis=0), at_points.max(axis=0)], axis=1)
        from_the_top = nodes[self._seen_nodes][:, ::-1].transpose(2, 1, 0)
        from_the_top = np.ascontiguousarray(from_the_top, np.float32)
        return SplineFrame(self._lattice, time, from_the_top, limits.astype(np.float32)).frame()


def lattice_of(grid: Grid, raster: Raster, tool: Tool, ambient: float) -> Lattice:
    """Return the nodes of the solver's grid that a raster's frames need."""
    in_tool = tool.signed_distance(raster.x[None, :], raster.y[:, None]) < 0.0
    return Lattice.within(raster, (grid.left, grid.bottom), grid.cell, in_tool, ambient)


@njit(cache=True)
def _fit(fx, fy, values, area, columns, rows, corrections):  # type: ignore[no-untyped-def]
    """Return coefficients (columns, rows, fields), filled fraction and where points are near."""
    fields = values.shape[1]
    weight = np.zeros((columns, rows))
    result = np.zeros((columns, rows, fields))
    change = np.zeros((columns, rows, fields))
    residual = np.empty(fields)
    for correction in range(corrections + 1):
        change[:] = 0.0
        for k in range(fx.size):
            i, ax = spline(fx[k])
            j, ay = spline(fy[k])
            wx, wy = spline_weights(ax), spline_weights(ay)
            residual[:] = values[k]
            if correction > 0:
                for a in range(3):
                    for b in range(3):
                        for f in range(fields):
                            residual[f] -= wx[a] * wy[b] * result[i + a, j + b, f]
            for a in range(3):
                for b in range(3):
                    w = wx[a] * wy[b] * area[k]
                    if correction == 0:
                        weight[i + a, j + b] += w
                    for f in range(fields):
                        change[i + a, j + b, f] += w * residual[f]
        for i in range(columns):
            for j in range(rows):
                if weight[i, j] > 0.0:
                    for f in range(fields):
                        result[i, j, f] += change[i, j, f] / weight[i, j]
    return result, weight, weight > 0.0


@njit(cache=True)
def _fill(values, known, passes):  # type: ignore[no-untyped-def]
    """Extend values beyond where they are known: mean of the known neighbours, a few nodes far."""
    columns, rows, fields = values.shape
    known = known.copy()
    for _ in range(passes):
        before = known.copy()
        for i in range(1, columns - 1):
            for j in range(1, rows - 1):
                if before[i, j]:
                    continue
                near = 0
                for a in range(-1, 2):
                    for b in range(-1, 2):
                        near += before[i + a, j + b]
                if near == 0:
                    continue
                for f in range(fields):
                    total = 0.0
                    for a in range(-1, 2):
                        for b in range(-1, 2):
                            if before[i + a, j + b]:
                                total += values[i + a, j + b, f]
                    values[i, j, f] = total / near
                known[i, j] = True
