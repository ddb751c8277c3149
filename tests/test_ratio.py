"""Ratio temperature: the thermometer, a camera of two bands, its errors, the choice of bands."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from analytic_chip import AnalyticChip
from command import refusal, typed
from figure6 import figure_6
from hypothesis import given, settings, strategies as st
from scipy.integrate import simpson
from scipy.optimize import brentq
from tolerances import DOUBLE, SINGLE

from chipglow import camera as cam
from chipglow.analysis import (
    CAUSES,
    Plan,
    RatioPair,
    Spot,
    WavelengthPlan,
    cut_spots,
    ratio_errors,
    wavelength_errors,
    wavelengths_frame,
)
from chipglow.io import write_scene
from chipglow.radiometry import Band, RatioThermometer, spectral_radiance
from chipglow.scene import Raster, Scene
from chipglow.study import Study
from chipglow.surface import CHIP_1, CHIP_2, Dispersion, HagenRubens, SpectralTable, UniformSurface

C2 = 0.01438776877
SHORT, LONG = Band(1.5e-6, 1.7e-6), Band(3.8e-6, 5.1e-6)
NARROW = Band(0.9e-6, 0.9002e-6), Band(1.0e-6, 1.0002e-6)
LAMBDA = 1 / (1 / 0.9001e-6 - 1 / 1.0001e-6)
METAL = HagenRubens(6e-7)
RASTER = Raster(left=-60e-6, top=40e-6, spacing=1e-6, rows=80, columns=120)
CAMERA = cam.Camera(pitch=4e-6, psf=None, integration_time=2e-6, lower_limit=None)
GRADIENT, RATE = 1e6, 1e6

SINGLE_KELVIN = 1e-4
"""In K: radiances in single precision, 6e-8, over a sensitivity of 1e-3/K."""

WIEN = 1e-4
"""Relative difference of the sensitivity from Wien's law in the narrow bands.

