"""Heat lost through free surfaces: their length, lumped cooling, radiation, the balance."""

from math import exp, radians

import numpy as np
import pytest
from scipy.constants import Stefan_Boltzmann
from solver import DENSITY, Block

from chipglow.cutting import (
    AISI_1045,
    CARBIDE,
    CuttingConditions,
    CuttingSimulation,
    Numerics,
    OutputWindow,
    Surroundings,
)
from chipglow.cutting.heat import (
    HeatLoss,
    ToolHeat,
    conduct,
    free_surface,
    lose_heat,
    return_heat,
    tool_fraction,
)
from chipglow.scene import Raster, ToolGeometry
from chipglow.study import Study

EVERYWHERE = HeatLoss(0.0, 0.0, 293.15, -1.0, 1.0, -1.0, 1.0)
TOOL_HEAT = ToolHeat(CARBIDE.density * CARBIDE.heat_capacity, CARBIDE.conductivity, 0.5, 0.0, 1.0)
CAPACITY = 520.0
STORE = DENSITY * CAPACITY


class WarmBlock:
    """A block with constant heat properties and the arrays of its heat."""

    def __init__(self, size, cell, temperature=1000.0, tool=None):
        self.block = Block(size, cell=cell)
        self.block.points["temperature"] = temperature
        shape = (self.block.grid.columns, self.block.grid.rows)
        self.nodes, self.increment = np.zeros((*shape, 3)), np.zeros(shape)
        self.fraction = tool_fraction(self.block.grid, tool) if tool else np.zeros(shape)
        self.tool_temperature = np.full(shape, 600.0)

    def step(self, loss, duration, conductivity=45.0):
        block, samples = self.block, AISI_1045.conductivity.sampled().size
        conduct(
            block.points, block.count, self.nodes, self.increment,
            np.full(samples, conductivity), np.full(samples, CAPACITY), block.step.heat_mass,
            block.grid, duration, 0.0,
        )  # fmt: skip
        lost = lose_heat(
            self.nodes, self.increment, self.tool_temperature, self.fraction, TOOL_HEAT, loss,
            block.grid, duration,
        )  # fmt: skip
        return_heat(block.points, block.count, self.increment, block.grid)
        return lost

    def cool(self, loss, duration):
        """Cool for a while; the mean temperature after it."""
        diffusivity = 45.0 / STORE
        steps = round(duration / (0.15 * self.block.cell**2 / diffusivity))
        for _ in range(steps):
            self.step(loss, duration / steps)
        return self.block.points["temperature"].mean()

    def heat(self):
        """Heat over 0 K of block and tool in J/m."""
        block = self.block
        tool = TOOL_HEAT.capacity * block.cell**2 * np.maximum(self.fraction, 0.25)
        held = (tool * self.tool_temperature)[self.fraction > 0].sum()
        return block.step.heat_mass * CAPACITY * block.points["temperature"].sum() + held

    def surface(self, left=-1.0, right=1.0):
        """Length of the free surface in m, of cells between two x."""
        grid = self.block.grid
        self.step(EVERYWHERE, 0.0)
        x = grid.left + grid.cell * (np.arange(grid.columns - 1) + 0.5)
        return sum(
            free_surface(self.nodes, self.fraction, grid, i, j)
            for i in np.flatnonzero((x > left) & (x < right))
            for j in range(grid.rows - 1)
        )


def turned(size, cell, angle):
    """A rectangle of points turned by an angle, off the nodes of the grid."""
    warm = WarmBlock(size, cell)
    points = warm.block.points
    x, y = points["x"] - size[0] / 2, points["y"] - size[1] / 2
    points["x"] = np.cos(angle) * x - np.sin(angle) * y + size[0] / 2 + 0.3 * cell
    points["y"] = np.sin(angle) * x + np.cos(angle) * y + size[1] / 2 - 0.2 * cell
    return warm


@pytest.mark.parametrize("degrees", [0.0, 10.0, 20.0, 30.0, 45.0])
def test_surface_of_a_rectangle_at_any_angle(degrees):
    size = (300e-6, 200e-6)
    found = turned(size, 10e-6, radians(degrees)).surface()
    # Lattice and grid in line or not: from -1.1 % to 0.8 %; the rounded corners take 0.5 % of it.
    assert found == pytest.approx(2 * sum(size), rel=0.015)


def test_uneven_filling_is_no_surface():
    warm = turned((300e-6, 200e-6), 10e-6, 0.3)
    scatter = np.random.default_rng(1).uniform(-2e-6, 2e-6, (2, warm.block.count))
    warm.block.points["x"] += scatter[0]
    warm.block.points["y"] += scatter[1]
    # Points that are scattered by 0.4 of their spacing make a filled fraction of 1 ± 0.06 inside.
    assert warm.surface() == pytest.approx(1e-3, rel=0.02)


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_contact_with_the_tool_is_no_free_surface(gap):
    upright = ToolGeometry(rake_angle=0.0)
    tool = upright.surface._replace(x=200e-6 + upright.edge_radius, y=-1.0)
    warm = WarmBlock((200e-6, 200e-6), 10e-6, tool=tool)
    warm.block.points["x"] -= gap
    warm.block.points["y"] += 3e-6
    free = warm.surface(right=150e-6)
    # Left, and both ends up to where it is cut off; the tool's own face is free over and under.
    assert free == pytest.approx(200e-6 + 2 * 150e-6, rel=0.02)
    grid = warm.block.grid
    middle = [
        free_surface(warm.nodes, warm.fraction, grid, i, j)
        for i in range(grid.columns - 1)
        for j in range(grid.rows - 1)
        if grid.left + i * grid.cell > 160e-6 and 40e-6 < grid.bottom + j * grid.cell < 160e-6
    ]
    # Of 120 µm of contact, which would count twice.
    assert sum(middle) < 1e-6


