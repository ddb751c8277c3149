"""One time step of the material points: grid to points, stress, contact, points to grid.

Moving-least-squares transfer with an affine velocity and quadratic B-splines: Jiang et al. (2015),
Hu et al. (2018). Points take the change of the grid's velocity rather than the velocity itself
(AFLIP: Fei et al. 2021), so the transfer dissipates next to nothing. Points are sorted by cell and
the grid is cut into blocks of columns; two neighbouring blocks are never worked on at once, so that
sums on the grid are made in the same order whatever the number of threads.
"""

from math import inf
from typing import Any, Final, NamedTuple

import numpy as np
from numba import njit, prange

from chipglow.cutting.flow_stress import comes_with_chipglow, flow_stress
from chipglow.cutting.lanes import FAST, INLINE
from chipglow.cutting.stencil import ADDED, SUMMED, add_to_nodes, sum_nodes
from chipglow.cutting.stress import (
    BUFFER,
    BULK,
    EXPANSION,
    FALL,
    LANES,
    SOFT,
    STRESS,
    TENSION,
    WORK,
    kelvin_index,
    update_stresses,
)
from chipglow.scene.kernels import INNER
from chipglow.scene.tool_surface import surface_bound, surface_distance

BLOCK_COLUMNS = 6
"""Points of a block reach two columns beyond it, three if they drift by a cell before the next
sorting: blocks two apart must not share a node."""

BATCH_CELLS = 16
"""Cells whose points are gathered before their stress is computed."""

NODE_VALUES = ADDED
MASS, MOMENTUM_X, MOMENTUM_Y, IMPULSE_X, IMPULSE_Y, FRICTION_LIMIT = range(6)
"""Sums of the points on a node: in kg/m; momentum and impulse of stress and contact in kg/s
twice; limit of the friction impulse in N s/m. The last two values stay zero."""

VELOCITY_VALUES = SUMMED
VELOCITY_X, VELOCITY_Y, CHANGE_X, CHANGE_Y = range(VELOCITY_VALUES)
"""A node's velocity after a step and its change in the step, in m/s."""

# Their number and their names.
SUMS = 9
(
    FORCE_X, FORCE_Y, BOUNDARY_WORK, CONTACT_WORK, PLASTIC_WORK, FRICTION_WORK, SHARING_LOSS,
    EXPANSION_WORK, MODULI_LOSS,
) = range(SUMS)  # fmt: skip
"""Sums of a step: forces on the chip (N/m), and work per width of cut (J/m), from the plastic work
on as in `EnergyHistory`; the last three are the elastic energy that goes when the points of a cell
share one dilation, that which comes when their volume without stress changes with the temperature,
and that which goes when the moduli fall with it."""

_SLIDING_RATE = 1e4
"""Plastic strain rate in 1/s at which the flow stress limits the friction of undamaged material."""


class Step(NamedTuple):
    """Constants of a step.

    Point mass (kg/m, scaled), heat mass (kg/m, true), volume without stress at room temperature
    (m²), time step (s), moduli at room temperature (Pa); contact: stiffness (Pa), damping (N s/m²),
    distance at which a point touches (m), area of a point (m²/m), friction; boundary: nodes under
    `floor`, and those left of `inflow` and under `ceiling` (m), move at `speed` (m/s). Friction
    falls with the temperature over `friction_melting` (K): see `friction_coefficient`. `viscosity`:
    see `NonlocalViscosity` (Pa s).
    """

    mass: float
    heat_mass: float
    volume: float
    time_step: float
    shear_modulus: float
    bulk_modulus: float
    stiffness: float
    damping: float
    reach: float
    area: float
    friction: float
    friction_factor: float
    floor: float
    inflow: float
    ceiling: float
    speed: float
    friction_exponent: float = 1.0
    friction_melting: float = inf
    viscosity: float = 0.0


@njit(**INLINE, **INNER)
def spline(position):  # type: ignore[no-untyped-def]
    """Return the first of three nodes of a quadratic B-spline and the offset from it in cells."""
    first = int(position - 0.5)
    return first, position - first


