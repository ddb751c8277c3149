"""The error on any scene: temperature alone is enough, and places are the user's own."""

import json
import re

import jsonschema
import numpy as np
import pytest
import xarray as xr
from command import chipglow, refused
from drawn import in_a_notebook, on_given_axes, on_new_axes
from tolerances import SINGLE
from undrawn import leave_undrawn

from chipglow.analysis import (
    LinePlace,
    Plan,
    PointPlace,
    RegionPlace,
    analyse,
    headline,
    image_error,
    line_error,
    line_psf_portion,
    readings_frame,
)
from chipglow.camera import Camera, GaussianPSF
from chipglow.io import write_scene
from chipglow.radiometry import Band
from chipglow.scene import Raster, Scene
from chipglow.scene.frame import FILLED
from chipglow.scene.regions import Circle, Polygon, Region
from chipglow.surface import TemperatureSurface, UniformSurface

RASTER = Raster(left=-60e-6, top=40e-6, spacing=1e-6, rows=80, columns=120)
BAND = Band(3.8e-6, 5.1e-6)
COLD, HOT = 500.0, 900.0
CAMERA = Camera(
    band=BAND,
    pitch=4e-6,
    psf=GaussianPSF(8e-6),
    psf_order="optics",
    integration_time=2e-6,
    lower_limit=None,
)
MIDDLE = PointPlace("middle", (30e-6, 0.0))
ACROSS = LinePlace("across", ((-40e-6, 2e-6), (40e-6, 2e-6)))


def plate(temperature=None, times=(0.0, 1e-6, 2e-6, 3e-6)):
    """A plate of temperature alone, hot on the right of x = 0."""
    hot = np.where(RASTER.x > 0, HOT, COLD) * np.ones((RASTER.rows, 1))
    one = hot if temperature is None else temperature
    return Scene.from_fields(RASTER, times, {"temperature": np.stack([one] * len(times))})


def found(scene=None, camera=CAMERA, surface=None, **plan):
    surfaces = {"plate": surface or UniformSurface(0.6)}
    plan = {"exposures": 2, "phases": 2, **plan}
    return analyse(scene or plate(), surfaces, camera, Plan(**plan))


def reading(result, place, name):
    return headline(result.data, f"{place}, {name}")


def test_an_even_plate_is_measured_without_error():
    """Blur and pixels change nothing where nothing changes: rounding and the table's 1/32 K."""
    even = plate(np.full(RASTER.shape, 800.0))
    result = found(even, places=(MIDDLE, ACROSS))
    for place, name in (("middle", "pixel"), ("across", "mean"), ("hottest pixel", "peak")):
        error = reading(result, place, name).error
        assert np.abs(error.values).max() < 1e-9, place  # rounding: the same table there and back
        assert error.values.shape == (2, 1, 4)


def test_a_place_at_filled_samples_is_warned_about():
    scene = plate()
    quality = np.zeros((4, RASTER.rows, RASTER.columns), np.uint8)
    quality[1:, 35:45, 85:95] = FILLED  # around (30 um, 0), which MIDDLE reads
    flagged = Scene(scene.data.assign(quality=(("time", "y", "x"), quality)))
    warnings = found(flagged, places=(MIDDLE, PointPlace("elsewhere", (-30e-6, 0.0)))).warnings
    told = [one for one in warnings if "filled from their neighbours" in one]
    assert len(told) == 1 and told[0].startswith("Middle: 100 % of its samples")
    assert not [one for one in found(places=(MIDDLE,)).warnings if "filled" in one]


def test_lines_and_regions_give_mean_and_extremes():
    pad = RegionPlace("pad", Region("pad", Circle((40e-6, 0.0), 10e-6), unit="m"))
    result = found(places=(ACROSS, pad))
    mean, worst, most = (
        reading(result, "across", name).error for name in ("mean", "most negative", "greatest")
    )
    assert (worst.values < mean.values).all() and (mean.values < most.values).all()
    assert worst.mean < -20 and most.mean > 20  # cold spills into hot, and hot into cold
    assert abs(reading(result, "pad", "mean").error.mean) < 1.0  # far from the edge
    frame = readings_frame(result.data).set_index(["place", "reading"])
    assert frame.loc[("across", "mean"), "error_K"] == mean.mean
    assert frame.loc[("across", "greatest"), "greatest_K"] == most.range[1]
    along = line_error(result.data, "across")
    assert along.distance[-1] == pytest.approx(80e-6)
    assert along.sizes["pixel_phase"] == 4
    whole = np.abs(image_error(result.data)).max()
    assert whole >= np.nanmax(np.abs(along.values[0, 0, 0])) - 1e-9


