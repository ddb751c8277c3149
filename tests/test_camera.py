"""The camera against the paper's loop, and against what can be worked out by hand."""

import re
from dataclasses import replace
from math import log, sqrt

import numba
import numpy as np
import pytest
from figure6 import figure_6
from hypothesis import given, strategies as st
from scipy.special import erf
from tolerances import DOUBLE, SINGLE

from chipglow.camera import AnnularAperturePSF, Camera, Flag, GaussianPSF, MeasuredPSF, Measurement
from chipglow.camera.exposure import SpectralView, expose, frame_weights
from chipglow.camera.optics.sampling import integrate, overlap_lengths, sensor_raster
from chipglow.io import read_measurement, write_measurement
from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Raster, Scene
from chipglow.study import Study
from chipglow.surface import EmissivityField, Surface, UniformSurface

LOOK_UP = 4e-7
"""Relative error of a radiance that is looked up in single precision, as stated."""

SPACING = 2e-6 / 3
STEP = 0.2e-6
BLACK = UniformSurface(1.0)
PSFS = [None, GaussianPSF(12e-6), AnnularAperturePSF(), MeasuredPSF(np.ones((3, 3)), 4e-6)]

# Radiance is looked up by straight lines 1/32 K apart and kept within 4e-7 (chipglow.camera);
# near 1000 K that is under 1e-5 K, as is the step of the float32 fields' own radiance.
ROUNDING = 1e-4
SECOND_RADIATION_CONSTANT = 1.438777e-2  # m K


class Painted(Surface):
    """Emissivity given for every frame."""

    def __init__(self, times, values):
        self.times, self.values = times, values

    def prepare(self, scene, band=None, reflected=None):
        return EmissivityField(self.emissivity)

    def emissivity(self, frame):
        return self.values[int(np.argmin(np.abs(self.times - frame.time)))]


def make_scene(temperature, spacing=SPACING, times=None, material=1):
    temperature = np.asarray(temperature, dtype=np.float32)
    if times is None:
        times = STEP * np.arange(temperature.shape[0])
    fields = {name: np.zeros_like(temperature) for name in FIELD_UNITS}
    fields["temperature"] = temperature
    fields["material"] = np.broadcast_to(np.uint8(material), temperature.shape)
    raster = Raster(-420e-6, 460e-6, spacing, *temperature.shape[1:])
    return Scene.from_fields(raster, times, fields)


def random_scene(frames=6, rows=54, columns=72, seed=0):
    rng = np.random.default_rng(seed)
    scene = make_scene(rng.uniform(300, 1500, (frames, rows, columns)))
    emissivity = rng.uniform(0.3, 0.9, (frames, rows, columns)).astype(np.float32)
    emissivity[:, :10, :20] = 0.0
    return scene, Painted(scene.times, emissivity)


def temperature_of(measurement):
    return measurement.radiance_temperature()[0]


@pytest.mark.parametrize("psf", PSFS, ids=repr)
def test_equals_the_loop_of_figure_6(psf):
    scene, surface = random_scene()
    camera = Camera(psf=psf, psf_order="detector", integration_time=6 * STEP, lower_limit=None)
    expected = figure_6(
        scene.data["temperature"].values.astype(np.float64),
        surface.values,
        camera.band.radiance,
        camera.band.temperature,
        np.ones((1, 1)) if psf is None else psf.view_kernel(camera.pitch, 6, 8),
    )
    measured = camera.measure(scene, surface, 0.0)
    assert expected.shape == (6, 8)
    np.testing.assert_allclose(temperature_of(measured), expected, atol=ROUNDING, rtol=0)


@given(
    temperature=st.floats(600, 1800),
    pitch=st.floats(0.5e-6, 20e-6),
    fill=st.floats(0.05, 1.0),
    offset=st.tuples(st.floats(0, 9e-6), st.floats(0, 9e-6)),
    psf=st.sampled_from(PSFS),
    order=st.sampled_from(["optics", "detector"]),
)
def test_a_black_body_measures_its_temperature(temperature, pitch, fill, offset, psf, order):
    scene = make_scene(np.full((2, 50, 60), temperature))
    camera = Camera(
        pitch=pitch,
        fill_factor=fill,
        offset=offset,
        psf=psf,
        psf_order=order,
        integration_time=2 * STEP,
    )
    measured = temperature_of(camera.measure(scene, BLACK, 0.0))
    # Three roundings of the radiance to float32: of the table, of what lies between its values,
    # and of the product with the emissivity. By Wien's law it rises by c2 / (λ T²) a kelvin, least
    # at the band's end. The lookups back and forth add less than 1e-5 K.
    rise = SECOND_RADIATION_CONSTANT / (camera.band.upper * temperature**2)
    tolerance = 3 * 2.0**-24 / rise + 1e-5
    np.testing.assert_allclose(measured, np.float32(temperature), atol=tolerance, rtol=0)


