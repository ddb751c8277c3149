"""Radiation of a blackbody that is not quite one."""

from dataclasses import dataclass

import numpy as np

from chipglow.quantities import Array
from chipglow.radiometry import Band


@dataclass(frozen=True)
class Blackbody:
    """The source of a calibration."""

    emissivity: float = 1.0
    """In the camera's band."""
    emissivity_uncertainty: float = 0.0
    """Standard uncertainty of it, which all points have in common."""
    surroundings: float = 293.15
    """Temperature in K of what it reflects."""

    def __post_init__(self) -> None:
        if not 0 < self.emissivity <= 1:
            raise ValueError(f"emissivity: is {self.emissivity!r}, expected over 0 to 1")
        if not 0 <= self.emissivity_uncertainty < 1:
            raise ValueError(
                f"emissivity_uncertainty: is {self.emissivity_uncertainty!r}, expected 0 to 1"
            )
        if not 0 < self.surroundings < np.inf:
            raise ValueError(f"surroundings: is {self.surroundings!r} K, expected over 0 K")

    def radiance_temperatures(self, kelvins: Array, band: Band) -> Array:
        """Return the temperatures in K of the ideal blackbodies that radiate as much."""
        if self.emissivity == 1.0:
            return kelvins
        return np.asarray(band.temperature(self._radiance(kelvins, band)), np.float64)

    def sensitivity(self, kelvins: Array, band: Band) -> tuple[Array, Array]:
        """Return the change of `radiance_temperatures` with temperature and with emissivity."""
        slope = band.slope(self.radiance_temperatures(kelvins, band))
        by_temperature = self.emissivity * np.asarray(band.slope(kelvins)) / slope
        reflected = float(band.radiance(np.array(self.surroundings)))
        return np.asarray(by_temperature), np.asarray((band.radiance(kelvins) - reflected) / slope)

    def _radiance(self, kelvins: Array, band: Band) -> Array:
        reflected = float(band.radiance(np.array(self.surroundings)))
        own = np.asarray(band.radiance(kelvins), np.float64)
        return self.emissivity * own + (1 - self.emissivity) * reflected
