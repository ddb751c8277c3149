"""Emissivity from heated chips: what was put in comes out, within its stated uncertainty."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
import yaml
from command import typed
from drawn import in_a_notebook, legend_of, on_given_axes, on_new_axes, points_of
from heated_chip import BAND, CELSIUS, RASTER, REGIONS, measured, table_1
from hypothesis import given, settings, strategies as st
from tolerances import DOUBLE, SINGLE

from chipglow.camera import CalibrationErrors, Camera, Flag
from chipglow.io import write_measurement
from chipglow.laboratory import emissivity as em
from chipglow.laboratory.emissivity.emissivity import COMMON
from chipglow.scene import FIELD_UNITS, Area, Polygon, Raster, Region, Scene, areas
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of
from chipglow.surface import CHIP_1, FeatureTrends, MapSurface, TrendSurface

STEP = 2.0**-24
"""Step of numbers below 1 in single precision: twice their rounding."""

TRUTH = 391.0 + CELSIUS
HEATING = em.Heating(TRUTH)
WHOLE = Area("all", "all", np.ones(RASTER.shape, bool), True)
EVEN = np.full(RASTER.shape, 0.5)
REGION_LIST = (
    Region("body left", Polygon.rectangle((0, 0), (16, 30)), "chip body"),
    Region("body right", Polygon.rectangle((24, 0), (40, 30)), "chip body"),
    Region("shear band", Polygon.rectangle((17, 0), (23, 30))),
)


def of_whole(image, heating=HEATING):
    return em.determine_emissivity([image], heating).of(WHOLE)


def rows_of(image, heating=HEATING):
    found = em.determine_emissivity([image], heating)
    return {area.name: found.of(area) for area in areas(REGION_LIST, found.raster)}


def off_by(image, kelvins):
    """The image of a camera whose radiance temperatures are wrong."""
    radiance = BAND.radiance(BAND.temperature(image.radiance) + kelvins)
    image.data["radiance"].values[:] = radiance
    return image


def slopes():
    """Radiances of object and surroundings, and their derivatives with temperature."""
    points = np.array([TRUTH, 293.0])
    return BAND.radiance(points), (BAND.radiance(points + 0.5) - BAND.radiance(points - 0.5))


# What was put in


@given(st.floats(0.02, 1.0), st.floats(500.0, 1500.0), st.floats(200.0, 350.0))
@settings(max_examples=50)
def test_equation_2_is_undone(emissivity, reference, reflected):
    small = Raster(0.0, 0.0, 6e-6, 2, 2)
    image = measured(np.full((2, 2), emissivity), reference, reflected, raster=small)
    found = em.determine_emissivity([image], em.Heating(reference, reflected))
    np.testing.assert_allclose(found.emissivity, emissivity, rtol=DOUBLE)


@pytest.mark.parametrize(
    ("body", "band", "celsius"),
    [((0.42, 0.07), (0.53, 0.05), 391.0), ((0.77, 0.03), (0.85, 0.02), 570.0)],
)
def test_table_1_of_the_paper_comes_back_through_camera_and_scene(body, band, celsius):
    put_in = table_1(body, band)
    fields = {name: np.zeros((11, *RASTER.shape)) for name in FIELD_UNITS}
    fields["temperature"] += celsius + CELSIUS
    fields["material"] += 1
    scene = Scene.from_fields(RASTER, np.arange(11) * 1e-6, fields)
    camera = Camera(psf=None, lower_limit=None, reflected=293.0)
    image = camera.measure(scene, MapSurface(put_in, RASTER), 0.0)
    rows = rows_of(image, em.Heating(celsius + CELSIUS))
    # A camera without blur whose pixels are the samples; emissivities are float32 on their way.
    parts = {"chip body": put_in[:, np.r_[:16, 24:40]], "shear band": put_in[:, 17:23]}
    for name, (mean, standard_deviation) in (("chip body", body), ("shear band", band)):
        row = rows[name]
        assert row.used.count == parts[name].size
        assert row.mean == pytest.approx(parts[name].mean(), abs=SINGLE)
        assert row.standard_deviation == pytest.approx(parts[name].std(ddof=1), abs=SINGLE)
        # And so the table's, but for drawing 960 and 180 pixels: four standard deviations of both.
        assert row.mean == pytest.approx(mean, abs=4 * standard_deviation / row.used.count**0.5)
        error = 4 / (2 * row.used.count) ** 0.5
        assert row.standard_deviation == pytest.approx(standard_deviation, rel=error)


# Uncertainty


def test_the_budget_is_that_of_the_derivatives():
    heating = em.Heating(TRUTH, 293.0, 2.0, 1.5, 0.8)
    row = of_whole(measured(EVEN), heating)
    (hot, cold), (hot_slope, cold_slope) = slopes()
    contrast = hot - cold
    temperature = BAND.temperature(0.5 * (hot + cold))
    slope = BAND.radiance(temperature + 0.5) - BAND.radiance(temperature - 0.5)
    expected = {
        "reference": -0.5 * hot_slope / contrast * 2.0,
        "reflected": -0.5 * cold_slope / contrast * 1.5,
        "calibration": slope * 0.8 / contrast,
    }
    for cause, effect in expected.items():
        # Second-order terms of 2 K in 664 K are 1e-4 of the first.
        assert row.estimate.effect(cause) == pytest.approx(effect, rel=1e-3)
    total = np.linalg.norm([row.estimate.effect(cause) for cause in COMMON])
    assert row.estimate.standard_uncertainty == pytest.approx(total, rel=DOUBLE)
    # Printed with six decimals.
    assert row.estimate.coverage_factor() == pytest.approx(1.959964, abs=1e-6)


def coverage(observe, repeats=100):
    """How often the 95 % interval of the body's mean holds the truth."""
    put_in = table_1()
    area = Area("body", "body", np.arange(40)[None, :] + np.zeros((30, 1)) < 16, True)
    held = 0
    for seed in range(repeats):
        row = observe(put_in, np.random.default_rng(seed)).of(area)
        held += abs(row.mean - put_in[area.mask].mean()) <= row.estimate.expanded_uncertainty()
    return held