@njit(**INLINE, **INNER)
def spline_weights(offset):  # type: ignore[no-untyped-def]
    """Return the weights of the three nodes."""
    # 3/4 − x² for |x| < 1/2 and (3/2 − |x|)²/2 beyond
    return 0.5 * (1.5 - offset) ** 2, 0.75 - (offset - 1.0) ** 2, 0.5 * (offset - 0.5) ** 2


@njit(**INLINE, **INNER)
def _distances(offset):  # type: ignore[no-untyped-def]
    """Return the distances of the three nodes from the position, in cells."""
    return -offset, 1.0 - offset, 2.0 - offset


@njit(**INLINE, **INNER)
def _gather(p, velocity, grid, step):  # type: ignore[no-untyped-def]
    """Take velocity and its gradient from the grid; move the point. True if it is on the grid."""
    inverse = 1.0 / grid.cell
    i, ax = spline((p.x - grid.left) * inverse)
    j, ay = spline((p.y - grid.bottom) * inverse)
    if not (0 <= i < grid.columns - 2 and 0 <= j < grid.rows - 2):
        return False
    wx, wy = spline_weights(ax), spline_weights(ay)
    (vx, vy, dx, dy), (cxx, cyx, _, _), (cxy, cyy, _, _) = sum_nodes(
        velocity, i, j, wx, wy, _distances(ax), _distances(ay)
    )
    # The weights of quadratic splines have a second moment of a quarter of a squared cell.
    scale = 4.0 * inverse
    p.vx, p.vy = vx, vy
    # In this order of the sums cuts stay the same to the last bit from version to version.
    p.own_vx = vx + (p.own_vx + dx - vx)
    p.own_vy = vy + (p.own_vy + dy - vy)
    p.cxx, p.cxy, p.cyx, p.cyy = scale * cxx, scale * cxy, scale * cyx, scale * cyy
    p.x += step.time_step * vx
    p.y += step.time_step * vy
    return True


@njit(**INLINE, **INNER)
def _scatter(p, soft, tension, fx, fy, limit, nodes, grid, step):  # type: ignore[no-untyped-def]
    """Give mass, momentum, stress and contact impulse to the grid. True if it is on it."""
    inverse = 1.0 / grid.cell
    i, ax = spline((p.x - grid.left) * inverse)
    j, ay = spline((p.y - grid.bottom) * inverse)
    if not (0 <= i < grid.columns - 2 and 0 <= j < grid.rows - 2):
        return False
    wx, wy = spline_weights(ax), spline_weights(ay)
    mass = step.mass
    # The second moment again.
    force = 4.0 * inverse * step.time_step * p.volume
    spread = mass * grid.cell
    qxx, qxy, qyx, qyy = spread * p.cxx, spread * p.cxy, spread * p.cyx, spread * p.cyy
    txx, tyy = force * (soft * p.dxx + tension), force * (soft * p.dyy + tension)
    txy = force * soft * p.dxy
    mx, my = mass * p.own_vx, mass * p.own_vy
    level = (mass, mx, my, step.time_step * fx, step.time_step * fy, limit)
    by_x, by_y = (0.0, qxx, qyx, -txx, -txy), (0.0, qxy, qyy, -txy, -tyy)
    add_to_nodes(nodes, i, j, wx, wy, _distances(ax), _distances(ay), level, by_x, by_y)
    return True


@njit
def friction_coefficient(coefficient, exponent, melting_temperature, temperature):  # type: ignore[no-untyped-def]
    """Return Coulomb's coefficient at a temperature: see `Friction`.

    With an infinite melting temperature it is `coefficient`, to the last bit.
    """
    return coefficient * max(1.0 - (temperature / melting_temperature) ** exponent, 0.0)