def test_radiance_is_as_exact_as_it_is_said_to_be():
    temperature = np.linspace(250, 3000, 100 * 100).reshape(1, 100, 100).astype(np.float32)
    exposure = Camera().expose(make_scene(temperature), BLACK, 0.0)
    exact = Camera().band.radiance(temperature[0].astype(np.float64))
    np.testing.assert_allclose(exposure.mean_radiance, exact, rtol=LOOK_UP)


@pytest.mark.parametrize("temperature", [200.0, 6000.0])
def test_the_ends_of_the_tables_are_as_exact(temperature):
    scene = make_scene(np.full((1, 9, 9), temperature))
    exposure = Camera().expose(scene, BLACK, 0.0)
    # The table is float32.
    np.testing.assert_allclose(exposure.mean_radiance, Camera().band.radiance(temperature), 1e-7)


def test_peaks_and_centre():
    scene, surface = random_scene(frames=5)
    band = Camera().band
    (exposure,) = expose(scene, [SpectralView(surface.prepare(scene), band)], 0.0, 5 * STEP)
    temperature = scene.data["temperature"].values
    radiance = surface.values * band.radiance(temperature.astype(np.float64))
    # The product with an emissivity is rounded to single precision.
    tolerance = LOOK_UP + 2.0**-24
    np.testing.assert_allclose(exposure.peak_radiance, radiance.max(axis=0), rtol=tolerance)
    np.testing.assert_allclose(exposure.centre_radiance, radiance[2], rtol=tolerance)
    np.testing.assert_array_equal(exposure.peak_temperature, temperature.max(axis=0))


def test_true_temperatures_are_those_of_the_material_while_it_is_there():
    generator = np.random.default_rng(8)
    kelvins = generator.uniform(300, 1500, (5, 18, 18)).astype(np.float32)
    material = generator.integers(0, 2, kelvins.shape).astype(np.uint8)
    material[:, 0, 0], material[:, 0, 1] = 0, 1
    scene, exposed = make_scene(kelvins, material=material), slice(0, 4)
    # Half of the first and of the last of four frames.
    weights = np.array([0.5, 1.0, 1.0, 0.5])[:, None, None] / 3
    exposure = Camera(integration_time=3 * STEP).expose(scene, BLACK, 0.5 * STEP)
    there = material[exposed] == 1
    fraction = (weights * there).sum(axis=0)
    np.testing.assert_allclose(exposure.material_fraction, fraction, rtol=DOUBLE)
    known = np.where(there, kelvins[exposed], 0.0)
    with np.errstate(invalid="ignore"):
        mean = (weights * known).sum(axis=0) / fraction
    np.testing.assert_allclose(exposure.mean_temperature, mean, rtol=DOUBLE)
    np.testing.assert_array_equal(
        exposure.centre_temperature, np.where(there[2], kelvins[2], np.nan)
    )


def test_no_emissivity_is_not_no_material():
    scene = make_scene(np.full((1, 18, 18), 900.0), material=0)
    solid = make_scene(np.full((1, 18, 18), 900.0))
    camera = Camera(reflected=800.0)
    mirror, nothing = (camera.expose(s, UniformSurface(0.0), 0.0) for s in (solid, scene))
    np.testing.assert_allclose(mirror.mean_radiance, camera.band.radiance(800.0))
    assert (mirror.peak_temperature == 900.0).all()
    assert (nothing.mean_radiance == 0.0).all()
    assert np.isnan(nothing.peak_temperature).all()


GAP = STEP * np.array([0, 1, 2, 3, 4, 10, 11, 12, 13, 14], float)
"""Times of frames; the one before the gap stands for one step, not for six."""


