"""Calibrations: parameters found again, uncertainties that cover, what is refused."""

from functools import partial

import numpy as np
import pytest
from tolerances import DOUBLE

from chipglow.camera import MODELS
from chipglow.laboratory.recordings import Blackbody, fit_calibration
from chipglow.radiometry import Band

BAND = Band(3.8e-6, 5.1e-6)
KELVINS = np.linspace(573.15, 1273.15, 10)
BETWEEN = np.array([600.0, 800.0, 1000.0, 1250.0])
OFFSET, GAIN = 1000.0, 1.7
FITS = {name: partial(fit_calibration, kind) for name, kind in MODELS.items()}
fit_linear, fit_sakuma_hattori = FITS.values()

# The nearest Sakuma-Hattori signal to that of the band, for counts of known truth.
SAKUMA_HATTORI = fit_sakuma_hattori(KELVINS, OFFSET + GAIN * BAND.radiance(KELVINS), BAND)


def counts_of(model, kelvins):
    if model == "linear":
        return OFFSET + GAIN * BAND.radiance(kelvins)
    return SAKUMA_HATTORI.calibration.counts(kelvins)


def test_exact_points_give_their_line_back():
    fit = fit_linear(KELVINS, counts_of("linear", KELVINS), BAND, integration_time=1e-5)
    assert fit.calibration.parameters == pytest.approx([OFFSET, GAIN], rel=DOUBLE)
    assert fit.degrees_of_freedom == 8
    assert (fit.calibration.lowest, fit.calibration.highest) == (573.15, 1273.15)
    assert fit.calibration.integration_time == 1e-5
    counts = counts_of("linear", BETWEEN)
    np.testing.assert_allclose(
        fit.calibration.radiance(counts), BAND.radiance(BETWEEN), rtol=DOUBLE
    )


def test_exact_points_give_their_sakuma_hattori_back():
    truth = SAKUMA_HATTORI.calibration
    fit = fit_sakuma_hattori(KELVINS, truth.counts(KELVINS), BAND)
    # The four parameters stand in for each other; what they say of a temperature does not.
    np.testing.assert_allclose(fit.calibration.parameters, truth.parameters, rtol=1e-4)
    counts = truth.counts(BETWEEN)
    # The fit ends at relative changes of 1e-9: 1e-6 K.
    np.testing.assert_allclose(fit.calibration.temperature(counts), BETWEEN, atol=1e-6)


def test_the_slopes_are_those_of_the_counts():
    for fit in (SAKUMA_HATTORI, fit_linear(KELVINS, counts_of("linear", KELVINS), BAND)):
        calibration = fit.calibration
        rise = calibration.counts(BETWEEN + 0.05) - calibration.counts(BETWEEN - 0.05)
        # The table of slopes has steps of 0.25 K, between which it is straight.
        np.testing.assert_allclose(calibration.slope(BETWEEN), rise / 0.1, rtol=1e-5)


def test_the_planckian_form_follows_the_band_within_millikelvins():
    """From 300 to 1000 degC, 3.8 to 5.1 um: docs/do/measurements.md states these figures."""
    kelvins = np.linspace(573.15, 1273.15, 141)
    fit = fit_sakuma_hattori(
        kelvins, counts_of("linear", kelvins), BAND, temperature_uncertainty=1.0
    )
    residuals = fit.residuals_temperature
    # Half of the last stated digit.
    assert np.abs(residuals).max() == pytest.approx(1.9e-3, abs=0.05e-3)
    assert np.sqrt(np.mean(residuals**2)) < 1e-3  # 0.65 mK measured


@pytest.mark.parametrize("model", FITS)
@pytest.mark.parametrize("case", ["stated", "scatter", "common"])
def test_the_interval_covers_as_often_as_it_says(model, case):
    """95 % intervals hold the truth in 95 % of 200 repeats, within three standard deviations."""
    fit, signal = FITS[model], counts_of(model, BETWEEN)
    # With few degrees of freedom Student's factor is far from that of the normal distribution.
    kelvins = KELVINS[[0, 2, 4, 5, 7, 9]] if case == "scatter" else KELVINS
    repeats, covered, scores = 200, np.zeros(BETWEEN.size), []
    for seed in range(repeats):
        rng = np.random.default_rng(seed)
        black_body = kelvins + rng.normal(0, 1.0) * (case == "common")
        if case != "scatter":
            black_body = black_body + rng.normal(0, 0.5, kelvins.size)
        counts = counts_of(model, black_body) + rng.normal(0, 3.0, kelvins.size)
        said = {"count_uncertainty": 3.0, "temperature_uncertainty": 0.5}
        if case == "common":
            said["common_uncertainty"] = 1.0
        found = fit(kelvins, counts, BAND, **({} if case == "scatter" else said))
        error = found.calibration.radiance(signal) - BAND.radiance(BETWEEN)
        scores.append(error / found.calibration.uncertainty(signal))
        covered += np.abs(scores[-1]) < 1.96
    # Binomial: 0.95 of 200 is 190 with a standard deviation of 3.1.
    assert (covered >= 0.95 * repeats - 10).all()
    if case != "scatter":
        # Birge's factor is never under 1 and makes them a tenth smaller on average.
        np.testing.assert_allclose(np.std(scores, axis=0), 0.93, atol=3 / np.sqrt(2 * repeats))


