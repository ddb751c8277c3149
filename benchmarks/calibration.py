"""Coverage of a calibration's stated interval when something is wrong with the calibration.

python benchmarks/calibration.py [--repeats 400]

Each row is a fault of the blackbodies' temperatures, of their counts, or of what is stated of them.
Held is how often the 95 % interval of the radiance temperature contains the truth; warned is how
often the calibration has a warning.
"""

import numpy as np
from common import arguments, print_head, print_row

from chipglow.camera import LinearCalibration, SakumaHattori
from chipglow.laboratory.recordings import Blackbody, fit_calibration
from chipglow.radiometry import Band

BAND = Band(3.8e-6, 5.1e-6)
KELVINS = 273.15 + np.linspace(300.0, 1000.0, 8)
BETWEEN = 273.15 + np.array([350.0, 600.0, 950.0])
ROOM = 293.15
OFFSET, GAIN = 1000.0, 1.7
COUNTS, TEMPERATURE = 2.0, 0.3  # standard uncertainties as stated, in counts and K
STATED = {"count_uncertainty": COUNTS, "temperature_uncertainty": TEMPERATURE}
UP_AND_DOWN = np.concatenate([KELVINS, KELVINS[::-1]])


def signal(kelvins, emissivity=1.0):
    radiance = emissivity * BAND.radiance(kelvins) + (1 - emissivity) * BAND.radiance(ROOM)
    return OFFSET + GAIN * radiance


def fitted(
    generator, kind=LinearCalibration, stated=STATED, kelvins=KELVINS, count_noise=COUNTS,
    temperature_noise=TEMPERATURE, emissivity=1.0, emissivity_noise=0.0, outlier=0.0, heating=0.0,
):  # fmt: skip
    """Fit blackbodies with true errors that the generator draws, and what is stated of them.

    The standard deviations are in counts and K; `emissivity` has one, too. One temperature is noted
    `outlier` K too high, and counts rise by `heating` from the first point to the last.
    """
    true = kelvins
    if emissivity_noise:
        emissivity += generator.normal(0.0, emissivity_noise)
    if temperature_noise:
        true = true + generator.normal(0.0, temperature_noise, true.size)
    counts = signal(true, emissivity) + generator.normal(0.0, count_noise, true.size)
    counts += heating * np.linspace(0.0, 1.0, true.size)
    if outlier:
        wrong = np.arange(true.size) == generator.integers(true.size)
        kelvins = kelvins + np.where(wrong, outlier, 0.0)
    return fit_calibration(kind, kelvins, counts, BAND, **stated)


GIVEN = {**STATED, "blackbody": Blackbody(0.97, 0.005, ROOM)}
SAKUMA = {"kind": SakumaHattori}
FAULTS = {
    "none": {},
    "none, sakuma-hattori": SAKUMA,
    "nothing stated": {"stated": {}},
    "nothing stated, sakuma-hattori": {**SAKUMA, "stated": {}},
    "emissivity 0.97, given": {"stated": GIVEN, "emissivity": 0.97, "emissivity_noise": 0.005},
    "emissivity 0.97, left out": {"emissivity": 0.97},
    "errors 7 times as stated": {
        "count_noise": 7 * COUNTS, "temperature_noise": 7 * TEMPERATURE,
    },
    "one point 10 K off": {"outlier": 10.0},
    "3 points, nothing stated": {
        "stated": {}, "kelvins": KELVINS[[0, 4, 7]], "count_noise": 5.0, "temperature_noise": 0.0,
    },
    "15 counts of self-heating, upward": {"heating": 15.0},
    "the same, upward and downward": {"heating": 15.0, "kelvins": UP_AND_DOWN},
}  # fmt: skip


def main():
    repeats = arguments(__doc__, repeats=400).repeats
    print_head("fault", "held at 350 degC", "600 degC", "950 degC", "u at 600 degC / K", "warned")
    true, at = BAND.radiance(BETWEEN), signal(BETWEEN)
    for name, fault in FAULTS.items():
        held, uncertainties, warned = np.zeros(3), np.zeros(3), 0
        for seed in range(repeats):
            fit = fitted(np.random.default_rng(seed), **fault)
            uncertainty = fit.calibration.uncertainty(at)
            error = np.abs(fit.calibration.radiance(at) - true)
            held += error < 1.96 * uncertainty
            uncertainties += uncertainty / BAND.slope(BETWEEN)
            warned += bool(fit.calibration.warnings)
        held, mean, warned = held / repeats, uncertainties[1] / repeats, warned / repeats
        print_row(name, *(f"{one:.0%}" for one in held), f"{mean:.2g}", f"{warned:.0%}")


if __name__ == "__main__":
    main()
