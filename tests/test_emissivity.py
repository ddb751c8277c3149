"""Emissivity from heated chips: what was put in comes out, within its stated uncertainty."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from heated_chip import BAND, CELSIUS, RASTER, REGIONS, measured, table_1
from hypothesis import given, settings, strategies as st
from typer.testing import CliRunner

from chipglow.camera import CalibrationErrors, Camera, Flag
from chipglow.cli import app
from chipglow.io import write_measurement
from chipglow.laboratory.emissivity import (
    Heating,
    RegionEmissivities,
    determine_emissivity,
    emissivity_covariance,
    emissivity_line,
    emissivity_trend,
    read_emissivity_lines,
    read_emissivity_map,
    write_emissivity,
)
from chipglow.laboratory.emissivity.emissivity import COMMON
from chipglow.scene import FIELD_UNITS, Area, Polygon, Raster, Region, Scene, areas
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of
from chipglow.surface import CHIP_1, FeatureTrends, MapSurface, TrendSurface

TRUTH = 391.0 + CELSIUS
HEATING = Heating(TRUTH)
WHOLE = Area("all", "all", np.ones(RASTER.shape, bool), True)
REGION_LIST = (
    Region("body left", Polygon.rectangle((0, 0), (16, 30)), "chip body"),
    Region("body right", Polygon.rectangle((24, 0), (40, 30)), "chip body"),
    Region("shear band", Polygon.rectangle((17, 0), (23, 30))),
)


def rows_of(found):
    return {area.name: found.of(area) for area in areas(REGION_LIST, found.raster)}


def slopes(reference=TRUTH, reflected=293.0):
    """Radiances of reference and reflected, and their derivatives with temperature."""
    points = np.array([reference, reflected])
    return BAND.radiance(points), (BAND.radiance(points + 0.5) - BAND.radiance(points - 0.5))


# What was put in


@given(st.floats(0.02, 1.0), st.floats(500.0, 1500.0), st.floats(200.0, 350.0))
@settings(max_examples=50)
def test_equation_2_is_undone(emissivity, reference, reflected):
    small = Raster(0.0, 0.0, 6e-6, 2, 2)
    image = measured(np.full((2, 2), emissivity), reference, reflected, raster=small)
    found = determine_emissivity([image], Heating(reference, reflected))
    np.testing.assert_allclose(found.emissivity, emissivity, rtol=1e-12)


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
    rows = rows_of(determine_emissivity([image], Heating(celsius + CELSIUS)))
    # A camera without blur whose pixels are the samples; emissivities are float32 on their way.
    parts = {"chip body": put_in[:, np.r_[:16, 24:40]], "shear band": put_in[:, 17:23]}
    for name, (mean, standard_deviation) in (("chip body", body), ("shear band", band)):
        row = rows[name]
        assert row.used.count == parts[name].size
        assert row.mean == pytest.approx(parts[name].mean(), abs=1e-6)
        assert row.standard_deviation == pytest.approx(parts[name].std(ddof=1), abs=1e-6)
        # And so the table's, but for drawing 960 and 180 pixels: four standard deviations of both.
        assert row.mean == pytest.approx(mean, abs=4 * standard_deviation / row.used.count**0.5)
        error = 4 / (2 * row.used.count) ** 0.5
        assert row.standard_deviation == pytest.approx(standard_deviation, rel=error)


# Uncertainty


def test_the_budget_is_that_of_the_derivatives():
    heating = Heating(TRUTH, 293.0, 2.0, 1.5, 0.8)
    row = determine_emissivity([measured(np.full(RASTER.shape, 0.5))], heating).of(WHOLE)
    (hot, cold), (hot_slope, cold_slope) = slopes()
    contrast = hot - cold
    seen = 0.5 * (hot + cold)
    temperature = BAND.temperature(seen)
    slope = BAND.radiance(temperature + 0.5) - BAND.radiance(temperature - 0.5)
    # Second-order terms of 2 K in 664 K are 1e-4 of the first.
    assert row.estimate.effect("reference") == pytest.approx(
        -0.5 * hot_slope / contrast * 2.0, rel=1e-3
    )
    assert row.estimate.effect("reflected") == pytest.approx(
        -0.5 * cold_slope / contrast * 1.5, rel=1e-3
    )
    assert row.estimate.effect("calibration") == pytest.approx(slope * 0.8 / contrast, rel=1e-3)
    assert row.estimate.standard_uncertainty == pytest.approx(
        np.linalg.norm([row.estimate.effect(cause) for cause in COMMON]), rel=1e-9
    )
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
    heating = Heating(TRUTH, 293.0, 2.0, 1.0, 1.5)

    def observe(put_in, generator):
        true, around, wrong = generator.normal((TRUTH, 293.0, 0.0), (2.0, 1.0, 1.5))
        image = measured(put_in, true, around, frames=4, noise=3.0, seed=generator, drift=0.5)
        radiance = BAND.radiance(BAND.temperature(image.radiance) + wrong)
        image.data["radiance"].values[:] = radiance
        return determine_emissivity([image], heating)

    # 95 of 100 expected, standard deviation 2.2: three of them. Of intervals half as wide 67 would
    # hold, and of those twice as wide all with a probability of 0.99.
    assert 88 <= coverage(observe) <= 99


@pytest.mark.parametrize("frames", [2, 8])
def test_intervals_of_chance_alone_hold_the_truth(frames):
    def observe(put_in, generator):
        image = measured(put_in, frames=frames, noise=3.0, seed=generator, drift=2.0)
        return determine_emissivity([image], HEATING)

    assert 88 <= coverage(observe) <= 99


def test_drift_and_noise_are_told_apart():
    noise, drift, frames = 4.0, 1.0, 400
    (hot, cold), _ = slopes()
    image = measured(np.full(RASTER.shape, 0.5), frames=frames, noise=noise, drift=drift)
    found = determine_emissivity([image], HEATING)
    row, contrast = found.of(WHOLE), hot - cold
    # The standard deviation of 400 frames is known to 3.5 %, that of 480 000 pixels to 0.1 %.
    expected = drift / frames**0.5 / contrast
    assert row.estimate.contribution("repeatability") == pytest.approx(expected, rel=0.15)
    assert row.estimate.contribution("noise") == pytest.approx(
        noise / (frames * RASTER.rows * RASTER.columns) ** 0.5 / contrast, rel=0.005
    )
    # A pixel's uncertainty has its own noise.
    expected = np.hypot(noise, drift) / frames**0.5 / contrast
    assert found.estimate.standard_uncertainty.mean() == pytest.approx(expected, rel=0.01)


def test_images_are_the_repetitions_where_there_are_several():
    put_in = np.full(RASTER.shape, 0.5)
    images = [measured(put_in * (1 + step), frames=50, noise=0.1) for step in (-0.01, 0.0, 0.01)]
    row = determine_emissivity(images, HEATING).of(WHOLE)
    # Means of 0.495, 0.5 and 0.505: s = 0.005, and s / sqrt(3) with 2 degrees of freedom.
    assert row.estimate.only("random").standard_uncertainty == pytest.approx(
        0.005 / 3**0.5, rel=1e-3
    )
    assert row.estimate.degrees_of_freedom == pytest.approx(2.0, rel=1e-6)
    assert row.estimate.coverage_factor() == pytest.approx(4.302653, rel=1e-6)


def test_the_uncertainty_of_the_calibration_comes_from_the_measurement():
    put_in = table_1()
    image = measured(
        put_in, calibration_errors=CalibrationErrors(np.array([0.0, 1.0]), np.array([[5.0, 5.0]]))
    )
    (hot, cold), _ = slopes()
    row = determine_emissivity([image], HEATING).of(WHOLE)
    # It is common to all pixels: a mean over them does not lessen it.
    assert row.estimate.contribution("calibration") == pytest.approx(5.0 / (hot - cold), rel=1e-12)
    own = determine_emissivity([image], replace(HEATING, camera_uncertainty=0.0)).of(WHOLE)
    assert own.estimate.contribution("calibration") == 0.0


def test_the_difference_of_two_regions_is_known_better_than_either():
    heating = Heating(TRUTH, 293.0, 4.0, 2.0, 3.0)
    put_in = table_1((0.42, 0.001), (0.53, 0.001))
    generator, differences = np.random.default_rng(8), []
    for _ in range(100):
        true, around, wrong = generator.normal((TRUTH, 293.0, 0.0), (4.0, 2.0, 3.0))
        image = measured(put_in, true, around, frames=3, drift=5.0, seed=generator)
        radiance = BAND.radiance(BAND.temperature(image.radiance) + wrong)
        image.data["radiance"].values[:] = radiance
        rows = rows_of(determine_emissivity([image], heating))
        differences.append(rows["shear band"].mean - rows["chip body"].mean)
    (a, b), (_, d) = emissivity_covariance([rows["shear band"], rows["chip body"]])
    stated = np.sqrt(a - 2 * b + d)
    # 100 differences: the standard deviation is known to 7 %; three of them.
    assert np.std(differences) == pytest.approx(stated, rel=0.21)
    assert stated < 0.25 * rows["shear band"].estimate.standard_uncertainty


# Over the temperature


def heated_series(generator, temperatures, errors=(0.0, 0.0), frames=4):
    """A body whose emissivity is 0.4 + 2e-4 (T − 700 K), with a wrong thermocouple and camera."""
    rows = []
    for temperature in temperatures:
        emissivity = np.full(RASTER.shape, 0.4 + 2e-4 * (temperature - 700.0))
        image = measured(emissivity, temperature, frames=frames, drift=1.0, seed=generator)
        radiance = BAND.radiance(BAND.temperature(image.radiance) + errors[1])
        image.data["radiance"].values[:] = radiance
        heating = Heating(temperature + errors[0], 293.0, 2.0, 0.0, 1.0)
        rows.append(determine_emissivity([image], heating).of(WHOLE).line)
    return emissivity_line(rows)


@pytest.mark.parametrize("temperatures", [(600.0, 800.0), (600.0, 700.0, 800.0, 900.0)])
def test_the_line_is_as_uncertain_as_it_says(temperatures):
    generator = np.random.default_rng(5)
    lines = [
        heated_series(generator, temperatures, generator.normal((0.0, 0.0), (2.0, 1.0)))
        for _ in range(60)
    ]
    for index, reference in ((1, 2e-4), (0, None)):
        off = np.array(
            [
                line.estimate.values[index] - (reference or 0.4 + 2e-4 * (line.middle - 700.0))
                for line in lines
            ]
        )
        stated = np.sqrt(np.mean([line.estimate.covariance()[index, index] for line in lines]))
        # The standard deviation of 60 is known to 9.2 %; three of that.
        assert off.std() == pytest.approx(stated, rel=0.28)
        assert abs(off.mean()) < 3 * stated / 60**0.5


def test_scatter_about_the_line_counts():
    rows = [
        determine_emissivity([measured(np.full(RASTER.shape, e), t)], Heating(t)).of(WHOLE).line
        for e, t in ((0.4, 600.0), (0.5, 700.0), (0.4, 800.0))
    ]
    line = emissivity_line(rows)
    # Sum of squares about the mean 13/30: 0.02/3; one degree of freedom.
    assert line.residual == pytest.approx((0.02 / 3) ** 0.5, rel=1e-6)
    assert line.estimate.standard_uncertainty[0] == pytest.approx(line.residual / 3**0.5, rel=1e-6)
    assert line.estimate.standard_uncertainty[1] == pytest.approx(
        line.residual / 20000**0.5, rel=1e-6
    )


# Warning and impossible


def test_flagged_pixels_are_left_out_counted_and_doubted():
    put_in = table_1()
    flags = np.zeros((3, *RASTER.shape), np.uint8)
    flags[1, 0, :10] = Flag.DEAD
    flags[2, 1, :100] = Flag.SATURATED
    flags[:, 2, :5] = Flag.REPLACED
    found = determine_emissivity([measured(put_in, frames=3, flags=flags)], HEATING)
    row = found.of(WHOLE)
    out = (flags & (Flag.DEAD | Flag.SATURATED)).any(axis=0)
    np.testing.assert_array_equal(np.isnan(found.emissivity), out)
    assert (row.used.count, row.used.left_out) == (1150, 50)
    assert row.used.flagged == {Flag.UNDER_RANGE: 0, Flag.SATURATED: 40, Flag.DEAD: 10}
    assert row.mean == pytest.approx(put_in[~out].mean(), rel=1e-12)
    assert row.estimate.warnings == ()
    flags[0, 5, :20] = Flag.SATURATED
    row = determine_emissivity([measured(put_in, frames=3, flags=flags)], HEATING).of(WHOLE)
    assert row.estimate.warnings == (
        "all: 70 of 1200 pixels are left out (60 saturated, 10 dead). "
        "The remaining pixels are darker than the region.",
    )


def test_a_region_that_the_floor_cuts_says_that_it_is_too_bright():
    put_in = table_1((0.42, 0.07))
    lower_limit = float(BAND.temperature(measured(np.full(RASTER.shape, 0.38)).radiance[0, 0, 0]))
    image = measured(put_in, lower_limit=lower_limit)
    row = determine_emissivity([image], HEATING).of(WHOLE)
    assert row.mean > put_in.mean() + 0.01
    assert (
        "under the lower range limit). The remaining pixels are brighter than the region"
        in row.estimate.warnings[0]
    )
    assert row.estimate.warnings[0].endswith("the camera's range hides emissivities below 0.38.")


def test_impossible_emissivities_are_told():
    put_in = np.full(RASTER.shape, 0.9)
    put_in[0] = 1.1
    put_in[1, :7] = -0.0005
    row = determine_emissivity([measured(put_in)], HEATING).of(WHOLE)
    assert row.outside == (7, 40)
    assert "7 of 1200 pixels have an emissivity under 0" in row.estimate.warnings[0]
    assert "40 of 1200 pixels have an emissivity over 1" in row.estimate.warnings[1]
    bright = determine_emissivity([measured(np.full(RASTER.shape, 1.2))], HEATING).of(WHOLE)
    assert bright.estimate.warnings[-1] == "all: the mean emissivity is not within 0 to 1."


def determined(values=None, heating=HEATING, **more):
    image = measured(table_1() if values is None else values, **more)
    return determine_emissivity([image], heating)


SMALL = measured(np.full((5, 5), 0.5), raster=Raster(0.0, 0.0, 6e-6, 5, 5))
DARK = np.full((1, *RASTER.shape), Flag.SATURATED, np.uint8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Heating(293.0), "reference: 19.85 °C must be over what is reflected, 19.85 °C"),
        (lambda: Heating(float("nan")), "reference: nan K, expected over 0 K"),
        (lambda: Heating(TRUTH, -1.0), "reflected: -1 K"),
        (lambda: Heating(TRUTH, camera_uncertainty=float("inf")), "camera_uncertainty: inf"),
        (lambda: Heating(TRUTH, drift=2), "drift: 2, expected 0 or more, under 1"),
        (lambda: Heating(300.0, 293.0, 3.0), "by 5 standard uncertainties of 3 K or more"),
        (
            lambda: determined(lower_limit=700.0),
            "reference: 391 °C is under the camera's lower range limit of 426.85 °C",
        ),
        (
            lambda: determine_emissivity([measured(table_1()), SMALL], HEATING),
            "image 2: has other pixels",
        ),
        (
            lambda: determined(flags=DARK).of(WHOLE),
            r"region all: 0 of its 1200 pixels can be used \(1200 sa",
        ),
        (
            lambda: emissivity_line(2 * [determined().of(WHOLE).line]),
            "the temperatures are all the same",
        ),
        (lambda: MapSurface(np.full((3, 3), 0.5), RASTER), "have shape"),
        (
            lambda: MapSurface(np.full(RASTER.shape, 1.01), RASTER),
            "goes from 1.01 to 1.01, expected 0 to 1",
        ),
        (lambda: MapSurface(np.full(RASTER.shape, np.nan), RASTER), "no pixel is known"),
    ],
)
def test_impossible_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


# The map as a surface, the regions as a study


def test_a_map_on_its_own_raster_is_itself_and_off_it_what_is_said():
    put_in = table_1()
    surface = MapSurface(put_in, RASTER, elsewhere=0.3)
    np.testing.assert_allclose(surface.at(RASTER), put_in, atol=1e-7)
    wide = Raster(RASTER.left - 12e-6, RASTER.top, 6e-6, 30, 44)
    wider = surface.at(wide)
    np.testing.assert_allclose(wider[:, 2:42], put_in, atol=1e-7)
    np.testing.assert_allclose(wider[:, [0, 1, 42, 43]], 0.3, atol=1e-7)


def test_a_map_is_averaged_over_areas_and_interpolated_between():
    put_in = table_1()
    coarse = MapSurface(put_in, RASTER).at(Raster(RASTER.left, RASTER.top, 12e-6, 15, 20))
    np.testing.assert_allclose(coarse, put_in.reshape(15, 2, 20, 2).mean(axis=(1, 3)), atol=1e-6)
    fine = Raster(RASTER.left + 12e-6, RASTER.top - 12e-6, 1.5e-6, 100, 140)
    plane, expected = (
        0.2 + 1500.0 * (r.x[None, :] - RASTER.left) + 1000.0 * (RASTER.top - r.y[:, None])
        for r in (RASTER, fine)
    )
    np.testing.assert_allclose(MapSurface(plane, RASTER).at(fine), expected, atol=1e-6)


def test_unknown_pixels_of_a_map_do_not_pull_their_neighbours():
    put_in = np.full(RASTER.shape, 0.6)
    put_in[10, 10] = np.nan
    coarse = MapSurface(put_in, RASTER).at(Raster(RASTER.left, RASTER.top, 12e-6, 15, 20))
    np.testing.assert_allclose(coarse, 0.6, atol=1e-7)


# Files and the command


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "regions.yaml").write_text(REGIONS)
    write_measurement(measured(table_1(), frames=5, noise=1.0), tmp_path / "a.nc")
    hot = measured(table_1((0.46, 0.07)), 500.0 + CELSIUS, frames=5, noise=1.0)
    write_measurement(hot, tmp_path / "b.nc")
    return tmp_path


def command(*arguments):
    return CliRunner().invoke(app, ["emissivity", "--regions", "regions.yaml", *arguments])


def test_the_command_writes_table_map_and_picture(folder):
    outputs = ["--out", "e.nc", "--table", "t.csv", "--plot", "p.png"]
    spread = ["--reference-uncertainty", "2 K", "--reflected-uncertainty", "1 degC"]
    result = command("a.nc", "--reference", "391degC", *spread, *outputs)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[-3:] == ["e.nc", "t.csv", "p.png"]
    assert "Assumed: The camera's calibration is exact" in result.output
    assert "repeatability" in result.output
    with Path("t.csv").open(encoding="utf-8", newline="") as file:
        lines = {line["region"]: line for line in csv.DictReader(file)}
    found = determine_emissivity(
        [measured(table_1(), frames=5, noise=1.0)], Heating(TRUTH, 293.0, 2.0, 1.0)
    )
    for name, row in rows_of(found).items():
        assert float(lines[name]["mean"]) == pytest.approx(row.mean, rel=1e-6)
        assert float(lines[name]["expanded_uncertainty"]) == pytest.approx(
            row.estimate.expanded_uncertainty(), rel=1e-6
        )
    text = result.stdout.split("For a study:")[1].split("e.nc")[0]
    assert Study(**yaml.safe_load(text)).surface.chips["measured chip"].body.mean == pytest.approx(
        float(lines["chip body"]["mean"]), abs=6e-5
    )
    surface = read_emissivity_map("e.nc")
    np.testing.assert_allclose(surface.values, found.emissivity, rtol=1e-15)
    np.testing.assert_allclose(surface.raster.extent, RASTER.extent, atol=1e-12)
    assert (folder / "p.png").stat().st_size > 10_000


def test_the_command_fits_over_the_temperature(folder):
    references = ["--reference", "391 degC", "--reference", "500 degC"]
    result = command("a.nc", "b.nc", *references, "--plot", "p.svg", "--out", "e.nc")
    assert result.exit_code == 0, result.output
    assert "change in 100 K" in result.output
    assert (folder / "p.svg").is_file()
    text = result.stdout.split("For a study:")[1].split("\ne.nc\n")[0]
    assert surfaces_of(Study(**yaml.safe_load(text)).surface, 1).keys() >= {"measured chip"}
    hotter = read_emissivity_map("e.nc", reference=770.0)
    # The body's emissivity is 0.04 more; its mean over 960 pixels varies by 0.07 / 31.
    assert hotter.values[:, :16].mean() == pytest.approx(0.46, abs=0.01)


OUTSIDE = "regions: {a: {rectangle: [[0, 0], [400, 3]]}}"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["a.nc", "--reference", "10degC"], "10 °C must be over what is reflected,"),
        (
            ["a.nc", "small.nc", "--reference", "391degC", "--reference", "500degC"],
            "small.nc: has other pixels, or another band, than a.nc, expected",
        ),
        (
            ["a.nc", "--reference", "391degC", "--regions", "outside.yaml"],
            "region a: reaches over columns 0 to 400, expected within the image's 0 to 40",
        ),
        (
            ["a.nc", "--reference", "1 K", "--reference", "2 K"],
            "--reference: 2 temperatures for 1 images",
        ),
        (["none.nc", "--reference", "391degC"], "none.nc: there is no such file"),
        (["a.nc", "--reference", "391degC", "--set", "band=1"], "--set"),
    ],
)
def test_bad_input_is_one_line(folder, arguments, message):
    (folder / "outside.yaml").write_text(OUTSIDE)
    write_measurement(SMALL, folder / "small.nc")
    before = set(folder.iterdir())
    result = command(*arguments, "--out", "e.nc")
    assert result.exit_code == 2
    assert message in result.output
    assert len(result.output.splitlines()) == 1
    assert set(folder.iterdir()) == before


def test_assumptions_and_warnings_are_printed(folder):
    flags = np.zeros((1, *RASTER.shape), np.uint8)
    flags[0, :3] = Flag.DEAD
    write_measurement(measured(table_1(), flags=flags), folder / "a.nc")
    result = command("a.nc", "--reference", "391degC")
    assert result.exit_code == 0
    for sentence in (
        "Assumed: The true temperature is exact",
        "Assumed: The object reflects exactly 19.85 degC; 100 K more would shift",
        "Assumed: The camera does not drift between recordings",
        "Assumed: The camera's calibration is exact",
        "Assumed: Nothing changes between frames",
    ):
        assert sentence in result.stderr
    assert "Warning: shear band: 18 of 180 pixels are left out (18 dead)." in result.stderr


# A study's surface of what was measured


def two_temperatures(folder):
    """The file of a chip at 391 °C and 500 °C, by the command."""
    references = ["--reference", "391 degC", "--reference", "500 degC"]
    more = ["--reference-uncertainty", "2 K", "--out", "e.nc"]
    result = command("a.nc", "b.nc", *references, *more)
    assert result.exit_code == 0, result.output
    return result.output


def even_scene(temperature, strain=1.0, rate=0.0, material=1):
    values = np.ones((1, *RASTER.shape))
    fields = {
        "temperature": values * temperature,
        "material": (values * material).astype(np.uint8),
        "plastic_strain": values * strain,
        "plastic_strain_rate": values * rate,
    }
    return Scene.from_fields(RASTER, [0.0], fields)


def test_a_study_takes_the_line_of_a_region(folder):
    two_temperatures(folder)
    line = read_emissivity_lines("e.nc")["chip body"]
    trend = emissivity_trend(line)
    np.testing.assert_allclose(trend.covariance, line.estimate.covariance(), rtol=1e-9)
    assert trend.measured == line.temperatures
    study = Study(surface={"kind": "measured", "file": "e.nc", "region": "chip body"})
    (surface,) = surfaces_of(study.surface, 1).values()
    for kelvins in (600.0, 700.0, 900.0):
        scene = even_scene(kelvins)
        found = surface.on(scene).emissivity(scene.frame(0))
        np.testing.assert_allclose(found, line.at(kelvins).values, rtol=1e-6)
    scene = even_scene(5_000.0)
    assert surface.on(scene).emissivity(scene.frame(0)).max() == 1.0


def test_draws_of_a_line_have_its_covariance(folder):
    two_temperatures(folder)
    areas_of = read_emissivity_lines("e.nc")
    body, band = (emissivity_trend(areas_of[name]) for name in ("chip body", "shear band"))
    surface = TrendSurface(body)
    assert surface.redrawn(0) is surface
    assert surface.redrawn(3).redrawn(2) == surface.redrawn(5)
    scene = even_scene(900.0)
    drawn = [surface.redrawn(k).on(scene).emissivity(scene.frame(0))[0, 0] for k in range(1, 401)]
    weights = np.array([1.0, 900.0 - body.middle])
    # 400 draws: their standard deviation is known to 3.5 %; three of them.
    assert np.std(drawn) == pytest.approx(np.sqrt(weights @ body.covariance @ weights), rel=0.11)
    # Both regions were heated by one thermocouple, whose error is nearly all there is.
    trends = FeatureTrends({"chip": body, "shear_band": band})
    scenes = [even_scene(664.0, rate=rate) for rate in (0.0, 5e4)]
    half = np.full(RASTER.shape, 0.5, np.float32)
    pairs = []
    for k in range(1, 101):
        change = trends.redrawn(k).change(CHIP_1, scene, None, None)
        pairs.append([change(half, one.frame(0))[0, 0] for one in scenes])
    assert np.corrcoef(np.array(pairs).T)[0, 1] > 0.99


@pytest.mark.parametrize(
    ("strain", "rate", "parts"),
    [(1.0, 0.0, {"chip body": 1.0}), (1.0, 18e3, {"chip body": 0.5, "shear band": 0.5})],
)
def test_a_measured_chip_is_its_features_by_their_lines(folder, strain, rate, parts):
    two_temperatures(folder)
    section = {"measured": {"heated": "e.nc"}, "follow": "none"}
    study = Study(surface=section, analysis={"rake_chip": "heated", "band_chip": "heated"})
    surface = surfaces_of(study.surface, 1)["heated"]
    lines = read_emissivity_lines("e.nc")
    found = {}
    for kelvins in (664.15, 850.0):
        scene = even_scene(kelvins, strain, rate)
        found[kelvins] = surface.on(scene).emissivity(scene.frame(0))
    # The texture is the same; what is between two temperatures are the lines alone.
    expected = sum(
        part * (lines[name].at(850.0) - lines[name].at(664.15)).values
        for name, part in parts.items()
    )
    np.testing.assert_allclose(found[850.0] - found[664.15], expected, atol=1e-6)
    assert read_emissivity_lines("e.nc")["chip body"].standard_deviation == pytest.approx(
        0.07, abs=0.01
    )


def test_a_map_of_several_temperatures_has_a_line_in_each_pixel(folder):
    two_temperatures(folder)
    cold, hot = (read_emissivity_map("e.nc", reference=one) for one in (660.0, 770.0))
    surface = read_emissivity_map("e.nc")
    for kelvins, one in ((TRUTH, cold), (500.0 + CELSIUS, hot)):
        scene = even_scene(kelvins)
        found = surface.on(scene).emissivity(scene.frame(0))
        np.testing.assert_allclose(found, one.values, atol=1e-6)
    # One error of all pixels: as much as each of them is uncertain.
    drawn = np.array([surface.redrawn(k).at(RASTER)[5, 5] for k in range(1, 401)])
    assert drawn.std() == pytest.approx(surface.uncertainty[5, 5], rel=0.11)
    assert surface.redrawn(0) is surface


def test_wrong_files_and_regions_are_one_error(folder):
    two_temperatures(folder)
    wrong = Study(surface={"kind": "measured", "file": "e.nc", "region": "nose"})
    with pytest.raises(ValueError, match=r"region: 'nose' is not in .*e.nc, expected one of body"):
        surfaces_of(wrong.surface, 1)
    found = determine_emissivity([measured(table_1())], HEATING)
    write_emissivity(RegionEmissivities((found,), ((found.of(WHOLE),),)), "all.nc")
    study = Study(surface={"measured": {"heated": "all.nc"}})
    with pytest.raises(ValueError, match=r"all.nc: is of the features all, expected chip body"):
        surfaces_of(study.surface, 1)
    with pytest.raises(ValueError, match="measured: 'chip 1' is the name of another chip"):
        Study(surface={"measured": {"chip 1": "e.nc"}})
    (folder / "empty.nc").touch()
    for name in ("a.nc", "empty.nc"):
        with pytest.raises(ValueError, match=rf"{name}: not an emissivity map"):
            read_emissivity_map(name)
    with pytest.raises(FileNotFoundError, match=r"none\.nc"):
        read_emissivity_map("none.nc")
