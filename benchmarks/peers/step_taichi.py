"""The solver's step of transfer and stress in Taichi, for `solver_speed.py`.

Written as Taichi's own MPM examples are: one thread a point, atomic sums on the grid, kernels
whose constants are compiled in. Material points keep the order they come in. The mean density of
a cell is taken over the points that are in it now.
"""

from time import perf_counter

import numpy as np
import taichi as ti

ITERATIONS = 6
SMALL_CHANGE = 0.02
SMALL_STRAIN = 0.01


@ti.data_oriented
class Stepper:
    # Two passes over a record of 16 numbers; per node velocity, sums and density of the cell.
    bytes_per_point = 4 * 16 * 8 + (2 * 16 + 4 * 24 + 4 * 16) / 4

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
        self.grid, self.step, self.flow = start.grid, start.step, start.flow
        self.heat_share = float(start.heat_shares[1, 0])
        self.start, count = start, start.points.size
        self.count = count
        point = ti.types.struct(
            x=ti.math.vec2, v=ti.math.vec2, c=ti.math.mat2, d=ti.math.vec3,
            strain=ti.f64, increment=ti.f64, damage=ti.f64, temperature=ti.f64, volume=ti.f64,
        )  # fmt: skip
        node = ti.types.struct(mass=ti.f64, momentum=ti.math.vec2)
        shape = (self.grid.columns, self.grid.rows)
        self.points = point.field(shape=count, layout=ti.Layout.AOS)
        self.nodes = node.field(shape=shape, layout=ti.Layout.AOS)
        self.velocity = ti.Vector.field(2, ti.f64, shape=shape, layout=ti.Layout.AOS)
        self.cells = ti.Vector.field(2, ti.f64, shape=shape, layout=ti.Layout.AOS)
        self.capacity = ti.field(ti.f64, shape=start.capacity.size)
        self.capacity.from_numpy(start.capacity)

    def reset(self):
        p = self.start.points
        self.points.from_numpy(
            {
                "x": np.stack([p["x"], p["y"]], 1),
                "v": np.stack([p["vx"], p["vy"]], 1),
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
            "vx": p["v"][:, 0], "volume": p["volume"], "dxy": p["d"][:, 2],
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
            v = ti.Vector.zero(ti.f64, 2)
            c = ti.Matrix.zero(ti.f64, 2, 2)
            for a, b in ti.static(ti.ndrange(3, 3)):
                offset = ti.Vector([a, b])
                u = self.velocity[first + offset]
                weighted = w[a].x * w[b].y * u
                v += weighted
                c += weighted.outer_product(offset - f)
            c *= 4.0 / self.grid.cell
            x += self.step.time_step * v
            self.points[k].x = x
            self.points[k].v = v
            self.points[k].c = c
            _, _, cell = self.base(x)
            grown = self.points[k].volume * (1.0 + self.step.time_step * c.trace())
            self.cells[cell] += ti.Vector([grown, 1.0])

    @ti.func
    def heat(self, temperature):
        span = ti.static(self.flow.melting_temperature - self.flow.reference_temperature)
        return ti.math.clamp((temperature - self.flow.reference_temperature) / span, 0.0, 0.99)

    @ti.func
    def weakening(self, damage, temperature):
        heat = self.heat(temperature)
        if ti.static(self.flow.thermal_exponent != 1.0):
            heat = heat**self.flow.thermal_exponent
        share = (damage - self.flow.onset) / (1.0 - self.flow.onset)
        return (1.0 - heat) * (1.0 - self.flow.loss * ti.math.clamp(share, 0.0, 1.0))

    @ti.func
    def plastic_increment(self, trial, strain, weak, guess):
        flow = ti.static(self.flow)
        stiffness = 3.0 * self.step.shear_modulus
        slowest = self.step.time_step * flow.reference_rate
        result = 0.0
        if trial > flow.yield_stress * weak:
            power = ti.exp(flow.hardening_exponent * ti.log(ti.max(strain, 1e-12)))
            hard = (flow.yield_stress + flow.hardening * power) * weak
            if trial > hard:
                slope = 0.0
                if strain > SMALL_STRAIN:
                    slope = weak * flow.hardening * flow.hardening_exponent * power / strain
                bound = (trial - hard) / (stiffness + slope)
                result = bound
                if guess > 2.0 * slowest:
                    result = ti.min(guess, bound)
                left = ITERATIONS
                while left > 0:
                    left -= 1
                    if result <= slowest:
                        result = ti.min(slowest, bound)
                        break
                    base = hard + slope * result
                    if strain <= SMALL_STRAIN:
                        end = strain + result
                        power = ti.exp(flow.hardening_exponent * ti.log(end))
                        base = (flow.yield_stress + flow.hardening * power) * weak
                        slope = weak * flow.hardening * flow.hardening_exponent * power / end
                    fast = 1.0 + flow.rate_sensitivity * ti.log(result / slowest)
                    excess = trial - stiffness * result - base * fast
                    fall = (stiffness + slope * fast) * result + base * flow.rate_sensitivity
                    change = excess / fall
                    if ti.abs(change) < SMALL_CHANGE:
                        result *= 1.0 + change * (1.0 + 0.5 * change)
                        break
                    result = ti.min(result * ti.exp(ti.max(change, -3.0)), bound)
        return result

    @ti.func
    def strain_to_failure(self, triaxiality, rate, temperature):
        flow = ti.static(self.flow)
        held = ti.math.clamp(triaxiality, -1.5, 1.5)
        fast = 1.0 + flow.d4 * ti.log(ti.max(rate / flow.reference_rate, 1.0))
        warm = 1.0 + flow.d5 * self.heat(temperature)
        return (flow.d1 + flow.d2 * ti.exp(flow.d3 * held)) * fast * warm

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
            weak = self.weakening(p.damage, p.temperature)
            increment = self.plastic_increment(trial, p.strain, weak, p.increment)
            tension = step.bulk_modulus * (volume / step.volume - 1.0)
            if increment > 0.0:
                stress = trial - 3.0 * step.shear_modulus * increment
                scale = stress / trial
                xx *= scale
                yy *= scale
                xy *= scale
                self.points[k].strain = p.strain + increment
                self.points[k].damage = p.damage + increment / self.strain_to_failure(
                    tension / stress, increment / dt, p.temperature
                )
                index = ti.cast(p.temperature - 200.0, ti.i32)
                capacity = self.capacity[ti.math.clamp(index, 0, self.capacity.shape[0] - 1)]
                heat = self.heat_share * stress * increment * volume
                self.points[k].temperature = p.temperature + heat / (step.heat_mass * capacity)
            self.points[k].increment = increment
            self.points[k].volume = volume
            self.points[k].d = ti.Vector([xx, yy, xy])
            force = 4.0 / self.grid.cell * dt * volume
            sigma = ti.Matrix([[xx + tension, xy], [xy, yy + tension]])
            affine = step.mass * self.grid.cell * p.c - force * sigma
            w = self.weights(f)
            for a, b in ti.static(ti.ndrange(3, 3)):
                offset = ti.Vector([a, b])
                weight = w[a].x * w[b].y
                node = first + offset
                self.nodes[node].momentum += weight * (step.mass * p.v + affine @ (offset - f))
                self.nodes[node].mass += weight * step.mass

    @ti.kernel
    def update_grid(self):
        for i, j in self.nodes:
            mass = self.nodes[i, j].mass
            v = ti.Vector.zero(ti.f64, 2)
            if mass > 0.0:
                v = self.nodes[i, j].momentum / mass
            self.velocity[i, j] = v
            self.nodes[i, j].mass = 0.0
            self.nodes[i, j].momentum = ti.Vector.zero(ti.f64, 2)
            self.cells[i, j] = ti.Vector.zero(ti.f64, 2)
