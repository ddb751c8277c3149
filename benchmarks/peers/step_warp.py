"""The solver's step of transfer and stress in NVIDIA Warp on the CPU, for `solver_speed.py`.

One thread a point, atomic sums on the grid, launches that are recorded once. Warp runs a kernel on
one CPU core only, so its atomic sums are plain ones. Material points keep the order they come in.
The mean density of a cell is taken over the points that are in it now. A point stores the velocity
that it carries, not that of the grid, which only contact asks for.
"""

from time import perf_counter
from types import SimpleNamespace

import numpy as np
import warp as wp

f64 = wp.float64
Sums = wp.types.vector(length=5, dtype=f64)
SLOWEST_RATE = wp.constant(f64(1.0))
ITERATIONS = wp.constant(8)
SMALL_CHANGE = wp.constant(f64(0.02))
SMALL_STRAIN = wp.constant(f64(0.01))
ZERO, HALF, ONE = wp.constant(f64(0.0)), wp.constant(f64(0.5)), wp.constant(f64(1.0))
TWO, THREE, FOUR = wp.constant(f64(2.0)), wp.constant(f64(3.0)), wp.constant(f64(4.0))
MOST_HEAT, TINY = wp.constant(f64(0.99)), wp.constant(f64(1e-12))
UNMEASURED = wp.constant(f64(1.5))
COLDEST = wp.constant(f64(200.0))


@wp.struct
class Point:
    x: wp.vec2d
    v: wp.vec2d
    c: wp.mat22d
    d: wp.vec3d
    strain: f64
    increment: f64
    damage: f64
    temperature: f64
    volume: f64


@wp.struct
class Grid:
    left: f64
    bottom: f64
    cell: f64


@wp.struct
class Step:
    mass: f64
    heat_mass: f64
    volume: f64
    time_step: f64
    kept: f64
    shear_modulus: f64
    bulk_modulus: f64
    heat_fraction: f64


@wp.struct
class Law:
    yield_stress: f64
    hardening: f64
    hardening_exponent: f64
    rate_sensitivity: f64
    thermal_exponent: f64
    melting_temperature: f64
    reference_temperature: f64
    reference_rate: f64


@wp.struct
class Damage:
    d1: f64
    d2: f64
    d3: f64
    d4: f64
    d5: f64
    per_work: f64
    loss: f64
    melting_temperature: f64
    reference_temperature: f64
    reference_rate: f64


def filled(struct, numbers):
    """A struct with the numbers of the same name."""
    result = struct()
    for name in struct.vars:
        setattr(result, name, float(getattr(numbers, name)))
    return result


@wp.func
def scaled(x: wp.vec2d, grid: Grid):
    return wp.vec2d((x[0] - grid.left) / grid.cell, (x[1] - grid.bottom) / grid.cell)


@wp.func
def weights(f: f64):
    a, b, c = f64(1.5) - f, f - ONE, f - HALF
    return wp.vec3d(HALF * a * a, f64(0.75) - b * b, HALF * c * c)


@wp.kernel
def gather(
    points: wp.array(dtype=Point), velocity: wp.array2d(dtype=wp.vec4d),
    cells: wp.array2d(dtype=wp.vec2d), grid: Grid, step: Step,
):  # fmt: skip
    k = wp.tid()
    x = points[k].x
    s = scaled(x, grid)
    i, j = int(s[0] - HALF), int(s[1] - HALF)
    fx, fy = s[0] - f64(i), s[1] - f64(j)
    wx, wy = weights(fx), weights(fy)
    dx, dy = wp.vec3d(-fx, ONE - fx, TWO - fx), wp.vec3d(-fy, ONE - fy, TWO - fy)
    sums = wp.vec4d()
    c = wp.mat22d()
    for a in range(3):
        for b in range(3):
            weighted = wx[a] * wy[b] * velocity[i + a, j + b]
            sums += weighted
            c += wp.outer(wp.vec2d(weighted[0], weighted[1]), wp.vec2d(dx[a], dy[b]))
    c = c * (FOUR / grid.cell)
    v = wp.vec2d(sums[0], sums[1])
    x += step.time_step * v
    points[k].x = x
    points[k].v = v + step.kept * (points[k].v + wp.vec2d(sums[2], sums[3]) - v)
    points[k].c = c
    s = scaled(x, grid)
    grown = points[k].volume * (ONE + step.time_step * wp.trace(c))
    wp.atomic_add(cells, int(s[0]), int(s[1]), wp.vec2d(grown, ONE))


@wp.func
def heat_of(temperature: f64, reference: f64, melting: f64):
    return wp.clamp((temperature - reference) / (melting - reference), ZERO, MOST_HEAT)