def test_the_pixel_phase_scatters_at_the_edge_and_not_far_from_it():
    near = PointPlace("near", (-1e-6, 2e-6))
    result = found(places=(near, MIDDLE), phases=4)
    assert reading(result, "near", "pixel").error.parts["pixel phase"].fraction > 0.99
    assert np.ptp(reading(result, "near", "pixel").error.values) > 5.0
    # Far from the edge the field is even.
    assert np.ptp(reading(result, "middle", "pixel").error.values) < 1e-9


def test_emissivity_follows_the_temperature():
    metal = TemperatureSurface(((600.0, 0.2), (700.0, 0.8)))
    ramp = np.linspace(500.0, 800.0, RASTER.columns) * np.ones((RASTER.rows, 1))
    frame = plate(ramp).frame(0)
    expected = np.clip(0.2 + 0.6 * (ramp - 600.0) / 100.0, 0.2, 0.8)
    np.testing.assert_allclose(metal.prepare(plate()).emissivity(frame), expected, atol=SINGLE)
    melting = TemperatureSurface(((500.0, 0.2), (650.0, 0.2), (650.0, 0.5), (800.0, 0.5)))
    expected = np.where(ramp.astype(np.float32) < 650.0, 0.2, 0.5)
    np.testing.assert_allclose(melting.prepare(plate()).emissivity(frame), expected, atol=SINGLE)
    for table, wrong in (
        (((600.0, 0.2),), "2 or more"),
        (((700.0, 0.2), (600.0, 0.3)), "ascending"),
        (((600.0, 0.2), (600.0, 0.3), (600.0, 0.4)), "twice for a jump"),
        (((600.0, 0.2), (700.0, 1.3)), "expected 0 to 1"),
    ):
        with pytest.raises(ValueError, match=wrong):
            TemperatureSurface(table)


@pytest.mark.parametrize(
    ("place", "wrong"),
    [
        (lambda: PointPlace("far", (1.0, 0.0)), r"far: reaches over x 1e\+06"),
        (lambda: LinePlace("dot", ((0.0, 0.0), (0.0, 0.0))), "two corners are the same"),
        (lambda: LinePlace("short", ((0.0, 0.0),)), "1 corners, expected 2"),
        (lambda: PointPlace(" ", (0.0, 0.0)), "the name is empty"),
        (
            lambda: RegionPlace(
                "pixels", Region("pixels", Polygon(((1, 1), (5, 1), (5, 5))), unit="pixel")
            ),
            "is in pixels, expected lengths",
        ),
        (lambda: PointPlace("middle", (0.0, 0.0)), "two places have the name 'middle'"),
    ],
)
def test_places_that_cannot_be_are_refused(place, wrong):
    with pytest.raises(ValueError, match=wrong):
        found(places=(MIDDLE, place()))


def test_a_place_that_some_pixels_do_not_hold_is_told_of():
    corner = PointPlace("corner", (-59.5e-6, 39.5e-6))
    result = found(places=(corner,))
    assert any("corner, plate: not read" in sentence for sentence in result.missing)


