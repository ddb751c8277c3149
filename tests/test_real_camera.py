"""From a camera's recording to a measurement: pixels, flags, object parameters, position."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from chipglow.camera import (
    Flag,
    LinearCalibration,
    NonUniformity,
    PlanckConversion,
    Recording,
    find_bad_pixels,
    replace_bad_pixels,
)
from chipglow.laboratory.recordings import (
    ImagePosition,
    calibrate_recording,
    fit_calibration,
    flag_fractions,
)
from chipglow.radiometry import Band, ObjectParameters

BAND = Band(3.8e-6, 5.1e-6)
KELVINS = np.linspace(573.15, 1273.15, 8)
LINE = fit_calibration(
    LinearCalibration, KELVINS, 500.0 + 1.8 * BAND.radiance(KELVINS), BAND, count_uncertainty=2.0
).calibration
RNG = np.random.default_rng(7)


def recording(signal, quantity="counts", **known):
    signal = np.asarray(signal)
    known = {"band": BAND, "pitch": 6e-6, "times": np.arange(len(signal)) / 600.0} | known
    return Recording(signal=signal, quantity=quantity, camera="test camera", **known)


def uniform(counts, frames=20, noise=2.0, shape=(12, 16)):
    rng = np.random.default_rng(int(counts))
    return counts + rng.normal(0.0, noise, (frames, *shape))


# Pixels


def test_two_points_correct_gain_and_offset_everywhere():
    gain, offset = RNG.normal(1.0, 0.1, (12, 16)), RNG.normal(0.0, 50.0, (12, 16))
    seen = [level * gain + offset for level in (1000.0, 5000.0, 3000.0)]
    correction = NonUniformity.two_point(seen[0][None], seen[1][None])
    corrected = correction.apply(seen[2][None])
    assert np.ptp(seen[2]) > 1000
    # What is left of the pattern is rounding; the level is that of the median pixel.
    assert np.ptp(corrected) < 1e-9
    assert corrected[0, 0, 0] == pytest.approx(3000.0, rel=0.03)  # of 192 gains: 2 % measured


def test_one_point_corrects_the_offset_only():
    gain, offset = RNG.normal(1.0, 0.1, (12, 16)), RNG.normal(0.0, 50.0, (12, 16))
    correction = NonUniformity.one_point((1000.0 * gain + offset)[None])
    # Rounding of counts of 1000.
    assert np.ptp(correction.apply((1000.0 * gain + offset)[None])) < 1e-9
    elsewhere = correction.apply((3000.0 * gain + offset)[None])
    # Rounding of counts of 3000.
    np.testing.assert_allclose(
        elsewhere - np.median(elsewhere), 2000.0 * (gain - np.median(gain))[None], atol=1e-9
    )


def test_bad_sensors_are_found_by_what_is_wrong_with_them():
    cold, hot = uniform(1000.0), uniform(5000.0)
    cold[:, 2, 3], hot[:, 2, 3] = 1200.0, 5000.0  # stuck in each
    hot[:, 5, 6] = 5000.0 + RNG.normal(0.0, 40.0, 20)  # noisy
    hot[:, 8, 1] = cold[:, 8, 1] + 0.3 * (hot[:, 8, 1] - cold[:, 8, 1])  # insensitive
    hot[:, 8, 3] = cold[:, 8, 3] + 1.8 * (hot[:, 8, 3] - cold[:, 8, 3])  # too sensitive
    found = find_bad_pixels(cold, hot)
    assert np.argwhere(found.stuck).tolist() == [[2, 3]]
    assert np.argwhere(found.noisy).tolist() == [[5, 6]]
    assert np.argwhere(found.unresponsive).tolist() == [[8, 1], [8, 3]]
    assert found.mask.sum() == 4


def test_of_one_uniform_object_the_level_tells():
    pattern = np.random.default_rng(3).normal(0.0, 30.0, (12, 16))
    frames = uniform(1000.0) + pattern
    frames[:, 4, 4] = 4095.0 - RNG.integers(0, 4, 20)
    found = find_bad_pixels(frames)
    assert np.argwhere(found.mask).tolist() == [[4, 4]]


def test_good_sensors_are_not_called_bad():
    """192 pixels, 60 repeats, at the least number of frames: the limits are far out."""
    for seed in range(60):
        rng = np.random.default_rng(seed)
        pattern = rng.normal(1.0, 0.05, (12, 16))
        cold, hot = (level * pattern + rng.normal(0, 3, (8, 12, 16)) for level in (1000.0, 5000.0))
        assert not find_bad_pixels(cold, hot).mask.any()


def test_neighbours_stand_in_for_single_bad_sensors():
    y, x = np.mgrid[:12, :16]
    signal = np.stack([100.0 * x + 10.0 * y, 50.0 * x])
    bad = np.zeros((12, 16), bool)
    bad[5, 5] = bad[0, 0] = bad[8, 8:10] = True
    replaced, done = replace_bad_pixels(np.where(bad, 1e6, signal), bad)
    assert (done == bad).all()
    # In a linear field the median of all eight neighbours is the value in the middle.
    np.testing.assert_allclose(replaced[:, 5, 5], signal[:, 5, 5])
    np.testing.assert_array_equal(replaced[:, ~bad], signal[:, ~bad])
    assert replaced[0, 0, 0] == pytest.approx(np.median([100.0, 10.0, 110.0]))
    # A row of the field, as the neighbours in one row are bad too.
    assert (np.abs(replaced - signal)[:, 8, 8:10] <= 10.0).all()


def test_larger_clusters_stay_dead():
    bad = np.zeros((12, 16), bool)
    bad[4:6, 4:6] = True  # four: replaced
    bad[8, 8:13] = True  # five: not
    bad[np.arange(6, 11), np.arange(5)] = True  # five over corner: not
    bad[0, 14:] = bad[1, 15] = True  # the corner of the image has no good neighbour
    replaced, done = replace_bad_pixels(np.ones((3, 12, 16)), bad)
    assert done[4:6, 4:6].all()
    assert not done[8, 8:13].any()
    assert np.isnan(replaced[:, 8, 8:13]).all()
    assert not done[6:11, :5].any()
    assert not done[0, 15]


# Measurements


def test_counts_become_radiance_with_its_uncertainty():
    kelvins = np.array([[[600.0, 900.0, 1200.0]]])
    counts = 500.0 + 1.8 * BAND.radiance(kelvins)
    measured = calibrate_recording(recording(counts, integration_time=1e-5), LINE)
    # The inverse of Planck's law: 2e-10 K.
    np.testing.assert_allclose(measured.radiance_temperature(), kelvins, rtol=0, atol=1e-9)
    # It is taken from a table of 513 counts.
    np.testing.assert_allclose(
        measured.calibration_uncertainty, LINE.uncertainty(counts), rtol=1e-4
    )
    assert measured.data.attrs["integration_time"] == 1e-5
    assert measured.data.attrs["camera"] == "test camera"
    assert (measured.band.lower, measured.band.upper) == (3.8e-6, 5.1e-6)


def test_the_range_of_calibration_and_detector_is_flagged():
    kelvins = np.array([[[500.0, 572.0, 574.0, 1272.0, 1275.0, 1400.0]]])
    counts = 500.0 + 1.8 * BAND.radiance(kelvins)
    measured = calibrate_recording(recording(counts, saturation=counts[0, 0, 4]), LINE)
    under, over = Flag.UNDER_RANGE, Flag.SATURATED
    assert measured.flags.tolist() == [[[under, under, 0, 0, over, over]]]
    assert (
        np.isnan(measured.radiance_temperature()[0, 0]).tolist()
        == [True] * 2 + [False] * 2 + [True] * 2
    )
    assert flag_fractions(measured)[Flag.SATURATED] == pytest.approx(1 / 3)
    # At the detector's limit, within the calibrated range.
    measured = calibrate_recording(recording(counts, saturation=counts[0, 0, 2]), LINE)
    assert measured.flags[0, 0, 3] == over
    assert measured.data.attrs["lower_limit"] == 573.15
    higher = calibrate_recording(recording(counts), LINE, lower_limit=600.0)
    assert higher.flags[0, 0, 2] == under


def test_bad_sensors_are_replaced_or_dead():
    kelvins = np.full((2, 8, 9), 900.0)
    counts = 500.0 + 1.8 * BAND.radiance(kelvins)
    bad = np.zeros((8, 9), bool)
    bad[1, 1] = True
    bad[5:8, 5:8] = True
    counts[:, bad] = 1e6
    measured = calibrate_recording(recording(counts, saturation=16000.0), LINE, bad_pixels=bad)
    assert (measured.flags[:, 1, 1] == Flag.REPLACED).all()
    assert (measured.flags[:, 5:8, 5:8] == Flag.DEAD).all()
    # The inverse of Planck's law: 2e-10 K.
    np.testing.assert_allclose(measured.radiance_temperature()[:, 1, 1], 900.0, rtol=0, atol=1e-9)
    assert np.isnan(measured.radiance_temperature()[:, 6, 6]).all()


def test_signals_below_the_cameras_range_are_flagged():
    counts = 500.0 + 1.8 * BAND.radiance(np.full((1, 5, 5), 900.0))
    least = counts[0, 0, 0] - 1.0
    counts[0, 1, 1] = least - 1.0
    counts[0, 4, 4] = least
    bad = np.zeros((5, 5), bool)
    bad[2, 2] = bad[0, 4] = True
    measured = calibrate_recording(recording(counts, least_signal=least), LINE, bad_pixels=bad)
    expected = np.zeros((5, 5), int)
    expected[1, 1] = Flag.UNDER_RANGE
    # The median of neighbours of which one is outside the range is not trusted.
    expected[2, 2] = Flag.REPLACED | Flag.UNDER_RANGE
    expected[0, 4] = Flag.REPLACED
    assert measured.flags[0].tolist() == expected.tolist()
    assert np.isnan(measured.radiance_temperature()[0, 1, 1])


def test_the_median_of_a_saturated_neighbourhood_is_not_trusted():
    counts = 500.0 + 1.8 * BAND.radiance(np.full((1, 5, 5), 900.0))
    counts[0, 1, 1] = 17000.0
    bad = np.zeros((5, 5), bool)
    bad[2, 2] = True
    measured = calibrate_recording(recording(counts, saturation=16000.0), LINE, bad_pixels=bad)
    assert measured.flags[0, 2, 2] == Flag.REPLACED | Flag.SATURATED
    assert np.isnan(measured.radiance_temperature()[0, 2, 2])


def test_the_correction_makes_dead_sensors_known():
    cold, hot = (
        500.0 + 1.8 * BAND.radiance(np.full((2, 6, 6), kelvins)) for kelvins in (700.0, 1000.0)
    )
    hot[:, 2, 2] = cold[:, 2, 2]
    correction = NonUniformity.two_point(cold, hot)
    measured = calibrate_recording(recording(hot), LINE, correction)
    assert measured.flags[0, 2, 2] == Flag.REPLACED
    # The inverse of Planck's law: 2e-10 K.
    np.testing.assert_allclose(measured.radiance_temperature(), 1000.0, rtol=0, atol=1e-9)


@given(
    emissivity=st.floats(0.1, 1.0),
    transmittance=st.floats(0.5, 1.0),
    reflected=st.floats(280.0, 400.0),
    atmosphere=st.floats(280.0, 310.0),
    kelvins=st.floats(600.0, 1500.0),
)
@settings(max_examples=50)  # the first call compiles
def test_what_the_camera_was_told_is_taken_back(
    emissivity, transmittance, reflected, atmosphere, kelvins
):
    told = ObjectParameters(emissivity, reflected, transmittance, atmosphere)
    received = float(BAND.radiance(kelvins))
    shown = told.temperature(received, BAND)
    measured = calibrate_recording(
        recording(np.full((1, 1, 1), shown), "temperature", object_parameters=told)
    )
    # Radiance is looked up within 1e-6 of the integral, twice, and divided by the emissivity.
    assert measured.radiance[0, 0, 0] == pytest.approx(received, rel=1e-4)
    assert measured.data.attrs["object_parameters"].endswith("taken back")


def test_radiance_is_taken_as_it_is():
    radiance = np.array([[[1000.0, np.inf, -5.0]]])
    told = ObjectParameters(emissivity=0.5)
    measured = calibrate_recording(recording(radiance, "radiance", object_parameters=told))
    assert measured.radiance[0, 0, 0] == 1000.0
    assert measured.flags[0, 0].tolist() == [0, Flag.UNDER_RANGE, Flag.UNDER_RANGE]
    assert "taken as it is" in measured.data.attrs["object_parameters"]


def test_counts_by_the_makers_conversion():
    conversion = PlanckConversion(r1=1e6, r2=1.0, b=3300.0, f=1.0, o=-500.0)
    counts = np.array([[[20000, 40000]]], np.uint16)
    measured = calibrate_recording(recording(counts, conversion=conversion))
    # Two tables of a band's radiance, one of them inverse: 4e-8 measured.
    np.testing.assert_allclose(
        measured.radiance_temperature(), conversion.temperature(counts), rtol=1e-7
    )
    assert "maker" in measured.data.attrs["calibration"]


def test_full_counts_are_doubted_unless_the_saturation_is_known():
    counts = np.full((1, 4, 4), 2000, np.uint16)
    counts[0, :2, 0] = 4095
    doubted = calibrate_recording(recording(counts), LINE)
    assert "2 values are 4095" in doubted.data.attrs["warnings"]
    known = calibrate_recording(recording(counts, saturation=4094), LINE)
    assert "warnings" not in known.data.attrs
    assert (known.flags[0, :2, 0] == Flag.SATURATED).all()


def calibrated(quantity="counts", calibration=LINE, arguments=(), **known):
    one = recording(np.full((1, 2, 2), 900.0), quantity, **known)
    calibrate_recording(one, calibration, **dict(arguments))


BAD = np.zeros((3, 3), bool)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: NonUniformity.two_point(uniform(2000.0), uniform(1000.0)), "second brighter"),
        (
            lambda: NonUniformity.two_point(uniform(1000.0), uniform(2000.0, shape=(3, 4))),
            "the second of 4 x 3 pixels, expected 16 x 12",
        ),
        (lambda: NonUniformity.one_point(np.ones((3, 4))), "expected \\(time, y, x\\)"),
        (lambda: NonUniformity.one_point(np.ones((1, 3, 4))).apply(uniform(1.0)), "expected 4 x 3"),
        (lambda: find_bad_pixels(uniform(2000.0), uniform(1000.0)), "second brighter"),
        (lambda: replace_bad_pixels(np.ones((1, 3, 4)), np.zeros((2, 2), bool)), "expected 2 x 2"),
        (lambda: ImagePosition(tip=(np.nan, 0.0)), "tip"),
        (
            lambda: calibrated(calibration=replace(LINE, range="A"), range="B"),
            "for the range 'A', the recording has 'B'",
        ),
        (lambda: calibrated("radiance"), "holds radiance, expected counts"),
        (lambda: calibrated("temperature", None, band=None), "band: is missing"),
        (lambda: calibrated("radiance", None, {"bad_pixels": BAD}), "2 x 2 pixels, expected 3 x 3"),
    ],
)
def test_what_does_not_fit_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_the_image_is_turned_mirrored_and_placed():
    signal = np.arange(6.0).reshape(1, 2, 3) + 900.0
    turned = calibrate_recording(
        recording(signal, "radiance"), position=ImagePosition(1, "horizontal", (0.5, 2.5))
    )
    expected = np.rot90(signal[0])[:, ::-1]
    np.testing.assert_array_equal(turned.radiance[0], expected)
    assert turned.raster.shape == (3, 2)
    # The tip is in the middle of the pixel in column 0 and row 2.
    assert turned.raster.x[0] == pytest.approx(0.0, abs=1e-15)
    # In m: places of 1e-4 m are rounded to 1e-20 m.
    assert turned.raster.y[2] == pytest.approx(0.0, abs=1e-15)
    upside = ImagePosition(mirror="vertical").place(signal)
    np.testing.assert_array_equal(upside[0], signal[0, ::-1])
    plain = calibrate_recording(recording(signal, "radiance"))
    assert plain.raster.extent == pytest.approx((0.0, 18e-6, 0.0, 12e-6))
