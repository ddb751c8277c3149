"""One time step of the material points: grid to points, stress, contact, points to grid.

Moving-least-squares transfer with an affine velocity (APIC) and quadratic B-splines: Jiang et al.
(2015), Hu et al. (2018). Points are sorted by cell and the grid is cut into blocks of columns; two
neighbouring blocks are never worked on at once, so that sums on the grid are made in the same order
whatever the number of threads.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from chipglow.cutting.flow_stress import flow_stress, plastic_increment, strain_to_failure
from chipglow.scene.tool import wedge_distance

BLOCK_COLUMNS = 6
"""Points of a block reach two columns beyond it, three if they drift by a cell before the next
sorting: blocks two apart must not share a node."""

MASS, MOMENTUM_X, MOMENTUM_Y, FRICTION_LIMIT = 0, 1, 2, 3
"""What the points gather on a node: in kg/m, kg/s twice, and friction impulse in N s/m."""

FORCE_X, FORCE_Y, BOUNDARY_WORK, CONTACT_WORK, PLASTIC_WORK, FRICTION_WORK = range(6)
"""What a step adds up: forces on the chip (N/m), and work per width of cut (J/m)."""

_RATE_OF_SLIDING = 1e4


class Step(NamedTuple):
    """Numbers of a step.

    Point mass (kg/m, scaled), heat mass (kg/m, true), volume free of stress (m²), time step (s),
    elastic constants (Pa), share of plastic work that is heat; contact: stiffness (Pa), damping
    (N s/m²), distance at which a point touches (m), area of a point (m²/m), friction; boundary:
    nodes under `floor`, and those left of `inflow` and under `ceiling` (m), move at `speed` (m/s).
    """

    mass: float
    heat_mass: float
    volume: float
    time_step: float
    shear_modulus: float
    bulk_modulus: float
    heat_share: float
    stiffness: float
    damping: float
    reach: float
    area: float
    friction: float
    shear_fraction: float
    floor: float
    inflow: float
    ceiling: float
    speed: float


@njit
def spline(position):  # type: ignore[no-untyped-def]
    """First of three nodes and the offset from it to a position in cells: quadratic B-spline."""
    first = int(position - 0.5)
    return first, position - first


@njit
def spline_weights(offset):  # type: ignore[no-untyped-def]
    """Weights of the three nodes."""
    return 0.5 * (1.5 - offset) ** 2, 0.75 - (offset - 1.0) ** 2, 0.5 * (offset - 0.5) ** 2


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _gather(p, velocity, grid, time_step):  # type: ignore[no-untyped-def]
    """Velocity and its gradient from the grid; the point moves. True if it is on the grid."""
    inverse = 1.0 / grid.cell
    i, ax = spline((p.x - grid.left) * inverse)
    j, ay = spline((p.y - grid.bottom) * inverse)
    if not (0 <= i < grid.columns - 2 and 0 <= j < grid.rows - 2):
        return False
    wx, wy = spline_weights(ax), spline_weights(ay)
    vx = vy = cxx = cxy = cyx = cyy = 0.0
    for a in range(3):
        sx = sy = tx = ty = 0.0
        for b in range(3):
            ux, uy = velocity[i + a, j + b, 0], velocity[i + a, j + b, 1]
            w = wy[b]
            sx += w * ux
            sy += w * uy
            tx += w * (b - ay) * ux
            ty += w * (b - ay) * uy
        w = wx[a]
        vx += w * sx
        vy += w * sy
        cxx += w * (a - ax) * sx
        cyx += w * (a - ax) * sy
        cxy += w * tx
        cyy += w * ty
    scale = 4.0 * inverse
    p.vx, p.vy = vx, vy
    p.cxx, p.cxy, p.cyx, p.cyy = scale * cxx, scale * cxy, scale * cyx, scale * cyy
    p.x += time_step * vx
    p.y += time_step * vy
    return True


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def update_stress(p, step, flow, capacity):  # type: ignore[no-untyped-def]
    """Hypo-elastic deviator (Jaumann rate), radial return, plastic work to heat.

    Returns the equivalent stress and the plastic work (J/m).
    """
    dt = step.time_step
    two_g = 2.0 * step.shear_modulus * dt
    spin = (p.cxy - p.cyx) * dt
    third = (p.cxx + p.cyy) / 3.0
    shear = p.dxy + 0.5 * spin * (p.dyy - p.dxx) + 0.5 * two_g * (p.cxy + p.cyx)
    dxx = p.dxx + spin * p.dxy + two_g * (p.cxx - third)
    dyy = p.dyy - spin * p.dxy + two_g * (p.cyy - third)
    trial = np.sqrt(3.0 * (dxx * dxx + dyy * dyy + dxx * dyy + shear * shear))
    increment = plastic_increment(
        trial, p.strain, p.temperature, p.damage, p.increment, step.shear_modulus, dt, flow
    )
    p.increment = increment
    stress, work = trial, 0.0
    if increment > 0.0:
        stress = trial - 3.0 * step.shear_modulus * increment
        scale = stress / trial
        dxx *= scale
        dyy *= scale
        shear *= scale
        p.strain += increment
        if flow.loss > 0.0:
            mean_stress = step.bulk_modulus * (p.volume / step.volume - 1.0)
            p.damage += increment / strain_to_failure(
                mean_stress / stress, increment / dt, p.temperature, flow
            )
        work = stress * increment * p.volume
        heat = step.heat_share * work
        p.temperature += heat / (step.heat_mass * _at(capacity, p.temperature))
    p.dxx, p.dyy, p.dxy = dxx, dyy, shear
    return stress, work


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _scatter(p, fx, fy, limit, nodes, grid, step):  # type: ignore[no-untyped-def]
    """Mass, momentum, stress and contact impulse to the grid. True if the point is on it."""
    inverse = 1.0 / grid.cell
    i, ax = spline((p.x - grid.left) * inverse)
    j, ay = spline((p.y - grid.bottom) * inverse)
    if not (0 <= i < grid.columns - 2 and 0 <= j < grid.rows - 2):
        return False
    wx, wy = spline_weights(ax), spline_weights(ay)
    mass = step.mass
    force = 4.0 * inverse * step.time_step * p.volume
    spread = mass * grid.cell
    tension = step.bulk_modulus * (p.volume / step.volume - 1.0)
    qxx = spread * p.cxx - force * (p.dxx + tension)
    qyy = spread * p.cyy - force * (p.dyy + tension)
    qxy, qyx = spread * p.cxy - force * p.dxy, spread * p.cyx - force * p.dxy
    mx = mass * p.vx + step.time_step * fx
    my = mass * p.vy + step.time_step * fy
    for a in range(3):
        ux = mx + qxx * (a - ax)
        uy = my + qyx * (a - ax)
        for b in range(3):
            w = wx[a] * wy[b]
            node = nodes[i + a, j + b]
            node[MASS] += w * mass
            node[MOMENTUM_X] += w * (ux + qxy * (b - ay))
            node[MOMENTUM_Y] += w * (uy + qyy * (b - ay))
            if limit > 0.0:
                node[FRICTION_LIMIT] += w * limit
    return True


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _contact(p, stress, tool, step, flow):  # type: ignore[no-untyped-def]
    """Force of the tool's surface on a point (N/m) and the limit of its friction impulse."""
    distance, nx, ny = wedge_distance(p.x, p.y, tool)
    depth = step.reach - distance
    if depth <= 0.0:
        return 0.0, 0.0, 0.0
    push = step.stiffness * depth - step.damping * (p.vx * nx + p.vy * ny)
    p.contact_time += step.time_step
    if push <= 0.0:
        return 0.0, 0.0, 0.0
    strength = max(stress, flow_stress(p.strain, _RATE_OF_SLIDING, p.temperature, p.damage, flow))
    sticking = step.shear_fraction * strength / np.sqrt(3.0) * step.area
    limit = min(step.friction * push, sticking) * step.time_step
    return push * nx, push * ny, limit


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _work_block(points, starts, block, velocity, nodes, tool, grid, step, flow, capacity, sums):  # type: ignore[no-untyped-def]
    """One step of the points of a block; False if a point left the grid."""
    first = block * BLOCK_COLUMNS * grid.rows
    last = min(first + BLOCK_COLUMNS * grid.rows, starts.size - 1)
    on_grid = True
    for cell in range(first, last):
        begin, end = starts[cell], starts[cell + 1]
        if begin == end:
            continue
        volume = change = 0.0
        for k in range(begin, end):
            p = points[k]
            on_grid &= _gather(p, velocity, grid, step.time_step)
            volume += p.volume
            change += p.volume * (p.cxx + p.cyy)
        # One density for the points that share a cell: plastic flow, which keeps its volume, does
        # not lock, and pressure does not alternate from point to point.
        volume = (volume + step.time_step * change) / (end - begin)
        for k in range(begin, end):
            p = points[k]
            p.volume = volume
            stress, work = update_stress(p, step, flow, capacity)
            fx, fy, limit = _contact(p, stress, tool, step, flow)
            sums[block, PLASTIC_WORK] += work
            sums[block, FORCE_X] += fx
            sums[block, FORCE_Y] += fy
            sums[block, CONTACT_WORK] += step.time_step * (fx * p.vx + fy * p.vy)
            on_grid &= _scatter(p, fx, fy, limit, nodes, grid, step)
    return on_grid