def test_intervals_hold_the_truth_as_often_as_they_say():
    heating = em.Heating(TRUTH, 293.0, 2.0, 1.0, 1.5)

    def observe(put_in, generator):
        true, around, wrong = generator.normal((TRUTH, 293.0, 0.0), (2.0, 1.0, 1.5))
        image = measured(put_in, true, around, frames=4, noise=3.0, seed=generator, drift=0.5)
        return em.determine_emissivity([off_by(image, wrong)], heating)

    # 95 of 100 expected, standard deviation 2.2: three of them. Of intervals half as wide 67 would
    # hold, and of those twice as wide all with a probability of 0.99.
    assert 88 <= coverage(observe) <= 99


def test_drift_and_noise_are_told_apart():
    noise, drift, frames = 4.0, 1.0, 400
    (hot, cold), _ = slopes()
    image = measured(EVEN, frames=frames, noise=noise, drift=drift)
    found = em.determine_emissivity([image], HEATING)
    row, contrast = found.of(WHOLE), hot - cold
    expected = drift / frames**0.5 / contrast
    # The standard deviation of 400 frames is known to 3.5 %: four times that.
    assert row.estimate.contribution("repeatability") == pytest.approx(expected, rel=0.15)
    # That of 480 000 pixels is known to 0.1 %: five times that.
    assert row.estimate.contribution("noise") == pytest.approx(
        noise / (frames * RASTER.rows * RASTER.columns) ** 0.5 / contrast, rel=0.005
    )
    # A pixel's uncertainty has its own noise.
    expected = np.hypot(noise, drift) / frames**0.5 / contrast
    # Drift, 1/17 of the variance, is known to 7 %, and the noise to 0.1 %: 0.4 % of the variance.
    assert found.estimate.standard_uncertainty.mean() == pytest.approx(expected, rel=0.01)


