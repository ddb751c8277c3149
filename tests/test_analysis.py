"""The analyses against scenes whose answers are known in closed form."""

import re
from dataclasses import replace
from math import cos, hypot, log, radians, sin

import numpy as np
import pytest
from analytic_chip import AnalyticChip
from figure6 import figure_6
from hypothesis import given, settings, strategies as st
from measured_band import BandImage
from scipy.interpolate import RegularGridInterpolator

from chipglow.analysis import (
    CASES,
    BandPlace,
    LinePlace,
    Plan,
    PointPlace,
    RakePlace,
    analyse,
    error_images,
    headline,
    headlines,
    image_error,
    line_error,
    one_draw,
    sensitivity_error,
    sensitivity_psf_fraction,
)
from chipglow.analysis.heated import heated_objects
from chipglow.camera import (
    EVERY,
    Camera,
    Detector,
    Effect,
    EnergyResponse,
    Exposure,
    GaussianPSF,
    ReadNoise,
    reference_temperature,
)
from chipglow.camera.optics.sampling import LEAST_COVERED
from chipglow.chip import NoShearBandError, contact_length, find_shear_band, segmentation
from chipglow.radiometry import Band
from chipglow.scene import Raster, Scene, ToolGeometry, sample
from chipglow.scene.lines import nearest
from chipglow.surface import CHIP_1, CHIP_2, UniformSurface

ROUNDING = 1e-10
"""In K: temperatures of 1000 K in double precision, 1e-13, after some sums."""

BAND = Band(3.8e-6, 5.1e-6)
CAMERA = replace(Camera.paper(), psf=GaussianPSF(12e-6))
GRID = Raster(left=-300e-6, top=300e-6, spacing=2e-6, rows=180, columns=180)
TOOL = ToolGeometry()
POINTS = np.stack(np.meshgrid(GRID.x, GRID.y), axis=-1)
DEPTH = TOOL.signed_distance(POINTS[..., 0], POINTS[..., 1])
SURFACES = {"chip 1": CHIP_1, "chip 2": CHIP_2}
NOISY = Detector(response=EnergyResponse(1e4), full_well=1e7, terms=(ReadNoise(2000.0),))


def exposure_of(radiance, peak=None, raster=GRID, temperature=None):
    radiance = np.asarray(radiance, np.float64)
    peak = radiance if peak is None else peak
    temperature = np.full(raster.shape, 900.0) if temperature is None else temperature
    return Exposure(
        start=0.0,
        duration=1e-5,
        raster=raster,
        mean_radiance=radiance,
        peak_radiance=np.asarray(peak, np.float32),
        peak_temperature=np.asarray(temperature, np.float32),
        centre_radiance=radiance,
        mean_temperature=np.asarray(temperature, np.float64),
        material_fraction=np.isfinite(temperature).astype(float),
        centre_temperature=np.asarray(temperature, np.float32),
    )


def random_exposure(seed):
    generator = np.random.default_rng(seed)
    temperature = generator.uniform(500.0, 1300.0, GRID.shape)
    mean = np.asarray(BAND.radiance(temperature))
    return exposure_of(mean, mean * generator.uniform(1.0, 1.2, GRID.shape))


# Errors


@given(
    seed=st.integers(0, 1000),
    pitch=st.floats(3e-6, 12e-6),
    offset=st.floats(0.0, 9e-6),
    fill=st.floats(0.4, 1.0),
)
@settings(max_examples=20)
def test_nothing_is_measured_over_the_maximum_without_a_psf(seed, pitch, offset, fill):
    camera = Camera(band=BAND, pitch=pitch, offset=(offset, offset / 2), fill_factor=fill, psf=None)
    exposure = random_exposure(seed)
    measured = camera.form_measurement(exposure).radiance[0]
    largest = BAND.radiance(reference_temperature(camera, exposure, "maximum"))
    # A mean of samples is not over their maximum, but for the slivers on four sides that the
    # maximum leaves out: they cover this part of the pixel at most.
    side = pitch * np.sqrt(fill)
    slivers = min(1.0, 4 * LEAST_COVERED * min(GRID.spacing, side) / side)
    brightest = exposure.peak_radiance.max()
    assert (measured <= (1 - slivers) * largest + slivers * brightest + 1e-3).all()


@given(rounding=st.floats(-1e-4, 1e-4), phase=st.integers(0, 8), seed=st.integers(0, 99))
@settings(max_examples=30)
def test_a_rounded_pitch_adds_no_samples_to_a_pixel(rounding, phase, seed):
    raster = Raster(left=0.0, top=0.0, spacing=2e-6 / 3 * (1 + rounding), rows=189, columns=279)
    values = np.random.default_rng(seed).uniform(600.0, 1200.0, raster.shape)
    exposure = exposure_of(np.asarray(BAND.radiance(values)), raster=raster, temperature=values)
    offset = phase * 2e-6 / 3
    camera = Camera(pitch=6e-6, shape=(20, 30), offset=(offset, offset), psf=None)
    own = values[phase : phase + 180, phase : phase + 270].reshape(20, 9, 30, 9)
    found = reference_temperature(camera, exposure, "true-maximum")
    # float32: 1e-4 K at 1200 K.
    np.testing.assert_allclose(found, own.max(axis=(1, 3)), atol=1e-3)


