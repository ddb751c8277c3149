"""Heat of the cutting simulation: conduction, the contact, losses, and their balance."""

from math import exp, pi, radians, sqrt

import numpy as np
import pytest
from cases.heat import CAPACITY, CONDUCTIVITY, DIFFUSIVITY, constant_properties
from scipy.constants import Stefan_Boltzmann
from solver import DENSITY, Block
from test_cutting_solver import short_cut
from tolerances import DOUBLE

from chipglow.cutting import CARBIDE, Surroundings
from chipglow.cutting.heat import (
    SMALLEST_FRACTION,
    HeatLoss,
    ToolHeat,
    conduct,
    conduct_tool,
    free_surface,
    heat_contact,
    lose_heat,
    return_heat,
    tool_fraction,
)
from chipglow.scene import ToolGeometry
from chipglow.study import Study

EVERYWHERE = HeatLoss(0.0, 0.0, 293.15, -1.0, 1.0, -1.0, 1.0)
TOOL_HEAT = ToolHeat(CARBIDE.density * CARBIDE.heat_capacity, CARBIDE.conductivity, 0.5, 0.0, 1.0)
STORE = DENSITY * CAPACITY


class WarmBlock(Block):
    """A block with constant heat properties, a tool, and the arrays of their heat."""

    def __init__(self, size, cell=10e-6, temperature=1000.0, tool=None, heat=TOOL_HEAT, **options):
        super().__init__(size, cell=cell, **options)
        self.points["temperature"] = temperature
        shape = (self.grid.columns, self.grid.rows)
        self.heat_nodes, self.increment = np.zeros((*shape, 3)), np.zeros(shape)
        self.outline, self.tool_heat = tool, heat
        self.fraction = tool_fraction(self.grid, tool) if tool else np.zeros(shape)
        self.tool_temperature, self.friction = np.full(shape, 600.0), np.zeros(shape)

    def thinned(self, seed):
        """Leave out two points of five, and make the others unevenly warm."""
        generator = np.random.default_rng(seed)
        keep = generator.random(self.count) < 0.6
        self.points, self.count = self.points[keep], int(keep.sum())
        self.points["temperature"] = generator.uniform(293.0, 1200.0, self.count)
        return self

    def conduct_once(self, duration, part=0.0):
        conduct(
            self.points, self.count, self.heat_nodes, self.increment, *constant_properties(),
            self.step.heat_mass, self.grid, duration, part,
        )  # fmt: skip

    def contact(self):
        entered = np.zeros((*self.friction.shape, 2))
        heat_contact(
            self.points, self.count, self.friction, entered, self.increment, self.heat_nodes,
            self.tool_temperature, self.fraction, self.outline, self.tool_heat,
            constant_properties()[1], self.step.heat_mass, self.grid,
        )  # fmt: skip
        return_heat(self.points, self.count, self.increment, self.grid)

    def lose(self, loss, duration):
        self.conduct_once(duration)
        lost = lose_heat(
            self.heat_nodes, self.increment, self.tool_temperature, self.fraction, self.tool_heat,
            loss, self.grid, duration,
        )  # fmt: skip
        return_heat(self.points, self.count, self.increment, self.grid)
        return lost

    def cool(self, loss, duration):
        """Cool for a while; the mean temperature after it."""
        steps = round(duration / (0.15 * self.cell**2 / DIFFUSIVITY))
        for _ in range(steps):
            self.lose(loss, duration / steps)
        return self.points["temperature"].mean()

    def heat_of_tool(self):
        """Heat over 0 K in J/m."""
        store = self.tool_heat.capacity * self.cell**2
        filled = np.maximum(self.fraction, SMALLEST_FRACTION)
        return store * (filled * self.tool_temperature)[self.fraction > 0].sum()

    def held(self):
        """Heat over 0 K of block and tool in J/m."""
        chip = self.step.heat_mass * CAPACITY * self.points["temperature"].sum()
        return chip + self.heat_of_tool()

    def surface(self, left=-1.0, right=1.0, bottom=-1.0, top=1.0):
        """Length of the free surface in m, of cells within limits."""
        grid = self.grid
        self.lose(EVERYWHERE, 0.0)
        x = grid.left + grid.cell * (np.arange(grid.columns - 1) + 0.5)
        y = grid.bottom + grid.cell * (np.arange(grid.rows - 1) + 0.5)
        return sum(
            free_surface(self.heat_nodes, self.fraction, grid, i, j)
            for i in np.flatnonzero((x > left) & (x < right))
            for j in np.flatnonzero((y > bottom) & (y < top))
        )


