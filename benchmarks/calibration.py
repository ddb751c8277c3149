"""Coverage of a calibration's stated interval when something is wrong with the calibration.

python benchmarks/calibration.py [--repeats 400]

Each row is a fault of the blackbodies' temperatures, of their counts, or of what is stated of them.
Held is how often the 95 % interval of the radiance temperature contains the truth; warned is how
often the calibration has a warning.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from common import arguments, print_head, print_row

from chipglow.camera import Blackbody, LinearCalibration, SakumaHattori, fit_calibration
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
    """Return the counts of a blackbody."""
    radiance = emissivity * BAND.radiance(kelvins) + (1 - emissivity) * BAND.radiance(ROOM)
    return OFFSET + GAIN * radiance


@dataclass(frozen=True)
class Fault:
    """True errors of a calibration and what is stated of it.

    The standard deviations are in counts and K; `emissivity` has one, too. One temperature is noted
    `outlier` K too high, and counts rise by `heating` from the first point to the last.
    """

    kind: Any = LinearCalibration
    stated: Mapping[str, Any] = field(default_factory=STATED.copy)
    kelvins: np.ndarray = field(default_factory=KELVINS.copy)
    count_noise: float = COUNTS
    temperature_noise: float = TEMPERATURE
    emissivity: float = 1.0
    emissivity_noise: float = 0.0
    outlier: float = 0.0
    heating: float = 0.0

    def fit(self, generator):
        """Fit blackbodies with errors that the generator draws."""
        emissivity, true = self.emissivity, self.kelvins
        if self.emissivity_noise:
            emissivity += generator.normal(0.0, self.emissivity_noise)
        if self.temperature_noise:
            true = true + generator.normal(0.0, self.temperature_noise, true.size)
        counts = signal(true, emissivity) + generator.normal(0.0, self.count_noise, true.size)
        counts += self.heating * np.linspace(0.0, 1.0, true.size)
        noted = self.kelvins
        if self.outlier:
            wrong = np.arange(true.size) == generator.integers(true.size)
            noted = noted + np.where(wrong, self.outlier, 0.0)
        return fit_calibration(self.kind, noted, counts, BAND, **self.stated)


GIVEN = {**STATED, "blackbody": Blackbody(0.97, 0.005, ROOM)}
FAULTS = {
    "none": Fault(),
    "none, sakuma-hattori": Fault(SakumaHattori),
    "nothing stated": Fault(stated={}),
    "nothing stated, sakuma-hattori": Fault(SakumaHattori, {}),
    "emissivity 0.97, given": Fault(stated=GIVEN, emissivity=0.97, emissivity_noise=0.005),
    "emissivity 0.97, left out": Fault(emissivity=0.97),
    "errors 7 times as stated": Fault(count_noise=7 * COUNTS, temperature_noise=7 * TEMPERATURE),
    "one point 10 K off": Fault(outlier=10.0),
    "3 points, nothing stated": Fault(
        stated={}, kelvins=KELVINS[[0, 4, 7]], count_noise=5.0, temperature_noise=0.0
    ),
    "15 counts of self-heating, upward": Fault(heating=15.0),
    "the same, upward and downward": Fault(heating=15.0, kelvins=UP_AND_DOWN),
}


def main():
    repeats = arguments(__doc__, repeats=400).repeats
    print_head("fault", "held at 350 degC", "600 degC", "950 degC", "u at 600 degC / K", "warned")
    true, at = BAND.radiance(BETWEEN), signal(BETWEEN)
    for name, fault in FAULTS.items():
        held, uncertainties, warned = np.zeros(3), np.zeros(3), 0
        for seed in range(repeats):
            fit = fault.fit(np.random.default_rng(seed))
            uncertainty = fit.calibration.uncertainty(at)
            error = np.abs(fit.calibration.radiance(at) - true)
            held += error < 1.96 * uncertainty
            uncertainties += uncertainty / BAND.slope(BETWEEN)
            warned += bool(fit.calibration.warnings)
        held, mean, warned = held / repeats, uncertainties[1] / repeats, warned / repeats
        print_row(name, *(f"{one:.0%}" for one in held), f"{mean:.2g}", f"{warned:.0%}")


if __name__ == "__main__":
    main()