def held(fault, repeats=60):
    """How often intervals hold the truth between the points, and how often there is a warning."""
    truth, signal = BAND.radiance(BETWEEN), counts_of("linear", BETWEEN)
    within, said = np.zeros(BETWEEN.size), 0
    for seed in range(repeats):
        fit = fault(np.random.default_rng(seed))
        error = np.abs(fit.calibration.radiance(signal) - truth)
        within += error < 1.96 * fit.calibration.uncertainty(signal)
        said += bool(fit.calibration.warnings)
    return within.min() / repeats, said / repeats


def measured(rng, kelvins=KELVINS, larger=1.0):
    counts = counts_of("linear", kelvins + rng.normal(0.0, 0.3 * larger, kelvins.size))
    return counts + rng.normal(0.0, 2.0 * larger, kelvins.size)


STATED = {"count_uncertainty": 2.0, "temperature_uncertainty": 0.3}


def test_an_emissivity_of_the_blackbody_is_an_input():
    def fault(rng, **said):
        emissivity = 0.97 + rng.normal(0.0, 0.005)
        own, room = BAND.radiance(KELVINS), BAND.radiance(np.array(300.0))
        counts = OFFSET + GAIN * (emissivity * own + (1 - emissivity) * room)
        return fit_linear(KELVINS, counts + rng.normal(0.0, 2.0, 10), BAND, **STATED, **said)

    assert held(fault)[0] < 0.1
    assert held(lambda rng: fault(rng, blackbody=Blackbody(0.97, 0.005, 300.0)))[0] > 0.85
    left_out = fit_linear(KELVINS, counts_of("linear", KELVINS), BAND)
    given = fit_linear(KELVINS, counts_of("linear", KELVINS), BAND, blackbody=Blackbody(0.97))
    wrong = given.calibration.temperature(left_out.calibration.counts(773.15)) - 773.15
    # A blackbody of 0.97 at 500 degC is as bright as one of 1 that is 5.4 K colder.
    assert wrong == pytest.approx(-5.44, abs=0.05)
    assert given.calibration.lowest < 573.15


def test_what_the_stated_uncertainties_do_not_explain_enlarges_the_uncertainty():
    def fault(rng):
        return fit_linear(KELVINS, measured(rng, larger=7.0), BAND, **STATED)

    within, said = held(fault)
    assert within > 0.85
    assert said == 1.0
    fit = fault(np.random.default_rng(0))
    assert fit.enlargement == pytest.approx(np.sqrt(fit.chi_squared / 8))
    assert "times as large as the stated uncertainties explain" in fit.calibration.warnings[0]


@pytest.mark.parametrize("stated", [True, False])
def test_an_outlier_is_named(stated):
    counts = measured(np.random.default_rng(1))
    wrong = KELVINS + np.where(np.arange(10) == 6, 10.0, 0.0)
    fit = fit_linear(wrong, counts, BAND, **(STATED if stated else {}))
    place = f"{wrong[6] - 273.15:.5g} °C"
    assert any(f"The point at {place} lies" in one for one in fit.calibration.warnings)


def test_a_drift_during_the_calibration_is_seen_in_points_up_and_down():
    kelvins = np.concatenate([KELVINS, KELVINS[::-1]])

    def fault(rng, drift=15.0):
        counts = measured(rng, kelvins) + np.linspace(0.0, drift, 20)
        return fit_linear(kelvins, counts, BAND, **STATED)

    within, said = held(fault)
    assert within > 0.9
    assert said > 0.95
    assert held(lambda rng: fault(rng, 0.0))[1] < 0.2
    warnings = fault(np.random.default_rng(0)).calibration.warnings
    assert any("self-heating" in one for one in warnings)


def test_the_temperature_uncertainty_counts_where_the_counts_are_steep():
    """A wrong hot point, whose temperature is poorly known, moves the line less."""
    counts = counts_of("linear", KELVINS)
    counts[-1] += 300.0
    poorly = np.where(np.arange(10) == 9, 20.0, 0.1)
    heavy = fit_linear(KELVINS, counts, BAND, count_uncertainty=3.0)
    light = fit_linear(KELVINS, counts, BAND, 3.0, temperature_uncertainty=poorly)
    gains = [fit.calibration.parameters[1] - GAIN for fit in (heavy, light)]
    assert abs(gains[1]) < 0.05 * abs(gains[0])
    assert heavy.probability < 1e-6
    assert light.probability > 0.01


def test_a_wrong_band_shows_in_the_residuals_and_the_criterion():
    """Counts of another band: the straight line fails, Sakuma-Hattori finds its wavelength."""
    other = Band(3.0e-6, 3.6e-6)
    rng = np.random.default_rng(4)
    counts = OFFSET + 3.0 * other.radiance(KELVINS) + rng.normal(0, 3.0, KELVINS.size)
    straight = fit_linear(KELVINS, counts, BAND, count_uncertainty=3.0)
    planckian = fit_sakuma_hattori(KELVINS, counts, BAND, count_uncertainty=3.0)
    assert straight.probability < 1e-6
    assert planckian.probability > 0.01
    assert planckian.information_criterion < straight.information_criterion
    assert 3.0e-6 < planckian.calibration.parameters[1] < 3.6e-6
    right = fit_linear(KELVINS, counts, other, count_uncertainty=3.0)
    assert right.information_criterion < planckian.information_criterion


def test_counts_without_radiance_have_none():
    line = fit_linear(KELVINS, counts_of("linear", KELVINS), BAND).calibration
    assert np.isnan(line.temperature([OFFSET - 1.0, np.nan])).all()
    assert np.isnan(SAKUMA_HATTORI.calibration.radiance([-1e9, np.nan])).all()