def test_the_mean_as_reference_leaves_no_error_without_a_psf():
    with pytest.raises(ValueError, match="exposure: Measurement, expected an Exposure"):
        error_images(CAMERA, CAMERA.form_measurement(random_exposure(2)))
    errors = error_images(CAMERA, random_exposure(2), "mean")
    np.testing.assert_array_equal(errors.case_2, 0.0)


def test_references_by_hand():
    raster = Raster(left=0.0, top=6e-6, spacing=2e-6, rows=3, columns=6)
    temperature = np.full(raster.shape, 800.0)
    temperature[0, 0], temperature[1, 4] = 950.0, 870.0
    radiance = np.asarray(BAND.radiance(temperature))
    exposure = exposure_of(radiance, raster=raster, temperature=temperature + 100.0)
    camera = Camera(band=BAND, pitch=6e-6, psf=None)
    reference = {k: reference_temperature(camera, exposure, k)[0] for k in ("maximum", "centre")}
    # float32 radiance: 1e-5 K.
    np.testing.assert_allclose(reference["maximum"], [950.0, 870.0], atol=1e-5)
    # Likewise.
    np.testing.assert_allclose(reference["centre"], [800.0, 870.0], atol=1e-5)
    true = {
        kind: reference_temperature(camera, exposure, f"true-{kind}")[0]
        for kind in ("maximum", "mean", "centre")
    }
    np.testing.assert_allclose(true["maximum"], [1050.0, 970.0])
    np.testing.assert_allclose(true["centre"], [900.0, 970.0])
    # Of nine samples one is 150 K hotter; the other pixel has one that is 70 K hotter.
    np.testing.assert_allclose(true["mean"], [900.0 + 150.0 / 9, 900.0 + 70.0 / 9])
    # With material in a third of the exposure the hot sample counts a third of the others: 1 of 25.
    present = np.ones(raster.shape)
    present[0, 0] = 1 / 3
    brief = replace(exposure, material_fraction=present)
    found = reference_temperature(camera, brief, "true-mean")[0, 0]
    assert found == pytest.approx(900.0 + 150.0 / 25)
    with pytest.raises(ValueError, match="unknown 'median'"):
        reference_temperature(camera, exposure, "median")


# Shear band


def rake_layer(rate, depth):
    """Strain rate of a layer that falls off from the rake face."""
    return rate * np.exp(-np.maximum(DEPTH, 0.0) / depth)


def band_scene(shape, width=20e-6, gap=0.0):
    """Gaussian ridge along a circle, from a distance on, to a free surface at y = 200 µm."""
    along, across = shape.place(POINTS)
    rate = 60e3 * np.exp(-4 * log(2) * (across / width) ** 2) * (along >= gap)
    return rate, (POINTS[..., 1] < 200e-6) & (DEPTH > 0)


@pytest.mark.parametrize("degrees", [36.0, 42.0, 50.0])
@pytest.mark.parametrize("width", [12e-6, 24e-6])
def test_a_straight_ridge_is_found_where_it_is(degrees, width):
    angle = radians(degrees)
    shape = BandImage(angle=angle, bend=1.0)
    band = find_shear_band(GRID, *band_scene(shape, width), TOOL)
    _, across = shape.place(band.ridge.points)
    # The parabola through three samples of a Gaussian, 2 µm apart, is within 0.4 µm of its top.
    # The tool and the surface cut the ridge off oblique; that reaches as far in as the smoothing.
    distance = band.ridge.distance
    inner = (distance > 40e-6) & (distance < distance[-1] - 40e-6)
    assert np.abs(across[inner]).max() < 0.4e-6  # 0.31 um measured
    assert np.abs(across).max() < width / 2
    assert band.reaches_surface
    assert distance[-1] == pytest.approx((200e-6 - TOOL.edge_point[1]) / sin(angle), abs=width)
    # At 50 degrees and under 29 µm from the edge the ridge's line is in the layer left out.
    assert band.start < (10e-6 if degrees < 45.0 else 35e-6)
    # Linear interpolation of the flanks at a sixth of the width: 2 %.
    assert band.width == pytest.approx(width, rel=0.02)
    # Bilinear reading between samples 2 µm apart cuts the top of the narrower one by up to 2 %.
    assert band.middle_rate == pytest.approx(60e3, rel=0.02)
    assert (band.normals @ np.array([sin(angle), cos(angle)]))[inner].min() > 0.995


def test_noise_and_a_sheared_rake_layer_do_not_lead_the_ridge_astray():
    shape = BandImage(angle=radians(38.0), bend=1.0)
    rate, workpiece = band_scene(shape)
    noise = np.random.default_rng(3).lognormal(0.0, 0.3, rate.shape)
    band = find_shear_band(GRID, (rate + rake_layer(300e3, 8e-6)) * noise, workpiece, TOOL)
    _, across = shape.place(band.ridge.points)
    far = (band.ridge.distance > 60e-6) & (band.ridge.distance < band.ridge.distance[-1] - 20e-6)
    # The top of a Gaussian under 30 % noise may be taken a few samples beside it.
    assert np.abs(across[far]).max() < 6e-6