def test_exposures_beside_a_gap_are_taken():
    for start, expected in ((2.0, range(2, 5)), (10.0, range(5, 8)), (12.0, range(7, 10))):
        indices, weights = frame_weights(GAP, STEP, start * STEP, 3 * STEP)
        assert indices == expected
        np.testing.assert_allclose(weights, 1 / 3)
    for start in (3.0, 4.5, 6.0, 9.0):
        with pytest.raises(ValueError, match="overlaps a gap of the scene"):
            frame_weights(GAP, STEP, start * STEP, 3 * STEP)


@given(st.floats(0, 81e-6), st.floats(0.01e-6, 10e-6))
def test_weights_are_shares_of_the_exposure(start, duration):
    times = STEP * np.arange(455)
    indices, weights = frame_weights(times, STEP, start, duration)
    assert weights.sum() == pytest.approx(1.0, abs=DOUBLE)
    assert (weights > 0).all()
    assert len(indices) == len(weights)
    # The mean time of the sub-frames' intervals is the middle of the exposure, but for those
    # that it covers in part: half of an interval at each end.
    middle = weights @ (times[indices] + STEP / 2)
    assert abs(middle - (start + duration / 2)) <= STEP / 2 + 1e-15


def test_weights_of_uneven_frames_and_parts_of_them():
    indices, weights = frame_weights(np.array([0.0, 1.0, 3.0]), 1.5, 0.5, 3.0)
    assert indices == range(3)
    np.testing.assert_allclose(weights, np.array([0.5, 2.0, 0.5]) / 3.0)


def test_a_scene_of_one_frame_does_not_change():
    scene = make_scene(np.full((1, 18, 18), 700.0))
    measured = Camera().measure(scene, BLACK, [0.0, 5.0])
    assert measured.times.tolist() == [0.0, 5.0]
    np.testing.assert_allclose(measured.radiance_temperature(), 700.0, atol=ROUNDING)


@pytest.mark.parametrize(
    ("step", "rise", "doubted"), [(1.0, 9, True), (1.0, 0, False), (1e-5, 9, False)]
)
def test_times_in_another_unit_are_doubted(step, rise, doubted):
    temperature = np.full((3, 18, 18), 700.0) + rise * np.arange(3)[:, None, None]
    scene = make_scene(temperature, times=step * np.arange(3))
    warnings = Camera().measure(scene, BLACK, 0.0).notes.warnings
    assert any("1 s apart, 1e+05 times the exposure of 10 µs" in one for one in warnings) == doubted


@given(pitch=st.floats(0.3e-6, 15e-6), offset=st.floats(0, 5e-6), fill=st.floats(0.01, 1.0))
def test_sampling_conserves_energy(pitch, offset, fill):
    scene = Raster(0.0, 0.0, SPACING, 41, 60)
    sensors = sensor_raster(scene, pitch, (offset, offset), None)
    radiance = np.random.default_rng(5).uniform(1, 2, scene.shape)
    np.testing.assert_allclose(
        integrate(np.ones(scene.shape), scene, sensors, fill), 1.0, rtol=DOUBLE
    )
    whole = integrate(radiance, scene, sensors, 1.0).sum() * pitch**2
    reach = [
        overlap_lengths(np.array([offset]), pitch * count, samples, SPACING)[0]
        for count, samples in zip(sensors.shape, scene.shape, strict=True)
    ]
    # The last pixel may stick out by 1e-6 of itself.
    assert whole == pytest.approx(reach[0] @ radiance @ reach[1], rel=1e-5)


@given(pitch=st.floats(1e-6, 9e-6), offset=st.floats(0, 5e-6), fill=st.floats(0.05, 1.0))
def test_sensors_of_a_plane_read_it_at_their_middles(pitch, offset, fill):
    scene = Raster(-3e-5, 2e-5, SPACING, 60, 90)
    sensors = sensor_raster(scene, pitch, (offset, 0.0), None)
    plane = scene.x + 3 * scene.y[:, None]
    expected = sensors.x + 3 * sensors.y[:, None]
    # A sample is even inside, so that a pixel's mean is that of a plane up to half a sample away
    # in x and in y: (1 + 3) / 2 samples.
    found = integrate(plane, scene, sensors, fill)
    np.testing.assert_allclose(found, expected, atol=2 * SPACING)  # those two samples


def test_a_ninth_of_a_sensor_is_its_middle_third():
    scene = Raster(0.0, 0.0, 1e-6, 9, 9)
    radiance = np.random.default_rng(7).uniform(1, 2, scene.shape)
    found = integrate(radiance, scene, sensor_raster(scene, 9e-6, (0.0, 0.0), None), 1 / 9)
    assert found[0, 0] == pytest.approx(radiance[3:6, 3:6].mean(), rel=DOUBLE)


