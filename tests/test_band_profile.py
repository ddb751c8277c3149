"""The shear band of a measured image: its curve, the temperature along it, its stage."""

import csv
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from command import typed
from drawn import in_a_notebook, legend_of, on_given_axes, on_new_axes, points_of
from hypothesis import given, settings, strategies as st
from measured_band import BAND, LENGTH, RASTER, TOOL, BandImage, measured
from PIL import Image

from chipglow.camera import Flag, Measurement
from chipglow.chip import NoShearBandError
from chipglow.io import read_measurement, write_measurement
from chipglow.laboratory.chip import Stage, ThermalImage, band_profile, find_band
from chipglow.laboratory.chip.band_profile import CALIBRATION_UNKNOWN
from chipglow.uncertainty import from_xarray

PITCH = RASTER.spacing
X, Y = np.meshgrid(RASTER.x, RASTER.y)
DEPTH = TOOL.signed_distance(X, Y)
STRAIGHT = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-230e-6, 230e-6]])


def found(image, noise=0.0):
    return find_band(ThermalImage.of(measured([image.temperature()], noise), 0), TOOL)


def inner(along):
    """Without the two ends, which the tool and the fading band cut off oblique."""
    return (along > 60e-6) & (along < LENGTH - 40e-6)


# The curve


@pytest.mark.parametrize("angle", [0.6, 0.7, 0.85])
@pytest.mark.parametrize("bend", [1e-3, 600.0, 1200.0])
@pytest.mark.parametrize("deviation", [9e-6, 15e-6])
def test_the_ridge_is_found_within_a_tenth_of_a_pixel(angle, bend, deviation):
    image = BandImage(angle=angle, bend=bend, deviation=deviation)
    line = found(image)
    along, across = image.place(line.points)
    assert np.abs(across[inner(along)]).max() < 0.1 * PITCH
    assert along[0] < 30e-6
    # It fades to half at its length.
    assert along[-1] == pytest.approx(LENGTH, abs=4 * PITCH)


@pytest.mark.parametrize("seed", range(4))
def test_noise_of_5_kelvin_moves_the_ridge_by_less_than_a_quarter_of_a_pixel(seed):
    image = BandImage(deviation=12e-6)
    frame = measured([image.temperature()], 5.0, seed)
    along, across = image.place(find_band(ThermalImage.of(frame, 0), TOOL).points)
    assert np.sqrt((across[inner(along)] ** 2).mean()) < 0.25 * PITCH


NO_BANDS = {
    "uniform": np.full(RASTER.shape, 650.0),
    "slope": 650.0 + 2e5 * X,
    "step": np.where((X + Y > 0) & (DEPTH > 0), 700.0, 500.0),
    "smooth step": 500.0 + 200.0 / (1.0 + np.exp(-(X + Y) / 8e-6)),
    "heat along the rake face": 600.0 + 200.0 * np.exp(-(((DEPTH - 40e-6) / 20e-6) ** 2) / 2),
    "spot": 600.0 + 200.0 * np.exp(-((X + 1e-4) ** 2 + (Y - 1e-4) ** 2) / (2 * (20e-6) ** 2)),
}


@pytest.mark.parametrize("name", NO_BANDS)
@pytest.mark.parametrize("noise", [0.0, 20.0])
def test_an_image_without_a_band_is_one_clear_error(name, noise):
    with pytest.raises(NoShearBandError, match=r"^shear band: [^\n]+expected [^\n]+$"):
        band_profile(measured([NO_BANDS[name]], noise), TOOL)


def test_of_several_frames_those_without_a_band_say_so():
    frames = [BandImage().temperature(), NO_BANDS["uniform"]]
    profile = band_profile(measured(frames), TOOL)
    assert CALIBRATION_UNKNOWN in profile.notes.warnings
    assert profile.stage == (Stage.DEVELOPED, Stage.NONE)
    assert np.isnan(profile.temperature[1]).all()
    assert np.isnan(profile.offset[1])
    with pytest.raises(NoShearBandError, match="none is found in any of 2 frames"):
        band_profile(measured(frames[1:] * 2), TOOL)
    with pytest.raises(NoShearBandError, match="no pixel of the frame has a radiance temperature"):
        band_profile(measured([np.full(RASTER.shape, 400.0)]), TOOL)