@njit(error_model="numpy", fastmath={"contract", "arcp", "nsz"})
def _work_column(i, velocity, nodes, heat, tool, grid, step, sums):  # type: ignore[no-untyped-def]
    """New velocities of a column of nodes: driven boundary and friction; sums are reset."""
    x = grid.left + i * grid.cell
    for j in range(grid.rows):
        node = nodes[i, j]
        mass = node[MASS]
        if mass == 0.0:
            velocity[i, j, 0] = velocity[i, j, 1] = 0.0
            continue
        y = grid.bottom + j * grid.cell
        vx, vy = node[MOMENTUM_X] / mass, node[MOMENTUM_Y] / mass
        limit = node[FRICTION_LIMIT]
        node[MASS] = node[MOMENTUM_X] = node[MOMENTUM_Y] = node[FRICTION_LIMIT] = 0.0
        if y < step.floor or (x < step.inflow and y < step.ceiling):
            sums[i, BOUNDARY_WORK] += mass * (step.speed - vx) * step.speed
            vx, vy = step.speed, 0.0
        elif limit > 0.0:
            _, nx, ny = wedge_distance(x, y, tool)
            slip = vy * nx - vx * ny
            loss = min(limit / mass, abs(slip))
            change = -loss if slip > 0.0 else loss
            work = mass * loss * abs(slip + 0.5 * change)
            heat[i, j] += work
            vx -= change * ny
            vy += change * nx
            sums[i, FRICTION_WORK] += work
            sums[i, FORCE_X] -= mass * change * ny / step.time_step
            sums[i, FORCE_Y] += mass * change * nx / step.time_step
        velocity[i, j, 0], velocity[i, j, 1] = vx, vy