@wp.func
def thermal(temperature: f64, law: Law):
    heat = heat_of(temperature, law.reference_temperature, law.melting_temperature)
    if law.thermal_exponent != ONE:
        heat = wp.pow(heat, law.thermal_exponent)
    return ONE - heat


@wp.func
def weakening(damage: f64, numbers: Damage):
    return ONE - numbers.loss * wp.clamp(damage - ONE, ZERO, ONE)


@wp.func
def hardened(strain: f64, law: Law):
    held = wp.max(strain, TINY)
    power = law.hardening * wp.exp(law.hardening_exponent * wp.log(held))
    return law.yield_stress + power, law.hardening_exponent * power / held


@wp.func
def plastic_increment(trial: f64, strain: f64, weak: f64, guess: f64, step: Step, law: Law):
    stiffness = THREE * step.shear_modulus
    slowest = SLOWEST_RATE * step.time_step
    base, slope = hardened(strain, law)
    fast = ONE + law.rate_sensitivity * wp.log(wp.max(SLOWEST_RATE / law.reference_rate, ONE))
    excess = trial - weak * base * fast
    if excess <= ZERO:
        return ZERO
    firm = f64(0.0)
    if strain > SMALL_STRAIN:
        firm = weak * slope * fast
    bound = excess / (stiffness + firm)
    increment = f64(bound)
    if guess > TWO * slowest:
        increment = wp.min(guess, bound)
    left = int(ITERATIONS)
    while left > 0:
        left -= 1
        if increment <= slowest:
            return wp.min(slowest, bound)
        base, slope = hardened(strain + increment, law)
        ratio = increment / step.time_step / law.reference_rate
        fast = ONE + law.rate_sensitivity * wp.log(wp.max(ratio, ONE))
        by_rate = f64(0.0)
        if ratio > ONE:
            by_rate = base * law.rate_sensitivity
        excess = trial - stiffness * increment - weak * base * fast
        fall = stiffness * increment + weak * (slope * fast * increment + by_rate)
        change = excess / wp.max(fall, HALF * stiffness * increment)
        increment *= wp.exp(wp.clamp(change, -THREE, THREE))
        increment = wp.min(increment, trial / stiffness)
        if wp.abs(change) <= SMALL_CHANGE:
            return increment
    return increment


@wp.func
def strain_to_failure(triaxiality: f64, rate: f64, temperature: f64, law: Damage):
    held = wp.clamp(triaxiality, -UNMEASURED, UNMEASURED)
    fast = ONE + law.d4 * wp.log(wp.max(rate / law.reference_rate, ONE))
    heat = heat_of(temperature, law.reference_temperature, law.melting_temperature)
    return (law.d1 + law.d2 * wp.exp(law.d3 * held)) * fast * (ONE + law.d5 * heat)


@wp.kernel
def stress_and_scatter(
    points: wp.array(dtype=Point), nodes: wp.array2d(dtype=Sums),
    cells: wp.array2d(dtype=wp.vec2d), capacities: wp.array(dtype=f64),
    grid: Grid, step: Step, law: Law, damage: Damage,
):  # fmt: skip
    k = wp.tid()
    p = points[k]
    s = scaled(p.x, grid)
    shared = cells[int(s[0]), int(s[1])]
    volume = shared[0] / shared[1]
    dt = step.time_step
    two_g = TWO * step.shear_modulus * dt
    spin = (p.c[0, 1] - p.c[1, 0]) * dt
    third = wp.trace(p.c) / THREE
    xy = p.d[2] + HALF * spin * (p.d[1] - p.d[0]) + HALF * two_g * (p.c[0, 1] + p.c[1, 0])
    xx = p.d[0] + spin * p.d[2] + two_g * (p.c[0, 0] - third)
    yy = p.d[1] - spin * p.d[2] + two_g * (p.c[1, 1] - third)
    trial = wp.sqrt(THREE * (xx * xx + yy * yy + xx * yy + xy * xy))
    kept = weakening(p.damage, damage)
    weak = kept * thermal(p.temperature, law)
    increment = plastic_increment(trial, p.strain, weak, p.increment, step, law)
    tension = step.bulk_modulus * (volume / step.volume - ONE)
    if increment > ZERO:
        stress = trial - THREE * step.shear_modulus * increment
        scale = stress / trial
        xx *= scale
        yy *= scale
        xy *= scale
        points[k].strain = p.strain + increment
        growth = increment * stress / kept * damage.per_work
        if p.damage < ONE:
            growth = increment / strain_to_failure(
                tension / stress, increment / dt, p.temperature, damage
            )
        points[k].damage = p.damage + growth
        capacity = capacities[wp.clamp(int(p.temperature - COLDEST), 0, capacities.shape[0] - 1)]
        heat = step.heat_fraction * stress * increment * volume
        points[k].temperature = p.temperature + heat / (step.heat_mass * capacity)
    points[k].increment = increment
    points[k].volume = volume
    points[k].d = wp.vec3d(xx, yy, xy)
    force = FOUR / grid.cell * dt * volume
    sigma = wp.mat22d(xx + tension, xy, xy, yy + tension)
    spread = step.mass * grid.cell * p.c
    i, j = int(s[0] - HALF), int(s[1] - HALF)
    fx, fy = s[0] - f64(i), s[1] - f64(j)
    wx, wy = weights(fx), weights(fy)
    dx, dy = wp.vec3d(-fx, ONE - fx, TWO - fx), wp.vec3d(-fy, ONE - fy, TWO - fy)
    for a in range(3):
        for b in range(3):
            offset = wp.vec2d(dx[a], dy[b])
            m = step.mass * p.v + spread * offset
            h = -force * (sigma * offset)
            sums = Sums(step.mass, m[0], m[1], h[0], h[1])
            wp.atomic_add(nodes, i + a, j + b, wx[a] * wy[b] * sums)


