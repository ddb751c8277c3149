"""The detector: mean, noise, limits and pattern of its counts; recordings that it makes."""

import numpy as np
import pytest

from chipglow.camera import Camera, Detector, Measurement, ReadNoise, ShotNoise
from chipglow.radiometry import Band
from chipglow.scene import Raster

BAND = Band(3.8e-6, 5.1e-6)


def generator(seed=1):
    return np.random.default_rng(seed)


def test_mean_and_variance_are_those_of_photons_and_reading():
    detector = Detector(gain=10.0, offset=400.0, terms=(ShotNoise(0.05), ReadNoise(3.0)))
    counts = detector.counts(np.full((1, 500, 500), 200.0), generator()).astype(float)
    # Photons 0.05 x 2000, reading 9, rounding 1/12; both bounds are five standard errors.
    variance = 0.05 * 2000.0 + 9.0 + 1 / 12
    assert counts.mean() == pytest.approx(2400.0, abs=5 * np.sqrt(variance / counts.size))
    assert counts.var() == pytest.approx(variance, rel=5 * np.sqrt(2 / counts.size))


def test_counts_end_at_the_digitisers_limits():
    detector = Detector(gain=10.0, offset=0.0, terms=(ReadNoise(0.0),))
    counts = detector.counts(np.array([[[-5.0, 0.0, 204.7, 409.5, 500.0]]]), generator())
    assert counts[0, 0].tolist() == [0, 0, 2047, 4095, 4095]
    assert detector.saturation == 4094


def test_sensors_differ_by_their_pattern_and_dead_ones_see_nothing():
    plain = Detector(gain=10.0, terms=(ReadNoise(0.0),))
    detector = plain.with_pattern((200, 200), 0.02, 5.0, 0.01, generator(3))
    dark, light = (
        detector.counts(np.full((1, 200, 200), radiance), generator())[0].astype(float)
        for radiance in (0.0, 100.0)
    )
    dead = detector.terms[-1].mask
    assert dead.mean() == pytest.approx(0.01, abs=5 * np.sqrt(0.01 / 40000))
    np.testing.assert_array_equal(light[dead], dark[dead])
    lit = (light - dark)[~dead]
    # Two roundings of variance 1/12 each beside 2 % of 1000 counts.
    assert lit.std() == pytest.approx(20.0, rel=5 / np.sqrt(2 * lit.size))
    assert dark.std() == pytest.approx(np.sqrt(25 + 1 / 12), rel=5 / np.sqrt(2 * dark.size))


def test_the_same_state_gives_the_same_counts_and_another_others():
    detector, radiance = Detector(gain=10.0), np.full((2, 30, 40), 100.0)
    first = detector.counts(radiance, generator(7))
    np.testing.assert_array_equal(first, detector.counts(radiance, generator(7)))
    assert (first != detector.counts(radiance, generator(8))).any()
    assert (first[0] != first[1]).any()


def test_a_recording_knows_the_camera():
    radiance = BAND.radiance(np.full((2, 4, 5), 800.0))
    measured = Measurement.from_radiance(
        radiance, BAND, np.array([0.0, 1e-3]), Raster(0, 0, 6e-6, 4, 5),
        attributes={"integration_time": 10e-6},
    )  # fmt: skip
    detector = Detector(gain=1.0, offset=0.0, terms=(ReadNoise(0.0),))
    recording = detector.record(measured, generator())
    np.testing.assert_array_equal(recording.signal, np.rint(radiance))
    assert recording.quantity == "counts"
    assert recording.times.tolist() == [0.0, 1e-3]
    assert (recording.integration_time, recording.pitch) == (10e-6, 6e-6)
    assert (recording.band, recording.saturation) == (Camera().band, 4094)


@pytest.mark.parametrize(
    ("field", "value"),
    [("gain", 0.0), ("offset", np.nan), ("bits", 0)],
)
def test_impossible_detectors_are_refused(field, value):
    with pytest.raises(ValueError, match=rf"Detector\.{field}: {value:g}, expected"):
        Detector(**{"gain": 1.0, field: value})


def test_a_pattern_of_another_shape_is_refused():
    detector = Detector(gain=1.0).with_pattern((3, 4), 0.0, 0.0, 0.0, generator())
    with pytest.raises(ValueError, match=r"gain is of shape \(3, 4\), expected \(4, 3\)"):
        detector.counts(np.zeros((1, 4, 3)), generator())


@pytest.mark.parametrize(
    ("term", "message"),
    [
        (lambda: ReadNoise(-1.0), "ReadNoise.standard_deviation: -1, expected 0 or more"),
        (lambda: ShotNoise(0.0), "ShotNoise.conversion_gain: 0, expected over 0"),
    ],
)
def test_impossible_terms_are_refused(term, message):
    with pytest.raises(ValueError, match=message):
        term()