def test_the_uncertainty_of_the_calibration_comes_from_the_measurement():
    errors = CalibrationErrors(np.array([0.0, 1.0]), np.array([[5.0, 5.0]]))
    image = measured(table_1(), calibration_errors=errors)
    (hot, cold), _ = slopes()
    row = of_whole(image)
    # It is common to all pixels: a mean over them does not lessen it.
    assert row.estimate.contribution("calibration") == pytest.approx(5.0 / (hot - cold), rel=1e-12)
    own = of_whole(image, replace(HEATING, camera_uncertainty=0.0))
    assert own.estimate.contribution("calibration") == 0.0


def test_the_difference_of_two_regions_is_known_better_than_either():
    heating = em.Heating(TRUTH, 293.0, 4.0, 2.0, 3.0)
    put_in = table_1((0.42, 0.001), (0.53, 0.001))
    generator, differences = np.random.default_rng(8), []
    for _ in range(100):
        true, around, wrong = generator.normal((TRUTH, 293.0, 0.0), (4.0, 2.0, 3.0))
        image = measured(put_in, true, around, frames=3, drift=5.0, seed=generator)
        rows = rows_of(off_by(image, wrong), heating)
        differences.append(rows["shear band"].mean - rows["chip body"].mean)
    (a, b), (_, d) = em.emissivity_covariance([rows["shear band"], rows["chip body"]])
    stated = np.sqrt(a - 2 * b + d)
    # 100 differences: the standard deviation is known to 7 %; three of them.
    assert np.std(differences) == pytest.approx(stated, rel=0.21)
    assert stated < 0.25 * rows["shear band"].estimate.standard_uncertainty


# Over the temperature


def heated_series(generator, temperatures, errors):
    """A body whose emissivity is 0.4 + 2e-4 (T − 700 K), with a wrong thermocouple and camera."""
    rows = []
    for temperature in temperatures:
        emissivity = np.full(RASTER.shape, 0.4 + 2e-4 * (temperature - 700.0))
        image = measured(emissivity, temperature, frames=4, drift=1.0, seed=generator)
        heating = em.Heating(temperature + errors[0], 293.0, 2.0, 0.0, 1.0)
        rows.append(of_whole(off_by(image, errors[1]), heating).line)
    return em.emissivity_line(rows)


@pytest.mark.parametrize("temperatures", [(600.0, 800.0), (600.0, 700.0, 800.0, 900.0)])
def test_the_line_is_as_uncertain_as_it_says(temperatures):
    generator = np.random.default_rng(5)
    lines = [
        heated_series(generator, temperatures, generator.normal((0.0, 0.0), (2.0, 1.0)))
        for _ in range(60)
    ]
    truth = [(0.4 + 2e-4 * (line.middle - 700.0), 2e-4) for line in lines]
    off = np.array([line.estimate.values for line in lines]) - truth
    stated = np.sqrt(np.mean([np.diag(line.estimate.covariance()) for line in lines], axis=0))
    # The standard deviation of 60 is known to 9.2 %; three of that.
    np.testing.assert_allclose(off.std(axis=0), stated, rtol=0.28)
    assert (abs(off.mean(axis=0)) < 3 * stated / 60**0.5).all()


def test_scatter_about_the_line_counts():
    rows = [
        of_whole(measured(np.full(RASTER.shape, e), t), em.Heating(t)).line
        for e, t in ((0.4, 600.0), (0.5, 700.0), (0.4, 800.0))
    ]
    line = em.emissivity_line(rows)
    # Sum of squares about the mean 13/30: 0.02/3; one degree of freedom.
    assert line.residual == pytest.approx((0.02 / 3) ** 0.5, rel=1e-6)
    expected = line.residual / np.sqrt([3.0, 20000.0])
    np.testing.assert_allclose(line.estimate.standard_uncertainty, expected, rtol=DOUBLE)


# Warning and impossible


