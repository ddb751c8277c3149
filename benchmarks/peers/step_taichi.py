"""The solver's step of transfer and stress in Taichi, for `solver_speed.py`.

Written as Taichi's own MPM examples are: one thread a point, atomic sums on the grid, kernels
whose constants are compiled in. Material points keep the order they come in. The mean density of
a cell is taken over the points that are in it now. A point stores the velocity that it carries, not
that of the grid, which only contact asks for.
"""

from time import perf_counter

import numpy as np
import taichi as ti

SLOWEST_RATE = 1.0
ITERATIONS = 8
SMALL_CHANGE = 0.02
SMALL_STRAIN = 0.01


@ti.data_oriented
class Stepper:
    # Two passes over a record of 16 numbers; per node velocity, sums and density of the cell.
    bytes_per_point = 8 * (4 * 16 + (2 * 4 + 4 * 5 + 4 * 2) / 4)

    def __init__(self, start, threads):
        ti.init(
            arch=ti.cpu,
            default_fp=ti.f64,
            cpu_max_num_threads=threads,
            fast_math=True,
            offline_cache=False,
            log_level=ti.ERROR,
            verbose=False,
        )
        self.grid, self.step = start.grid, start.step
        self.law, self.damage = start.law, start.damage
        self.heat_fraction = float(start.heat_fractions[1, 0])
        self.start, count = start, start.points.size
        self.count = count
        point = ti.types.struct(
            x=ti.math.vec2, v=ti.math.vec2, c=ti.math.mat2, d=ti.math.vec3,
            strain=ti.f64, increment=ti.f64, damage=ti.f64, temperature=ti.f64, volume=ti.f64,
        )  # fmt: skip
        node = ti.types.struct(mass=ti.f64, momentum=ti.math.vec2, impulse=ti.math.vec2)
        shape = (self.grid.columns, self.grid.rows)
        self.points = point.field(shape=count, layout=ti.Layout.AOS)
        self.nodes = node.field(shape=shape, layout=ti.Layout.AOS)
        self.velocity = ti.Vector.field(4, ti.f64, shape=shape, layout=ti.Layout.AOS)
        self.cells = ti.Vector.field(2, ti.f64, shape=shape, layout=ti.Layout.AOS)
        self.capacity = ti.field(ti.f64, shape=start.capacity.size)
        self.capacity.from_numpy(start.capacity)

    def reset(self):
        p = self.start.points
        self.points.from_numpy(
            {
                "x": np.stack([p["x"], p["y"]], 1),
                "v": np.stack([p["own_vx"], p["own_vy"]], 1),
                "c": np.stack([p[k] for k in ("cxx", "cxy", "cyx", "cyy")], 1).reshape(-1, 2, 2),
                "d": np.stack([p[k] for k in ("dxx", "dyy", "dxy")], 1),
                **{
                    k: np.ascontiguousarray(p[k])
                    for k in ("strain", "increment", "damage", "temperature", "volume")
                },
            }
        )
        self.velocity.from_numpy(self.start.velocity)
        self.nodes.mass.fill(0.0)
        self.nodes.momentum.fill(0.0)
        self.nodes.impulse.fill(0.0)
        self.cells.fill(0.0)

    def advance(self, steps):
        begin = perf_counter()
        for _ in range(steps):
            self.gather()
            self.stress_and_scatter()
            self.update_grid()
        ti.sync()
        return perf_counter() - begin

    def result(self):
        p = self.points.to_numpy()
        return {
            "own_vx": p["v"][:, 0], "volume": p["volume"], "dxy": p["d"][:, 2],
            "strain": p["strain"], "damage": p["damage"], "temperature": p["temperature"],
        }  # fmt: skip

    @ti.func
    def base(self, x):
        scaled = (x - ti.Vector([self.grid.left, self.grid.bottom])) / self.grid.cell
        first = ti.cast(scaled - 0.5, ti.i32)
        return first, scaled - first, ti.cast(scaled, ti.i32)

    @ti.func
    def weights(self, f):
        return [0.5 * (1.5 - f) ** 2, 0.75 - (f - 1.0) ** 2, 0.5 * (f - 0.5) ** 2]

    @ti.kernel
    def gather(self):
        for k in self.points:
            x = self.points[k].x
            first, f, _ = self.base(x)
            w = self.weights(f)
            sums = ti.Vector.zero(ti.f64, 4)
            c = ti.Matrix.zero(ti.f64, 2, 2)
            for a, b in ti.static(ti.ndrange(3, 3)):
                offset = ti.Vector([a, b])
                weighted = w[a].x * w[b].y * self.velocity[first + offset]
                sums += weighted
                c += weighted.xy.outer_product(offset - f)
            c *= 4.0 / self.grid.cell
            v = sums.xy
            x += self.step.time_step * v
            self.points[k].x = x
            self.points[k].v = v + self.step.kept * (self.points[k].v + sums.zw - v)
            self.points[k].c = c
            _, _, cell = self.base(x)
            grown = self.points[k].volume * (1.0 + self.step.time_step * c.trace())
            self.cells[cell] += ti.Vector([grown, 1.0])

    @ti.func
    def heat(self, temperature, numbers: ti.template()):
        span = ti.static(numbers.melting_temperature - numbers.reference_temperature)
        return ti.math.clamp((temperature - numbers.reference_temperature) / span, 0.0, 0.99)

    @ti.func
    def thermal(self, temperature):
        heat = self.heat(temperature, self.law)
        if ti.static(self.law.thermal_exponent != 1.0):
            heat = heat**self.law.thermal_exponent
        return 1.0 - heat

    @ti.func
    def weakening(self, damage):
        return 1.0 - self.damage.loss * ti.math.clamp(damage - 1.0, 0.0, 1.0)

    @ti.func
    def hardened(self, strain):
        held = ti.max(strain, 1e-12)
        power = self.law.hardening * ti.exp(self.law.hardening_exponent * ti.log(held))
        return self.law.yield_stress + power, self.law.hardening_exponent * power / held

    @ti.func
    def plastic_increment(self, trial, strain, weak, guess):
        law = ti.static(self.law)
        stiffness = 3.0 * self.step.shear_modulus
        slowest = SLOWEST_RATE * self.step.time_step
        base, slope = self.hardened(strain)
        fast = 1.0 + law.rate_sensitivity * ti.log(ti.max(SLOWEST_RATE / law.reference_rate, 1.0))
        excess = trial - weak * base * fast
        result = 0.0
        if excess > 0.0:
            firm = 0.0
            if strain > SMALL_STRAIN:
                firm = weak * slope * fast
            bound = excess / (stiffness + firm)
            result = bound
            if guess > 2.0 * slowest:
                result = ti.min(guess, bound)
            left = ITERATIONS
            while left > 0:
                left -= 1
                if result <= slowest:
                    result = ti.min(slowest, bound)
                    break
                base, slope = self.hardened(strain + result)
                ratio = result / self.step.time_step / law.reference_rate
                fast = 1.0 + law.rate_sensitivity * ti.log(ti.max(ratio, 1.0))
                by_rate = 0.0
                if ratio > 1.0:
                    by_rate = base * law.rate_sensitivity
                excess = trial - stiffness * result - weak * base * fast
                fall = stiffness * result + weak * (slope * fast * result + by_rate)
                change = excess / ti.max(fall, 0.5 * stiffness * result)
                result *= ti.exp(ti.math.clamp(change, -3.0, 3.0))
                result = ti.min(result, trial / stiffness)
                if ti.abs(change) <= SMALL_CHANGE:
                    break
        return result

    @ti.func
    def strain_to_failure(self, triaxiality, rate, temperature):
        law = ti.static(self.damage)
        held = ti.math.clamp(triaxiality, -1.5, 1.5)
        fast = 1.0 + law.d4 * ti.log(ti.max(rate / law.reference_rate, 1.0))
        warm = 1.0 + law.d5 * self.heat(temperature, self.damage)
        return (law.d1 + law.d2 * ti.exp(law.d3 * held)) * fast * warm

    @ti.kernel
    def stress_and_scatter(self):
        step = ti.static(self.step)
        dt = ti.static(step.time_step)
        two_g = ti.static(2.0 * step.shear_modulus * dt)
        for k in self.points:
            p = self.points[k]
            first, f, cell = self.base(p.x)
            shared = self.cells[cell]
            volume = shared.x / shared.y
            spin = (p.c[0, 1] - p.c[1, 0]) * dt
            third = p.c.trace() / 3.0
            xy = p.d.z + 0.5 * spin * (p.d.y - p.d.x) + 0.5 * two_g * (p.c[0, 1] + p.c[1, 0])
            xx = p.d.x + spin * p.d.z + two_g * (p.c[0, 0] - third)
            yy = p.d.y - spin * p.d.z + two_g * (p.c[1, 1] - third)
            trial = ti.sqrt(3.0 * (xx * xx + yy * yy + xx * yy + xy * xy))
            kept = self.weakening(p.damage)
            weak = kept * self.thermal(p.temperature)
            increment = self.plastic_increment(trial, p.strain, weak, p.increment)
            tension = step.bulk_modulus * (volume / step.volume - 1.0)
            if increment > 0.0:
                stress = trial - 3.0 * step.shear_modulus * increment
                scale = stress / trial
                xx *= scale
                yy *= scale
                xy *= scale
                self.points[k].strain = p.strain + increment
                growth = increment * stress / kept * self.damage.per_work
                if p.damage < 1.0:
                    growth = increment / self.strain_to_failure(
                        tension / stress, increment / dt, p.temperature
                    )
                self.points[k].damage = p.damage + growth
                index = ti.cast(p.temperature - 200.0, ti.i32)
                capacity = self.capacity[ti.math.clamp(index, 0, self.capacity.shape[0] - 1)]
                heat = self.heat_fraction * stress * increment * volume
                self.points[k].temperature = p.temperature + heat / (step.heat_mass * capacity)
            self.points[k].increment = increment
            self.points[k].volume = volume
            self.points[k].d = ti.Vector([xx, yy, xy])
            force = 4.0 / self.grid.cell * dt * volume
            sigma = ti.Matrix([[xx + tension, xy], [xy, yy + tension]])
            spread = step.mass * self.grid.cell * p.c
            w = self.weights(f)
            for a, b in ti.static(ti.ndrange(3, 3)):
                offset = ti.Vector([a, b])
                weight = w[a].x * w[b].y
                node = first + offset
                self.nodes[node].momentum += weight * (step.mass * p.v + spread @ (offset - f))
                self.nodes[node].impulse -= weight * force * (sigma @ (offset - f))
                self.nodes[node].mass += weight * step.mass

    @ti.kernel
    def update_grid(self):
        for i, j in self.nodes:
            mass = self.nodes[i, j].mass
            velocity = ti.Vector.zero(ti.f64, 4)
            if mass > 0.0:
                change = self.nodes[i, j].impulse / mass
                velocity.xy = self.nodes[i, j].momentum / mass + change
                velocity.zw = change
            self.velocity[i, j] = velocity
            self.nodes[i, j].mass = 0.0
            self.nodes[i, j].momentum = ti.Vector.zero(ti.f64, 2)
            self.nodes[i, j].impulse = ti.Vector.zero(ti.f64, 2)
            self.cells[i, j] = ti.Vector.zero(ti.f64, 2)
