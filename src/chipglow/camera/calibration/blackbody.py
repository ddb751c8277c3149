"""What a blackbody radiates that is not quite one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.radiometry import Band


@dataclass(frozen=True)
class Blackbody:
    """The source of a calibration.

    Parameters
    ----------
    emissivity : float
        Its emissivity in the camera's band.
    emissivity_uncertainty : float
        Standard uncertainty of it, which all points have in common.
    surroundings : float
        Temperature in K of what it reflects.

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    emissivity: float = 1.0
    emissivity_uncertainty: float = 0.0
    surroundings: float = 293.15

    def __post_init__(self) -> None:
        if not 0 < self.emissivity <= 1:
            raise ValueError(f"emissivity: is {self.emissivity!r}, expected over 0 to 1")
        if not 0 <= self.emissivity_uncertainty < 1:
            raise ValueError(
                f"emissivity_uncertainty: is {self.emissivity_uncertainty!r}, expected 0 to 1"
            )
        if not 0 < self.surroundings < np.inf:
            raise ValueError(f"surroundings: is {self.surroundings!r} K, expected over 0 K")

    def radiance_temperatures(
        self, kelvins: NDArray[np.float64], band: Band
    ) -> NDArray[np.float64]:
        """Temperatures in K of the blackbodies of emissivity 1 that radiate as much."""
        if self.emissivity == 1.0:
            return kelvins
        return np.asarray(band.temperature(self._radiance(kelvins, band)), np.float64)

    def sensitivity(
        self, kelvins: NDArray[np.float64], band: Band
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Change of `radiance_temperatures` with the temperature and, in K, with the emissivity."""
        slope = band.slope(self.radiance_temperatures(kelvins, band))
        by_temperature = self.emissivity * np.asarray(band.slope(kelvins)) / slope
        reflected = float(band.radiance(np.array(self.surroundings)))
        return np.asarray(by_temperature), np.asarray((band.radiance(kelvins) - reflected) / slope)

    def _radiance(self, kelvins: NDArray[np.float64], band: Band) -> NDArray[np.float64]:
        reflected = float(band.radiance(np.array(self.surroundings)))
        own = np.asarray(band.radiance(kelvins), np.float64)
        return self.emissivity * own + (1 - self.emissivity) * reflected
