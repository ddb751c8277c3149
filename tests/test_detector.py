"""The detector: mean and noise of its counts by theory, its limits, patterns and recordings."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.constants import c, h
from tolerances import DOUBLE

from chipglow import camera as cam
from chipglow.radiometry import Band, TabulatedResponse
from chipglow.scene import Raster

BAND = Band(3.8e-6, 5.1e-6)
FRAMES = 10_000
PIXELS = (4, 4)
MEAN_ERRORS = 5.0
"""Standard errors by which a mean or variance may be off: beyond in one of two million cases."""


def generator(seed=1):
    return np.random.default_rng(seed)


def detector(*terms, gain=1.0, **others):
    settings = {"offset": 400.0, "bits": 20, **others}
    return cam.Detector(response=cam.EnergyResponse(1.0), gain=gain, terms=terms, **settings)


def frames(made, radiance, count=FRAMES, shape=PIXELS, seed=1):
    return made.counts(np.full((count, *shape), radiance), generator(seed)).astype(float)


def assert_variance(counts, expected, independent=None):
    """Variance over time as expected, within standard errors of a normal variable's."""
    count = independent or counts.size
    found = counts.var(axis=0, ddof=1).mean()
    assert found == pytest.approx(expected, rel=MEAN_ERRORS * np.sqrt(2 / count))


def assert_mean(counts, expected, variance):
    error = np.sqrt(variance / counts.size)
    assert counts.mean() == pytest.approx(expected, abs=MEAN_ERRORS * error)


def test_photons_make_electrons_by_the_closed_form():
    point = cam.OperationPoint(BAND, integration_time=20e-6, fill_factor=0.9)
    found = cam.PhotonResponse(0.8, 15e-6, 2.5, 0.7, 4.5e-6).electrons(point, 1.0)
    # Energy on the element over that of a photon: π τ sin²θ A t / (h c / λ), sin θ = 1 / 2 N.
    energy = np.pi * 0.7 / 5.0**2 * 0.9 * 225e-12 * 20e-6
    assert found == pytest.approx(0.8 * energy * 4.5e-6 / (h * c), rel=DOUBLE)


def test_a_flat_quantum_efficiency_counts_the_photons_of_the_band():
    """By the response λ / λ₀ relative to energy; photons by their own integral of Planck's law."""
    wavelengths = tuple(np.linspace(3.8e-6, 5.1e-6, 3))
    flat = TabulatedResponse(wavelengths, tuple(w / 4e-6 for w in wavelengths))
    point = cam.OperationPoint(Band(3.8e-6, 5.1e-6, flat))
    response = cam.PhotonResponse(1.0, 10e-6, 2.0, wavelength=4.6e-6)
    found = response.electrons(point, 1.0) * point.band.weights(900.0)[1].sum()
    at = np.linspace(3.8e-6, 5.1e-6, 20_001)
    photons = 2 * c / at**4 / np.expm1(h * c / (1.380649e-23 * 900.0 * at))
    cone = np.pi / 16 * 100e-12 * 10e-6
    # Trapezoids of h = 65 pm: h²/12 · (c₂/(λ²T))² = 2e-10.
    assert found == pytest.approx(cone * np.trapezoid(photons, at), rel=1e-9)


def test_other_responses():
    point = cam.OperationPoint()
    assert cam.EnergyResponse(3e4).electrons(point, 1e7) == 3e4
    per_radiance = cam.RangeResponse(413.15).electrons(point, 1e7)
    assert per_radiance * float(BAND.radiance(413.15)) == pytest.approx(1e7, rel=DOUBLE)
    assert set(cam.RESPONSES.kinds) == {"photon", "energy", "range"}


def test_quantisation_has_a_variance_of_a_twelfth():
    """Of a signal that is spread evenly over the counts."""
    radiance = generator().uniform(100.0, 1100.0, (1, 400, 400))
    counts = detector().counts(radiance, generator()).astype(float)
    error = counts - 400.0 - radiance
    # The fourth moment of an even distribution: its variance's error is √(4/5)/√N of it.
    assert error.var() == pytest.approx(1 / 12, rel=5 * np.sqrt(0.8 / error.size))
    assert np.abs(error).max() <= 0.5 + 1e-9  # rounding of counts of 1000


