"""The tool after a long cut: conduction to the holder, and the rounds that lead there."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest

from chipglow.cutting import (
    CARBIDE,
    CuttingConditions,
    CuttingSimulation,
    Numerics,
    OutputWindow,
    ToolBody,
)
from chipglow.cutting.heat import ToolHeat, tool_fraction
from chipglow.cutting.points import Grid
from chipglow.cutting.steady_tool import SteadyTool, steady_temperature
from chipglow.scene import Raster, ToolGeometry

HEAT = 40e3
CELL = 20e-6
BODY = ToolBody()


def wedge(rake, cell=CELL, body=BODY):
    """Distance from the edge and temperature of the nodes within a tool heated at its edge."""
    margin = 4 * cell
    columns, rows = (round((size + 2 * margin) / cell) + 1 for size in (1.3e-3, 1.55e-3))
    grid = Grid(-0.75e-3 - margin, -0.35e-3 - margin, cell, columns, rows)
    fraction = tool_fraction(grid, ToolGeometry(radians(rake)).surface)
    x = grid.left + cell * np.arange(columns)[:, None]
    y = grid.bottom + cell * np.arange(rows)[None, :]
    distance = np.hypot(x, y)
    heat = np.where(distance < 60e-6, fraction, 0.0)
    heat *= HEAT / heat.sum()
    conduction = ToolHeat(CARBIDE.density * CARBIDE.heat_capacity, CARBIDE.conductivity, 0, 0, 0)
    temperature = steady_temperature(grid, fraction, conduction, body, heat, 0 * heat)
    return grid, fraction, distance, temperature


@pytest.mark.parametrize("rake", [-7.0, 5.0])
@pytest.mark.parametrize("r", [0.15e-3, 0.3e-3, 0.5e-3, 0.8e-3])
def test_heat_at_the_edge_of_a_wedge_follows_the_closed_form(rake, r):
    _, fraction, distance, temperature = wedge(rake)
    at = (np.abs(distance - r) < CELL) & (fraction > 0.99)
    angle = pi / 2 - radians(rake) - radians(7.0)
    # Q / (k theta) integral of w / (r (w + r)) from r to the holder, written out.
    width, holder = 3e-3, 10e-3
    fine = np.geomspace(r, holder, 20_001)
    integral = np.trapezoid(width / (fine * (width + fine)), fine)
    expected = HEAT / (CARBIDE.conductivity * angle) * integral
    # The region's square border takes the heat as if it flowed from the edge: 1.5 %.
    assert temperature[at].mean() - 293.15 == pytest.approx(expected, rel=0.015)


def test_a_hotter_holder_and_a_narrow_cut_shift_as_they_should():
    _, fraction, _, usual = wedge(-7.0)
    _, _, _, hot = wedge(-7.0, body=replace(BODY, holder_temperature=393.15))
    _, _, _, narrow = wedge(-7.0, body=replace(BODY, width=1e-3))
    tool = fraction > 0
    # Rounding of a linear solution.
    assert hot[tool] - usual[tool] == pytest.approx(100.0, abs=1e-9)
    # Heat per width: a narrow cut spreads sideways sooner.
    assert (narrow[tool] < usual[tool]).all()


def test_the_field_is_taken_over_to_a_finer_grid():
    grid, fraction, _, temperature = wedge(-7.0)
    steady = SteadyTool(grid, fraction, temperature, ())
    fine, of_fine, distance, expected = wedge(-7.0, cell=10e-6)
    taken = steady.on(fine, of_fine)
    tool = (of_fine > 0.99) & (distance > 0.15e-3)
    # Between nodes of twice the spacing: 0.4 % measured.
    assert np.abs(taken[tool] / expected[tool] - 1).max() < 0.01


@pytest.fixture(scope="module")
def cold():
    # Cells of 40 um and a small region, for time: the contact is some 6 cells long.
    return CuttingSimulation(
        conditions=CuttingConditions(feed=0.15e-3, cutting_length=0.3e-3),
        numerics=Numerics(40e-6, upstream=0.32e-3, downstream=0.36e-3, height=0.48e-3),
    )


@pytest.mark.slow
def test_a_long_cut_settles_and_the_next_one_begins_warm(cold):
    simulation = replace(cold, tool_temperature=BODY)
    steady = simulation.steady_tool()
    assert np.ptp(steady.rounds[-3:]) < 1.0  # in K: the stated tolerance
    hottest = steady.temperature.max()
    assert 800.0 < hottest < 1733.0
    window = OutputWindow(0.1e-3, 0.3e-3, 10e-6, later_bands=0)
    raster = Raster(-0.3e-3, 0.3e-3, 20e-6, 20, 20)
    frames = []
    simulation.run(window, raster, frames.append)
    cool = []
    cold.run(window, raster, cool.append)
    x, y = np.meshgrid(raster.x, raster.y)
    inside = simulation.tool.signed_distance(x, y) < -40e-6
    assert frames[0].temperature[inside].mean() > cool[0].temperature[inside].mean() + 200.0


def test_a_tool_of_a_given_temperature_begins_with_it(cold):
    simulation = replace(cold, tool_temperature=573.15)
    frames = []
    raster = Raster(-0.1e-3, 0.3e-3, 20e-6, 16, 20)
    window = OutputWindow(0.01e-3, 0.02e-3, 2e-6, later_bands=0)
    simulation.run(window, raster, frames.append)
    x, y = np.meshgrid(raster.x, raster.y)
    inside = simulation.tool.signed_distance(x, y) < -150e-6
    assert inside.sum() > 10
    assert frames[0].temperature[inside] == pytest.approx(573.15, abs=1e-4)  # float32 of 573 K


def test_without_a_body_no_tool_is_steady(cold):
    with pytest.raises(ValueError, match="tool_temperature: None, expected the body"):
        cold.steady_tool()