Planck's denominator differs by exp(−c₂/(λT)) = 1e-5 at 1300 K and 0.95 µm, and the sensitivity is
the difference of two bands, a tenth of either.
"""

SOLVED = 1e-7
"""In K: both sides use the same tables, and the inverse is solved to less."""


def scene(temperature):
    """A scene of temperature alone, of four frames 1 us apart."""
    times = np.arange(4) * 1e-6
    values = np.broadcast_to(temperature, (4, *RASTER.shape))
    return Scene.from_fields(RASTER, times, {"temperature": values})


def sloping():
    """Warmer to the right."""
    return scene(1000.0 + GRADIENT * RASTER.x)


def warming():
    """Warmer by the time."""
    return scene(1000.0 + RATE * np.arange(4)[:, None, None] * 1e-6)


def two(bands=(SHORT, LONG), camera=CAMERA, **settings):
    return RatioPair(*(camera.in_band(band) for band in bands), **settings)


@pytest.fixture(scope="module")
def analytic_scene():
    return AnalyticChip().scene()


# --- the thermometer


@settings(max_examples=50)
@given(st.floats(300.0, 3000.0), st.floats(0.01, 1.0), st.floats(0.5, 2.0))
def test_the_ratio_gives_the_temperature_back_whatever_the_emissivity(kelvins, emissivity, ratio):
    thermometer = RatioThermometer(SHORT, LONG, ratio)
    first = ratio * emissivity * SHORT.radiance(kelvins)
    found = thermometer.temperature(first, emissivity * LONG.radiance(kelvins))
    assert found == pytest.approx(kelvins, abs=SOLVED)
    assert thermometer.ratio(kelvins) == pytest.approx(
        first / (emissivity * LONG.radiance(kelvins)), rel=DOUBLE
    )


def test_error_and_sensitivity_in_wiens_limit():
    thermometer = RatioThermometer(*NARROW, 1.0, 0.01)
    kelvins = np.array([700.0, 1000.0, 1300.0])
    np.testing.assert_allclose(
        thermometer.sensitivity(kelvins), C2 / (LAMBDA * kelvins**2), rtol=WIEN
    )
    for true in (0.9, 1.05):
        expected = 1 / (1 / kelvins - LAMBDA * np.log(true) / C2) - kelvins
        found = thermometer.emissivity_error(kelvins, true)
        # Planck's law differs at both temperatures.
        np.testing.assert_allclose(found, expected, rtol=2 * WIEN)
    np.testing.assert_allclose(
        thermometer.uncertainty(kelvins), 0.01 * LAMBDA * kelvins**2 / C2, rtol=WIEN
    )


def test_no_temperature_has_an_impossible_ratio():
    thermometer = RatioThermometer(SHORT, LONG)
    assert thermometer.range == (200.0, 6000.0)
    one = LONG.radiance(800.0)
    for first in (0.0, -1.0, np.nan, np.inf, 1e9 * one, 1e-30 * one):
        assert np.isnan(thermometer.temperature(first, one))
    assert np.isnan(thermometer.temperature(SHORT.radiance(800.0), [0.0, -1.0, np.nan])).all()


def test_bands_of_which_one_holds_the_other_have_a_range():
    # Its ratio rises until most of the light is short of 5 um, and falls from there.
    inner, outer = Band(3e-6, 5e-6), Band(1e-6, 12e-6)
    thermometer = RatioThermometer(inner, outer)
    low, high = thermometer.range
    assert low == 200.0 and 600 < high < 1500
    kelvins = np.linspace(250.0, high - 1.0, 40)
    found = thermometer.temperature(inner.radiance(kelvins), outer.radiance(kelvins))
    np.testing.assert_allclose(found, kelvins, atol=SOLVED)
    assert (thermometer.sensitivity(np.array([high - 5, high + 5])) > 0).tolist() == [True, False]


# --- bands in one sweep, and cameras in other bands


def test_views_of_several_bands_are_those_of_each_alone(analytic_scene):
    surfaces = [replace(chip, follow="mean").prepare(analytic_scene) for chip in (CHIP_1, CHIP_2)]
    views = [
        cam.SpectralView(surface, band, reflected)
        for surface in surfaces
        for band, reflected in ((SHORT, None), (LONG, 400.0), (SHORT, 900.0))
    ]
    together = cam.expose(analytic_scene, views, analytic_scene.times[0], 5e-6)
    for view, found in zip(views, together, strict=True):
        (alone,) = cam.expose(analytic_scene, [view], found.start, 5e-6)
        for name in ("mean_radiance", "centre_radiance", "peak_radiance", "peak_temperature"):
            np.testing.assert_array_equal(getattr(found, name), getattr(alone, name))


def test_diffraction_grows_with_the_wavelength_and_other_blurs_do_not():
    far = Band(8e-6, 14e-6)
    annular = cam.AnnularAperturePSF(4.5e-6)
    assert annular.in_band(far).fwhm == pytest.approx(annular.fwhm * 11 / 4.5)
    assert cam.PupilPSF(LONG, 0.28).in_band(far) == cam.PupilPSF(far, 0.28)
    assert cam.GaussianPSF(9e-6).in_band(far) == cam.GaussianPSF(9e-6)
    blurred = cam.BlurredPSF(annular, (cam.Jitter(1e-6),))
    assert blurred.in_band(far) == replace(blurred, psf=annular.in_band(far))
    camera = cam.Camera().in_band(far)
    assert (camera.band, camera.lower_limit) == (far, None)
    assert cam.Camera(psf=None).in_band(far).psf is None


# --- emissivity that is not grey


def emissivity(surface, band):
    return surface.prepare(sloping(), band).emissivity(sloping().frame(0))


def test_an_emissivity_that_is_the_laws_stays_the_laws():
    bare = METAL.in_band(LONG, None)
    there = METAL.in_band(SHORT, None)
    # Both are linear between tables every 5 K: where they bend they are 1e-6 apart.
    np.testing.assert_allclose(
        emissivity(bare.modified(Dispersion(METAL, LONG)), SHORT),
        emissivity(there, SHORT),
        rtol=1e-5,
    )


def test_the_odds_of_emission_follow_the_law():
    law = SpectralTable(((1.6e-6, 300.0, 0.3), (4.45e-6, 300.0, 0.15)))
    grey = SpectralTable(((3e-6, 300.0, 0.3),))
    known = {"measured_in": Band(4.449e-6, 4.451e-6)}
    seen = Band(1.599e-6, 1.601e-6)
    for bare in (0.01, 0.5, 0.9):
        factor = (0.3 / 0.7) / (0.15 / 0.85)
        expected = bare * factor / (1 - bare + bare * factor)
        found = emissivity(UniformSurface(bare).modified(Dispersion(law, **known)), seen)
        # Half a band, 1 nm, changes the law by 5e-5, which is 3.5e-4 of 0.15.
        np.testing.assert_allclose(found, expected, rtol=4e-4)
        same = emissivity(UniformSurface(bare).modified(Dispersion(grey, **known)), seen)
        np.testing.assert_allclose(same, bare, rtol=SINGLE)


# --- the camera of two bands


def test_a_uniform_grey_scene_has_no_error():
    camera = two(
        shift=(1.3e-6, -0.7e-6), delay=0.5e-6, camera=replace(CAMERA, psf=cam.GaussianPSF(8e-6))
    )
    flat = scene(900.0)
    _, temperature = measured(camera, flat, UniformSurface(0.3), [0.0, 1e-6])
    np.testing.assert_allclose(temperature, 900.0, atol=SINGLE_KELVIN)
    errors = ratio_errors(camera, flat, UniformSurface(0.3), 0.0)
    assert tuple(errors.cause.values) == tuple(CAUSES)
    np.testing.assert_allclose(errors.step, 0.0, atol=SINGLE_KELVIN)


def measured(pair, field, surface, start):
    """The ratio temperature of the frames of both cameras."""
    first, second = pair.with_common_pixels(field.raster)
    frames = (
        first.measure(field, surface, start),
        second.measure(field, surface, np.add(start, pair.delay)),
    )
    return frames, pair.thermometer.temperature(*(one.radiance for one in frames))


def of_wien(first, second):
    """Ratio temperature of bodies of two temperatures in the narrow bands."""
    return 1 / (LAMBDA * (1 / (0.9001e-6 * first) - 1 / (1.0001e-6 * second)))


@pytest.mark.parametrize("right", [2e-6, -2e-6, 6e-6])
def test_misregistration_on_a_slope(right):
    errors = ratio_errors(two(NARROW, shift=(right, 1e-6)), sloping(), UniformSurface(0.4), 0.0)
    truth = 1000.0 + GRADIENT * errors.x.values
    expected = of_wien(truth, truth + GRADIENT * right) - truth
    found = errors.step.sel(cause="misregistration")[10]
    # The mean of the radiance in a pixel is that of its middle but for the bend, 0.1 K.
    np.testing.assert_allclose(found, expected, atol=0.1)
    assert abs(expected).min() > 15
    for name in ("emissivity", "motion", "delay", "noise", "optics"):
        np.testing.assert_allclose(errors.step.sel(cause=name), 0.0, atol=SINGLE_KELVIN)


def test_a_delay_while_it_warms():
    errors = ratio_errors(two(NARROW, delay=1e-6), warming(), UniformSurface(0.4), 0.0)
    expected = of_wien(1000.5, 1001.5) - of_wien(1000.5, 1000.5)
    # Means over two frames each, 1 K apart: as warm as their middle but for 1e-3 K.
    np.testing.assert_allclose(errors.step.sel(cause="delay"), expected, atol=1e-3)
    # In the middle of the exposure the second frame has begun.
    np.testing.assert_allclose(errors.truth, 1001.0)
    # Both radiances bend over 1 K: (1/λ₁ + 1/λ₂) c₂/T² / 8 = 4e-3 K.
    np.testing.assert_allclose(errors.step.sel(cause="motion"), -0.5, atol=4e-3)


def test_exposures_that_do_not_last_alike():
    camera = two(NARROW)
    longer = replace(camera, second=replace(camera.second, integration_time=3e-6))
    errors = ratio_errors(longer, warming(), UniformSurface(0.4), 0.0)
    expected = of_wien(1000.5, 1001.0) - 1001.0
    # The mean of the radiances is that of the middle but for its bend, 0.02 K.
    np.testing.assert_allclose(errors.step.sel(cause="motion"), expected, atol=0.03)
    _, temperature = measured(longer, warming(), UniformSurface(0.4), 0.0)
    np.testing.assert_allclose(temperature[0], errors.measured, rtol=DOUBLE)


def test_what_is_not_grey_is_an_error_of_the_emissivity():
    camera = two(NARROW)
    table = SpectralTable(((0.9001e-6, 300.0, 0.5), (1.0001e-6, 300.0, 0.4)))
    errors = ratio_errors(camera, sloping(), table, 0.0)
    truth = 1000.0 + GRADIENT * errors.x.values
    expected = 1 / (1 / truth - LAMBDA * np.log(0.5 / 0.4) / C2) - truth
    # Within half of a band, 0.1 nm, an emissivity changes by up to 1e-4. The mean over the band
    # changes by a quarter of it: 5e-4 of the logarithm of the ratio of the emissivities.
    np.testing.assert_allclose(errors.step.sel(cause="emissivity")[3], expected, rtol=1e-3)
    told = ratio_errors(replace(camera, emissivity_ratio=1.25), sloping(), table, 0.0)
    # Beyond its ends, which are in the bands' middles, the table is flat: the mean emissivities
    # are 5e-5 and 6e-5 off, at 630 K for a ratio of e.
    np.testing.assert_allclose(told.step.sel(cause="emissivity"), 0.0, atol=0.1)


def test_the_causes_add_up_to_what_is_measured():
    noisy = replace(CAMERA, psf=cam.GaussianPSF(9e-6), detector=detector())
    camera = two(camera=noisy, shift=(1.5e-6, -1e-6), delay=1e-6)
    slope = scene(900.0 + GRADIENT * RASTER.x + RATE * np.arange(4)[:, None, None] * 1e-6)
    errors = ratio_errors(camera, slope, METAL, 0.0)
    (first, second), temperature = measured(camera, slope, METAL, 0.0)
    np.testing.assert_allclose(errors.measured, temperature[0], rtol=DOUBLE)
    np.testing.assert_array_equal(first.raster.x, errors.x)
    assert second.raster.left - first.raster.left == pytest.approx(1.5e-6)
    assert all(np.ptp(values) > 1e-3 for values in errors.step.values)


def detector():
    return cam.Detector(
        response=cam.RangeResponse(1400.0),
        full_well=1e6,
        bits=14,
        terms=(cam.ShotNoise(), cam.ReadNoise(standard_deviation=200.0)),
        frames=64,
    )


def test_noise_is_that_of_both_channels():
    camera = replace(CAMERA, pitch=1e-6, detector=detector())
    pair = two(camera=camera)
    first, second = replace(pair.first, seed=1), replace(pair.second, seed=2)
    errors = ratio_errors(
        replace(pair, first=first, second=second), scene(1000.0), UniformSurface(1.0), 0.0
    )

    def relative(band):
        electrons = 1e6 * band.radiance(1000.0) / band.radiance(1400.0)
        counts = (2**14 - 1 - 400) / 1e6
        return np.sqrt(electrons + 200.0**2 + 1 / (12 * counts**2)) / electrons

    slope = C2 / 1000.0**2 * (1 / 1.63e-6 - 1 / 4.5e-6)
    expected = np.hypot(relative(SHORT), relative(LONG)) / slope
    found = float(errors.step.sel(cause="noise").std())
    # Of 9600 pixels to 0.7 %; the bands' middles, by the wavelength, to some percent.
    assert found == pytest.approx(expected, rel=0.06)
    plan = WavelengthPlan((SHORT, LONG))
    spot = Spot("middle", "plate", 0.0, np.array([0.5e-6, 0.5e-6]))
    study = wavelength_errors(
        scene(1000.0), {"plate": UniformSurface(1.0)}, camera, plan, [spot], 1, 1
    )
    # A second way: frames of a flat field, of 64 x 64 elements.
    assert float(study.noise[0, -1]) == pytest.approx(found, rel=0.03)


# --- the choice of bands


def planck(kelvins, band):
    """In-band radiance by Simpson's rule."""
    wavelength = np.linspace(band.lower, band.upper, 41)
    return simpson(spectral_radiance(wavelength, np.asarray(kelvins)[..., None]), x=wavelength)


