"""The contract of a scene, its raster, and the tool's outline."""

import re
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from chipglow.scene import FIELD_UNITS, Raster, Scene, SceneError, ToolGeometry

RASTER = Raster(left=-6e-6, top=4e-6, spacing=2e-6, rows=4, columns=5)
TIMES = np.array([0.0, 0.2e-6, 0.4e-6])


def fields(**changed):
    shape = (len(TIMES), *RASTER.shape)
    values = {name: np.zeros(shape, dtype=np.float32) for name in FIELD_UNITS}
    values["temperature"] += 300.0
    values["material"] = np.ones(shape, dtype=np.uint8)
    return {**values, **changed}


def with_value(name, value):
    values = fields()[name]
    values[1, 2, 3] = value
    return values


def scene(**changed):
    return Scene.from_fields(RASTER, TIMES, fields(**changed))


def test_raster_gives_the_middles_of_its_samples():
    np.testing.assert_allclose(RASTER.x, [-5e-6, -3e-6, -1e-6, 1e-6, 3e-6])
    np.testing.assert_allclose(RASTER.y, [3e-6, 1e-6, -1e-6, -3e-6])
    assert RASTER.extent == pytest.approx((-6e-6, 4e-6, -4e-6, 4e-6))


@given(
    left=st.floats(-1e-3, 1e-3),
    top=st.floats(-1e-3, 1e-3),
    spacing=st.floats(1e-7, 1e-4),
    rows=st.integers(2, 9),
    columns=st.integers(2, 9),
)
@settings(max_examples=30)
def test_scene_gives_its_raster_back(left, top, spacing, rows, columns):
    raster = Raster(left, top, spacing, rows, columns)
    values = {name: np.zeros((1, rows, columns)) for name in FIELD_UNITS}
    values["temperature"] += 300.0
    found = Scene.from_fields(raster, [0.0], values).raster
    assert found.shape == raster.shape
    # The corner is as exact as the coordinates, doubles of up to 2 mm, divided by few steps.
    np.testing.assert_allclose(found.extent, raster.extent, rtol=0, atol=1e-17)


def test_scene_gives_its_frames():
    moving = np.arange(60, dtype=np.float32).reshape(3, 4, 5)
    made = scene(velocity_x=moving)
    np.testing.assert_array_equal(made.times, TIMES)
    assert made.frame_spacing == pytest.approx(0.2e-6)
    assert not made.has_material_coordinates
    assert made.tool is None
    frames = list(made.frames())
    assert [frame.time for frame in frames] == list(TIMES)
    np.testing.assert_array_equal(frames[2].velocity_x, moving[2])
    assert frames[0].material.dtype == np.uint8
    assert frames[0].temperature.dtype == np.float32
    assert [frame.time for frame in made.frames(range(1, 2))] == [TIMES[1]]
    assert list(made.frames(range(0))) == []


@pytest.mark.parametrize("value", [257, -255, 1.7, np.nan, 1e300])
@pytest.mark.parametrize("name", ["material", "quality"])
def test_a_byte_is_checked_before_it_is_one(name, value):
    # As a byte, 257, -255 and 1.7 would be 1: workpiece.
    values = np.ones((3, *RASTER.shape))
    values[1, 2, 3] = value
    with pytest.raises(
        SceneError, match=rf"scene: {name} has value {re.escape(f'{value:g}')}, exp"
    ):
        scene(**{name: values})


@pytest.mark.parametrize("kind", [np.int64, np.float64, np.bool_])
def test_whole_numbers_of_any_type_are_materials(kind):
    made = scene(material=np.ones((3, *RASTER.shape), kind))
    assert made.frame(0).material.dtype == np.uint8
    assert (made.frame(0).material == 1).all()


def test_a_negative_rake_leans_over_the_chip():
    tool = ToolGeometry(rake_angle=radians(-7.0))
    bottom, top = tool.rake_point([0.0, 100e-6])
    assert top[0] - bottom[0] == pytest.approx(-100e-6 * sin(radians(7.0)))
    assert top[1] - bottom[1] == pytest.approx(100e-6 * cos(radians(7.0)))


def test_a_scene_of_temperature_alone_shows_itself():
    made = Scene.from_fields(RASTER, TIMES, {"temperature": fields()["temperature"]})
    assert "26.85 °C" in repr(made)
    assert made.plot().get_images()