def test_flagged_pixels_are_left_out_counted_and_doubted():
    put_in = table_1()
    flags = np.zeros((3, *RASTER.shape), np.uint8)
    flags[1, 0, :10] = Flag.DEAD
    flags[2, 1, :100] = Flag.SATURATED
    flags[:, 2, :5] = Flag.REPLACED
    found = em.determine_emissivity([measured(put_in, frames=3, flags=flags)], HEATING)
    row = found.of(WHOLE)
    out = (flags & (Flag.DEAD | Flag.SATURATED)).any(axis=0)
    np.testing.assert_array_equal(np.isnan(found.emissivity), out)
    assert (row.used.count, row.used.left_out) == (1150, 50)
    assert row.used.flagged == {Flag.UNDER_RANGE: 0, Flag.SATURATED: 40, Flag.DEAD: 10}
    assert row.mean == pytest.approx(put_in[~out].mean(), rel=DOUBLE)
    assert row.estimate.warnings == ()
    flags[0, 5, :20] = Flag.SATURATED
    row = of_whole(measured(put_in, frames=3, flags=flags))
    assert row.estimate.warnings == (
        "all: 70 of 1200 pixels are left out (60 saturated, 10 dead). "
        "The remaining pixels are darker than the region.",
    )


def test_a_region_that_the_floor_cuts_says_that_it_is_too_bright():
    put_in = table_1((0.42, 0.07))
    lower_limit = float(BAND.temperature(measured(np.full(RASTER.shape, 0.38)).radiance[0, 0, 0]))
    row = of_whole(measured(put_in, lower_limit=lower_limit))
    assert row.mean > put_in.mean() + 0.01
    (warning,) = row.estimate.warnings
    assert "range limit). The remaining pixels are brighter than the region" in warning
    assert warning.endswith("the camera's range hides emissivities below 0.38.")


def test_impossible_emissivities_are_told():
    put_in = np.full(RASTER.shape, 0.9)
    put_in[0] = 1.1
    put_in[1, :7] = -0.0005
    row = of_whole(measured(put_in))
    assert row.outside == (7, 40)
    text = " ".join(row.estimate.warnings)
    assert "7 of 1200 pixels have an emissivity below 0" in text
    assert "40 of 1200 pixels have an emissivity over 1" in row.estimate.warnings[1]
    bright = of_whole(measured(np.full(RASTER.shape, 1.2)))
    assert bright.estimate.warnings[-1] == "all: the mean emissivity is not within 0 to 1."


COARSE = Raster(RASTER.left, RASTER.top, 12e-6, 15, 20)
# The map as a surface, the regions as a study


def test_a_map_is_itself_averaged_interpolated_and_elsewhere_what_is_said():
    put_in = table_1()
    surface = MapSurface(put_in, RASTER, elsewhere=0.3)
    np.testing.assert_allclose(surface.at(RASTER), put_in, atol=STEP)
    wider = surface.at(Raster(RASTER.left - 12e-6, RASTER.top, 6e-6, 30, 44))
    np.testing.assert_allclose(wider[:, 2:42], put_in, atol=STEP)
    np.testing.assert_allclose(wider[:, [0, 1, 42, 43]], 0.3, atol=STEP)
    coarse = surface.at(COARSE)
    np.testing.assert_allclose(coarse, put_in.reshape(15, 2, 20, 2).mean(axis=(1, 3)), atol=STEP)
    fine = Raster(RASTER.left + 12e-6, RASTER.top - 12e-6, 1.5e-6, 100, 140)
    plane, expected = (
        0.2 + 1500.0 * (r.x[None, :] - RASTER.left) + 1000.0 * (RASTER.top - r.y[:, None])
        for r in (RASTER, fine)
    )
    np.testing.assert_allclose(MapSurface(plane, RASTER).at(fine), expected, atol=STEP)


def test_unknown_pixels_of_a_map_do_not_pull_their_neighbours():
    put_in = EVEN.copy()
    put_in[10, 10] = np.nan
    np.testing.assert_allclose(MapSurface(put_in, RASTER).at(COARSE), 0.5, atol=STEP)


# Files and the command