def inverse(value, of):
    return brentq(lambda kelvins: of(kelvins) - value, 400.0, 3000.0, xtol=1e-9)


def test_a_study_of_bands_beside_the_loop_of_figure_6():
    """One spot on a curved field that warms, with a PSF and a shift, by other code."""
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    shape = 900.0 + 200.0 * np.exp(-((x - 3e-6) ** 2 + y**2) / (9e-6) ** 2)
    values = shape + RATE * np.arange(4)[:, None, None] * 1e-6
    camera = replace(CAMERA, psf=cam.GaussianPSF(10e-6), psf_order="detector")
    point = np.array([5.2e-6, 2.2e-6])  # the pixel of column 16, row 9: its centre at 6 um, 2 um
    plan = WavelengthPlan((LONG, SHORT), 1e-6, 1e-6, 0.1, 0.15)
    study = wavelength_errors(
        scene(values),
        {"plate": UniformSurface(0.6)},
        camera,
        plan,
        [Spot("hill", "plate", 0.0, point)],
        1,
        1,
    )
    kernel = cam.GaussianPSF(10e-6).kernel(4e-6)
    # The pixel's middle is the corner of four samples.
    truth = float(values.astype(np.float32)[1, 37:39, 65:67].mean(dtype=np.float64))

    def image(band, frames, left=0, up=0, psf=kernel):
        part = [one[up : up + 76, left : left + 116] for one in frames]
        grey = [np.full(part[0].shape, 0.6)] * len(part)
        return figure_6(part, grey, lambda t: planck(t, band), lambda r: r, psf, 4)

    def ratio(one, other):
        return inverse(one / other, lambda t: planck(t, SHORT) / planck(t, LONG))

    bands = list(zip(study.first_um.values, study.second_um.values, strict=True))
    here = study.isel(place=0)
    alone, pair = (
        here.isel(ratio=bands.index(names)) for names in (("3.8-5.1", ""), ("1.5-1.7", "3.8-5.1"))
    )
    early, late, ideal = values[:2], values[1:3], np.ones((1, 1))
    long, short = image(LONG, early)[9, 16], image(SHORT, early)[9, 16]
    # The temperatures of a scene in single precision, 6e-5 K, over some steps.
    close = {"abs": 2e-4}
    found = inverse(long / 0.6, lambda t: planck(t, LONG))
    assert here.truth.values == pytest.approx([truth], rel=DOUBLE)
    assert alone.step.sum("cause").values == pytest.approx([found - truth], **close)
    sharp = inverse(image(LONG, early, psf=ideal)[9, 16] / 0.6, lambda t: planck(t, LONG))
    assert alone.step.sel(cause="optics").values == pytest.approx([found - sharp], **close)
    slope = planck(truth + 0.5, LONG) - planck(truth - 0.5, LONG)
    assert float(alone.emissivity_uncertainty) == pytest.approx(
        0.1 * planck(truth, LONG) / slope, rel=SINGLE
    )

    together, delayed = ratio(short, long), ratio(short, image(LONG, late)[9, 16])
    assert pair.step.sum("cause").values == pytest.approx([delayed - truth], **close)
    assert pair.step.sel(cause="delay").values == pytest.approx([delayed - together], **close)
    # One sample to the right, to the left, up and down; the pixels begin within the first.
    places = [((1, 0), (9, 16)), ((3, 0), (9, 15)), ((0, 3), (8, 16)), ((0, 1), (9, 16))]
    shifts = [
        ratio(short, image(LONG, early, *corner)[pixel]) - together for corner, pixel in places
    ]
    assert pair.misregistration.values[:, 0] == pytest.approx(shifts, **close)
    logarithm = 0.15 * np.log(8.9 / 3.2)
    change = np.log(ratio_at(truth + 0.5) / ratio_at(truth - 0.5))
    assert float(pair.emissivity_uncertainty) == pytest.approx(logarithm / change, rel=SINGLE)
    row = wavelengths_frame(study).iloc[-1]
    squares = [row.error_K, np.sqrt(np.mean(np.square(shifts))), 0.0, row.emissivity_uncertainty_K]
    assert row.total_K == pytest.approx(np.linalg.norm(squares), rel=SINGLE)