def test_faces_of_the_tool():
    geometry = ToolGeometry()
    warm = WarmBlock((400e-6, 400e-6), 10e-6, tool=geometry.surface)
    warm.block.points["x"] -= 1.0
    warm.block.count = 0
    grid = warm.block.grid
    right = grid.left + (grid.columns - 1) * grid.cell
    top = grid.bottom + (grid.rows - 1) * grid.cell
    radius, (rake, clearance) = 20e-6, (radians(7.0), radians(7.0))
    faces = (top - radius) / np.cos(rake) + (right - radius) / np.cos(clearance)
    # The edge's quarter circle, and the little that the face's foot is off the circle's middle.
    assert warm.surface() == pytest.approx(faces + radius * np.pi / 2, rel=0.02)


def test_a_thin_warm_block_cools_as_a_lump():
    """T − T₀ falls as exp(−t/τ), τ = ρcA/(hP): the inside is even, hL/k = 0.006."""
    side, convection, duration = 100e-6, 1e4, 1e-3
    loss = EVERYWHERE._replace(convection=convection)
    tau = STORE * side / (4 * convection)
    exact = 293.15 + (1000.0 - 293.15) * exp(-duration / tau)
    coarse, fine = (
        (WarmBlock((side, side), cell).cool(loss, duration) - exact) / (1000.0 - exact)
        for cell in (10e-6, 5e-6)
    )
    # The corners are rounded over a cell or so: the error of the length, and it goes with the cell.
    assert 0 < coarse < 0.05
    assert fine < 0.6 * coarse


def test_radiation_into_the_cold_follows_its_closed_solution():
    """T = (T₀⁻³ + 3εσPt/(ρcA))^(−1/3) towards surroundings at 1 K."""
    side, duration, start = 200e-6, 4e-3, 1500.0
    emissivity = 40.0  # more than there is, for less time
    loss = EVERYWHERE._replace(emissivity=emissivity, ambient=1.0)
    end = WarmBlock((side, side), 10e-6, start).cool(loss, duration)
    growth = 3 * emissivity * Stefan_Boltzmann * 4 / (side * STORE)
    exact = (start**-3 + growth * duration) ** (-1 / 3)
    assert start - exact > 150.0
    # The surface is a little colder than the mean, and the corners are rounded.
    assert start - end == pytest.approx(start - exact, rel=0.03)


def test_what_is_lost_is_missing():
    geometry = ToolGeometry()
    warm = WarmBlock((100e-6, 100e-6), 10e-6, tool=geometry.surface)
    warm.block.points["x"] -= 110e-6
    loss = EVERYWHERE._replace(convection=1e5, emissivity=0.8)
    before = warm.heat()
    lost = sum(warm.step(loss, 1e-6) for _ in range(20))
    assert lost > 0
    assert before - warm.heat() == pytest.approx(lost, rel=1e-9)
    cooled = warm.tool_temperature < 600.0
    # Only the tool's skin is cooled directly, as it does not conduct here.
    assert cooled.any()
    assert not cooled[warm.fraction == 0].any()


def test_only_the_window_loses_heat():
    warm = WarmBlock((100e-6, 100e-6), 10e-6)
    loss = EVERYWHERE._replace(convection=1e5, left=30e-6, right=70e-6, bottom=50e-6)
    lost = warm.step(loss, 1e-6)
    # Of the upper face, 40 µm of 100.
    assert lost == pytest.approx(1e5 * (1000.0 - 293.15) * 40e-6 * 1e-6, rel=0.03)


def short_cut(surroundings):
    simulation = CuttingSimulation(
        CuttingConditions(cutting_length=0.06e-3),
        numerics=Numerics(cell=30e-6),
        surroundings=surroundings,
    )
    raster = Raster(-100e-6, 100e-6, 10e-6, 20, 20)
    window = OutputWindow(start=0.05e-3, end=0.06e-3, interval=1e-6, later_bands=0)
    frames = []
    history = simulation.run(window, raster, frames.append)
    return history.energy.lost_heat, frames[-1].temperature


def test_a_cut_loses_heat_if_asked_to():
    none, still = short_cut(Surroundings())
    some, cooled = short_cut(Surroundings(convection=1e6, emissivity=0.9, temperature=250.0))
    assert not none.any()
    assert (np.diff(some) > 0).all()
    # All of the workpiece's upper face and the cut surface cool from 293 K.
    least = 1e6 * 43.0 * 1e-3 * 14.4e-6
    assert 0.5 * least < some[-1] < 5 * least
    assert np.nanmin(cooled) < np.nanmin(still) - 1.0


def test_a_study_names_the_surroundings():
    section = {"convection": "50 W/m^2/K", "emissivity": 0.8, "temperature": "25 degC"}
    study = Study(**{"cutting": {"surroundings": section}})
    assert study.cutting.simulation().surroundings == Surroundings(50.0, 0.8, 298.15)
    assert Study().cutting.simulation().surroundings == Surroundings()