def test_a_band_that_leaves_the_view_says_so():
    leaving = band_scene(BandImage(angle=radians(25.0), bend=1.0))
    assert not find_shear_band(GRID, *leaving, TOOL).reaches_surface


def test_without_a_band_there_is_none():
    _, workpiece = band_scene(BandImage())
    with pytest.raises(NoShearBandError, match="largest plastic strain rate"):
        find_shear_band(GRID, np.full(GRID.shape, 100.0), workpiece, TOOL)
    with pytest.raises(NoShearBandError, match="no path"):
        find_shear_band(GRID, np.full(GRID.shape, 1e5), np.zeros(GRID.shape, bool), TOOL)
    with pytest.raises(NoShearBandError, match="no ridge"):
        find_shear_band(GRID, rake_layer(300e3, 8e-6), workpiece, TOOL)


def depth_in_layer(points):
    """Depth in m in the layer along the rake face that is left out; negative beyond it."""
    radius = np.hypot(*(points - TOOL.edge_point).T)
    return np.minimum(25e-6, 0.4 * radius) - TOOL.signed_distance(points[:, 0], points[:, 1])


def turning(points):
    """Sum of the magnitudes of all turns of a curve in rad."""
    steps = np.diff(points, axis=0)
    return np.abs(np.diff(np.unwrap(np.arctan2(steps[:, 1], steps[:, 0])))).sum()


@pytest.mark.parametrize("layer", [0.0, 300e3])
@pytest.mark.parametrize("gap", [40e-6, 80e-6])
@pytest.mark.parametrize(("degrees", "bend"), [(35.0, 1.0), (42.0, 1.0), (45.0, 800.0)])
def test_a_ridge_begins_where_the_band_does(degrees, bend, gap, layer):
    shape = BandImage(angle=radians(degrees), bend=bend)
    rate, workpiece = band_scene(shape, gap=gap)
    band = find_shear_band(GRID, rate + rake_layer(layer, 8e-6), workpiece, TOOL)
    points = band.ridge.points
    along, across = shape.place(points)
    # The path steps by a sample, and its first point lies up to 8 µm beside the ridge.
    assert abs(along[0] - gap) < 3 * GRID.spacing
    assert abs(band.start - gap) < 3 * GRID.spacing
    assert band.start == pytest.approx(hypot(*(points[0] - TOOL.edge_point)))
    assert depth_in_layer(points).max() < 0
    inner = (along > gap + 40e-6) & (along < along[-1] - 40e-6)
    assert np.abs(across[inner]).max() < 0.4e-6  # the parabola's limit, as above; 0.29 um measured
    # Both ends are cut off oblique: the path bends there by up to 30 degrees.
    assert turning(points) < bend * band.length + radians(60.0)
    whole = np.linspace(0.0, 0.4e-3, 4001)
    end = np.interp(200e-6, shape.curve(whole)[:, 1], whole)
    # The free surface cuts it off oblique, so that it ends within its width of 20 µm.
    assert band.length == pytest.approx(end - gap, abs=20e-6)
    half = 10e-6 + GRID.spacing
    assert along[band.middle] == pytest.approx((gap + end) / 2, abs=half)
    quarters = np.quantile([gap, end], [0.25, 0.75])
    # Three quarters of the uncertainty of the end.
    np.testing.assert_allclose(along[band.middle_half][[0, -1]], quarters, atol=3 / 4 * 20e-6)


LEFT = [(35.0, 1.0, 50e-6), (35.0, 1.0, 100e-6), (45.0, 800.0, 50e-6), (45.0, 800.0, 70e-6)]


@pytest.mark.parametrize(("degrees", "bend", "shift"), LEFT)
def test_a_band_that_has_left_the_edge_begins_where_it_leaves_the_layer(degrees, bend, shift):
    shape = BandImage(angle=radians(degrees), bend=bend, shift=shift)
    rate, workpiece = band_scene(shape)
    check_that_it_begins_beside_the_layer(rate + rake_layer(300e3, 8e-6), workpiece, shape)


def test_the_next_band_is_no_part_of_one_that_has_left_the_edge():
    """Its strong beginning would pay for the way over to the other, which reaches the surface."""
    shape = BandImage(angle=radians(38.0), bend=1.0, shift=80e-6)
    rate, workpiece = band_scene(shape)
    following = BandImage(angle=radians(20.0), bend=1.0)
    along, _ = following.place(POINTS)
    fading = 2 * np.exp(-np.maximum(along, 0.0) / 80e-6)
    rate = rate + fading * band_scene(following, width=25e-6)[0] + rake_layer(300e3, 8e-6)
    check_that_it_begins_beside_the_layer(rate, workpiece, shape)