def ratio_at(kelvins):
    return planck(kelvins, SHORT) / planck(kelvins, LONG)


def test_spots_of_a_cut(analytic_scene):
    spots = cut_spots(analytic_scene, cam.Camera.paper(), Plan(exposures=2))
    assert [(spot.place, spot.surface) for spot in spots] == [
        ("rake face", "chip 2"),
        ("shear band", "chip 1"),
    ]
    # Half a pixel within the chip.
    face = spots[0].point
    assert analytic_scene.tool.signed_distance(*face) == pytest.approx(3e-6)


def bands_of(place, **plan):
    spot = Spot("far", "plate", 0.0, np.array([place, 0.0]))
    plan = WavelengthPlan((SHORT, LONG), **plan)
    wavelength_errors(scene(900.0), {"plate": UniformSurface(1.0)}, CAMERA, plan, [spot], 1, 1)


REFUSED = {
    "bands: 1, expected two or more": lambda: WavelengthPlan((SHORT,)),
    "bands: 2, expected two or more that differ": lambda: WavelengthPlan((SHORT, SHORT)),
    "delay: -1 s, expected 0 s or more": lambda: WavelengthPlan((SHORT, LONG), delay=-1),
    "(?s)wavelengths.misregistration.*-1 um, expected 0 um or more": lambda: Study(
        wavelengths={"misregistration": "-1 um"}
    ),
    "delay: 1000 us, expected so little": lambda: bands_of(0.0, delay=1e-3),
    "far: .* is outside the pixels": lambda: bands_of(1.0),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_study_of_bands_refuses_the_impossible(message):
    with pytest.raises(ValueError, match=message):
        REFUSED[message]()


def test_the_command_reads_a_users_points(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_scene(sloping(), "scene.nc")
    text = """
    scene: scene.nc
    surface: {kind: uniform, emissivity: 0.5}
    camera: {pitch: 4 um, integration_time: 2 us}
    wavelengths: {bands: [1.5-1.7 um, 3.8-5.1 um], misregistration: 2 um}
    analysis: {phases: 1, textures: 1, exposures: 2%s}
    """
    (tmp_path / "study.yaml").write_text(text % ", points: {here: [0 um, 0 um]}")
    said = typed("wavelengths study.yaml --out bands.csv --plot bands.png").stdout
    assert "here: 72" in said and "1.5-1.7" in said
    frame = pd.read_csv("bands.csv")
    assert frame.second_um.fillna("").tolist() == ["", "", "3.8-5.1"]
    assert (frame.draws == 2).all()
    assert (tmp_path / "bands.png").stat().st_size > 10_000
    (tmp_path / "study.yaml").write_text(text % "")
    said = refusal("wavelengths study.yaml")
    assert "scene.nc: No rake face is read" in said
    assert "Expected points to read (analysis.points)" in said