COMMAND = "emissivity --regions regions.yaml --reference 391degC"


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Images of a chip at 391 °C and 500 °C."""
    path = tmp_path_factory.mktemp("chip")
    (path / "regions.yaml").write_text(REGIONS)
    hot = measured(table_1((0.46, 0.07)), 500.0 + CELSIUS, frames=5, noise=1.0)
    write_measurement(measured(table_1(), frames=5, noise=1.0), path / "a.nc")
    write_measurement(hot, path / "b.nc")
    return path


@pytest.fixture
def folder(made, monkeypatch):
    monkeypatch.chdir(made)
    return made


@pytest.fixture
def two(folder):
    """What the command says of both images, whose emissivities it has written."""
    if not Path("two.nc").exists():
        spread = "--reference-uncertainty '2 K' --plot p.svg --out two.nc"
        said = typed(f"{COMMAND} a.nc b.nc --reference '500 degC' {spread}").stdout
        Path("said.txt").write_text(said, encoding="utf-8")
    return Path("said.txt").read_text(encoding="utf-8")


def study_of(output):
    """The study that the command proposes, before the names of its files."""
    return Study(**yaml.safe_load(re.split(r"\n\w+\.nc\n", output.split("For a study:")[1])[0]))


def test_the_command_writes_table_map_and_picture(folder):
    outputs = "--metal Ti-6Al-4V --out one.nc --table t.csv --plot p.png"
    spread = "--reference-uncertainty '2 K' --reflected-uncertainty '1 degC'"
    said = typed(f"{COMMAND} a.nc {spread} {outputs}").stdout
    assert said.splitlines()[-3:] == ["one.nc", "t.csv", "p.png"]
    lines = pd.read_csv("t.csv", index_col="region")
    image, heating = measured(table_1(), frames=5, noise=1.0), em.Heating(TRUTH, 293.0, 2.0, 1.0)
    for name, row in rows_of(image, heating).items():
        expanded = row.estimate.expanded_uncertainty()
        # The table has nine digits.
        assert lines["mean"][name] == pytest.approx(row.mean, rel=1e-8)
        # Nine digits.
        assert lines["expanded_uncertainty"][name] == pytest.approx(expanded, rel=1e-8)
    chip = study_of(said).surface.chips["measured chip"]
    # The written study has six digits: 2e-6 measured.
    assert chip.body.mean == pytest.approx(lines["mean"]["chip body"], abs=5e-6)
    surface, found = em.read_emissivity_map("one.nc"), em.determine_emissivity([image], heating)
    known = (pytest.approx(BAND.lower), pytest.approx(BAND.upper)), "Ti-6Al-4V"
    for one in (surface, *surfaces_of(study_of(said).surface, 1).values()):
        assert (one.origin.band, one.origin.metal) == known
    np.testing.assert_array_equal(surface.values, found.emissivity)
    # In m: a millionth of a pixel.
    np.testing.assert_allclose(surface.raster.extent, RASTER.extent, atol=1e-12)
    assert (folder / "p.png").stat().st_size > 10_000


def test_the_command_fits_over_the_temperature(two):
    assert "change in 100 K" in two
    assert Path("p.svg").is_file()
    assert surfaces_of(study_of(two).surface, 1).keys() >= {"measured chip"}


def test_assumptions_and_warnings_are_printed(folder):
    flags = np.zeros((1, *RASTER.shape), np.uint8)
    flags[0, :3] = Flag.DEAD
    write_measurement(measured(table_1(), flags=flags), folder / "dead.nc")
    said = typed(f"{COMMAND} dead.nc").stderr
    for words in (
        *("The true temperature is exact", "The camera's calibration is exact"),
        *("reflects exactly 19.85 degC; 100 K more would shift", "does not drift"),
        *("Nothing changes between frames", "Warning: shear band: 18 of 180 pixels are left out"),
    ):
        assert words in said
    stated = typed(f"{COMMAND} dead.nc --reflected-uncertainty '5 K'").stderr
    assert "reflects 19.85 ± 5 degC and nothing hotter; 100 K more would shift" in stated


# A study's surface of what was measured


def even_scene(temperature, strain=1.0, rate=0.0):
    fields = {"temperature": temperature, "plastic_strain": strain, "plastic_strain_rate": rate}
    values = {name: np.full((1, *RASTER.shape), value) for name, value in fields.items()}
    return Scene.from_fields(RASTER, [0.0], {**values, "material": np.ones((1, *RASTER.shape))})


def shown(surface, *of_scene):
    """The emissivity that a surface has in an even scene."""
    scene = even_scene(*of_scene)
    return surface.prepare(scene).emissivity(scene.frame(0))


@pytest.mark.usefixtures("two")
def test_a_study_takes_the_line_of_a_region():
    line = em.read_emissivity_lines("two.nc")["chip body"]
    trend = em.emissivity_trend(line)
    np.testing.assert_allclose(trend.covariance, line.estimate.covariance(), rtol=DOUBLE)
    assert trend.measured == line.temperatures
    study = Study(surface={"kind": "measured", "file": "two.nc", "region": "chip body"})
    (surface,) = surfaces_of(study.surface, 1).values()
    for kelvins in (600.0, 700.0, 900.0):
        np.testing.assert_allclose(shown(surface, kelvins), line.at(kelvins).values, rtol=SINGLE)
    assert shown(surface, 5_000.0).max() == 1.0


@pytest.mark.usefixtures("two")
def test_draws_of_a_line_have_its_covariance():
    lines = em.read_emissivity_lines("two.nc")
    body, band = (em.emissivity_trend(lines[name]) for name in ("chip body", "shear band"))
    surface = TrendSurface(body)
    assert surface.redrawn(0) is surface
    assert surface.redrawn(3).redrawn(2) == surface.redrawn(5)
    drawn = [shown(surface.redrawn(k), 900.0)[0, 0] for k in range(1, 401)]
    weights = np.array([1.0, 900.0 - body.middle])
    # 400 draws: their standard deviation is known to 3.5 %; three of them.
    assert np.std(drawn) == pytest.approx(np.sqrt(weights @ body.covariance @ weights), rel=0.11)
    # Both regions were heated by one thermocouple, whose error is nearly all there is.
    trends = FeatureTrends({"chip": body, "shear_band": band})
    scenes = [even_scene(664.0, 1.0, rate) for rate in (0.0, 5e4)]
    half, pairs = np.full(RASTER.shape, 0.5, np.float32), []
    for k in range(1, 101):
        change = trends.redrawn(k).change(CHIP_1, scenes[0], None, None)
        pairs.append([change(half, one.frame(0))[0, 0] for one in scenes])
    assert np.corrcoef(np.array(pairs).T)[0, 1] > 0.99


@pytest.mark.parametrize(
    ("strain", "rate", "parts"),
    [(1.0, 0.0, {"chip body": 1.0}), (1.0, 18e3, {"chip body": 0.5, "shear band": 0.5})],
)
@pytest.mark.usefixtures("two")
def test_a_measured_chip_is_its_features_by_their_lines(strain, rate, parts):
    section = {"measured": {"heated": "two.nc"}, "follow": "none"}
    study = Study(surface=section, analysis={"rake_chip": "heated", "band_chip": "heated"})
    surface = surfaces_of(study.surface, 1)["heated"]
    lines = em.read_emissivity_lines("two.nc")
    cold, hot = (shown(surface, kelvins, strain, rate) for kelvins in (664.15, 850.0))
    # The texture is the same; what is between two temperatures are the lines alone.
    expected = sum(
        part * (lines[name].at(850.0) - lines[name].at(664.15)).values
        for name, part in parts.items()
    )
    np.testing.assert_allclose(hot - cold, expected, atol=2 * STEP)  # a step of the map each
    # Of 960 pixels it is known to 0.0016: five times that.
    assert lines["chip body"].standard_deviation == pytest.approx(0.07, abs=0.008)


@pytest.mark.usefixtures("two")
def test_a_map_of_several_temperatures_has_a_line_in_each_pixel():
    surface = em.read_emissivity_map("two.nc")
    with xr.open_dataset("two.nc", engine="h5netcdf") as data:
        for kelvins, one in zip((TRUTH, 500.0 + CELSIUS), data["emissivity"].values, strict=True):
            # Likewise.
            np.testing.assert_allclose(shown(surface, kelvins), np.clip(one, 0, 1), atol=2 * STEP)
    # The body's emissivity is 0.04 more; its mean over 960 pixels varies by 0.07 / 31.
    assert shown(surface, 500.0 + CELSIUS)[:, :16].mean() == pytest.approx(0.46, abs=0.01)
    # One error of all pixels: as much as each of them is uncertain.
    drawn = np.array([surface.redrawn(k).at(RASTER)[5, 5] for k in range(1, 401)])
    # The standard deviation of 400 draws is known to 3.5 %: three times that.
    assert drawn.std() == pytest.approx(surface.uncertainty[5, 5], rel=0.11)
    assert surface.redrawn(0) is surface


def test_a_map_is_a_row_for_each_pixel_and_a_picture():
    image = measured(table_1(), frames=3, noise=0.5)
    image.data["flags"].values[:, 0, 1] = Flag.DEAD
    found = em.determine_emissivity([image], HEATING)
    frame = found.to_frame()
    assert len(frame) == RASTER.rows * RASTER.columns
    assert np.isnan(frame.emissivity[1])
    x, y = RASTER.x[5], RASTER.y[2]  # third row, sixth column
    (pixel,) = frame[np.isclose(frame.x_um, 1e6 * x) & np.isclose(frame.y_um, 1e6 * y)].index
    assert pixel == 2 * RASTER.columns + 5
    assert frame.emissivity[pixel] == found.emissivity[2, 5]
    assert frame.standard_uncertainty[pixel] == found.estimate.standard_uncertainty[2, 5]
    expected = found.radiance_temperature[2, 5] - CELSIUS
    assert frame.radiance_temperature_degC[pixel] == expected
    for axes in (on_given_axes(found), on_new_axes(found)):
        (picture,) = axes.get_images()
        np.testing.assert_array_equal(picture.get_array().filled(np.nan), found.emissivity)
    columns, rows, _ = in_a_notebook(found)
    assert columns == list(frame.columns)
    assert rows[0][2:4] == [f"{found.emissivity[0, 0]:.6g}", f"{frame.standard_uncertainty[0]:.6g}"]


@pytest.mark.parametrize("kelvins", [(0.0,), (0.0, 100.0)])
def test_emissivities_of_regions_are_drawn_with_their_uncertainty(kelvins):
    heatings = [em.Heating(TRUTH + more, reflected_uncertainty=5.0) for more in kelvins]
    images = [measured(table_1(), reference=one.reference) for one in heatings]
    found = em.determine_emissivities(images, heatings, REGION_LIST)
    axes = on_given_axes(found)
    names = [*(region.name for region in REGION_LIST), "chip body"]  # of both bodies
    if len(kelvins) == 1:
        bars = axes.containers[0]
        np.testing.assert_allclose(bars.lines[0].get_ydata(), found.to_frame()["mean"])
        low, high = (line.get_ydata() for line in bars.lines[1])
        u = [float(row.estimate.standard_uncertainty) for row in found.rows[0]]
        np.testing.assert_allclose(high - low, 4 * np.array(u))
        assert [tick.get_text() for tick in axes.get_xticklabels()] == names
    else:
        assert legend_of(axes) == names
        celsius, means = points_of(axes, "shear band")
        np.testing.assert_allclose(celsius, [one.reference - CELSIUS for one in heatings])
        np.testing.assert_allclose(means, [rows[2].mean for rows in found.rows])
    assert on_new_axes(found).get_ylabel() == "emissivity"
    columns, rows, sentences = in_a_notebook(found)
    assert columns[0] == "region" and [row[0] for row in rows] == names * len(kelvins)
    assert sentences == [*found.notes.warnings, *found.notes.assumed]