@njit(**FAST, **INNER)
def _contact(p, stress, tool, step, law):  # type: ignore[no-untyped-def]
    """Return the force of the tool on a point (N/m) and the limit of its friction impulse."""
    distance, nx, ny = surface_distance(p.x, p.y, tool)
    depth = step.reach - distance
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    push = step.stiffness * depth - step.damping * (p.vx * nx + p.vy * ny)
    p.contact_time += step.time_step
    if push <= 0.0:
        return 0.0, 0.0, 0.0
    strength = flow_stress(p.strain, _SLIDING_RATE, p.temperature, law)
    strength = max(stress, strength)
    sticking = step.friction_factor * strength / np.sqrt(3.0) * step.area
    coefficient = friction_coefficient(
        step.friction, step.friction_exponent, step.friction_melting, p.temperature
    )
    limit = min(coefficient * push, sticking) * step.time_step
    return push * nx, push * ny, limit


@njit(**FAST, **INNER)
def _gather_cells(points, starts, first, last, velocity, grid, step, elastic, sums):  # type: ignore[no-untyped-def]
    """Move the points of some cells; False if one left the grid."""
    on_grid = True
    lost = 0.0
    for cell in range(first, last):
        begin, end = starts[cell], starts[cell + 1]
        if begin == end:
            continue
        total = free = squares = 0.0
        for k in range(begin, end):
            p = points[k]
            on_grid &= _gather(p, velocity, grid, step)
            volume = p.volume * (1.0 + step.time_step * (p.cxx + p.cyy))
            total += volume
            free += p.free_volume
            squares += volume * volume / p.free_volume
        # One dilation for the points that share a cell: plastic flow, which keeps its volume, does
        # not lock, and pressure does not alternate from point to point.
        dilated = total / free
        bulk = elastic[kelvin_index(points[begin].temperature, elastic.shape[0]), BULK]
        lost += bulk * (squares - dilated * total)
        for k in range(begin, end):
            points[k].volume = dilated * points[k].free_volume
    sums[SHARING_LOSS] += 0.5 * step.bulk_modulus * lost
    return on_grid


@njit(**FAST, **INNER)
def _work_block(  # type: ignore[no-untyped-def]
    points, starts, block, velocity, nodes, tool, grid, step, law, damage, elastic, capacity,
    heat_fractions, sums, buffer,
):  # fmt: skip
    """Do one step of the points of a block; False if a point left the grid."""
    first = block * BLOCK_COLUMNS * grid.rows
    last = min(first + BLOCK_COLUMNS * grid.rows, starts.size - 1)
    on_grid = True
    for cell in range(first, last, BATCH_CELLS):
        end_cell = min(cell + BATCH_CELLS, last)
        on_grid &= _gather_cells(
            points, starts, cell, end_cell, velocity, grid, step, elastic, sums[block]
        )
        for begin in range(starts[cell], starts[end_cell], LANES):
            end = min(begin + LANES, starts[end_cell])
            update_stresses(
                points, begin, end, step, law, damage, elastic, capacity, heat_fractions, buffer
            )
            for k in range(begin, end):
                p = points[k]
                sums[block, PLASTIC_WORK] += buffer[WORK + k - begin]
                sums[block, EXPANSION_WORK] += buffer[EXPANSION + k - begin]
                sums[block, MODULI_LOSS] += buffer[FALL + k - begin]
                fx = fy = limit = 0.0
                if surface_bound(p.x, p.y, tool) < step.reach:
                    fx, fy, limit = _contact(p, buffer[STRESS + k - begin], tool, step, law)
                    sums[block, FORCE_X] += fx
                    sums[block, FORCE_Y] += fy
                    sums[block, CONTACT_WORK] += step.time_step * (fx * p.vx + fy * p.vy)
                soft, tension = buffer[SOFT + k - begin], buffer[TENSION + k - begin]
                on_grid &= _scatter(p, soft, tension, fx, fy, limit, nodes, grid, step)
    return on_grid


