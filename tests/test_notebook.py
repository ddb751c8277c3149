"""What a notebook shows of a scene and a measurement: a line, degrees Celsius, a picture."""

import subprocess
import sys

import numpy as np
import pytest
from matplotlib import pyplot as plt

from chipglow.camera import Camera, Flag, Measurement
from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Raster, Scene, ToolGeometry
from chipglow.study import Study
from chipglow.surface import UniformSurface
from chipglow.uncertainty import Estimate

RASTER = Raster(-30e-6, 20e-6, 2e-6, 25, 40)
TOOL = ToolGeometry()


@pytest.fixture(autouse=True)
def no_figures_are_left():
    yield
    plt.close("all")


def scene(frames=3, tool=TOOL):
    fields = {name: np.zeros((frames, *RASTER.shape)) for name in FIELD_UNITS}
    fields["temperature"] += 573.15 + np.arange(frames)[:, None, None] + RASTER.x * 1e6
    fields["material"] += 1
    fields["material"][:, :5, :8] = 0
    fields["temperature"][:, :5, :8] = 293.15
    return Scene.from_fields(RASTER, 1e-6 * np.arange(frames), fields, tool)


def measurement(tool=TOOL):
    kelvin = np.array([[[700.0, 800.15, 900.0]], [[701.0, 801.0, 901.15]]])
    band, flags = Band(3.8e-6, 5.1e-6), np.array([[[0, 0, Flag.DEAD]], [[0, 0, 0]]], np.uint8)
    times, raster = np.array([0.0, 5e-3]), Raster(-9e-6, 0.0, 6e-6, 1, 3)
    made = Measurement.from_radiance(
        band.radiance(kelvin), band, times, raster, flags=flags, attributes={"warnings": "A.\nB."}
    )
    return made.with_tool(tool) if tool else made


def test_a_scene_in_a_line():
    assert repr(scene()) == (
        "<Scene: 3 frames of 25 x 40 samples of 2 µm; 0 µs to 2 µs; 271 °C to 349 °C in the first; "
        "with tool>"
    )
    assert repr(scene(1, None)) == (
        "<Scene: 1 frame of 25 x 40 samples of 2 µm; at 0 µs; 271 °C to 349 °C; without tool>"
    )


def test_a_measurement_in_a_line():
    assert repr(measurement()) == (
        "<Measurement: 2 frames of 1 x 3 pixels of 6 µm; 0 µs to 5000 µs; 426.9 °C to 527 °C in "
        "the first; with tool; 2 warnings: see .notes>"
    )
    assert measurement().notes.warnings == ["A.", "B."]
    cold = Camera(psf=None, integration_time=1e-6, lower_limit=573.15).measure(
        scene(), UniformSurface(0.1), 0.0
    )
    assert repr(cold) == (
        "<Measurement: 1 frame of 8 x 13 pixels of 6 µm; at 0 µs; no temperature; with tool>"
    )
    assert cold.notes.warnings == []


def test_a_notebook_shows_the_data_the_budget_and_the_study():
    assert "271 °C to 349 °C" in scene()._repr_html_() and "plastic_strain" in scene()._repr_html_()
    assert "2 warnings" in measurement()._repr_html_()
    shown = Estimate(np.array(0.42)).with_component("thermometer", 0.01)._repr_html_()
    assert "0.42" in shown and "thermometer" in shown and "0.01" in shown
    study = Study(camera={"pitch": "5 um"})._repr_html_()
    assert "pitch: 5 um" in study and "<details>" in study


def test_degrees_celsius_of_a_frame():
    # Float32 of 600 K.
    np.testing.assert_allclose(scene().celsius(-1)[7], 302.0 + RASTER.x * 1e6, atol=5e-5)
    # The band's table and its inverse: 2e-8 K measured.
    np.testing.assert_allclose(
        measurement().celsius(), [[426.85, 527.0, np.nan]], rtol=0, atol=1e-7
    )
    np.testing.assert_allclose(
        measurement().celsius(1), [[427.85, 527.85, 628.0]], rtol=0, atol=1e-7
    )


@pytest.mark.parametrize(
    ("shown", "frame", "label", "title"),
    [
        (scene(), 2, "temperature / °C", "2 µs"),
        (measurement(), 1, "radiance temperature / °C", "5000 µs"),
    ],
    ids=["scene", "measurement"],
)
def test_a_picture_of_a_frame(shown, frame, label, title):
    axes = shown.plot(frame)
    (picture,) = axes.get_images()
    np.testing.assert_allclose(picture.get_extent(), np.array(shown.raster.extent) * 1e6)
    known = np.isfinite(shown.celsius(frame))
    if isinstance(shown, Scene):
        known[:5, :8] = False
    np.testing.assert_array_equal(np.ma.getmaskarray(picture.get_array()), ~known)
    np.testing.assert_allclose(picture.get_array()[known], shown.celsius(frame)[known])
    assert axes.get_title(loc="left") == title
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x / µm", "y / µm")
    assert axes.figure.axes[1].get_ylabel() == label
    outline = axes.get_lines()[-1].get_xydata()
    np.testing.assert_allclose(outline, 1e6 * TOOL.outline(3e-3))


def test_a_picture_on_given_axes_without_a_tool():
    figure, axes = plt.subplots(1, 2)
    for at, shown in zip(axes, (scene(tool=None), measurement(tool=None)), strict=True):
        assert shown.plot(ax=at) is at
        assert not at.get_lines()
    assert plt.get_fignums() == [figure.number]


def test_numerics_do_not_import_matplotlib():
    imported = (
        "import sys, chipglow; chipglow.Camera, chipglow.Scene, chipglow.rake_grid;"
        "import chipglow.laboratory.comparison, chipglow.laboratory.emissivity;"
        "import chipglow.laboratory.psf, chipglow.analysis"
    )
    check = "assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", f"{imported}; {check}"], check=True)
