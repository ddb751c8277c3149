"""From points to a raster: linear fields, straight surfaces, the tool beside the chip."""

import numpy as np
import pytest

from chipglow.cutting.heat import tool_fraction
from chipglow.cutting.picture import Picture, lattice_of
from chipglow.cutting.points import Grid, block_of_points
from chipglow.scene import Material, Raster, ToolGeometry

CELL = 10e-6
GRID = Grid(-300e-6, -200e-6, CELL, 60, 60)
RASTER = Raster(-150e-6, 200e-6, 1e-6, 300, 250)
AWAY = ToolGeometry()
X, Y = np.meshgrid(RASTER.x, RASTER.y)
DEPTH = AWAY.signed_distance(X, Y)


def lattice(angle=0.0, spacing=CELL / 2, top=100e-6):
    """Points under a straight surface through (0, top), turned by an angle."""
    along = spacing * (np.arange(-200, 200) + 0.5)
    down = -spacing * (np.arange(0, 120) + 0.5)
    points = block_of_points(along, down, spacing, 300.0, 0.0)
    x, y = points["x"].copy(), points["y"].copy()
    points["x"] = np.cos(angle) * x - np.sin(angle) * y
    points["y"] = np.sin(angle) * x + np.cos(angle) * y + top
    inside = (np.abs(points["x"]) < 270e-6) & (np.abs(points["y"]) < 170e-6)
    return points[inside]


def frame_of(points, tool=AWAY, **fields):
    fraction = tool_fraction(GRID, tool.surface)
    picture = Picture(GRID, lattice_of(GRID, RASTER, tool, 293.0), fraction)
    names = ["temperature", "plastic_strain", "plastic_strain_rate", "velocity_x", "velocity_y"]
    values = {name: np.zeros(points.size) for name in [*names, "material_x", "material_y"]}
    values["temperature"] = np.full(points.size, 300.0)
    values.update(fields)
    tool_temperature = 400.0 + 1e6 * (GRID.left + CELL * np.arange(GRID.columns))[:, None]
    tool_temperature = np.repeat(tool_temperature, GRID.rows, axis=1)
    return picture.frame(1e-6, points, values, tool_temperature)


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0, 70.0])
def test_a_straight_free_surface_is_straight_and_in_its_place(degrees):
    angle = np.radians(degrees)
    points = lattice(angle)
    material = frame_of(points).material
    height = np.cos(angle) * (Y - 100e-6) - np.sin(angle) * X
    clear = (DEPTH > 30e-6) & (np.abs(X) < 110e-6) & (Y > -60e-6)
    # Sub-pixel of the camera (6 um): half a micrometre of a 10 um cell, half a sample.
    assert (material[clear & (height < -0.7e-6)] == Material.WORKPIECE).all()
    assert (material[clear & (height > 0.7e-6)] == Material.VOID).all()


def test_linear_fields_are_drawn_exactly_inside():
    points = lattice(0.3)
    field = 600.0 + 5e5 * points["x"] - 3e5 * points["y"]
    frame = frame_of(points, temperature=field, material_x=points["x"])
    height = np.cos(0.3) * (Y - 100e-6) - np.sin(0.3) * X
    inside = (height < -35e-6) & (np.abs(X) < 110e-6) & (DEPTH > 0)
    exact = 600.0 + 5e5 * X - 3e5 * Y
    # Weighted means of points that lie unevenly: what two corrections leave is 0.2 K of 5 K a cell.
    assert np.abs(frame.temperature - exact)[inside].max() < 0.2
    edge = (height < -1e-6) & (np.abs(X) < 110e-6) & (DEPTH > 0)
    # On the surface the fit is one-sided: less than the change over a third of a cell.
    assert np.abs(frame.temperature - exact)[edge].max() < 2.0


def test_no_gap_between_chip_and_tool_and_the_tool_shows_its_own_temperature():
    points = lattice(0.0, top=150e-6)
    outside = AWAY.signed_distance(points["x"], points["y"]) > 0
    frame = frame_of(points[outside])
    tool = DEPTH < 0
    assert (frame.material[tool] == Material.TOOL).all()
    beside = (DEPTH > 0) & (Y > -50e-6) & (Y < 120e-6) & (X > -110e-6)
    assert (frame.material[beside] == Material.WORKPIECE).all()
    deep = DEPTH < -15e-6
    # Float32 of 500 K, several times: 6e-5 K measured.
    assert frame.temperature[deep] == pytest.approx(400.0 + 1e6 * X[deep], abs=2e-4)


def test_steps_do_not_overshoot():
    points = lattice()
    field = np.where(points["x"] < 0, 300.0, 1300.0)
    frame = frame_of(points, temperature=field, plastic_strain=1e-3 * field)
    chip = frame.material == Material.WORKPIECE
    assert frame.temperature[chip].min() >= 300.0
    assert frame.temperature[chip].max() <= 1300.0  # the larger of both values


@pytest.mark.parametrize("degrees", [-20.0, -7.0, 0.0, 6.0, 15.0])
def test_a_bare_tool_face_shows_no_chip(degrees):
    tool = ToolGeometry(rake_angle=np.radians(degrees))
    frame = frame_of(lattice(top=-20e-6), tool)
    above = RASTER.y > 20e-6
    assert (frame.material[above] == Material.TOOL).any()
    assert not (frame.material[above] == Material.WORKPIECE).any()