@njit(cache=True, parallel=True)
def advance(  # type: ignore[no-untyped-def]
    steps, points, starts, velocity, nodes, heat, tool, grid, step, flow, capacity, sums, threads
):
    """Advance all points by some steps, shared out among some threads.

    `velocity` (columns, rows, 2) is the grid's velocity after the last step and is kept for the
    next; `nodes` (columns, rows, 4) is zero before and after; `heat` (columns, rows) gathers
    friction work (J/m); `sums` (6,) gathers over the steps what `FORCE_X` and so on name. Returns
    False if a point left the grid.
    """
    blocks = (grid.columns + BLOCK_COLUMNS - 1) // BLOCK_COLUMNS
    of_blocks = np.zeros((blocks, sums.size))
    of_columns = np.zeros((grid.columns, sums.size))
    good = np.ones(blocks, np.bool_)
    for _ in range(steps):
        for colour in range(2):
            for thread in prange(threads):
                for block in range(colour + 2 * thread, blocks, 2 * threads):
                    good[block] &= _work_block(
                        points, starts, block, velocity, nodes, tool, grid, step, flow, capacity,
                        of_blocks,
                    )  # fmt: skip
        for thread in prange(threads):
            for i in range(thread, grid.columns, threads):
                _work_column(i, velocity, nodes, heat, tool, grid, step, of_columns)
        if not good.all():
            return False
    sums += of_blocks.sum(axis=0) + of_columns.sum(axis=0)
    return True


@njit
def _at(table, temperature):  # type: ignore[no-untyped-def]
    """Value of a sampled `TemperatureTable`."""
    return table[min(max(int(temperature - 200.0), 0), table.size - 1)]