def spoilt(name, value):
    return lambda: scene(**{name: with_value(name, value)})


def changed_coordinate(name, values):
    data = scene().data
    return Scene(data.assign_coords({name: (name, np.array(values), data[name].attrs)}))


def changed_field(name, change):
    data = scene().data
    return Scene(data.assign({name: change(data["temperature"])}))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (spoilt("temperature", np.nan), "'temperature' is not finite everywhere at 2e-07 s"),
        (spoilt("velocity_y", np.inf), "'velocity_y' is not finite everywhere at 2e-07 s"),
        (spoilt("velocity_x", -np.inf), "'velocity_x' is not finite everywhere at 2e-07 s"),
        (spoilt("temperature", 25.0), "temperature 25 at .* expected kelvin .* looks like °C"),
        (spoilt("temperature", -300.0), "temperature -300 at 2e-07 s, .* kelvin of 200 to 6000$"),
        (spoilt("temperature", 9000.0), "temperature 9000 at 2e-07 s, .* kelvin of 200 to 6000"),
        (spoilt("plastic_strain", -0.1), "'plastic_strain' is -0.1 at 2e-07 s, expected 0 or more"),
        (spoilt("plastic_strain_rate", -5.0), "'plastic_strain_rate' is -5 at .* 0 or more"),
        (spoilt("material", 3), r"material has value 3 .* of 0 \(void\), 1 \(workpiece\)"),
        (
            lambda: scene(temperature=np.full(RASTER.shape, 300.0)),
            r"'temperature' has shape \(4, 5\), expected \(3, 4, 5\): time",
        ),
        (
            lambda: scene(velocity_x=np.zeros((3, 5, 4))),
            r"'velocity_x' has shape \(3, 5, 4\), expected \(3, 4, 5\): time, y, x",
        ),
        (
            lambda: scene(plastic_strain=0.0),
            r"'plastic_strain' has shape \(\), expected \(3, 4, 5\)",
        ),
        (
            lambda: scene(temperature=np.full((3, 4, 5), "20 degC")),
            "'temperature' has type <U7, expected numbers",
        ),
        (lambda: replace(RASTER, spacing=0.0), "Raster.spacing: 0 m, expected 1e-12 m or more"),
        (
            lambda: replace(RASTER, spacing=np.nan),
            "Raster.spacing: nan m, expected 1e-12 m or more",
        ),
        (lambda: replace(RASTER, rows=0), "Raster.rows: 0, expected 1 to 100000"),
        (lambda: replace(RASTER, left=np.inf), "Raster.left: inf m is not finite"),
        (lambda: Scene.from_fields(RASTER, 0.0, fields()), r"times have shape \(\), expected \(ti"),
        (lambda: scene(pressure=np.zeros((3, 4, 5))), "unknown field 'pressure'"),
        (lambda: Scene(scene().data.drop_vars("velocity_x")), "velocity_x missing, expected with"),
        (lambda: Scene(scene().data.drop_vars("time")), "coordinate 'time' is missing"),
        (
            lambda: changed_field("material_x", lambda one: one.assign_attrs(units="m")),
            "material_y missing, expected with 'material_x'",
        ),
        (
            lambda: changed_field("temperature", lambda one: one.assign_attrs(units="°C")),
            "'temperature' has units '°C', expected 'K'",
        ),
        (
            lambda: changed_field("temperature", lambda one: one.transpose("y", "time", "x")),
            "'temperature' has dimensions",
        ),
        (lambda: changed_coordinate("time", [0.0, 2e-7, 2e-7]), "time must ascend"),
        (lambda: changed_coordinate("time", [0.0, 2e-7, np.nan]), "'time' is not finite"),
        (lambda: changed_coordinate("x", 1e-6 * np.array([-5, -3, -1, 1, 9])), "x must have even"),
        (lambda: changed_coordinate("x", 1e-6 * np.array([5, 3, 1, -1, -3])), "x must ascend"),
        (lambda: changed_coordinate("y", 1e-6 * np.array([-3, -1, 1, 3])), "y must descend"),
        (lambda: changed_coordinate("y", 1e-6 * np.array([9, 6, 3, 0])), "samples must be square"),
    ],
)
def test_what_cannot_be_a_scene_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
