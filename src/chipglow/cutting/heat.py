"""Conduction in chip and tool, friction heat, the heat that crosses their contact, and losses."""

from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.constants import Stefan_Boltzmann

from chipglow.cutting.conditions import Numerics, Surroundings
from chipglow.cutting.momentum import spline, spline_weights
from chipglow.cutting.points import Grid
from chipglow.cutting.stress import property_at
from chipglow.quantities import Array
from chipglow.scene.tool_surface import ToolSurface, surface_distance, surface_distances


class ToolHeat(NamedTuple):
    """Heat of the tool and of its contact.

    Capacity (J/(m³ K)), conductivity (W/(m K)), fraction of friction heat that enters the tool,
    conductance of the contact (W/(m² K)), contact area of a point (m²/m).
    """

    capacity: float
    conductivity: float
    friction_fraction: float
    conductance: float
    area: float


def tool_fraction(grid: Grid, tool: ToolSurface) -> Array:
    """Return the fraction of each node's square that the tool fills, shape (columns, rows)."""
    x, y = np.meshgrid(*grid.axes, indexing="ij")
    distance = np.reshape(surface_distances(x.ravel(), y.ravel(), tool), x.shape)
    return np.asarray(np.clip(0.5 - distance / grid.cell, 0.0, 1.0), np.float64)


@njit(cache=True)
def conduct(  # type: ignore[no-untyped-def]
    points, count, nodes, increment, conductivity, capacity, heat_mass, grid, duration, part
):
    """Gather heat and temperature of the points on the grid and conduct for `duration` (s).

    `nodes` (columns, rows, 3) becomes heat capacity (J/(m K)), temperature (K) and filled fraction;
    `increment` (columns, rows) the rise of temperature (K), for `return_heat`. The flux is that at
    the points and acts on the nodes by the slopes of their weights (weak form), so none crosses a
    free surface wherever the surface lies between the nodes.

    Increments leave differences between the points of a cell as they are, so a point much colder
    than the others would be cooled with them. A `part` of the variation below the grid's resolution
    is taken away: that is all of the noise, but of a smooth field only a fourth derivative.
    """
    _gather_heat(points, count, nodes, capacity, heat_mass, grid)
    increment[:] = 0.0
    for k in range(count):
        _conduct_at(points[k], nodes, increment, conductivity, grid, duration, part)
    for i in range(grid.columns):
        for j in range(grid.rows):
            if nodes[i, j, 0] > 0.0:
                increment[i, j] /= nodes[i, j, 0]


@njit
def nodes_around(p, grid):  # type: ignore[no-untyped-def]
    """Return the first node around a point, the offset from it in cells, and the weights."""
    i, ax = spline((p.x - grid.left) / grid.cell)
    j, ay = spline((p.y - grid.bottom) / grid.cell)
    return i, j, ax, ay, spline_weights(ax), spline_weights(ay)


@njit
def _slopes(offset):  # type: ignore[no-untyped-def]
    """Return the slopes of the weights of the three nodes, per cell."""
    # derivatives of `spline_weights`
    return offset - 1.5, 2.0 * (1.0 - offset), offset - 0.5


@njit
def _gather_heat(points, count, nodes, capacity, heat_mass, grid):  # type: ignore[no-untyped-def]
    """Heat capacity, temperature and filled fraction of the nodes.

    A point brings the temperature that its slopes make at the node (affine transfer, Jiang et al.
    2015): a linear field is exact up to a free surface, where the points lie on one side only.
    """
    nodes[:] = 0.0
    for k in range(count):
        p = points[k]
        i, j, ax, ay, wx, wy = nodes_around(p, grid)
        heat = heat_mass * property_at(capacity, p.temperature)
        filled = p.volume / (grid.cell * grid.cell)
        for a in range(3):
            for b in range(3):
                w = wx[a] * wy[b]
                there = p.temperature + p.rise_x * (a - ax) + p.rise_y * (b - ay)
                nodes[i + a, j + b, 0] += w * heat
                nodes[i + a, j + b, 1] += w * heat * there
                nodes[i + a, j + b, 2] += w * filled
    for i in range(grid.columns):
        for j in range(grid.rows):
            if nodes[i, j, 0] > 0.0:
                nodes[i, j, 1] /= nodes[i, j, 0]


