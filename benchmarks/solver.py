"""The cutting solver's kernels on blocks of material, without a cut: for tests and benchmarks."""

from dataclasses import replace

import numpy as np
from numba import get_num_threads

from chipglow.cutting import workpiece
from chipglow.cutting.damage import Damage
from chipglow.cutting.heat import conduct, return_heat
from chipglow.cutting.material import ROOM_TEMPERATURE
from chipglow.cutting.momentum import (
    CHANGE_X,
    CHANGE_Y,
    NODE_VALUES,
    SUMS,
    VELOCITY_VALUES,
    VELOCITY_X,
    VELOCITY_Y,
    Step,
    advance_with,
)
from chipglow.cutting.points import POINT, Grid, block_of_points, sort_by_cell
from chipglow.cutting.recording import held_energy
from chipglow.scene import ToolGeometry

FAR = 1.0
STEEL = workpiece("aisi-1045/jaspers-dautzenberg")
DENSITY = float(STEEL.density_at(ROOM_TEMPERATURE))
UNBROKEN = replace(STEEL, damage=None, density=DENSITY)
"""AISI 1045 that does not fail and does not expand."""
ELASTIC = replace(
    UNBROKEN,
    young_modulus=205e9,
    poisson_ratio=0.29,
    flow_stress=replace(STEEL.flow_stress, yield_stress=1e15),
)


class Block:
    """A rectangle of material on a grid; the tool, the floor and the inflow are far away."""

    def __init__(
        self, size, cell=10e-6, material=ELASTIC, courant=0.35, tool=None, margin=12, **changes
    ):
        self.cell, self.spacing = cell, cell / 2
        columns, rows = (round(length / self.spacing) for length in size)
        self.grid = Grid(
            -margin * cell, -margin * cell, cell, columns // 2 + 2 * margin, rows // 2 + 2 * margin
        )
        centres = [self.spacing * (np.arange(count) + 0.5) for count in (columns, rows)]
        self.points = block_of_points(*centres, self.spacing, 293.0, 0.0)
        self.count = self.points.size
        self.sound = material.sound_speed()
        mass = float(material.density_at(ROOM_TEMPERATURE)) * self.spacing**2
        self.step = Step(
            mass=mass,
            heat_mass=mass,
            volume=self.spacing**2,
            time_step=courant * cell / self.sound,
            shear_modulus=float(material.shear_modulus_at(ROOM_TEMPERATURE)),
            bulk_modulus=float(material.bulk_modulus_at(ROOM_TEMPERATURE)),
            stiffness=50e9,
            damping=0.0,
            reach=self.spacing / 2,
            area=self.spacing,
            friction=0.0,
            friction_factor=1.0,
            floor=-FAR,
            inflow=-FAR,
            ceiling=-FAR,
            speed=0.0,
        )._replace(**changes)
        self.law = material.flow_stress.numbers()
        self.damage = Damage.of(material.damage, material.failing_layer(cell))
        self.elastic = material.elastic_ratios()
        self.capacity = material.heat_capacity.sampled()
        self.heat_fractions = material.heat_fractions()
        self.conductivity = material.conductivity.sampled()
        self.tool = tool or ToolGeometry().surface._replace(x=FAR, y=FAR)
        shape = (self.grid.columns, self.grid.rows)
        self.velocity = np.zeros((*shape, VELOCITY_VALUES))
        self.nodes = np.zeros((*shape, NODE_VALUES))
        self.heat = np.zeros(shape)
        self.sums = np.zeros(SUMS)
        self.force = self.sums[:2]
        self.starts = np.zeros(shape[0] * shape[1] + 1, np.int64)

    def set_velocity(self, vx, vy):
        """Velocity of grid and points as functions of x and y, linear in them."""
        x = self.grid.left + self.cell * np.arange(self.grid.columns)[:, None]
        y = self.grid.bottom + self.cell * np.arange(self.grid.rows)[None, :]
        self.velocity[..., 0], self.velocity[..., 1] = vx(x, y), vy(x, y)
        points = self.points
        for name, of in (("vx", vx), ("vy", vy)):
            points[name] = points[f"own_{name}"] = of(points["x"], points["y"])

    def advance(self, steps, cycle=20):
        """Advance, sorting the points every few steps."""
        while steps > 0:
            self.sort()
            now = min(steps, cycle)
            self.step_on(now)
            self.force /= now
            steps -= now

    def advance_with_the_grid(self, steps):
        """Advance points that take the grid's velocity (APIC), with the sums of all steps.

        Points take the change of the grid's velocity: from rest, that is all of it.
        """
        self.sort()
        sums = np.zeros(SUMS)
        for _ in range(steps):
            self.points["own_vx"] = self.points["own_vy"] = 0.0
            self.velocity[..., CHANGE_X] = self.velocity[..., VELOCITY_X]
            self.velocity[..., CHANGE_Y] = self.velocity[..., VELOCITY_Y]
            self.step_on(1)
            sums += self.sums
        self.sums[:] = sums

    def sort(self):
        spare = np.zeros_like(self.points, POINT)
        count = sort_by_cell(self.points, self.count, self.grid, FAR, FAR, spare, self.starts)
        assert count == self.count
        self.points = spare

    def step_on(self, steps, threads=None):
        """Advance points that are sorted."""
        self.sums[:] = 0.0
        assert advance_with(self.law)(
            steps, self.points, self.starts, self.velocity, self.nodes, self.heat, self.tool,
            self.grid, self.step, self.law, self.damage, self.elastic, self.capacity,
            self.heat_fractions, self.sums, threads or get_num_threads(),
        )  # fmt: skip

    def conduct(self, duration, steps, conductivity, capacity):
        """Conduct heat for a time, with properties sampled as a `TemperatureTable` does."""
        shape = (self.grid.columns, self.grid.rows)
        nodes, increment = np.zeros((*shape, 3)), np.zeros(shape)
        diffusivity = conductivity[0] / (self.step.heat_mass / self.step.volume * capacity[0])
        fraction = min(diffusivity * duration / steps / self.cell**2, 1.0)
        for _ in range(steps):
            conduct(
                self.points, self.count, nodes, increment, conductivity, capacity,
                self.step.heat_mass, self.grid, duration / steps, fraction,
            )  # fmt: skip
            return_heat(self.points, self.count, increment, self.grid)

    def deviator(self):
        """Deviator of the points' Cauchy stress, xx, yy and xy, in Pa, shape (3, n)."""
        kelvins = np.clip(self.points["temperature"] - 200.0, 0, len(self.elastic) - 1)
        soft = self.elastic[kelvins.astype(int), 0]
        return soft * np.array([self.points[name] for name in ("dxx", "dyy", "dxy")])

    def energy(self):
        """Kinetic and elastic energy in J/m."""
        return held_energy(self.points, self.count, self.step, self.elastic, self.cell)

    def momentum(self):
        """Momentum of the points, x and y, and their angular momentum (with the affine part)."""
        p, mass = self.points, self.step.mass
        orbit = p["x"] * p["own_vy"] - p["y"] * p["own_vx"]
        spin = self.cell**2 / 4 * (p["cyx"] - p["cxy"])
        return mass * p["own_vx"].sum(), mass * p["own_vy"].sum(), mass * (orbit + spin).sum()