def evened(block, fraction):
    for part in (0.0, fraction):  # the slopes first
        block.conduct_once(0.0, part)
    return block.points["temperature"]


def conducted(block):
    block.conduct(1e-4, 200, *constant_properties())
    return block.points["temperature"]


@pytest.mark.parametrize(
    ("change", "left"), [(conducted, 0.9), (lambda block: evened(block, 0.5), 0.8)]
)
def test_conduction_and_evening_out_keep_heat_whatever_the_shape(change, left):
    block = WarmBlock((100e-6, 80e-6)).thinned(1)
    before = block.points["temperature"].copy()
    after = change(block)
    assert after.sum() == pytest.approx(before.sum(), rel=DOUBLE)
    assert after.std() < left * before.std()


def test_evening_out_takes_the_noise_and_leaves_a_smooth_field():
    block = WarmBlock((200e-6, 200e-6))
    x, y = block.points["x"], block.points["y"]
    inside = (np.abs(x - 100e-6) < 50e-6) & (np.abs(y - 100e-6) < 50e-6)
    smooth = 600.0 + 2e6 * x + 1e6 * y + 2e10 * (x - 100e-6) * (y - 50e-6) + 1e10 * x**2
    noise = np.where((np.rint(x / block.spacing - 0.5) % 2) == 0, 40.0, -40.0)
    block.points["temperature"] = smooth
    # No rounding is left of a quadratic, nor is anything taken: the residue is a fourth derivative.
    assert np.abs(evened(block, 0.25) - smooth)[inside].max() < 1e-9
    block.points["temperature"] = smooth + noise
    # The grid sees nothing of what alternates from point to point: all of that is taken, but
    # for the slopes that it makes at the border, which fade inward.
    left = (evened(block, 0.25) - smooth)[inside]
    # In K: those slopes, of the 30 K that are left.
    assert left == pytest.approx(0.75 * noise[inside], abs=0.01)


def test_a_cold_point_is_not_cooled_with_the_hot_ones_around_it():
    block = WarmBlock((100e-6, 100e-6))
    middle = np.argmin(np.hypot(block.points["x"] - 50e-6, block.points["y"] - 50e-6))
    block.points["temperature"] = 1293.0 - 18e6 * np.abs(block.points["y"] - 50e-6)
    block.points["temperature"][middle] = 350.0
    coldest = []
    for _ in range(10):
        block.conduct(4e-6, 20, *constant_properties())
        coldest.append(block.points["temperature"][middle])
    # Its own heat cannot flow away: everything around it is hotter.
    assert min(coldest) > 350.0


