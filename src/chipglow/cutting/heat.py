"""Conduction in chip and tool, friction heat, and the heat that crosses their contact."""

from typing import NamedTuple

import numpy as np
from numba import njit

from chipglow.cutting.momentum import spline, spline_weights
from chipglow.cutting.stress import property_at
from chipglow.scene.tool_surface import surface_distance


class ToolHeat(NamedTuple):
    """Heat of the tool and of its contact.

    Capacity (J/(m³ K)), conductivity (W/(m K)), share of friction heat that enters the tool,
    conductance of the contact (W/(m² K)), contact area of a point (m²/m).
    """

    capacity: float
    conductivity: float
    friction_share: float
    conductance: float
    area: float


@njit(cache=True)
def tool_fraction(grid, tool):  # type: ignore[no-untyped-def]
    """Share of each node's square that the tool fills, shape (columns, rows)."""
    result = np.zeros((grid.columns, grid.rows))
    for i in range(grid.columns):
        for j in range(grid.rows):
            distance, _, _ = surface_distance(
                grid.left + i * grid.cell, grid.bottom + j * grid.cell, tool
            )
            result[i, j] = min(max(0.5 - distance / grid.cell, 0.0), 1.0)
    return result


@njit(cache=True)
def conduct(points, count, nodes, increment, conductivity, capacity, heat_mass, grid, duration):  # type: ignore[no-untyped-def]
    """Gather heat and temperature of the points on the grid and conduct for `duration` (s).

    `nodes` (columns, rows, 3) becomes heat capacity (J/(m K)), temperature (K) and filled share;
    `increment` (columns, rows) the rise of temperature (K). No heat crosses a free surface: the
    flux between two nodes goes through the smaller of their filled shares.
    """
    _gather_heat(points, count, nodes, capacity, heat_mass, grid)
    increment[:] = 0.0
    for i in range(grid.columns - 1):
        for j in range(grid.rows - 1):
            if nodes[i, j, 0] > 0.0:
                _exchange(nodes, increment, conductivity, i, j, i + 1, j, duration)
                _exchange(nodes, increment, conductivity, i, j, i, j + 1, duration)
    for i in range(grid.columns):
        for j in range(grid.rows):
            if nodes[i, j, 0] > 0.0:
                increment[i, j] /= nodes[i, j, 0]


@njit
def _nodes_around(p, grid):  # type: ignore[no-untyped-def]
    """First of the nodes around a point, column and row, and their weights along either."""
    i, ax = spline((p.x - grid.left) / grid.cell)
    j, ay = spline((p.y - grid.bottom) / grid.cell)
    return i, j, spline_weights(ax), spline_weights(ay)


@njit
def _gather_heat(points, count, nodes, capacity, heat_mass, grid):  # type: ignore[no-untyped-def]
    nodes[:] = 0.0
    for k in range(count):
        p = points[k]
        i, j, wx, wy = _nodes_around(p, grid)
        heat = heat_mass * property_at(capacity, p.temperature)
        share = p.volume / (grid.cell * grid.cell)
        for a in range(3):
            for b in range(3):
                w = wx[a] * wy[b]
                nodes[i + a, j + b, 0] += w * heat
                nodes[i + a, j + b, 1] += w * heat * p.temperature
                nodes[i + a, j + b, 2] += w * share
    for i in range(grid.columns):
        for j in range(grid.rows):
            if nodes[i, j, 0] > 0.0:
                nodes[i, j, 1] /= nodes[i, j, 0]


@njit(cache=True)
def even_out(points, count, nodes, deviation, capacity, heat_mass, grid, share):  # type: ignore[no-untyped-def]
    """Take a share of what the grid cannot see off the points' temperatures; heat is kept.

    Increments from the grid leave differences between the points of a cell as they are, so a point
    much colder than the others would be cooled with them. The share is taken off T - S T - S(T -
    S T), with S the way from the points to the grid and back: all of the noise that the grid does
    not see, and of a smooth field only a fourth derivative (XPIC of order 2 for the temperature,
    Hammerquist and Nairn 2017). `nodes` is that of `conduct`; `deviation` (columns, rows) is
    overwritten.
    """
    deviation[:] = 0.0
    for k in range(count):
        p = points[k]
        i, j, wx, wy = _nodes_around(p, grid)
        heat = heat_mass * property_at(capacity, p.temperature)
        beyond = p.temperature
        for a in range(3):
            for b in range(3):
                beyond -= wx[a] * wy[b] * nodes[i + a, j + b, 1]
        for a in range(3):
            for b in range(3):
                deviation[i + a, j + b] += wx[a] * wy[b] * heat * beyond
    for i in range(grid.columns):
        for j in range(grid.rows):
            if nodes[i, j, 0] > 0.0:
                deviation[i, j] /= nodes[i, j, 0]
    for k in range(count):
        p = points[k]
        i, j, wx, wy = _nodes_around(p, grid)
        noise = p.temperature
        for a in range(3):
            for b in range(3):
                node = nodes[i + a, j + b, 1] + deviation[i + a, j + b]
                noise -= wx[a] * wy[b] * node
        p.temperature -= share * noise