@pytest.mark.parametrize(
    ("terms", "mean", "variance"),
    [
        ((cam.ShotNoise(),), 0.0, 5000.0),
        ((cam.ReadNoise(30.0),), 0.0, 900.0),
        ((cam.ColumnNoise(25.0),), 0.0, 625.0),
        ((cam.DarkCurrent(3e8), cam.ShotNoise()), 3000.0, 8000.0),
        ((cam.ShotNoise(), cam.DarkCurrent(3e8)), 3000.0, 8000.0),
        ((cam.EquivalentNoise(2.0, 500.0),), 0.0, (2.0 * float(BAND.slope(500.0))) ** 2),
        ((cam.ShotNoise(), cam.ReadNoise(30.0), cam.DarkCurrent(1e8)), 1000.0, 6900.0),
    ],
    ids=lambda value: ", ".join(t.kind for t in value) if isinstance(value, tuple) else "",
)
def test_mean_and_variance_over_10_000_frames_are_theorys(terms, mean, variance):
    counts = frames(detector(*terms, gain=2.0), 5000.0)
    expected = 4.0 * variance + 1 / 12
    columns = counts[:, :1] if isinstance(terms[0], cam.ColumnNoise) else counts
    assert_mean(columns, 400.0 + 2.0 * (5000.0 + mean), expected)
    assert_variance(columns, expected)


def test_noise_of_columns_is_the_same_in_a_column_and_independent_between_them():
    counts = frames(detector(cam.ColumnNoise(200.0)), 1000.0, count=2000, shape=(5, 6))
    np.testing.assert_array_equal(counts, np.broadcast_to(counts[:, :1], counts.shape))
    together = np.corrcoef(counts[:, 0].T)
    assert np.abs(together - np.eye(6)).max() < 5 / np.sqrt(2000)


def test_flicker_noise_has_the_spectrum_of_1_over_f():
    """Where the limits of frequency, 0.01 Hz and 50 Hz, are a decade away."""
    term = cam.FlickerNoise(100.0, since_correction=100.0)
    point = cam.OperationPoint(frame_rate=100.0)
    made = detector(term, offset=1e5)
    radiance = np.zeros((4096, 16, 16))
    counts = made.counts(radiance, generator(), point).astype(float)
    series = (counts - counts.mean(axis=0)).reshape(4096, -1) * np.hanning(4096)[:, None]
    power = (np.abs(np.fft.rfft(series, axis=0)) ** 2).mean(axis=1)
    density = 2 * power / (100.0 * (np.hanning(4096) ** 2).sum())
    frequency = np.fft.rfftfreq(4096, 0.01)
    expected = 100.0**2 / (np.log(10) * frequency[1:])
    for low, high in ((0.1, 0.3), (0.3, 1.0), (1.0, 3.0)):
        inside = (frequency[1:] >= low) & (frequency[1:] < high)
        ratio = density[1:][inside] / expected[inside]
        # 256 pixels, bins of the window two wide: 5 standard errors, and 5 % for what is missing
        # beyond the limits and aliased from there.
        tolerance = 5 * np.sqrt(2 / (256 * inside.sum())) + 0.05
        assert ratio.mean() == pytest.approx(1.0, abs=tolerance)


def test_lag_is_a_filter_of_first_order():
    """A step's answer, and the transfer function (1 − a) / (1 − a exp(−iω)) of a sine."""
    made = detector(cam.Lag(0.2), gain=100.0, bits=32)
    step = np.where(np.arange(12) >= 4, 5000.0, 1000.0)[:, None, None] * np.ones((1, 2, 2))
    found = made.counts(step, generator())[:, 0, 0] - 400.0
    after = np.maximum(np.arange(12) - 3, 0)
    # Counts are whole.
    np.testing.assert_allclose(found, 100 * (5000.0 - 4000.0 * 0.2**after), atol=0.5)
    number = np.arange(400)
    for omega in (0.1, 1.0, 3.0):
        sine = 5000.0 + 1000.0 * np.cos(omega * number)
        seen = made.counts(sine[:, None, None], generator())[100:, 0, 0] / 100.0
        design = np.stack([np.cos(omega * number), np.sin(omega * number), number**0])[:, 100:]
        real, imaginary, _ = np.linalg.lstsq(design.T, seen, rcond=None)[0]
        expected = 1000.0 * 0.8 / (1 - 0.2 * np.exp(-1j * omega))
        # Whole counts are up to 0.005 electrons off in each sample.
        assert real - 1j * imaginary == pytest.approx(expected, abs=0.01)


def test_elements_differ_by_their_patterns_and_dead_ones_see_nothing():
    made = detector(
        cam.GainPattern(0.02), cam.OffsetPattern(5.0), cam.DeadElements(0.01), gain=10.0, offset=1e3
    )
    shape = (200, 200)
    dark, light = (frames(made, r, 1, shape, seed)[0] for r, seed in ((0.0, 1), (100.0, 2)))
    dead = made.terms[-1].mask(shape, made.seed)
    assert dead.mean() == pytest.approx(0.01, abs=5 * np.sqrt(0.01 / 40000))  # five standard errors
    np.testing.assert_array_equal(light[dead], dark[dead])
    lit = (light - dark)[~dead]
    # Two roundings of variance 1/12 each beside 2 % of 1000 counts, and 50 counts in the dark.
    assert lit.std() == pytest.approx(20.0, rel=5 / np.sqrt(2 * lit.size))
    assert dark.std() == pytest.approx(50.0, rel=5 / np.sqrt(2 * dark.size))  # five standard errors
    other = frames(replace(made, seed=2), 100.0, 1, shape)[0]
    assert (other != light).mean() > 0.9