@njit
def _conduct_at(p, nodes, increment, conductivity, grid, duration, part):  # type: ignore[no-untyped-def]
    """Set the slopes of a point's temperature, damp its noise, and give its flux to its nodes."""
    i, j, ax, ay, wx, wy = nodes_around(p, grid)
    sx, sy = _slopes(ax), _slopes(ay)
    seen = rise_x = rise_y = slope_x = slope_y = 0.0
    for a in range(3):
        for b in range(3):
            temperature = nodes[i + a, j + b, 1]
            weighted = wx[a] * wy[b] * temperature
            seen += weighted
            rise_x += (a - ax) * weighted
            rise_y += (b - ay) * weighted
            slope_x += sx[a] * wy[b] * temperature
            slope_y += wx[a] * sy[b] * temperature
    # Squares of the nodes' distances are a quarter of a cell's on average, wherever the point is.
    p.rise_x, p.rise_y = 4.0 * rise_x, 4.0 * rise_y
    p.temperature += part * (seen - p.temperature)
    flow = property_at(conductivity, seen) * p.volume / (grid.cell * grid.cell) * duration
    for a in range(3):
        for b in range(3):
            increment[i + a, j + b] -= flow * (sx[a] * wy[b] * slope_x + wx[a] * sy[b] * slope_y)


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
                common = min(fraction[i, j], fraction[k, m])
                heat = rate * common * (temperature[k, m] - temperature[i, j])
                flow[i, j] += heat
                flow[k, m] -= heat
    for i in range(grid.columns):
        for j in range(grid.rows):
            if fraction[i, j] > 0.0:
                temperature[i, j] += flow[i, j] / max(fraction[i, j], SMALLEST_FRACTION)


SMALLEST_FRACTION = 0.25
"""Nodes that the tool fills less than this store heat as if it filled so much: a thin sliver would
need a needlessly short time step."""


CELLS: Final = 24
"""Cells of the tool beyond each border node; see `GROWTH`."""

GROWTH: Final = 1.25
"""Ratio of the lengths of successive cells.

Beyond the computed region the tool continues in a row of cells for each border node: 840 cells of
the grid out, 8.4 mm for cells of 10 µm. They conduct along the row only: heat that reaches a border
far from the contact goes outward.
"""


