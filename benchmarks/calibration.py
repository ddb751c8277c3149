"""How often the stated interval of a calibration holds the truth if something is wrong with it.

python benchmarks/calibration.py [--repeats 400]

Each row is a fault of the temperatures of blackbodies, of their counts, or of what is said of them.
Held is how often the 95 % interval of the radiance temperature holds the truth; said is how often
the calibration has a warning.
"""

import argparse

import numpy as np

from chipglow.camera import Blackbody, LinearCalibration, SakumaHattori, fit_calibration
from chipglow.radiometry import Band

BAND = Band(3.8e-6, 5.1e-6)
KELVINS = 273.15 + np.linspace(300.0, 1000.0, 8)
BETWEEN = 273.15 + np.array([350.0, 600.0, 950.0])
ROOM = 293.15
OFFSET, GAIN = 1000.0, 1.7
COUNTS, TEMPERATURE = 2.0, 0.3  # standard uncertainties as stated, in counts and K
STATED = {"count_uncertainty": COUNTS, "temperature_uncertainty": TEMPERATURE}


def signal(kelvins, emissivity=1.0):
    """Counts of a blackbody."""
    radiance = emissivity * BAND.radiance(kelvins) + (1 - emissivity) * BAND.radiance(ROOM)
    return OFFSET + GAIN * radiance


def points(generator, kelvins=KELVINS, larger=1.0, emissivity=1.0):
    """Temperatures as read and counts, with errors so many times as large as stated."""
    true = kelvins + larger * generator.normal(0.0, TEMPERATURE, kelvins.size)
    noise = larger * generator.normal(0.0, COUNTS, kelvins.size)
    return kelvins, signal(true, emissivity) + noise


def sound(generator):
    """Nothing is wrong."""
    return fit_calibration(LinearCalibration, *points(generator), BAND, **STATED)


def planckian(generator):
    """The same, fitted by the form of Sakuma and Hattori."""
    return fit_calibration(SakumaHattori, *points(generator), BAND, **STATED)


def unstated(generator):
    """The same, and nothing is stated."""
    return fit_calibration(LinearCalibration, *points(generator), BAND)


def planckian_unstated(generator):
    """Sakuma and Hattori's form, and nothing is stated."""
    return fit_calibration(SakumaHattori, *points(generator), BAND)


def emissivity_given(generator):
    """A blackbody of about 0.97, which is said."""
    said = Blackbody(0.97, 0.005, ROOM)
    true = 0.97 + generator.normal(0.0, 0.005)
    return fit_calibration(
        LinearCalibration, *points(generator, emissivity=true), BAND, blackbody=said, **STATED
    )


def emissivity_left_out(generator):
    """The same, which is not said."""
    return fit_calibration(LinearCalibration, *points(generator, emissivity=0.97), BAND, **STATED)


def understated(generator):
    """Errors seven times as large as stated: a reduced chi-squared of about 50."""
    return fit_calibration(LinearCalibration, *points(generator, larger=7.0), BAND, **STATED)


def outlier(generator):
    """One temperature was noted 10 K wrong."""
    kelvins, counts = points(generator)
    wrong = kelvins + np.where(np.arange(8) == generator.integers(8), 10.0, 0.0)
    return fit_calibration(LinearCalibration, wrong, counts, BAND, **STATED)


def three_points(generator):
    """Three points of unknown uncertainty, whose counts scatter alike."""
    kelvins = KELVINS[[0, 4, 7]]
    return fit_calibration(
        LinearCalibration, kelvins, signal(kelvins) + generator.normal(0.0, 5.0, 3), BAND
    )


def self_heating(generator, kelvins=KELVINS):
    """The camera warms up: 15 counts from the first point to the last."""
    kelvins, counts = points(generator, kelvins)
    warm = 15.0 * np.linspace(0.0, 1.0, kelvins.size)
    return fit_calibration(LinearCalibration, kelvins, counts + warm, BAND, **STATED)


def self_heating_twice(generator):
    """The same, with the points upward and again downward."""
    return self_heating(generator, np.concatenate([KELVINS, KELVINS[::-1]]))


FAULTS = {
    "none": sound,
    "none, sakuma-hattori": planckian,
    "nothing stated": unstated,
    "nothing stated, sakuma-hattori": planckian_unstated,
    "emissivity 0.97, given": emissivity_given,
    "emissivity 0.97, left out": emissivity_left_out,
    "errors 7 times as stated": understated,
    "one point 10 K off": outlier,
    "3 points, nothing stated": three_points,
    "15 counts of self-heating, upward": self_heating,
    "the same, upward and downward": self_heating_twice,
}


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--repeats", type=int, default=400, help="calibrations of each row")
    repeats = parser.parse_args().repeats
    print("| fault | held at 350 degC | 600 degC | 950 degC | u at 600 degC / K | said |")
    print("|---|---|---|---|---|---|")
    true, at = BAND.radiance(BETWEEN), signal(BETWEEN)
    for name, fault in FAULTS.items():
        held, uncertainties, said = np.zeros(3), np.zeros(3), 0
        for seed in range(repeats):
            fit = fault(np.random.default_rng(seed))
            uncertainty = fit.calibration.uncertainty(at)
            error = np.abs(fit.calibration.radiance(at) - true)
            held += error < fit.coverage_factor() * uncertainty
            uncertainties += uncertainty / BAND.slope(BETWEEN)
            said += bool(fit.calibration.warnings)
        fractions = " | ".join(f"{100 * value / repeats:.0f} %" for value in held)
        mean = uncertainties[1] / repeats
        print(f"| {name} | {fractions} | {mean:.2g} | {100 * said / repeats:.0f} % |", flush=True)


if __name__ == "__main__":
    main()