def test_contact_shares_friction_heat_and_loses_none():
    tool = ToolGeometry()
    heat = TOOL_HEAT._replace(friction_fraction=0.4, conductance=1e7, area=5e-6)
    block = WarmBlock((60e-6, 60e-6), temperature=900.0, tool=tool.surface, heat=heat)
    block.tool_temperature[:] = 293.0
    block.points["x"] -= 62e-6
    block.points["y"] += 30e-6
    touching = tool.signed_distance(block.points["x"], block.points["y"]) < 4e-6
    assert touching.sum() > 3
    block.points["contact_time"][touching] = 1e-7
    block.conduct_once(0.0)
    chip = block.heat_nodes[..., 0]
    block.friction[(chip > 0.3 * chip.max()) & (block.fraction > 0.2)] = 1e-3
    work, before, of_tool = block.friction.sum(), block.held(), block.heat_of_tool()
    block.contact()
    assert work > 0
    # Energy is conserved; a change of the sum is rounded by 1e-16 of the whole.
    assert block.held() - before == pytest.approx(work, rel=1e-8)
    assert not block.friction.any()
    assert not block.points["contact_time"].any()
    # The chip was hotter: beside its part of the friction heat the tool took some by contact.
    assert block.heat_of_tool() - of_tool > 0.4 * work


def test_friction_heats_chip_and_tool_as_half_spaces_in_contact():
    geometry = ToolGeometry(rake_angle=0.0)
    cell, duration, flux = 10e-6, 40e-6, 4e8
    effusivity = sqrt(CONDUCTIVITY * DENSITY * CAPACITY)
    to_tool = CARBIDE.effusivity / (CARBIDE.effusivity + effusivity)
    heat = TOOL_HEAT._replace(friction_fraction=to_tool, conductance=1e7, area=cell / 2)
    tool = geometry.surface._replace(x=geometry.surface.x + 3e-6)
    block = WarmBlock((200e-6, 200e-6), cell, 293.0, tool, heat, margin=30)
    block.tool_temperature[:] = 293.0
    block.points["x"] -= 200e-6 - 3e-6
    block.points["y"] += 60e-6
    touching = block.points["x"] > 3e-6 - 0.6 * block.spacing
    column = round((3e-6 - block.grid.left) / cell) - 1
    rows = block.grid.bottom + cell * np.arange(block.grid.rows)
    steps = 200
    step = duration / steps
    for _ in range(steps):
        block.conduct_once(step, DIFFUSIVITY * step / cell**2)
        conduct_tool(block.tool_temperature, block.fraction, heat, block.grid, step)
        block.points["contact_time"][touching] = step
        block.friction[column, (rows > 60e-6) & (rows < 260e-6)] = flux * cell * step
        block.contact()
    # Both surfaces rise alike; away from it by the conduction of each side (Carslaw, Jaeger 2.9).
    rise = 2 * flux * (1 - to_tool) * sqrt(duration / pi) / effusivity
    middle = touching & (np.abs(block.points["y"] - 160e-6) < 30e-6)
    depth = block.spacing / 2
    at_points = rise - flux * (1 - to_tool) * depth / CONDUCTIVITY
    # The chip's side is second order; the tool's fraction of a node is first: 2 % at this cell.
    assert block.points["temperature"][middle].mean() - 293 == pytest.approx(at_points, rel=0.03)
    node = round((3e-6 - block.grid.left) / cell) + 1
    inside = block.grid.left + node * cell - 3e-6
    of_tool = rise - flux * to_tool * inside / CARBIDE.conductivity
    row = round((160e-6 - block.grid.bottom) / cell)
    # The tool's fraction: 2.4 % measured.
    assert block.tool_temperature[node, row] - 293 == pytest.approx(of_tool, rel=0.03)


def turned(size, cell, angle):
    """A rectangle of points turned by an angle, off the nodes of the grid."""
    warm = WarmBlock(size, cell)
    points = warm.points
    x, y = points["x"] - size[0] / 2, points["y"] - size[1] / 2
    points["x"] = np.cos(angle) * x - np.sin(angle) * y + size[0] / 2 + 0.3 * cell
    points["y"] = np.sin(angle) * x + np.cos(angle) * y + size[1] / 2 - 0.2 * cell
    return warm