def test_sensors_lie_where_they_are_said_to():
    scene = make_scene(np.full((1, 810, 900), 700.0))
    sensors = Camera().pixels(scene.raster)
    assert sensors.shape == (90, 100)
    assert sensors.x[0] == pytest.approx(-417e-6)
    assert sensors.y[0] == pytest.approx(457e-6)
    moved = Camera(offset=(12e-6, 6e-6), shape=(3, 4)).pixels(scene.raster)
    assert moved.shape == (3, 4)
    assert (moved.left, moved.top) == pytest.approx((-408e-6, 454e-6))


def test_motion_blur_of_a_moving_step_is_a_ramp():
    # A hot front moves three samples in each sub-frame across a cold surface.
    frames, speed, columns = 24, 3, 108
    column = np.arange(columns)
    temperature = np.array(
        [np.where(column < 18 + speed * k, 1200.0, 700.0) * np.ones((9, 1)) for k in range(frames)]
    )
    camera = Camera(pitch=SPACING, psf=None, integration_time=frames * STEP)
    measured = camera.measure(make_scene(temperature), BLACK, 0.0).radiance[0, 0]
    hot, cold = camera.band.radiance(1200.0), camera.band.radiance(700.0)
    fraction = np.clip((18 + speed * frames - speed - column) / (speed * frames), 0, 1)
    fraction = np.ceil(fraction * frames - 1e-9) / frames
    np.testing.assert_allclose(measured, cold + fraction * (hot - cold), rtol=SINGLE)


@pytest.mark.parametrize("order", ["optics", "detector"])
@pytest.mark.parametrize("psf", PSFS, ids=repr)
def test_a_pixel_does_not_depend_on_how_many_others_are_read_out(psf, order):
    scene, surface = random_scene()
    whole = Camera(integration_time=STEP, lower_limit=None, psf=psf, psf_order=order)
    part = replace(whole, shape=(2, 3), offset=(2 * whole.pitch, 3 * whole.pitch))
    expected = whole.measure(scene, surface, 0.0).radiance[:, 3:5, 2:5]
    # Places and transforms are rounded.
    np.testing.assert_allclose(part.measure(scene, surface, 0.0).radiance, expected, rtol=1e-9)


@pytest.mark.parametrize("order", ["optics", "detector"])
def test_it_is_said_where_the_border_of_the_scene_matters(order):
    temperature = np.full((1, 54, 180), 700.0)
    temperature[..., 81:90] = 1300.0  # one column of pixels, at the border of the smaller scene
    camera = Camera(psf=GaussianPSF(12e-6), psf_order=order)
    larger = camera.measure(make_scene(temperature), BLACK, 0.0)
    measured = camera.measure(make_scene(temperature[..., 81:]), BLACK, 0.0)
    wrong = temperature_of(measured) - temperature_of(larger)[:, 9:]
    # The rule, the scene goes on as at its edge, makes of a hot column a hot half plane.
    assert wrong[3, 0] > 50.0
    assert abs(wrong[3, -1]) < ROUNDING
    (said,) = measured.data.attrs["warnings"].splitlines()
    found = re.search(
        r"The border of the scene: .* ([\d.]+) % .*up to ([\d.]+) µm .* by at most ([\d.]+) K", said
    )
    fraction, reach, most = (float(number) for number in found.groups())
    # Two pixels of 6 um and a part of a third are within the Gaussian's 12 um of it.
    columns = np.flatnonzero((np.abs(wrong) > 1.0).any(axis=0)).max() + 1
    # To a pixel of 6 µm.
    assert reach == pytest.approx(6 * columns - 3, abs=6)
    # Printed with three digits.
    assert fraction == pytest.approx(100 * columns / wrong.shape[1], rel=5e-3)
    assert 0.3 * wrong.max() < most < 3 * wrong.max()


@pytest.mark.parametrize(("spacing", "warns"), [(3e-6, False), (4e-6, True)])
def test_samples_wider_than_half_a_pixel_are_a_warning(spacing, warns):
    scene = make_scene(np.full((5, 40, 40), 900.0), spacing)
    measured = Camera(pitch=6e-6, psf=None, integration_time=4 * STEP).measure(scene, BLACK, 0.0)
    assert any("samples are" in one for one in measured.notes.warnings) == warns