def test_a_signal_falls_short_by_the_non_linearity():
    made = detector(cam.NonLinearity(0.1), full_well=10_000.0)
    found = [frames(made, r, 1)[0, 0, 0] - 400 for r in (0.0, 1000.0, 5000.0, 10_000.0)]
    assert found == [0, 990, 4750, 9000]


def test_full_well_and_digitiser_end_the_counts():
    well = detector(cam.ShotNoise(), cam.ReadNoise(50.0), full_well=5000.0, gain=2.0)
    over = frames(well, 6000.0)
    # The charge is full, so its shot noise is gone: the read noise is what is left.
    assert_mean(over, 400.0 + 2 * 5000.0, 4 * 2500.0 + 1 / 12)
    assert_variance(over, 4 * 2500.0 + 1 / 12)
    assert (well.capacity, well.saturation) == (5000.0, 10_399)
    digitiser = detector(gain=10.0, offset=0.0, bits=12)
    counts = digitiser.counts(np.array([[[-5.0, 0.0, 204.7, 409.5, 500.0]]]), generator())
    assert counts[0, 0].tolist() == [0, 0, 2047, 4095, 4095]
    assert (digitiser.capacity, digitiser.saturation) == (409.5, 4094)
    # Without a gain the full well is the last count.
    filled = detector(gain=None, full_well=1e6, bits=14)
    assert frames(filled, 1e6, 1).max() == 16383
    assert filled.conversion_gain == pytest.approx((16383 - 400) / 1e6)


def test_the_photon_transfer_curve_gives_gain_and_read_noise_back():
    """EMVA 1288, 6.6: the slope of the variance over the mean is the gain, at no light the dark."""
    gain, read = 0.02, 400.0
    made = detector(cam.ShotNoise(), cam.ReadNoise(read), gain=gain, offset=100.0, bits=14)
    means, variances = [], []
    levels = np.linspace(0.0, 7e5, 15)
    for i, electrons in enumerate(levels):
        # Two frames each, as the standard measures: what is fixed falls out of the difference.
        first, second = frames(made, electrons, 2, (300, 300), seed=i)
        means.append((first.mean() + second.mean()) / 2)
        variances.append(np.mean((first - second) ** 2) / 2)
    dark_mean, dark_variance = means[0], variances[0]
    slope, offset = np.polyfit(np.array(means) - dark_mean, variances, 1)
    # Each variance is of 90 000 differences: √(2/90 000) = 0.5 %; of 15 levels the slope is
    # within 0.3 %, and three times that is allowed.
    assert slope == pytest.approx(gain, rel=0.01)
    found = np.sqrt((dark_variance - 1 / 12) / slope**2)
    # Half of the 0.5 % of a variance and 0.3 % of the slope: five times their 0.4 %.
    assert found == pytest.approx(read, rel=0.02)
    # Half a per cent of each variance.
    assert offset == pytest.approx(gain**2 * read**2 + 1 / 12, abs=0.005 * max(variances))


def test_the_order_of_the_list_does_not_matter():
    terms = (
        cam.ReadNoise(5.0),
        cam.ShotNoise(),
        cam.DarkCurrent(1e6),
        cam.GainPattern(0.1),
        cam.NonLinearity(0.1),
    )
    counts = [frames(detector(*order), 2e5, 2) for order in (terms, terms[::-1])]
    np.testing.assert_array_equal(*counts)


def test_another_term_leaves_the_noise_of_the_others_as_it_was():
    terms = (cam.ShotNoise(), cam.ReadNoise(20.0), cam.FlickerNoise(10.0))
    more = (cam.ColumnNoise(0.0), *terms)
    counts = [frames(detector(*some), 2e4, 3) for some in (terms, more)]
    np.testing.assert_array_equal(*counts)


def test_a_recording_knows_the_camera():
    radiance = BAND.radiance(np.full((2, 4, 5), 800.0))
    measured = cam.Measurement.from_radiance(
        radiance, BAND, np.array([0.0, 1e-3]), Raster(0, 0, 6e-6, 4, 5),
        attributes={"integration_time": 10e-6},
    )  # fmt: skip
    made = detector(offset=0.0, bits=12)
    recording = made.record(measured, generator())
    np.testing.assert_array_equal(recording.signal, np.rint(radiance))
    assert recording.quantity == "counts"
    assert recording.times.tolist() == [0.0, 1e-3]
    assert (recording.integration_time, recording.pitch) == (10e-6, 6e-6)
    assert (recording.band, recording.saturation) == (cam.Camera().band, 4094)
    measured.data.attrs["detector"] = "another"
    with pytest.raises(ValueError, match="the measurement already contains one"):
        made.record(measured, generator())