def check_that_it_begins_beside_the_layer(rate, workpiece, shape):
    band = find_shear_band(GRID, rate, workpiece, TOOL)
    along, across = shape.place(band.ridge.points)
    whole = np.linspace(0.0, 0.5e-3, 5001)
    leaves = whole[np.flatnonzero(depth_in_layer(shape.curve(whole)) >= 0)[-1]]
    # The layer's slope hides the ridge's maximum until it is its own standard deviation away.
    assert -2 * GRID.spacing < along[0] - leaves < 8.5e-6 + 2 * GRID.spacing
    # The layer's slope shifts the ridge: 0.9 um measured.
    assert np.abs(across[along < along[-1] - 40e-6]).max() < 1.5e-6
    assert depth_in_layer(band.ridge.points).max() < 0
    # It is cut off oblique at one end.
    assert turning(band.ridge.points) < shape.bend * band.length + radians(30.0)


@pytest.mark.parametrize("degrees", [48.0, 50.0, 52.0])
def test_what_climbs_into_the_layer_is_not_the_bands(degrees):
    shape = BandImage(angle=radians(degrees), bend=600.0)
    rate, workpiece = band_scene(shape, gap=40e-6)
    band = find_shear_band(GRID, rate + rake_layer(100e3, 20e-6), workpiece, TOOL)
    assert depth_in_layer(band.ridge.points).max() < 0


# Rake face


@given(length=st.floats(40e-6, 200e-6))
@settings(max_examples=20)
def test_the_contact_ends_where_the_chip_leaves(length):
    along = (POINTS - TOOL.rake_point(0.0)) @ np.array(TOOL.rake_direction)
    chip = (DEPTH > 0) & ((along < length) | (DEPTH > 10e-6))
    # A sample and a half, and the samples' slant to the face.
    assert contact_length(GRID, chip, TOOL, 3e-6) == pytest.approx(length, abs=4e-6)


def test_no_contact_is_no_length():
    assert contact_length(GRID, DEPTH > 20e-6, TOOL, 3e-6) == 0.0


def test_lines_across_the_rake_face_follow_its_normal():
    """Errors that grow by 1 K a µm away from the rake face, a quarter of them the PSF's."""
    pixels = Raster(left=-300e-6, top=300e-6, spacing=6e-6, rows=60, columns=60)
    points = np.stack(np.meshgrid(pixels.x, pixels.y), axis=-1)
    error = -40.0 + (points - TOOL.rake_point(0.0)) @ np.array(TOOL.rake_normal) * 1e6
    images = np.array([np.full(pixels.shape, 900.0), 900.0 + error, 900.0 + 0.75 * error])
    place = RakePlace("rake face", TOOL, 120e-6)
    found = place.lines(6e-6)
    lines = {
        name: np.array([sample(image, pixels, line.points) for image in images])
        for name, line in found.items()
    }
    # Planes are read exactly, so rounding only.
    np.testing.assert_allclose(
        lines["rake"][1], 860.0 + found["rake"].distance * 1e6, rtol=0, atol=ROUNDING
    )
    np.testing.assert_allclose(lines["contact"][1], 860.0, rtol=0, atol=ROUNDING)
    assert found["contact"].distance[-1] == 120e-6
    readings = dict(zip(place.quantities, place.read(images, pixels, lines), strict=True))
    for quantity, expected in (
        ("mid-contact", -40.0),
        ("mean along the contact", -40.0),
        # Two pixels into the tool, the last place that belongs to the face.
        ("most negative within two pixels", -52.0),
    ):
        reading = readings[quantity]
        assert reading[1] - reading[0] == pytest.approx(expected), quantity
        assert reading[2] - reading[0] == pytest.approx(0.75 * expected), quantity


def test_lines_beyond_the_image_have_no_reading():
    pixels = Raster(left=-300e-6, top=300e-6, spacing=6e-6, rows=60, columns=60)
    band = find_shear_band(GRID, *band_scene(BandImage()), TOOL)
    for place in (RakePlace("rake face", TOOL, 120e-6), BandPlace("shear band", band)):
        lines = {
            name: np.full((3, line.distance.size), np.nan)
            for name, line in place.lines(6e-6).items()
        }
        readings = place.read(np.full((3, *pixels.shape), np.nan), pixels, lines)
        assert np.isnan(readings).all() and readings.shape == (3, 3)


# Segments


@pytest.mark.parametrize("period", [45e-6, 95e-6])
@pytest.mark.parametrize("shape", ["sine", "saw"])
def test_the_segments_of_a_known_thickness_are_found(period, shape):
    time = np.arange(0.0, 470e-6, 0.25e-6)
    phase = time / period % 1.0
    saw = 2 * np.minimum(phase / 0.8, 5 - 5 * phase) - 1
    wave = np.sin(2 * np.pi * phase) if shape == "sine" else saw
    noise = np.random.default_rng(5).uniform(-5e-6, 5e-6, time.size)
    found = segmentation(time, 350e-6 + 50e-6 * wave + noise, 20e-6)
    # Noise of 1.5 um where the wave is flat within 3 um of its valley: it is off by some 3 us.
    intervals = found.valleys.size - 1
    # First and last valley, each off by that, over the intervals between them.
    assert found.period == pytest.approx(period, abs=6e-6 / intervals)
    assert found.period_uncertainty < 6e-6 / np.sqrt(intervals)
    assert found.segments >= int(470e-6 / period) - 1
    # A Gaussian of 1 us takes its standard deviation times the mean slope of both sides, over
    # sqrt(2 pi) each, off the tip of a saw; of a sine 1 - exp(-(2 pi 1 us / period)^2 / 2).
    slopes = 100e-6 / period * (1 / 0.2 + 1 / 0.8)
    cut = slopes * 1e-6 / np.sqrt(2 * np.pi) if shape == "saw" else 2e-6
    # The cut, and the noise that smoothing leaves: 3.8 um measured in all.
    assert found.peak == pytest.approx(400e-6, abs=cut + 4e-6)
    assert found.valley == pytest.approx(300e-6, abs=cut + 4e-6)  # the same; 3.6 um measured
    # Peak and valley off by so much each.
    assert found.degree == pytest.approx(0.25, abs=2 * (cut + 4e-6) / 400e-6)