@pytest.mark.parametrize("order", ["optics", "detector"])
def test_nothing_is_said_of_a_border_that_does_not_matter(order):
    temperature = np.full((1, 90, 90), 700.0)
    temperature[:, 42:48, 42:48] = 1300.0
    camera = Camera(psf=GaussianPSF(4e-6), psf_order=order)
    measured = camera.measure(make_scene(temperature), BLACK, 0.0)
    assert "warnings" not in measured.data.attrs


def test_light_from_beyond_the_scene():
    scene = Raster(0.0, 0.0, SPACING, 90, 180)
    for order in ("optics", "detector"):
        camera = Camera(psf=GaussianPSF(8e-6), psf_order=order, shape=(10, 20))
        beyond = camera.light_from_beyond(scene)
        assert beyond.shape == (10, 20)
        # The mean of (1 - erf) / 2 over a pixel at the border; with the pixels first the blur is
        # wider by a footprint, but what is within a pixel stays there.
        sigma = 8e-6 / (2 * sqrt(2 * log(2)))
        nodes, weights = np.polynomial.legendre.leggauss(20)
        x = 3e-6 * (1 + nodes)
        at_border = ((1 - erf(x / (sqrt(2) * sigma))) / 2) @ weights / 2
        if order == "detector":
            at_border = (1 - erf(3e-6 / (sqrt(2) * sigma))) / 2
        # Samples of the scene beside the border: 0.13 % measured.
        assert beyond[5, 0] == pytest.approx(at_border, rel=2e-3)
        assert beyond[5, 10] < 1e-12
        part = replace(camera, shape=(2, 2), offset=(12e-6, 0.0)).light_from_beyond(scene)
        np.testing.assert_allclose(part, beyond[:2, 2:4], atol=DOUBLE)
    assert (Camera(psf=None).light_from_beyond(scene) == 0.0).all()


def test_a_sequence_is_its_frames():
    scene, surface = random_scene(frames=8)
    camera = Camera(integration_time=3 * STEP, lower_limit=None)
    starts = [0.0, 1.5 * STEP, 5 * STEP]
    measured = camera.measure(scene, surface, starts)
    assert measured.times.tolist() == starts
    for index, start in enumerate(starts):
        one = camera.measure(scene, surface, start)
        np.testing.assert_array_equal(measured.radiance[index], one.radiance[0])


def test_result_does_not_depend_on_the_number_of_threads():
    scene, surface = random_scene()
    camera = Camera(integration_time=6 * STEP)
    before = numba.get_num_threads()
    try:
        radiance = []
        for threads in (1, before):
            numba.set_num_threads(threads)
            radiance.append(camera.measure(scene, surface, 0.0).radiance)
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(*radiance)


def test_under_the_floor_is_flagged_not_returned():
    temperature = np.full((1, 18, 27), 900.0)
    temperature[:, :, :9] = 500.0
    camera = Camera(psf=None, lower_limit=573.15)
    measured = camera.measure(make_scene(temperature), BLACK, 0.0)
    assert measured.flags.dtype == np.uint8
    np.testing.assert_array_equal(measured.flags[0], [[Flag.UNDER_RANGE, 0, 0]] * 2)
    np.testing.assert_array_equal(np.isnan(temperature_of(measured)), measured.flags[0] == 1)
    np.testing.assert_allclose(
        measured.radiance_temperature(flagged=True)[0], [[500, 900, 900]] * 2, atol=ROUNDING
    )


def test_without_a_floor_only_darkness_is_flagged():
    temperature = np.full((1, 9, 18), 500.0)
    material = np.ones_like(temperature, dtype=np.uint8)
    material[:, :, :9] = 0
    scene = make_scene(temperature, material=material)
    measured = Camera(psf=None, lower_limit=None).measure(scene, BLACK, 0.0)
    np.testing.assert_array_equal(measured.flags[0], [[Flag.UNDER_RANGE, 0]])