def test_dead_and_saturated_pixels_do_not_lead_the_ridge_astray():
    image = BandImage()
    clean = measured([image.temperature()])
    flags, radiance = clean.flags.copy(), clean.radiance.copy()
    rows, columns = np.random.default_rng(3).integers(0, 60, (2, 80))
    flags[0, rows, columns] = np.where(rows % 2, Flag.DEAD, Flag.SATURATED)
    radiance[0, rows, columns] = 0.0
    damaged = Measurement.from_radiance(radiance, BAND, clean.times, RASTER, 573.15, flags)
    along, across = image.place(find_band(ThermalImage.of(damaged, 0), TOOL).points)
    assert np.abs(across[inner(along)]).max() < 0.5 * PITCH


# The temperature


def test_the_temperature_of_a_found_band_is_returned():
    image = BandImage(deviation=20e-6)
    profile = band_profile(measured([image.temperature()]), TOOL, width=0.0)
    along, _ = image.place(profile.points[0])
    kept = inner(along) & np.isfinite(profile.temperature[0])
    # Reading between four pixels of a Gaussian of 200 K, 3.3 pixels wide: up to 1/4 of 200/3.3² K.
    error = profile.temperature[0] - image.ridge_temperature(along)
    assert np.abs(error[kept]).max() < 4.6  # that limit; 2.0 K measured
    assert kept.sum() > 80
    # The distance counts from the edge along the curve.
    np.testing.assert_allclose(profile.distance[kept], along[kept], atol=PITCH)


def test_a_linear_field_is_read_exactly_along_a_given_curve():
    temperature = 700.0 + 1e5 * X - 5e4 * Y
    profile = band_profile(measured([temperature]), TOOL, curve=STRAIGHT, width=24e-6)
    x, y = profile.points[0].T
    # Temperatures are found from radiances to 1.6e-10: 1.1e-7 K.
    np.testing.assert_allclose(profile.temperature[0], 700.0 + 1e5 * x - 5e4 * y, atol=1.2e-7)
    assert profile.distance[0] == pytest.approx(np.hypot(30e-6, 30e-6))
    assert profile.distance[-1] - profile.distance[0] == pytest.approx(np.hypot(2e-4, 2e-4))
    assert profile.stage == (Stage.NONE,)
    assert any(text.startswith("The given curve") for text in profile.notes.assumed)


def test_the_mean_is_over_the_stated_width():
    raster = replace(RASTER, spacing=2e-6, rows=150, columns=150, left=-280e-6, top=290e-6)
    x, y = np.meshgrid(raster.x, raster.y)
    across = ((x - TOOL.edge_point[0]) + (y - TOOL.edge_point[1])) / np.sqrt(2)
    temperature = 900.0 - 1e11 * across**2
    curve = TOOL.edge_point + np.array([[-30e-6, 30e-6], [-200e-6, 200e-6]])
    narrow, wide = (
        band_profile(measured([temperature], raster=raster), TOOL, curve=curve, width=width)
        for width in (1e-6, 40e-6)
    )
    # The mean of -k n² over a width w is -k w²/12; 80 points come within 1/80² of it.
    drop = narrow.temperature[0] - wide.temperature[0]
    # Values between pixels add to that: 0.3 % measured.
    np.testing.assert_allclose(drop, 1e11 * (40e-6**2 - 1e-6**2) / 12, rtol=0.005)


# Its uncertainty


@settings(max_examples=8)
@given(shift=st.sampled_from([0.0, 12e-6, 20e-6]), error=st.sampled_from([1e-6, 3e-6]))
def test_the_position_s_uncertainty_is_that_of_curves_that_are_off(shift, error):
    """On the ridge, where the bend counts, and beside it, where the slope does."""
    image = BandImage(deviation=20e-6, bend=1e-3)
    frame = measured([image.temperature()])
    along = np.array([60e-6, 340e-6])
    curve = BandImage(deviation=20e-6, bend=1e-3, shift=shift).curve(along)
    profile = band_profile(frame, TOOL, curve=curve, width=0.0, position=error)
    off = error * np.random.default_rng(5).standard_normal((2000, 1, 2))
    away = image.at(profile.points[0] + off) - image.at(profile.points[0])
    spread = np.sqrt((away**2).mean(axis=0))
    middle = slice(5, -5)
    mean = np.sqrt((spread[middle] ** 2).mean())
    stated = np.sqrt((profile.estimate.standard_uncertainty[0][middle] ** 2).mean())
    # 2000 draws are good to 2 %; slope and bend are taken over two pixels, which takes up to 10 %
    # of those of a Gaussian 3.3 pixels wide, and up to 0.1 K of what vanishes.
    assert stated == pytest.approx(mean, rel=0.12, abs=0.1)