STUDY = """
surface: {kind: uniform, emissivity: 0.6}
camera:
  band: 3.8-5.1 um
  fill_factor: 1.0
  frame_rate: 600 Hz
  pitch: 4 um
  integration_time: 2 us
  lower_limit: none
  psf: {kind: gaussian, fwhm: 8 um}
  psf_order: optics
analysis:
  exposures: 2
  phases: 2
  points: {middle: [30 um, 0 um]}
  lines: {across: [[-40 um, 2 um], [40 um, 2 um]]}
  regions: {pad: {circle: {centre: [40 um, 0 um], radius: 10 um}}}
"""


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """Folder and output of ``chipglow error``."""
    work = tmp_path_factory.mktemp("error")
    write_scene(plate(), work / "plate.nc")
    (work / "study.yaml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(work)
        leave_undrawn(patch)
        return work, chipglow("error", "plate.nc", "--study", "study.yaml", "--out", "out")


@pytest.fixture
def folder(reported, undrawn, monkeypatch):
    monkeypatch.chdir(reported[0])
    return reported[0]


def test_the_command_reports_without_a_word_of_cutting(folder, reported):
    for word in ("hottest", "middle", "across", "pad"):
        assert word in reported[1].output
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    told = re.sub(r"<pre>.*?</pre>|src=\"[^\"]*\"|<style>.*?</style>", "", page, flags=re.S)
    told = told.replace("chipglow", "").replace(
        "The paper&#39;s values of omitted settings of analysis", ""
    )
    told = told.replace("virtual infrared camera for metal cutting", "")  # the program's title
    assert not re.search(r"\b(chip|rake|shear|cut|cutting|tool|workpiece|paper)\b", told, re.I)
    assert "Measurement error of plate.nc" in told
    sections = re.findall(r'<section id="(\w+)">', page)
    assert sections == ["answer", "causes", "details", "comparison", "repeat"]
    assert set(re.findall(r'href="#([^"]+)"', page)) <= set(re.findall(r' id="([^"]+)"', page))
    assert '<figure id="exposure">' in page
    summary = json.loads((folder / "out" / "summary.json").read_text())
    schema = json.loads((folder / "out" / "summary.schema.json").read_text())
    jsonschema.validate(summary, schema)
    errors = found(places=(MIDDLE, ACROSS))
    here = reading(errors, "across", "most negative").error.mean
    key = "across_most_negative_error_degC"
    # The file's temperatures are rounded to 1/40 K.
    assert summary["results"][key] == pytest.approx(here, abs=0.03)
    assert summary["draws"][key]["count"] == 8
    # 518 is rounded: 0.3 K measured.
    assert summary["references"][key] == pytest.approx(518.0, abs=0.5)
    with xr.open_dataset(folder / "out" / "results.nc", engine="h5netcdf") as data:
        assert data["line_error"].sel(line="across").sizes["pixel_phase"] == 4
        assert all(data[name].attrs.get("units") for name in data.data_vars)


def test_the_command_on_the_page_gives_the_same_numbers(folder, monkeypatch):
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    # Not `run`, which would read the rake face and the shear band of a scene that shows a cut.
    command = re.search("chipglow (error .*)--out results", page)[1].split()
    monkeypatch.chdir(folder / "out")
    chipglow(*command, "--out", "../again")
    first, second = (
        json.loads((folder / name / "summary.json").read_text())["results"]
        for name in ("out", "again")
    )
    assert first == second


def test_one_emissivity_is_enough(folder):
    (folder / "short.yaml").write_text("camera: {integration_time: 2 us, lower_limit: none}\n")
    chipglow("error", "plate.nc", "--study", "short.yaml", "--emissivity", "0.5", "--out", "short")
    assert (folder / "short" / "report.html").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("plate.nc", "--emissivity", "1.5"), ("emissivity", "1.5", "expected 0 to 1")),
        (("none.nc",), ("none.nc", "no such file")),
        (("plate.nc",), ("plate.nc", "no plastic strain", "kind: uniform")),
    ],
)
def test_what_cannot_be_is_one_sentence(folder, arguments, words):
    refused(("error", *arguments, "--out", "refused"), *words)
    assert not (folder / "refused").exists()


def test_an_analysis_answers_by_its_methods():
    result = found(places=(MIDDLE, ACROSS))
    one = result.headline("middle, pixel")
    np.testing.assert_array_equal(
        one.error.values, headline(result.data, "middle, pixel").error.values
    )
    expected = (
        "'rake' is not known in every draw, expected one of: hottest pixel, peak; middle, pix"
    )
    with pytest.raises(ValueError, match=expected):
        result.headline("rake")
    line = result.line("across")
    np.testing.assert_array_equal(line.error, line_error(result.data, "across"))
    np.testing.assert_array_equal(line.psf_portion, line_psf_portion(result.data, "across"))
    assert line.distance.values[-1] == pytest.approx(80e-6)
    assert line.error.units == "K"
    with pytest.raises(ValueError, match="line: 'rake' is unknown, expected one of: across"):
        result.line("rake")
    assert result.to_frame().equals(readings_frame(result.data))
    columns, rows, sentences = in_a_notebook(result)
    assert columns == list(result.to_frame().columns)
    assert [row[1] for row in rows] == result.to_frame().place.tolist()
    assert sentences == [*result.warnings, *result.missing, *result.assumed]


def test_the_error_of_an_analysis_is_drawn_with_its_places():
    surfaces = {"dark": UniformSurface(0.3), "bright": UniformSurface(0.9)}
    plan = Plan(exposures=1, phases=1, places=(MIDDLE, ACROSS))
    result = analyse(plate(), surfaces, CAMERA, plan)
    for name, axes in {
        "dark": on_new_axes(result),
        "bright": on_given_axes(result, "bright"),
    }.items():
        error = image_error(result.data).sel(surface=name).values
        np.testing.assert_array_equal(axes.get_images()[0].get_array(), error)
        assert axes.get_title(loc="left") == f"error, {name}"
        drawn = [line.get_xydata() for line in axes.get_lines()]
        np.testing.assert_allclose(drawn[0], [[30.0, 0.0]], atol=1e-9)  # µm
        np.testing.assert_allclose(drawn[1], 1e6 * np.array(ACROSS.corners))
    with pytest.raises(ValueError, match="'grey' is unknown, expected one of dark, bright"):
        result.plot("grey")
