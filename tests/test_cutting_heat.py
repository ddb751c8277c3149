"""Heat of the cutting simulation: conduction, the contact, and their balance."""

from math import pi, sqrt

import numpy as np
import pytest
from cases.heat import CAPACITY, CONDUCTIVITY, DIFFUSIVITY, constant_properties
from solver import DENSITY, Block

from chipglow.cutting import AISI_1045, CARBIDE
from chipglow.cutting.heat import (
    SMALLEST_FRACTION,
    ToolHeat,
    conduct,
    conduct_tool,
    heat_contact,
    return_heat,
    tool_fraction,
)
from chipglow.cutting.points import Grid
from chipglow.scene import ToolGeometry


def test_conduction_keeps_heat_whatever_the_shape():
    generator = np.random.default_rng(1)
    block = Block((100e-6, 80e-6))
    keep = generator.random(block.count) < 0.6
    block.points, block.count = block.points[keep], int(keep.sum())
    block.points["temperature"] = generator.uniform(293.0, 1200.0, block.count)
    conductivity, capacity = constant_properties()
    before, spread = block.points["temperature"].sum(), block.points["temperature"].std()
    block.conduct(1e-4, 200, conductivity, capacity)
    assert block.points["temperature"].sum() == pytest.approx(before, rel=1e-12)
    assert block.points["temperature"].std() < 0.9 * spread


def evened(block, fraction):
    shape = (block.grid.columns, block.grid.rows)
    nodes, increment = np.zeros((*shape, 3)), np.zeros(shape)
    conductivity, capacity = constant_properties()
    for part in (0.0, fraction):  # the slopes first
        conduct(
            block.points, block.count, nodes, increment, conductivity, capacity,
            block.step.heat_mass, block.grid, 0.0, part,
        )  # fmt: skip
    return block.points["temperature"]


def test_evening_out_keeps_heat_whatever_the_shape():
    generator = np.random.default_rng(2)
    block = Block((100e-6, 80e-6))
    keep = generator.random(block.count) < 0.6
    block.points, block.count = block.points[keep], int(keep.sum())
    block.points["temperature"] = generator.uniform(293.0, 1200.0, block.count)
    before = block.points["temperature"].copy()
    after = evened(block, 0.5)
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12)
    assert after.std() < 0.8 * before.std()


def test_evening_out_takes_the_noise_and_leaves_a_smooth_field():
    block = Block((200e-6, 200e-6))
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
    assert left == pytest.approx(0.75 * noise[inside], abs=0.01)


def test_a_cold_point_is_not_cooled_with_the_hot_ones_around_it():
    block = Block((100e-6, 100e-6))
    middle = np.argmin(np.hypot(block.points["x"] - 50e-6, block.points["y"] - 50e-6))
    block.points["temperature"] = 1293.0 - 18e6 * np.abs(block.points["y"] - 50e-6)
    block.points["temperature"][middle] = 350.0
    conductivity, capacity = constant_properties()
    coldest = []
    for _ in range(10):
        block.conduct(4e-6, 20, conductivity, capacity)
        coldest.append(block.points["temperature"][middle])
    # Its own heat cannot flow away: everything around it is hotter.
    assert min(coldest) > 350.0


def test_tool_conducts_as_a_half_space_and_keeps_its_heat():
    grid = Grid(-50e-6, -50e-6, 5e-6, 150, 120)
    tool = ToolGeometry(rake_angle=0.0).surface._replace(x=-20e-6, y=-1.0)
    fraction = tool_fraction(grid, tool)
    # The face x = -40 um lies in the middle between two nodes.
    x = grid.left + grid.cell * np.arange(grid.columns) + 40e-6
    heat = ToolHeat(CARBIDE.density * CARBIDE.heat_capacity, CARBIDE.conductivity, 0.5, 0.0, 1.0)
    diffusivity, start, duration = heat.conductivity / heat.capacity, 40e-6, 40e-6
    temperature = np.repeat(
        (293.0 + 300.0 * np.exp(-(x**2) / (4 * diffusivity * start)))[:, None], grid.rows, axis=1
    )
    store = heat.capacity * np.where(fraction > 0, np.maximum(fraction, SMALLEST_FRACTION), 0)
    before = (store * temperature).sum()
    steps = round(duration / (0.1 * grid.cell**2 / diffusivity))
    for _ in range(steps):
        conduct_tool(temperature, fraction, heat, grid, duration / steps)
    assert (store * temperature).sum() == pytest.approx(before, rel=1e-12)
    exact = 293.0 + 300.0 * sqrt(start / (start + duration)) * np.exp(
        -(x**2) / (4 * diffusivity * (start + duration))
    )
    inside = (x > 0) & (x < 500e-6)
    # The face lies on a node here: its half cell stores and conducts half, which is second order.
    assert np.abs(temperature[inside, 60] - exact[inside]).max() < 2.0


