"""The temperature of a tool at steady state: conduction from contact to holder.

Near the edge it is conduction in the plane of the cut; with the distance r from the edge the heat
spreads to one side of the cut as well (the chip forms at the tool's imaged side), so that it flows
through a width of w + r. Beyond the computed region it flows outward from the edge:
T − T_holder = Q / (kθ) (Φ(r) − Φ(R)) with Φ(r) = ln((w + r) / r), for a heat Q per time and width,
a wedge of the angle θ and a holder at R.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from chipglow.cutting.conditions import INITIAL_TEMPERATURE
from chipglow.cutting.heat import CELLS, GROWTH, ToolHeat, border_nodes
from chipglow.cutting.points import Grid
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH

Field = NDArray[np.float64]

_MIN_FACING: Final = 0.2
"""Smallest cosine between the outward direction and a side of the grid: a side along the heat flow
still conducts."""


@dataclass(frozen=True)
class ToolBody(Part):
    """Body through which the heat of a steady tool flows."""

    width: Annotated[
        float, Parameter("Width of cut; the paper's discs are 3 mm thick.", LENGTH)
    ] = 3e-3
    holder_distance: Annotated[
        float,
        Parameter("Distance from the edge to the holder, over 2 mm.", LENGTH, over=2e-3, most=1.0),
    ] = 10e-3
    holder_temperature: Annotated[
        float, replace(INITIAL_TEMPERATURE, meaning="Temperature of the holder.")
    ] = 293.15

    def fall(self, r: Field) -> Field:
        """Return Φ(r) − Φ(R) at distances r from the edge in m; 0 from the holder on."""
        here, there = (np.log1p(self.width / at) for at in (r, self.holder_distance))
        return np.asarray(np.maximum(here - there, 0.0))

    def spreading(self, r: Field) -> Field:
        """Return the width that heat flows through at a distance, over that of the cut."""
        return 1.0 + r / self.width


@dataclass(frozen=True)
class SteadyTool:
    """Temperature of a tool's nodes after a long cut."""

    grid: Grid
    fraction: Field
    """Fraction of each node's square that the tool fills, shape (columns, rows)."""
    temperature: Field
    """In K, shape (columns, rows)."""
    rounds: tuple[float, ...]
    """Mean temperature of the contact in K after each round of cutting and conduction."""

    def on(self, grid: Grid, fraction: Field) -> Field:
        """Return the temperature on the nodes of another grid, in K, shape (columns, rows)."""
        x, y = self.grid.axes
        filled = self.fraction > 0.0
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
        nearest = scipy.interpolate.NearestNDInterpolator(places[filled], self.temperature[filled])
        # Nodes beside the tool have no temperature: the nearest of the tool's own stands there.
        whole = np.where(filled, self.temperature, nearest(places))
        inside = scipy.interpolate.RegularGridInterpolator(
            (x, y), whole, bounds_error=False, fill_value=None
        )
        new = np.stack(np.meshgrid(*grid.axes, indexing="ij"), axis=-1)
        beside = float(self.temperature[filled].min())
        return np.where(fraction > 0.0, inside(new), beside)


def steady_temperature(
    grid: Grid, fraction: Field, tool_heat: ToolHeat, body: ToolBody, heat: Field, draining: Field
) -> Field:
    """Return the temperature in K of a tool's nodes under a steady heat, shape (columns, rows).

    `heat` enters each node, per time and width in W/m; by `draining` less per kelvin of the node,
    in W/(m K).
    """
    filled = fraction > 0.0
    number = np.full(fraction.shape, -1)
    number[filled] = np.arange(np.count_nonzero(filled))
    conductivity = tool_heat.conductivity * body.spreading(_distance(grid))
    links = []
    for one, other in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        flow = np.minimum(fraction[one], fraction[other])
        flow = flow * 0.5 * (conductivity[one] + conductivity[other])
        joined = flow > 0.0
        links.append((number[one][joined], number[other][joined], flow[joined]))
    border = border_nodes(fraction)
    i, j = border[:, 0], border[:, 1]
    outward = fraction[i, j] * grid.cell * _outward(grid, border, conductivity, body)
    drained, given = draining.copy(), heat.copy()
    np.add.at(drained, (i, j), outward)
    np.add.at(given, (i, j), outward * body.holder_temperature)
    result = np.full(fraction.shape, body.holder_temperature)
    result[filled] = scipy.sparse.linalg.spsolve(_conduction(links, drained[filled]), given[filled])
    return result


def _conduction(
    links: Iterable[tuple[NDArray[np.int64], NDArray[np.int64], Field]], drained: Field
) -> scipy.sparse.csc_array:
    """Return the matrix of the heat that leaves each node, per kelvin of each."""
    one, other, flow = (np.concatenate(part) for part in zip(*links, strict=True))
    every = np.arange(drained.size)
    rows = np.concatenate([every, one, other, one, other])
    columns = np.concatenate([every, one, other, other, one])
    values = np.concatenate([drained, flow, flow, -flow, -flow])
    return scipy.sparse.csc_array((values, (rows, columns)), shape=(drained.size, drained.size))


def _distance(grid: Grid) -> Field:
    """Return the distance of the nodes from the edge in m, a cell at least."""
    x, y = grid.axes
    return np.maximum(np.hypot(x[:, None], y[None, :]), grid.cell)


def _outward(grid: Grid, border: NDArray[np.int64], conductivity: Field, body: ToolBody) -> Field:
    """Return the heat through the border per area and kelvin over the holder, W/(m² K), shape (n,).

    −dΦ/dr = w / (r (w + r)); the widening is part of the conductivity.
    """
    i, j = border[:, 0], border[:, 1]
    r = _distance(grid)[i, j]
    sides = np.stack([(i == 0) | (i == grid.columns - 1), (j == 0) | (j == grid.rows - 1)])
    x, y = grid.axes
    along = np.abs(np.stack([x[i], y[j]])) / r
    facing = np.maximum(np.where(sides, along, 0.0).max(axis=0), _MIN_FACING)
    slope = body.width / (r * (body.width + r))
    return np.asarray(conductivity[i, j] * facing * slope / body.fall(r))


def beyond(grid: Grid, border: NDArray[np.int64], temperature: Field, body: ToolBody) -> Field:
    """Return the temperature in K of the cells beyond the border, shape (n, `CELLS`)."""
    lengths = grid.cell * GROWTH ** np.arange(CELLS)
    out = np.cumsum(lengths) - 0.5 * lengths + 0.5 * grid.cell
    i, j = border[:, 0], border[:, 1]
    r = _distance(grid)[i, j][:, None]
    left = body.fall(r + out) / body.fall(r)
    return body.holder_temperature + left * (temperature[i, j][:, None] - body.holder_temperature)