# The stage


def test_the_stage_follows_from_the_place_beside_the_reference():
    shifts = [-18e-6, 0.0, 3e-6, 30e-6]
    frames = measured([BandImage(shift=shift, bend=1e-3).temperature() for shift in shifts])
    profile = band_profile(frames, TOOL, reference=1)
    assert profile.stage == (Stage.DEVELOPING, Stage.DEVELOPED, Stage.DEVELOPED, Stage.MOVED)
    # Either of the two curves is within a tenth of a pixel.
    np.testing.assert_allclose(profile.offset, shifts, atol=0.2 * PITCH)
    np.testing.assert_array_equal(profile.in_place, [True, True, True, False])


def test_without_a_reference_the_hottest_band_at_the_edge_is_it():
    frames = [BandImage(bend=1e-3).temperature() + rise for rise in (0.0, 20.0, 10.0)]
    profile = band_profile(measured(frames), TOOL)
    assert any("at 10 µs is fully developed" in text for text in profile.notes.assumed)
    chosen = band_profile(measured(frames), TOOL, frames=[0, 2])
    assert any("at 20 µs is fully developed" in text for text in chosen.notes.assumed)
    assert chosen.times.tolist() == [0.0, 2e-5]


def test_a_given_curve_is_the_place_of_the_reference():
    image = BandImage(bend=1e-3)
    frames = [BandImage(bend=1e-3, shift=shift).temperature() for shift in (0.0, 24e-6)]
    curve = image.curve(np.array([30e-6, 300e-6]))
    profile = band_profile(measured(frames), TOOL, curve=curve)
    assert profile.stage == (Stage.DEVELOPED, Stage.MOVED)
    np.testing.assert_array_equal(profile.points[0], profile.points[1])


def test_a_single_band_has_a_doubtful_stage():
    frames = [BandImage().temperature(), NO_BANDS["uniform"]]
    profile = band_profile(measured(frames, relative_uncertainty=0.01), TOOL)
    assert profile.notes.warnings == ["Only one frame has a band; its stage cannot be judged."]


@pytest.mark.parametrize(("left", "doubted"), [(0.3, True), (0.95, False)])
def test_a_curve_over_a_deep_valley_is_doubtful(left, doubted):
    # The band's height over the chip is 140 to 200 K; 70 % of it is gone in the valley, or 5 %.
    image = BandImage()
    along, _ = image.place(np.stack([X, Y], axis=-1))
    valley = (1.0 - left) * np.exp(-(((along - 150e-6) / 30e-6) ** 2))
    temperature = 600.0 + (image.temperature() - 600.0) * (1.0 - valley)
    profile = band_profile(measured([temperature, temperature]), TOOL)
    said = "The curve at 0, 10 µs crosses a valley"
    assert any(warning.startswith(said) for warning in profile.notes.warnings) is doubted


def test_without_a_band_near_the_edge_the_stages_are_doubtful():
    image = BandImage()
    along, _ = image.place(np.stack([X, Y], axis=-1))
    temperature = np.where(along > 150e-6, image.temperature(), 600.0)
    profile = band_profile(measured([temperature, temperature + 5.0]), TOOL)
    assert profile.stage == (Stage.DEVELOPED, Stage.DEVELOPED)
    assert any(warning.startswith("No band begins near") for warning in profile.notes.warnings)


def test_a_coarse_image_of_a_wide_band_is_searched_as_well():
    raster = replace(RASTER, spacing=30e-6, left=-2.1e-3, top=1.8e-3)
    x, y = np.meshgrid(raster.x, raster.y)
    across = ((x - TOOL.edge_point[0]) + (y - TOOL.edge_point[1])) / np.sqrt(2)
    image = np.where(y > 0, 600.0 + 150.0 * np.exp(-0.5 * (across / 60e-6) ** 2), 500.0)
    line = find_band(ThermalImage.of(measured([image], raster=raster), 0), TOOL)
    off = np.abs((line.points - TOOL.edge_point).sum(axis=1)) / np.sqrt(2)
    middle = (line.distance > 300e-6) & (line.distance < 1.5e-3)
    assert off[middle].max() < 0.06 * 30e-6  # a parabola through pixels: 0.03 of a pixel measured