@njit
def _exchange(nodes, increment, conductivity, i, j, k, l, duration):  # type: ignore[no-untyped-def]  # noqa: E741
    if nodes[k, l, 0] == 0.0:
        return
    mean = 0.5 * (nodes[i, j, 1] + nodes[k, l, 1])
    k_mean = property_at(conductivity, mean)
    share = min(nodes[i, j, 2], nodes[k, l, 2], 1.0)
    heat = k_mean * share * (nodes[k, l, 1] - nodes[i, j, 1]) * duration
    increment[i, j] += heat
    increment[k, l] -= heat


@njit(cache=True)
def conduct_tool(temperature, fraction, tool_heat, grid, duration):  # type: ignore[no-untyped-def]
    """Conduct heat within the tool for `duration` (s); `temperature` (columns, rows) changes."""
    flow = np.zeros_like(temperature)
    rate = tool_heat.conductivity * duration / (tool_heat.capacity * grid.cell**2)
    for i in range(grid.columns - 1):
        for j in range(grid.rows - 1):
            if fraction[i, j] == 0.0:
                continue
            for k, m in ((i + 1, j), (i, j + 1)):
                share = min(fraction[i, j], fraction[k, m])
                heat = rate * share * (temperature[k, m] - temperature[i, j])
                flow[i, j] += heat
                flow[k, m] -= heat
    for i in range(grid.columns):
        for j in range(grid.rows):
            if fraction[i, j] > 0.0:
                temperature[i, j] += flow[i, j] / max(fraction[i, j], SMALLEST_FRACTION)


SMALLEST_FRACTION = 0.25
"""Nodes that the tool fills less than this store heat as if it filled so much: a thin sliver would
need a needlessly short time step."""


@njit(cache=True)
def heat_contact(  # type: ignore[no-untyped-def]
    points, count, friction, increment, nodes, temperature, fraction, tool, tool_heat, capacity,
    heat_mass, grid,
):  # fmt: skip
    """Share the friction work and exchange heat through the contact.

    Friction work (J/m, on the chip's nodes) goes to chip and tool by their effusivities; each
    point that touched the tool then exchanges heat with the tool's temperature next to it.
    """
    for i in range(grid.columns):
        for j in range(grid.rows):
            if friction[i, j] > 0.0:
                into_tool = tool_heat.friction_share * friction[i, j]
                increment[i, j] += (friction[i, j] - into_tool) / max(nodes[i, j, 0], 1e-12)
                x, y = grid.left + i * grid.cell, grid.bottom + j * grid.cell
                _warm(x, y, into_tool, temperature, fraction, tool, tool_heat, grid)
                friction[i, j] = 0.0
    for k in range(count):
        p = points[k]
        if p.contact_time > 0.0:
            inside = _tool_temperature(p.x, p.y, temperature, fraction, tool, grid)
            chip = heat_mass * property_at(capacity, p.temperature)
            store = tool_heat.capacity * grid.cell**2
            both = chip * store / (chip + store)
            flow = tool_heat.conductance * tool_heat.area * p.contact_time
            heat = both * (1.0 - np.exp(-flow / both)) * (p.temperature - inside)
            p.temperature -= heat / chip
            p.contact_time = 0.0
            _warm(p.x, p.y, heat, temperature, fraction, tool, tool_heat, grid)


@njit
def _partner(x, y, tool, grid):  # type: ignore[no-untyped-def]
    """Nodes and weights of the place half a cell under the tool's surface next to a point."""
    distance, nx, ny = surface_distance(x, y, tool)
    down = distance + 0.5 * grid.cell
    fx = (x - nx * down - grid.left) / grid.cell
    fy = (y - ny * down - grid.bottom) / grid.cell
    i, j = int(fx), int(fy)
    return i, j, fx - i, fy - j


@njit
def _tool_temperature(x, y, temperature, fraction, tool, grid):  # type: ignore[no-untyped-def]
    i, j, ax, ay = _partner(x, y, tool, grid)
    total = weight = 0.0
    for a in range(2):
        for b in range(2):
            w = (ax if a else 1.0 - ax) * (ay if b else 1.0 - ay) * fraction[i + a, j + b]
            total += w * temperature[i + a, j + b]
            weight += w
    return total / weight


@njit
def _warm(x, y, heat, temperature, fraction, tool, tool_heat, grid):  # type: ignore[no-untyped-def]
    i, j, ax, ay = _partner(x, y, tool, grid)
    weight = 0.0
    for a in range(2):
        for b in range(2):
            weight += (ax if a else 1.0 - ax) * (ay if b else 1.0 - ay) * fraction[i + a, j + b]
    for a in range(2):
        for b in range(2):
            w = (ax if a else 1.0 - ax) * (ay if b else 1.0 - ay) * fraction[i + a, j + b]
            if w > 0.0:
                store = (
                    tool_heat.capacity
                    * grid.cell**2
                    * max(fraction[i + a, j + b], SMALLEST_FRACTION)
                )
                temperature[i + a, j + b] += heat * w / weight / store


@njit(cache=True)
def return_heat(points, count, increment, grid):  # type: ignore[no-untyped-def]
    """Give the rise of temperature on the grid to the points: increments, so nothing diffuses."""
    for k in range(count):
        p = points[k]
        i, j, wx, wy = _nodes_around(p, grid)
        rise = 0.0
        for a in range(3):
            for b in range(3):
                rise += wx[a] * wy[b] * increment[i + a, j + b]
        p.temperature += rise