@njit(**FAST, **INNER)
def _work_column(i, velocity, nodes, heat, tool, grid, step, sums):  # type: ignore[no-untyped-def]
    """Set new velocities of a column of nodes: driven boundary and friction; reset its sums."""
    x = grid.left + i * grid.cell
    for j in range(grid.rows):
        node = nodes[i, j]
        mass = node[MASS]
        if mass == 0.0:
            velocity[i, j, :] = 0.0
            continue
        y = grid.bottom + j * grid.cell
        ux, uy = node[MOMENTUM_X] / mass, node[MOMENTUM_Y] / mass
        vx, vy = ux + node[IMPULSE_X] / mass, uy + node[IMPULSE_Y] / mass
        limit = node[FRICTION_LIMIT]
        node[:] = 0.0
        if y < step.floor or (x < step.inflow and y < step.ceiling):
            sums[i, BOUNDARY_WORK] += mass * (step.speed - vx) * step.speed
            vx, vy = step.speed, 0.0
        elif limit > 0.0:
            _, nx, ny = surface_distance(x, y, tool)
            slip = vy * nx - vx * ny
            loss = min(limit / mass, abs(slip))
            change = -loss if slip > 0.0 else loss
            work = mass * loss * abs(slip + change)
            heat[i, j] += work
            vx -= change * ny
            vy += change * nx
            sums[i, FRICTION_WORK] += work
            sums[i, FORCE_X] -= mass * change * ny / step.time_step
            sums[i, FORCE_Y] += mass * change * nx / step.time_step
        velocity[i, j, VELOCITY_X], velocity[i, j, VELOCITY_Y] = vx, vy
        velocity[i, j, CHANGE_X], velocity[i, j, CHANGE_Y] = vx - ux, vy - uy


_PARALLEL: Final[Any] = {
    "parallel": dict.fromkeys(
        ("comprehension", "reduction", "inplace_binop", "setitem", "numpy", "stencil", "fusion"),
        False,
    )
}
"""Only loops over `prange` are parallel: others are short, and take as long to compile."""


def _advance(  # type: ignore[no-untyped-def]
    steps, points, starts, velocity, nodes, heat, tool, grid, step, law, damage, elastic,
    capacity, heat_fractions, sums, threads,
):  # fmt: skip
    """Advance all points by some steps, shared out among some threads.

    `velocity` (columns, rows, 4) is the grid's velocity after the last step and its change in that
    step, kept for the next; `nodes` (columns, rows, 8) is zero before and after; `heat` (columns,
    rows) gathers friction work (J/m); `sums` gathers over the steps what `FORCE_X` and so on name.
    `elastic` is `WorkpieceMaterial.elastic_ratios`, `heat_fractions` that of `heat_fraction`.
    Returns False if a point left the grid.
    """
    blocks = (grid.columns + BLOCK_COLUMNS - 1) // BLOCK_COLUMNS
    of_blocks = np.zeros((blocks, sums.size))
    of_columns = np.zeros((grid.columns, sums.size))
    good = np.ones(blocks, np.bool_)
    buffers = np.empty((threads, BUFFER))
    for _ in range(steps):
        for colour in range(2):
            for thread in prange(threads):
                for block in range(colour + 2 * thread, blocks, 2 * threads):
                    good[block] &= _work_block(
                        points, starts, block, velocity, nodes, tool, grid, step, law, damage,
                        elastic, capacity, heat_fractions, of_blocks, buffers[thread],
                    )  # fmt: skip
        for thread in prange(threads):
            for i in range(thread, grid.columns, threads):
                _work_column(i, velocity, nodes, heat, tool, grid, step, of_columns)
        if not good.all():
            return False
    for i in range(sums.size):  # a sum along an axis takes seconds to compile
        sums[i] += of_blocks[:, i].sum() + of_columns[:, i].sum()
    return True


advance = njit(cache=True, **_PARALLEL)(_advance)


def advance_with(law: Any) -> Any:
    """Return `advance` for the numbers of a flow-stress law.

    Compiled code is kept on disk for the laws that come with chipglow only: for other laws
    a change of the law would go unnoticed.
    """
    return advance if comes_with_chipglow(type(law)) else _advance_afresh


_advance_afresh = njit(**_PARALLEL)(_advance)