def test_contact_shares_friction_heat_and_loses_none():
    geometry = ToolGeometry()
    block = Block((60e-6, 60e-6))
    block.points["x"] -= 62e-6
    block.points["y"] += 30e-6
    block.points["temperature"] = 900.0
    distance = geometry.signed_distance(block.points["x"], block.points["y"])
    touching = distance < 4e-6
    assert touching.sum() > 3
    block.points["contact_time"][touching] = 1e-7
    capacity = np.full(AISI_1045.heat_capacity.sampled().size, 520.0)
    conductivity = AISI_1045.conductivity.sampled()
    shape = (block.grid.columns, block.grid.rows)
    fraction = tool_fraction(block.grid, geometry.surface)
    temperature = np.full(shape, 293.0)
    heat = ToolHeat(CARBIDE.density * CARBIDE.heat_capacity, CARBIDE.conductivity, 0.4, 1e7, 5e-6)
    nodes, increment, friction = np.zeros((*shape, 3)), np.zeros(shape), np.zeros(shape)
    conduct(
        block.points, block.count, nodes, increment, conductivity, capacity,
        block.step.heat_mass, block.grid, 0.0, 0.0,
    )  # fmt: skip
    near = (nodes[..., 0] > 0.3 * nodes[..., 0].max()) & (fraction > 0.2)
    friction[near] = 1e-3
    work = friction.sum()
    store = heat.capacity * block.grid.cell**2 * np.maximum(fraction, SMALLEST_FRACTION)

    def heat_of_all():
        chip = block.step.heat_mass * 520.0 * block.points["temperature"].sum()
        return chip + (store * (temperature - 293.0)).sum()

    before = heat_of_all()
    heat_contact(
        block.points, block.count, friction, np.zeros(shape),
        np.zeros((*shape, 2)), increment, nodes, temperature,
        fraction, geometry.surface, heat, capacity, block.step.heat_mass, block.grid,
    )  # fmt: skip
    return_heat(block.points, block.count, increment, block.grid)
    assert work > 0
    assert heat_of_all() - before == pytest.approx(work, rel=1e-9)
    assert not friction.any()
    assert not block.points["contact_time"].any()
    # The chip was hotter: beside its part of the friction heat the tool took some by contact.
    assert (store * (temperature - 293.0)).sum() > 0.4 * work


def test_friction_heats_chip_and_tool_as_half_spaces_in_contact():
    geometry = ToolGeometry(rake_angle=0.0)
    cell, duration, flux = 10e-6, 40e-6, 4e8
    block = Block((200e-6, 200e-6), cell=cell, margin=30)
    block.points["x"] -= 200e-6 - 3e-6
    block.points["y"] += 60e-6
    tool = geometry.surface._replace(x=geometry.surface.x + 3e-6)
    shape = (block.grid.columns, block.grid.rows)
    fraction, temperature = tool_fraction(block.grid, tool), np.full(shape, 293.0)
    nodes, increment, friction = np.zeros((*shape, 3)), np.zeros(shape), np.zeros(shape)
    effusivity = sqrt(CONDUCTIVITY * DENSITY * CAPACITY)
    to_tool = CARBIDE.effusivity / (CARBIDE.effusivity + effusivity)
    store = CARBIDE.density * CARBIDE.heat_capacity
    heat = ToolHeat(store, CARBIDE.conductivity, to_tool, 1e7, block.spacing)
    conductivity, capacity = constant_properties()
    touching = block.points["x"] > 3e-6 - 0.6 * block.spacing
    steps = 200
    for _ in range(steps):
        conduct(
            block.points, block.count, nodes, increment, conductivity, capacity,
            block.step.heat_mass, block.grid, duration / steps,
            DIFFUSIVITY * duration / steps / cell**2,
        )  # fmt: skip
        conduct_tool(temperature, fraction, heat, block.grid, duration / steps)
        block.points["contact_time"][touching] = duration / steps
        column = round((3e-6 - block.grid.left) / cell) - 1
        rows = block.grid.bottom + cell * np.arange(block.grid.rows)
        friction[column, (rows > 60e-6) & (rows < 260e-6)] = flux * cell * duration / steps
        heat_contact(
            block.points, block.count, friction, np.zeros(shape),
        np.zeros((*shape, 2)), increment, nodes, temperature,
            fraction, tool, heat, capacity, block.step.heat_mass, block.grid,
        )  # fmt: skip
        return_heat(block.points, block.count, increment, block.grid)
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
    assert temperature[node, row] - 293 == pytest.approx(of_tool, rel=0.03)