def test_the_degree_is_the_mean_of_the_segments_with_its_uncertainty():
    time = np.arange(0.0, 400e-6, 1e-6)
    heights = [0, 400, 300, 400, 200, 400, 300, 400, 0]
    found = segmentation(time, np.interp(time, np.arange(9) * 50e-6, heights) * 1e-6, 20e-6)
    # Degrees of 1/4, 1/2 and 1/4; the Gaussian takes up to 3 um off tips, of slopes of 4 um/us.
    assert found.segments == 3
    # 3 µm off tips and on valleys of 200 µm or more.
    assert found.degree == pytest.approx(1 / 3, abs=0.03)
    # A third of that, in the mean of three.
    assert found.degree_uncertainty == pytest.approx(0.25 / np.sqrt(3) / np.sqrt(3), abs=0.01)
    # A step of the times.
    assert found.period == pytest.approx(100e-6, abs=1e-6)


def test_a_relief_under_the_resolution_is_no_segment():
    time = np.arange(0.0, 470e-6, 1e-6)
    ripple = 350e-6 + 8e-6 * np.sin(2 * np.pi * time / 60e-6)
    found = segmentation(time, ripple, 20e-6)
    assert found.segments == 0 and np.isnan([found.period, found.degree_uncertainty]).all()
    # What there is of a degree is stated: 16 um of 358 um.
    assert found.degree == pytest.approx(16 / 358, abs=0.003)
    assert segmentation(time, ripple, 10e-6).segments == 6


def test_a_ripple_between_segments_is_no_segment():
    time = np.arange(0.0, 470e-6, 0.5e-6)
    saw = 350e-6 + 50e-6 * np.sin(2 * np.pi * time / 90e-6)
    ripple = 8e-6 * np.sin(2 * np.pi * time / 17e-6)
    found = segmentation(time, saw + ripple, 5e-6)
    assert found.segments == segmentation(time, saw, 5e-6).segments
    # The ripple moves a valley by less than half of its period, 8.5 µs, over four periods.
    assert found.period == pytest.approx(90e-6, abs=8.5e-6 / 4)


def test_an_unknown_thickness_has_no_segments():
    time = np.arange(0.0, 400e-6, 1e-6)
    found = segmentation(time, np.full(time.size, np.nan), 20e-6)
    assert found.segments == 0 and np.isnan([found.period, found.peak, found.degree]).all()


# The study


@pytest.fixture(scope="module")
def chip():
    return AnalyticChip(frames=80)


@pytest.fixture(scope="module")
def study(chip):
    plan = Plan(exposures=5, phases=2, textures=3, psf_widths=(6e-6, 12e-6, 18e-6))
    told = []
    result = analyse(
        chip.scene(), SURFACES, CAMERA, plan, lambda label, part: told.append((label, part))
    )
    assert {label for label, part in told if part == 1.0} >= {"shear band", "camera", "chip"}
    assert all(0.0 <= part <= 1.0 for _, part in told)
    return result


def test_the_developed_instant_is_the_first_near_the_greatest_rise(study, chip):
    starts = study.data.instant.values
    # On the ridge of the chip: half of what shearing heats, and all that the band does.
    rise = np.array(
        [
            180 / 2 + chip.peak_rise * chip.growth(start + CAMERA.integration_time / 2)
            for start in starts
        ]
    )
    assert study.cut.developed == np.flatnonzero(rise >= 0.95 * rise.max())[0]
    assert study.data.shown_instant == study.cut.developed
    assert study.measurements["chip 1"].times.tolist() == starts.tolist()


def test_the_band_of_the_study_is_the_chips(study, chip):
    segment = study.cut.segments[0]
    middle = segment.start + CAMERA.integration_time / 2
    band = study.cut.band
    offset = chip.distance_to_band(band.ridge.points, middle)
    inner = (band.ridge.distance > 40e-6) & (band.ridge.distance < 0.85 * band.ridge.distance[-1])
    # The ridge lies between samples 2 um apart: 0.26 um measured.
    assert np.abs(offset[inner]).max() < 0.5e-6
    assert segment.momentary_band is not None
    # Widths between samples: 0.5 % measured.
    assert segment.band_width == pytest.approx(chip.band_width, rel=0.01)
    drift = chip.shear_angle_drift * CAMERA.integration_time * band.length / 2
    # Both ridges are off by tenths of a micrometre: 0.6 um measured.
    assert segment.sweep == pytest.approx(drift, abs=1e-6)
    period = study.cut.forces.history.segmentation.period
    assert period == pytest.approx(chip.segment_period)