@wp.kernel
def update_grid(
    nodes: wp.array2d(dtype=Sums), velocity: wp.array2d(dtype=wp.vec4d),
    cells: wp.array2d(dtype=wp.vec2d),
):  # fmt: skip
    i, j = wp.tid()
    node = nodes[i, j]
    v = wp.vec4d()
    if node[0] > ZERO:
        dx, dy = node[3] / node[0], node[4] / node[0]
        v = wp.vec4d(node[1] / node[0] + dx, node[2] / node[0] + dy, dx, dy)
    velocity[i, j] = v
    nodes[i, j] = Sums()
    cells[i, j] = wp.vec2d()


class Stepper:
    name = "Warp"
    # Two passes over a record of 16 numbers; per node velocity, sums and density of the cell.
    bytes_per_point = 8 * (4 * 16 + (2 * 4 + 4 * 5 + 4 * 2) / 4)

    def __init__(self, start, threads):
        wp.config.log_level = wp.LOG_ERROR
        wp.init()
        wp.set_module_options({"enable_backward": False})
        wp.set_device("cpu")
        self.start, self.threads, self.count = start, threads, start.points.size
        shape = (start.grid.columns, start.grid.rows)
        self.points = wp.zeros(self.count, dtype=Point)
        self.nodes = wp.zeros(shape, dtype=Sums)
        self.cells = wp.zeros(shape, dtype=wp.vec2d)
        self.velocity = wp.zeros(shape, dtype=wp.vec4d)
        capacity = wp.array(start.capacity, dtype=f64)
        step = SimpleNamespace(**start.step._asdict(), heat_fraction=start.heat_fractions[1, 0])
        numbers = (start.grid, step, start.law, start.damage)
        grid, step, law, damage = map(filled, (Grid, Step, Law, Damage), numbers)
        launches = (
            (gather, self.count, [self.points, self.velocity, self.cells, grid, step]),
            (
                stress_and_scatter,
                self.count,
                [self.points, self.nodes, self.cells, capacity, grid, step, law, damage],
            ),
            (update_grid, shape, [self.nodes, self.velocity, self.cells]),
        )
        self.commands = [
            wp.launch(kernel, size, inputs=inputs, record_cmd=True)
            for kernel, size, inputs in launches
        ]

    def reset(self):
        p = self.start.points
        records = np.zeros(self.count, Point.numpy_dtype())
        records["x"] = np.stack([p["x"], p["y"]], 1)
        records["v"] = np.stack([p["own_vx"], p["own_vy"]], 1)
        rates = [p[name] for name in ("cxx", "cxy", "cyx", "cyy")]
        records["c"] = np.stack(rates, 1).reshape(-1, 2, 2)
        records["d"] = np.stack([p[name] for name in ("dxx", "dyy", "dxy")], 1)
        for name in ("strain", "increment", "damage", "temperature", "volume"):
            records[name] = p[name]
        self.points.assign(wp.array(records, dtype=Point))
        self.velocity.assign(self.start.velocity)
        self.nodes.zero_()
        self.cells.zero_()

    def advance(self, steps):
        begin = perf_counter()
        for _ in range(steps):
            for command in self.commands:
                command.launch()
        wp.synchronize()
        return perf_counter() - begin

    def result(self):
        p = self.points.numpy()
        return {
            "own_vx": p["v"][:, 0], "volume": p["volume"], "dxy": p["d"][:, 2],
            "strain": p["strain"], "damage": p["damage"], "temperature": p["temperature"],
        }  # fmt: skip