def border_nodes(fraction: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the nodes at which the tool continues beyond the grid, (n, 2); a corner is twice.

    `fraction` is the fraction of each node's square filled by the tool, shape (columns, rows).
    """
    columns, rows = fraction.shape
    i, j = np.arange(columns), np.arange(rows)
    sides = [(i, 0 * i), (i, 0 * i + rows - 1), (0 * j, j), (0 * j + columns - 1, j)]
    nodes: NDArray[np.int64] = np.concatenate([np.stack(side, axis=1) for side in sides])
    here: NDArray[np.bool_] = fraction[nodes[:, 0], nodes[:, 1]] > 0.0
    return nodes[here]


@njit(cache=True)
def conduct_beyond(temperature, far, border, fraction, tool_heat, grid, duration):  # type: ignore[no-untyped-def]
    """Conduct heat across the tool's border and beyond it for `duration` (s).

    `temperature` (columns, rows) and `far` (n, `CELLS`), both in K, change.
    """
    rate = tool_heat.conductivity * duration / (tool_heat.capacity * grid.cell**2)
    for k in range(border.shape[0]):
        i, j = border[k, 0], border[k, 1]
        filled = fraction[i, j]
        # Heat over capacity times a node's square; lengths and distances in cells of the grid.
        flow = rate * (temperature[i, j] - far[k, 0])
        temperature[i, j] -= filled * flow / max(filled, SMALLEST_FRACTION)
        length = 1.0
        for m in range(CELLS):
            out = 0.0
            if m + 1 < CELLS:
                out = rate * (far[k, m] - far[k, m + 1]) / (0.5 * length * (1.0 + GROWTH))
            far[k, m] += (flow - out) / length
            flow, length = out, length * GROWTH


@njit(cache=True)
def heat_contact(  # type: ignore[no-untyped-def]
    points, count, friction, entered, increment, nodes, temperature, fraction, tool, tool_heat,
    capacity, heat_mass, grid,
):  # fmt: skip
    """Share the friction work and exchange heat through the contact.

    Friction work (J/m, on the chip's nodes) goes to the points that touched the tool, and from each
    to chip and tool by their effusivities; each then exchanges heat with the tool next to it. Heat
    that finds no point is kept for the next time. `entered` (columns, rows, 2) gathers heat that
    entered the tool (J/m), and contact area times time (m s).
    """
    touched = np.zeros_like(friction)
    for k in range(count):
        if points[k].contact_time > 0.0:
            _touch(points[k], touched, grid)
    for k in range(count):
        p = points[k]
        if p.contact_time > 0.0:
            work = _friction_work(p, friction, touched, grid)
            _heat_contact_of(
                p, work, entered, increment, nodes, temperature, fraction, tool, tool_heat,
                capacity, heat_mass, grid,
            )  # fmt: skip
            p.contact_time = 0.0
    for i in range(grid.columns):
        for j in range(grid.rows):
            if touched[i, j] > 0.0:
                friction[i, j] = 0.0


@njit
def _touch(p, touched, grid):  # type: ignore[no-untyped-def]
    """Add a point's time in contact, weighted, to its nodes."""
    i, j, _, _, wx, wy = nodes_around(p, grid)
    for a in range(3):
        for b in range(3):
            touched[i + a, j + b] += wx[a] * wy[b] * p.contact_time


@njit
def _friction_work(p, friction, touched, grid):  # type: ignore[no-untyped-def]
    """Return a point's part of its nodes' friction work in J/m, by weight and time in contact."""
    i, j, _, _, wx, wy = nodes_around(p, grid)
    work = 0.0
    for a in range(3):
        for b in range(3):
            if friction[i + a, j + b] > 0.0:
                part = wx[a] * wy[b] * p.contact_time / touched[i + a, j + b]
                work += part * friction[i + a, j + b]
    return work


@njit
def _heat_contact_of(  # type: ignore[no-untyped-def]
    p, work, entered, increment, nodes, temperature, fraction, tool, tool_heat, capacity, heat_mass,
    grid,
):  # fmt: skip
    """Heat of a point's friction work to chip and tool, and what they exchange there.

    Both surfaces are warmer than the next place at which their temperature is known, by what
    flows through the layer between: the chip's by the slopes of its temperature, the tool's by the
    heat that enters it.
    """
    distance, nx, ny = surface_distance(p.x, p.y, tool)
    dx, dy = -distance * nx / grid.cell, -distance * ny / grid.cell
    # The tool's next place is half a cell under its surface.
    down = distance + 0.5 * grid.cell
    fx = (p.x - nx * down - grid.left) / grid.cell
    fy = (p.y - ny * down - grid.bottom) / grid.cell
    i, j = int(fx), int(fy)
    ax, ay = fx - i, fy - j
    total = weight = 0.0
    for a in range(2):
        for b in range(2):
            w = _part_of_tool(fraction, i, j, ax, ay, a, b)
            total += w * temperature[i + a, j + b]
            weight += w
    into_tool = tool_heat.friction_fraction * work
    surface = p.temperature + p.rise_x * dx + p.rise_y * dy
    contact = tool_heat.area * p.contact_time
    layer = 0.5 * grid.cell / tool_heat.conductivity
    inside = total / weight + layer * into_tool / contact
    chip = heat_mass * property_at(capacity, p.temperature)
    store = tool_heat.capacity * grid.cell**2
    both = chip * store / (chip + store)
    flow = contact * tool_heat.conductance / (1.0 + layer * tool_heat.conductance)
    heat = both * (1.0 - np.exp(-flow / both)) * (surface - inside)
    heat_surface(p, dx, dy, work - into_tool - heat, increment, nodes, grid)
    into_tool += heat
    for a in range(2):
        for b in range(2):
            w = _part_of_tool(fraction, i, j, ax, ay, a, b)
            if w > 0.0:
                filled = max(fraction[i + a, j + b], SMALLEST_FRACTION)
                temperature[i + a, j + b] += into_tool * w / weight / (store * filled)
                entered[i + a, j + b, 0] += into_tool * w / weight
                entered[i + a, j + b, 1] += contact * w / weight


@njit
def heat_surface(p, dx, dy, heat, increment, nodes, grid):  # type: ignore[no-untyped-def]
    """Heat (J/m) to a point's nodes as if it entered at dx, dy (cells) from the point.

    Weights that are extrapolated to the surface keep the heat's first moment, and reach no node
    that the material does not fill.
    """
    i, j, ax, ay, wx, wy = nodes_around(p, grid)
    sx, sy = _slopes(ax), _slopes(ay)
    for a in range(3):
        for b in range(3):
            if nodes[i + a, j + b, 0] > 0.0:
                weight = wx[a] * wy[b] + dx * sx[a] * wy[b] + dy * wx[a] * sy[b]
                increment[i + a, j + b] += weight * heat / nodes[i + a, j + b, 0]


@njit
def _part_of_tool(fraction, i, j, ax, ay, a, b):  # type: ignore[no-untyped-def]
    """Return the linear weight of node (i + a, j + b), times its fraction that is tool."""
    return (ax if a else 1.0 - ax) * (ay if b else 1.0 - ay) * fraction[i + a, j + b]


@njit(cache=True)
def return_heat(points, count, increment, grid):  # type: ignore[no-untyped-def]
    """Give the rise of temperature on the grid to the points: increments, so nothing diffuses."""
    for k in range(count):
        p = points[k]
        i, j, _, _, wx, wy = nodes_around(p, grid)
        rise = 0.0
        for a in range(3):
            for b in range(3):
                rise += wx[a] * wy[b] * increment[i + a, j + b]
        p.temperature += rise


_SIGMA = float(Stefan_Boltzmann)
_OUTSIDE, _INSIDE = 0.1, 0.7
"""Filled fractions between which the surface lies: that of a surface runs over three cells, that
of the inside is uneven. So the two sides of a contact together are inside."""


class HeatLoss(NamedTuple):
    """Losses of a free surface within left, right, bottom and top (m): see `Surroundings`."""

    convection: float
    emissivity: float
    ambient: float
    left: float
    right: float
    bottom: float
    top: float

    @classmethod
    def of(cls, surroundings: Surroundings, numerics: Numerics) -> "HeatLoss":
        """Return losses in the computed region, whose own border is not a free surface."""
        edge = 2 * numerics.cell
        surface = surroundings.convection, surroundings.emissivity, surroundings.temperature
        left, right = -numerics.upstream, numerics.downstream - edge
        bottom, top = -numerics.depth, numerics.height - edge
        return cls(*surface, left, right, bottom, top)


@njit
def heat_flux(temperature, loss):  # type: ignore[no-untyped-def]
    """Return the heat in W/m² that a surface loses at a temperature in K."""
    radiated = _SIGMA * (temperature**4 - loss.ambient**4)
    return loss.convection * (temperature - loss.ambient) + loss.emissivity * radiated


@njit(cache=True)
def free_surface(nodes, fraction, grid, i, j):  # type: ignore[no-untyped-def]
    """Return the free surface of chip and tool per width (m) at the four nodes from (i, j) on.

    The gradient of the filled fraction, integrated over an area, is the length of the boundary in
    it (coarea formula).
    """
    a, b = _filled(nodes, fraction, i, j), _filled(nodes, fraction, i + 1, j)
    c, d = _filled(nodes, fraction, i, j + 1), _filled(nodes, fraction, i + 1, j + 1)
    x, y = 0.5 * (b + d - a - c), 0.5 * (c + d - a - b)
    return np.sqrt(x * x + y * y) * grid.cell


@njit
def _filled(nodes, fraction, i, j):  # type: ignore[no-untyped-def]
    inside = (nodes[i, j, 2] + fraction[i, j] - _OUTSIDE) / (_INSIDE - _OUTSIDE)
    return min(max(inside, 0.0), 1.0)


@njit(cache=True)
def lose_heat(nodes, increment, temperature, fraction, tool_heat, loss, grid, duration):  # type: ignore[no-untyped-def]
    """Take the heat that the free surface loses in `duration` (s); return it in J/m.

    `nodes` is as in `conduct`. `increment` of the chip and `temperature` of the tool, in K and of
    shape (columns, rows), change.
    """
    lost = 0.0
    first = max(int(np.ceil((loss.left - grid.left) / grid.cell)), 0)
    last = min(int((loss.right - grid.left) / grid.cell), grid.columns - 1)
    low = max(int(np.ceil((loss.bottom - grid.bottom) / grid.cell)), 0)
    high = min(int((loss.top - grid.bottom) / grid.cell), grid.rows - 1)
    for i in range(first, last):
        for j in range(low, high):
            surface = free_surface(nodes, fraction, grid, i, j)
            if surface > 0.0:
                lost += _lose(
                    nodes, increment, temperature, fraction, tool_heat, loss, grid, i, j,
                    surface * duration,
                )  # fmt: skip
    return lost


@njit
def _lose(  # type: ignore[no-untyped-def]
    nodes, increment, temperature, fraction, tool_heat, loss, grid, i, j, surface_time
):
    """Share a piece of surface, times its time, among what is at its four nodes."""
    total = 0.0
    for k in range(i, i + 2):
        for m in range(j, j + 2):
            total += nodes[k, m, 2] + fraction[k, m]
    lost = 0.0
    for k in range(i, i + 2):
        for m in range(j, j + 2):
            if nodes[k, m, 0] > 0.0:
                heat = heat_flux(nodes[k, m, 1], loss) * surface_time * nodes[k, m, 2] / total
                increment[k, m] -= heat / nodes[k, m, 0]
                lost += heat
            if fraction[k, m] > 0.0:
                heat = heat_flux(temperature[k, m], loss) * surface_time * fraction[k, m] / total
                store = tool_heat.capacity * grid.cell**2 * max(fraction[k, m], SMALLEST_FRACTION)
                temperature[k, m] -= heat / store
                lost += heat
    return lost