# Lattice and grid in line or not: from -1.1 % to 0.8 %; the rounded corners take 0.5 % of it.
# Points that are scattered by 0.4 of their spacing make a filled fraction of 1 ± 0.06 inside.
@pytest.mark.parametrize(
    ("degrees", "scatter", "off"),
    [*((degrees, 0.0, 0.015) for degrees in (0.0, 10.0, 20.0, 30.0, 45.0)), (17.2, 2e-6, 0.02)],
)
def test_surface_of_a_rectangle_at_any_angle_and_of_uneven_filling(degrees, scatter, off):
    warm = turned((300e-6, 200e-6), 10e-6, radians(degrees))
    moved = np.random.default_rng(1).uniform(-scatter, scatter, (2, warm.count))
    warm.points["x"] += moved[0]
    warm.points["y"] += moved[1]
    assert warm.surface() == pytest.approx(1e-3, rel=off)


@pytest.mark.parametrize("gap", [0.0, 1e-6])
def test_contact_with_the_tool_is_no_free_surface(gap):
    upright = ToolGeometry(rake_angle=0.0)
    tool = upright.surface._replace(x=200e-6 + upright.edge_radius, y=-1.0)
    warm = WarmBlock((200e-6, 200e-6), 10e-6, tool=tool)
    warm.points["x"] -= gap
    warm.points["y"] += 3e-6
    free = warm.surface(right=150e-6)
    # Left, and both ends up to where it is cut off; the tool's own face is free over and under.
    assert free == pytest.approx(200e-6 + 2 * 150e-6, rel=0.02)
    middle = warm.surface(160e-6, 1.0, 40e-6, 160e-6)
    # Of 120 µm of contact, which would count twice.
    assert middle < 1e-6


def test_faces_of_the_tool():
    geometry = ToolGeometry()
    warm = WarmBlock((400e-6, 400e-6), 10e-6, tool=geometry.surface)
    warm.points["x"] -= 1.0
    warm.count = 0
    grid = warm.grid
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
    warm.points["x"] -= 110e-6
    loss = EVERYWHERE._replace(convection=1e5, emissivity=0.8)
    before = warm.held()
    lost = sum(warm.lose(loss, 1e-6) for _ in range(20))
    assert lost > 0
    # Energy is conserved; a change of the sum is rounded by 1e-16 of the whole.
    assert before - warm.held() == pytest.approx(lost, rel=1e-9)
    cooled = warm.tool_temperature < 600.0
    # Only the tool's skin is cooled directly, as it does not conduct here.
    assert cooled.any()
    assert not cooled[warm.fraction == 0].any()


def test_only_the_window_loses_heat():
    warm = WarmBlock((100e-6, 100e-6), 10e-6)
    loss = EVERYWHERE._replace(convection=1e5, left=30e-6, right=70e-6, bottom=50e-6)
    lost = warm.lose(loss, 1e-6)
    # Of the upper face, 40 µm of 100.
    assert lost == pytest.approx(1e5 * (1000.0 - 293.15) * 40e-6 * 1e-6, rel=0.03)


def test_a_cut_loses_heat_if_asked_to():
    losses = Surroundings(), Surroundings(convection=1e6, emissivity=0.9, temperature=250.0)
    (one, still), (other, cooled) = (short_cut(0.06e-3, surroundings=each) for each in losses)
    none, some = one.energy.lost_heat, other.energy.lost_heat
    assert not none.any()
    assert (np.diff(some) > 0).all()
    # All of the workpiece's upper face and the cut surface cool from 293 K.
    least = 1e6 * 43.0 * 1e-3 * 14.4e-6
    assert 0.5 * least < some[-1] < 5 * least
    assert cooled[-1].temperature.min() < still[-1].temperature.min() - 1.0


def test_a_study_names_the_surroundings():
    section = {"convection": "50 W/m^2/K", "emissivity": 0.8, "temperature": "25 degC"}
    study = Study(**{"cutting": {"surroundings": section}})
    assert study.cutting.simulation().surroundings == Surroundings(50.0, 0.8, 298.15)
    assert Study().cutting.simulation().surroundings == Surroundings()