def test_contact_and_errors_of_the_study_make_sense(study, chip):
    lift = 3e-6 / np.tan(radians(12.0))
    rake_place, band_place = study.places
    assert isinstance(rake_place, RakePlace) and isinstance(band_place, BandPlace)
    # The gap closes between samples, over a wedge of 12 degrees: 5.9 um measured.
    assert rake_place.contact_length == pytest.approx(chip.contact_length + lift, abs=8e-6)
    draws = {name: one_draw(study.data, name) for name in headlines(study.data)}
    for name in ("rake", "band"):
        assert draws[name].error < draws[name].psf_portion < 0
    assert draws["rake_extremum"].error <= draws["rake"].error
    assert draws["band_worst"].error <= draws["band"].error
    across = line_error(study.data, "band").isel(exposure=0, texture=0, pixel_phase=0)
    assert draws["band_worst"].error == float(across.min())
    assert (study.data.line_motion.sel(line="band") <= 0).all()


def test_the_measured_centre_of_a_band_is_where_the_image_is_hottest(study):
    first = study.data.isel(exposure=0, texture=0, pixel_phase=0)
    line = first.sel(line="band", effects="all")
    near = np.abs(line.line_distance.values) <= 2 * CAMERA.pitch
    hottest = np.flatnonzero(near)[np.argmax(line.line_measured.values[near])]
    error = line.line_measured.values[hottest] - line.line_reference.values[hottest]
    assert one_draw(study.data, "band_measured").error == error
    image = study.data.image_measured.sel(surface="chip 1", effects="all").values
    measured = study.measurements["chip 1"].radiance_temperature(flagged=True)
    there = np.isfinite(image)
    np.testing.assert_allclose(image[there], measured[study.cut.developed][there], atol=ROUNDING)


def test_the_first_draw_is_read_in_the_shown_image(study):
    assert headline(study.data, "rake").error.values.shape == (1, 3, 4)
    errors = image_error(study.data)
    pixels = study.measurements["chip 1"].raster
    for line, surface in (("rake", "chip 2"), ("band", "chip 1")):
        where = study.data.isel(exposure=0).sel(line=line)
        points = np.stack([where.line_x.values, where.line_y.values], axis=-1)
        known = np.isfinite(points).all(axis=1)
        expected = sample(errors.sel(surface=surface).values, pixels, points[known])
        drawn = line_error(study.data, line).values[0, 0, 0]
        np.testing.assert_allclose(drawn, expected, atol=ROUNDING)