def test_a_measurement_keeps_a_response_that_is_no_box(tmp_path):
    def hill(wavelength):
        return np.exp(-(((wavelength - 4.2e-6) / 0.3e-6) ** 2))

    band = Band(3e-6, 5e-6, response=hill)
    measured = Camera(band=band, lower_limit=600.0).measure(
        make_scene(np.full((1, 9, 9), 500.0)), BLACK, 0.0
    )
    write_measurement(measured, tmp_path / "measured.nc")
    again = read_measurement(tmp_path / "measured.nc")
    # The response is kept at the nodes of the integral: nothing is lost but rounding.
    np.testing.assert_allclose(again.band.radiance(800.0), band.radiance(800.0), rtol=1e-12)
    again.data = again.data.drop_vars("wavelength")
    del again.__dict__["band"]
    with pytest.raises(ValueError, match="'response' over 'wavelength'"):
        again.band.radiance(800.0)


@pytest.mark.parametrize("lower_limit", [300.0, 250, 370.0])
def test_a_floor_that_is_meant_in_degrees_celsius_is_doubted(lower_limit):
    scene = make_scene(np.full((1, 9, 9), 700.0))

    def doubts(limit):
        warnings = Camera(lower_limit=limit).measure(scene, BLACK, 0.0).notes.warnings
        return [text for text in warnings if "lower range limit" in text]

    (said,) = doubts(lower_limit)
    assert f"{lower_limit:g} K is" in said and f"write {lower_limit + 273.15:g} K." in said
    assert doubts(lower_limit + 3.15) == []


def test_the_papers_camera_is_that_of_a_study():
    assert Camera.paper() == Study().camera.build()


def test_what_is_the_papers_comes_with_its_camera_only():
    near = Camera(band=Band(1.5e-6, 1.6e-6))
    assert near.psf.wavelength == pytest.approx(1.55e-6)
    assert near.psf.fwhm == pytest.approx(Camera.paper().psf.fwhm * 1.55 / 4.5)
    assert (near.lower_limit, Camera().lower_limit) == (None, None)
    with pytest.raises(ValueError, match="wavelength is none"):
        AnnularAperturePSF(None).kernel(1e-6)


SMALL, LARGE = (make_scene(np.full((1, 9, columns), 900.0)) for columns in (9, 18))
TOO_BRIGHT = Painted(SMALL.times, np.full((1, 9, 9), 1.5, dtype=np.float32))
SHORT = Camera(integration_time=STEP)


def seen(camera, start=0.0, surface=BLACK):
    return camera.measure(make_scene(np.full((5, 18, 18), 900.0)), surface, start)


def formed(*scenes):
    return Camera().form_measurement([Camera().expose(scene, BLACK, 0.0) for scene in scenes])


def without(name):
    data = Camera().measure(SMALL, BLACK, 0.0).data.copy()
    if name == "radiance":
        data = data.drop_vars(name)
    else:
        del data.attrs[name]
    return Measurement(data).radiance_temperature(flagged=True)


def in_watts():
    data = Camera().measure(SMALL, BLACK, 0.0).data.copy()
    data["radiance"] = data["radiance"].assign_attrs(units="W")
    return Measurement(data)


REFUSED = {
    "pitch of 50 um .* scene of 12 x 12 um": lambda: seen(Camera(pitch=50e-6)),
    "offset of 11, 0 um does not fit": lambda: seen(Camera(offset=(11e-6, 0.0))),
    "shape is 3 x 1 pixels, but only 2 x 2": lambda: seen(Camera(shape=(3, 1))),
    "0 us to 10 us is not within the scene, which covers 0 us to 1 us": lambda: seen(Camera()),
    "-0.2 us to .* not within the scene": lambda: seen(SHORT, -STEP),
    "0.9 us to .* not within the scene": lambda: seen(SHORT, 4.5 * STEP),
    "nan .* not within the scene": lambda: seen(SHORT, float("nan")),
    "surface: 'chip-1' is not a Surface": lambda: seen(SHORT, 0.0, "chip-1"),
    "surface: None is not a Surface": lambda: seen(SHORT, 0.0, None),
    "surface: 0.6 is not a Surface": lambda: Camera().expose(SMALL, 0.6, 0.0),
    "or emissivity not within 0 to 1 at 81 samples": lambda: Camera().measure(
        SMALL, TOO_BRIGHT, 0.0
    ),
    "at least one exposure": lambda: formed(),
    "exposure, all of the same grid": lambda: formed(SMALL, LARGE),
    "measurement: .*radiance": lambda: without("radiance"),
    "measurement: .*pitch": lambda: without("pitch"),
    "measurement: .*band_upper": lambda: without("band_upper"),
    "measurement: units of 'radiance'": in_watts,
}


@pytest.mark.parametrize("message", REFUSED)
def test_the_impossible_is_refused(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()