# Bad input


# The command


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    frames = [BandImage(shift=shift, bend=1e-3).temperature() for shift in (-18e-6, 0.0)]
    write_measurement(measured(frames, relative_uncertainty=0.01), tmp_path / "measured.nc")
    return "measured.nc"


def test_the_command_writes_what_it_shows(file, tmp_path):
    said = typed(f"shearband {file} --reference '10 us' --out band.csv --plot band.png").output
    assert "developing" in said and "fully developed" in said
    with (tmp_path / "band.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    profile = band_profile(read_measurement(file), TOOL, reference=1)
    values = [float(row["radiance_temperature_degC"] or "nan") for row in rows]
    there = np.isfinite(profile.points[..., 0])
    # Nine printed digits.
    np.testing.assert_allclose(values, profile.temperature[there] - 273.15, atol=1e-6)
    for cause in ("calibration", "position"):
        parts = [float(row[f"{cause}_uncertainty_K"] or "nan") for row in rows]
        expected = profile.estimate.contribution(cause)[there]
        # Nine printed digits.
        np.testing.assert_allclose(parts, expected, atol=1e-7)
        (line,) = (line.split() for line in said.splitlines() if cause in line)
        # Two printed digits.
        assert float(line[-1]) == pytest.approx(np.nanmax(expected), rel=0.05)
    assert {row["tool_along_uncertainty_K"] for row in rows} == {""}
    assert [row["stage"] for row in rows].count("developing") == there[0].sum()
    with Image.open(tmp_path / "band.png") as picture:
        assert picture.width > 800


def test_the_netcdf_file_holds_si_units(file, tmp_path):
    (tmp_path / "curve.csv").write_text("x_um,y_um\n-30,40\n-230,240\n", encoding="utf-8")
    options = "--at '10 us' --curve curve.csv --width '12 um' --position '2 um'"
    typed(f"shearband {file} {options} --out band.nc")
    data = xr.load_dataset(tmp_path / "band.nc", engine="h5netcdf", decode_times=False)
    assert data["temperature"].attrs["units"] == "K"
    assert data.sizes["time"] == 1
    assert data.attrs["width"] == pytest.approx(12e-6)
    assert 600 < float(data["temperature"].mean()) < 800  # the image has nothing else
    read = from_xarray(data, "temperature")
    both = np.hypot(read.contribution("calibration"), read.contribution("position"))
    np.testing.assert_allclose(data["standard_uncertainty"], both)
    assert 1.5 < np.nanmax(read.contribution("calibration")) < 2.0


@pytest.mark.parametrize("depth", [5e-6, 10e-6, 20e-6])
def test_a_cold_strip_below_the_edge_does_not_hide_a_band(depth):
    """The border of the strip is bent more than the band of 110 K, and no ridge."""
    image = BandImage(base=690.0)
    shown = np.where(TOOL.edge_point[1] - depth > Y, 300.0, image.temperature())
    line = find_band(ThermalImage.of(measured([shown], 1.0), 0), TOOL)
    along, across = image.place(line.points)
    middle = (along > 60e-6) & (along < 250e-6)
    assert middle.sum() > 50
    assert np.abs(across[middle]).max() < 0.5 * PITCH


@pytest.mark.parametrize("count", [2, 13])  # over 12, a colour bar names the frames
def test_a_profile_is_drawn_by_frame_and_shown_with_its_notes(count):
    image = BandImage(deviation=20e-6).temperature()
    profile = band_profile(measured([image + k for k in range(count)]), TOOL, reference=0)
    axes = on_given_axes(profile)
    assert legend_of(axes) == legend_of(on_new_axes(profile))
    if count == 2:
        along, celsius = points_of(axes, legend_of(axes)[1])
        np.testing.assert_allclose(along, 1e6 * profile.distance)
        np.testing.assert_allclose(celsius, profile.temperature[1] - 273.15)
    else:
        assert legend_of(axes) == ["fully developed"]
        assert axes.figure.axes[1].get_ylabel() == "time / µs"
    columns, rows, sentences = in_a_notebook(profile)
    assert columns[:3] == ["time_us", "stage", "distance_um"]
    assert rows[0][1] == "fully developed"
    assert sentences == [*profile.notes.warnings, *profile.notes.assumed]