def test_every_draw_is_the_loop_of_figure_6(chip):
    """A literal transcription: textures of other seeds, pixels that begin at another sample."""
    scene, phases, group = chip.scene(), 3, 3
    plan = Plan(exposures=5, phases=phases, textures=2, psf_widths=(12e-6,))
    result = analyse(scene, SURFACES, CAMERA, plan)
    kernel = CAMERA.psf.kernel(CAMERA.pitch)
    first = int(np.searchsorted(scene.times, result.cut.segments[0].start - 1e-9))
    frames = [scene.frame(i) for i in range(first, first + 20)]
    place = scene.tool.rake_point(result.places[0].contact_length / 2)
    for texture in range(2):
        field = replace(CHIP_2, seed=CHIP_2.seed + texture).prepare(scene)
        emissivities = [field.emissivity(frame) for frame in frames]
        for phase in range(phases**2):
            down, right = divmod(phase, phases)
            rows = (chip.raster.rows - down) // group * group
            columns = (chip.raster.columns - right) // group * group
            part = (slice(down, down + rows), slice(right, right + columns))
            hot = [frame.temperature[part].astype(np.float64) for frame in frames]
            grey = [emissivity[part].astype(np.float64) for emissivity in emissivities]
            measured = figure_6(hot, grey, BAND.radiance, BAND.temperature, kernel, group)
            peak = np.max([e * BAND.radiance(t) for t, e in zip(hot, grey, strict=True)], axis=0)
            grouped = peak.reshape(rows // group, group, columns // group, group)
            error = measured - BAND.temperature(grouped.max(axis=(1, 3)))
            x = chip.raster.left + right * 2e-6 + 6e-6 * (np.arange(columns // group) + 0.5)
            y = chip.raster.top - down * 2e-6 - 6e-6 * (np.arange(rows // group) + 0.5)
            read = RegularGridInterpolator((y[::-1], x), error[::-1])
            found = headline(result.data, "rake").error.values[0, texture, phase]
            # Radiance within 4e-7 by the look-up and float32: 1e-3 K.
            assert found == pytest.approx(read(place[::-1]).item(), abs=5e-3)


def test_each_part_of_a_scene_with_gaps_is_a_segment(chip):
    whole = chip.scene()
    # The first part grows the band, the second holds one exposure of 20 frames after a gap.
    kept = [*range(0, 50), *range(55, 75)]
    scene = Scene(whole.data.isel(time=kept))
    plan = Plan(exposures=5, phases=1, textures=2, psf_widths=(12e-6,))
    result = analyse(scene, SURFACES, CAMERA, plan)
    assert result.data.exposure.values[1] == whole.times[55]
    assert result.cut.one_segment[-1].start == whole.times[30]
    assert result.data.instant.values[5:].tolist() == [whole.times[55]]
    drawn = headline(result.data, "band").error
    assert drawn.values.shape == (2, 2, 1) and drawn.causes[0] == "segment"
    alone = Scene(whole.data.isel(time=range(55, 75)))
    other = headline(analyse(alone, SURFACES, CAMERA, plan).data, "band").error
    np.testing.assert_allclose(drawn.values[1], other.values[0], atol=ROUNDING)


def test_an_image_and_a_place_under_the_limit_of_the_range_are_warned_about(chip):
    plan = Plan(exposures=3, phases=1, textures=1, psf_widths=(12e-6,))
    told = {}
    for limit in (None, 1000.0):
        camera = replace(CAMERA, lower_limit=limit)
        warnings = analyse(chip.scene(), SURFACES, camera, plan).warnings
        told[limit] = [one for one in warnings if "below the lower range limit" in one]
    assert told[None] == []
    titles = [one.partition(":")[0] for one in told[1000.0]]
    images, places = (["Image of chip 1", "Image of chip 2"], ["Rake face (chip 2)"])
    assert titles == [*images, *places, "Shear band (chip 1)"]


def test_the_part_of_a_line_that_is_out_of_range_is_warned_about():
    """The ends are 40 um of 160 um; pixels of 6 um at both borders make that 24 % to 26 %."""
    raster = Raster(-100e-6, 60e-6, 2e-6, 60, 100)
    hot = np.where(np.abs(raster.x) < 60e-6, 1000.0, 600.0) * np.ones((60, 1))
    scene = Scene.from_fields(raster, np.array([0.0, 1e-5]), {"temperature": np.stack([hot, hot])})
    line = LinePlace("across", ((-80e-6, 0.0), (80e-6, 0.0)))
    plan = Plan(exposures=1, phases=1, places=(line,))
    camera = replace(CAMERA, psf=None, psf_order="optics", lower_limit=800.0)
    warnings = analyse(scene, {"plate": UniformSurface(1.0)}, camera, plan).warnings
    (told,) = (one for one in warnings if one.startswith("Across (plate)"))
    assert "below the lower range limit" in told
    assert 24 <= int(re.search(r"(\d+) %", told)[1]) <= 26


def test_one_phase_and_one_texture_are_undrawn_causes(chip):
    plan = Plan(exposures=3, phases=1, textures=1, psf_widths=(12e-6,))
    surfaces = {"chip 1": CHIP_1, "chip 2": UniformSurface(0.6)}
    found = headlines(analyse(chip.scene(), surfaces, CAMERA, plan).data)
    assert found["band"].error.missing == ("texture", "pixel phase")
    assert found["rake"].error.missing == ("pixel phase",)  # a uniform surface has no texture


def test_the_corrected_temperature_of_a_uniform_surface_is_the_true_one(chip):
    """With the right emissivity set, what is left is blur, footprint and motion."""
    plan = Plan(exposures=3, phases=1, textures=1, psf_widths=(12e-6,))
    black = replace(CAMERA, psf=None, reflected=None)
    of = {
        name: analyse(chip.scene(), dict.fromkeys(SURFACES, UniformSurface(value)), black, plan)
        for name, value in (("grey", 0.5), ("black", 1.0))
    }
    grey, body = (headlines(one.data)["rake"] for one in of.values())
    # A grey body with its emissivity set reads as a black one. Between pixels the temperature is
    # interpolated: (30 K)² / 8 times the curvature of T over the grey T_r, 9e-4 1/K by Wien's law.
    np.testing.assert_allclose(grey.corrected_error.values, body.true_error.values, atol=0.1)
    assert grey.true_error.mean < body.true_error.mean - 50


def test_the_sensitivity_meets_the_study_at_its_own_width(study):
    data = study.data
    at = int(np.flatnonzero(np.isclose(data.psf_width, 12e-6))[0])
    for name, drawn in headlines(data).items():
        own = drawn.error.values[:, 0].mean()
        assert sensitivity_error(data, CAMERA.psf_order, name)[at] == pytest.approx(
            own, abs=ROUNDING
        )
    for order in ("detector", "optics"):
        errors = error_images(replace(CAMERA, psf_order=order), exposure_at(study, "chip 2"))
        across = study.places[0].lines(CAMERA.pitch)["rake"]
        face = sample(
            errors.case_1.values,
            study.measurements["chip 2"].raster,
            across.points[across.distance == 0.0],
        )
        first = data.sel(psf_order=order, reading="rake").isel(
            psf_width=at, exposure=0, varied_phase=0
        )
        error = first.varied_measured.sel(effects="all") - first.varied_reference
        assert float(error) == pytest.approx(face[0], abs=ROUNDING)
        assert (np.diff(sensitivity_error(data, order, "band")) < 0).all()
        assert (np.diff(sensitivity_psf_fraction(data, order, "rake")) > 0).all()


def exposure_at(study, name):
    return CAMERA.expose(AnalyticChip().scene(), SURFACES[name], study.cut.segments[0].start)


def test_an_effect_switched_off_is_one_more_row(chip):
    """Without motion the camera sees the hottest moment of the exposure."""
    scene = chip.scene()

    def still(exposure):
        return replace(exposure, mean_radiance=exposure.peak_radiance.astype(float))

    place = PointPlace("here", (-60e-6, 80e-6))
    plan = Plan(exposures=1, phases=1, textures=1, places=(place,))
    effects = {**CASES, "without motion": EVERY - {Effect.MOTION}}
    result = analyse(scene, {"chip 1": CHIP_1}, CAMERA, plan, effects=effects)
    row = result.data.measured.sel(reading="here, pixel").isel(exposure=0, texture=0, pixel_phase=0)
    exposure = CAMERA.expose(scene, CHIP_1, float(result.data.exposure[0]))
    for effect, seen in (("all", exposure), ("without motion", still(exposure))):
        errors = error_images(CAMERA, seen)
        expected = nearest(errors.measured.values, CAMERA.pixels(scene.raster), place.point)
        assert row.sel(effects=effect) == pytest.approx(float(expected), abs=ROUNDING)
    assert row.sel(effects="all") != row.sel(effects="without motion")


def test_other_noise_is_in_every_draw(chip):
    noisy = replace(CAMERA, detector=NOISY)
    plan = Plan(exposures=3, phases=1, textures=2, psf_widths=(12e-6,))
    scene = chip.scene()
    data = analyse(scene, {"chip": UniformSurface(0.6)}, noisy, replace(plan, cut=False)).data
    # The noise of each exposure of one surface without texture, and no noise of the reference.
    clean = analyse(scene, {"chip": UniformSurface(0.6)}, CAMERA, replace(plan, cut=False)).data
    noise = (data.measured - clean.measured).sel(reading="rake face, mid-contact", effects="all")
    assert np.unique(noise.values).size == 3 and np.ptp(noise.values) > 1e-3
    np.testing.assert_array_equal(data.reference, clean.reference)


def test_a_part_that_fails_leaves_the_others(chip, monkeypatch):
    def broken(*arguments):
        raise ValueError("region chip 1 body: reaches over columns 50.34 to 81.35")

    monkeypatch.setattr("chipglow.analysis.engine.heated_objects", broken)
    plan = Plan(exposures=2, phases=1, textures=1, psf_widths=(12e-6,))
    result = analyse(chip.scene(), SURFACES, CAMERA, plan)
    assert list(result.failed) == ["heated chips and tool"]
    assert "columns 50.34 to 81.35" in result.failed["heated chips and tool"]
    assert result.cut.heated == () and result.cut.chip is not None
    assert set(headlines(result.data)) >= {"rake", "band"}


def test_bands_far_apart_are_heated_on_a_wider_image():
    """The body's region lies half a spacing beside the band: beyond 80 pixels of 2 um."""
    camera = replace(CAMERA, pitch=2e-6)
    chip, tool = heated_objects(camera, {"chip 1": CHIP_1}, TOOL, 20e-6, 180e-6, 1)
    assert chip.map.raster.columns == 130
    for row in (*chip.rows, *tool.rows):
        # 0.02 measured: few pixels, some mixed at the border.
        assert row.found.mean == pytest.approx(row.true.mean, abs=0.03), row.feature


def test_a_study_that_can_not_be_is_refused(chip):
    scene = AnalyticChip(frames=30).scene()
    surfaces = {"chip 1": CHIP_1}
    with pytest.raises(ValueError, match="surface 'chip 2' is not one of"):
        analyse(scene, surfaces, CAMERA, Plan())
    plan = Plan(rake_chip="chip 1")
    with pytest.raises(ValueError, match="expected an exposure's 20 us"):
        analyse(scene, surfaces, replace(CAMERA, integration_time=2e-5), plan)
    for name in ("exposures", "phases", "textures"):
        with pytest.raises(ValueError, match=f"{name}: 0, expected"):
            Plan(**{name: 0})


@pytest.mark.parametrize("without", ["tool", "band"])
def test_a_scene_without_tool_or_band_is_read_exposure_by_exposure(without):
    data = AnalyticChip(frames=30).scene().data.copy()
    if without == "tool":
        data.attrs = {}
    else:
        data["plastic_strain_rate"] = data["plastic_strain_rate"] * 0 + np.float32(1.0)
        data["plastic_strain_rate"].attrs["units"] = "1/s"
    plan = Plan(exposures=2, phases=1, textures=1, rake_chip="chip 1")
    result = analyse(Scene(data), {"chip 1": CHIP_1}, CAMERA, plan)
    assert result.cut is None
    reason = "the scene has no tool" if without == "tool" else "in any of the exposures"
    assert reason in " ".join(result.missing)
    places = [place.name for place in result.places]
    assert places == (["hottest pixel"] if without == "tool" else ["hottest pixel", "rake face"])
