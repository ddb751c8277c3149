"""Object parameters that are set in a thermographic camera."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike

from chipglow.quantities import Array
from chipglow.radiometry.band import Band


@dataclass(frozen=True)
class ObjectParameters:
    """Parameters with which a camera computes the temperature that it shows.

    The measured radiance is L = τ (ε L(T) + (1 − ε) L(T_reflected)) + (1 − τ) L(T_atmosphere).
    """

    emissivity: float = 1.0
    """Emissivity ε of the object, over 0 to 1."""
    reflected: float = 293.15
    """Temperature in K of the surroundings that the object reflects."""
    transmittance: float = 1.0
    """Transmission τ of atmosphere and window, over 0 to 1."""
    atmosphere: float = 293.15
    """Temperature of atmosphere and window in K."""

    def __post_init__(self) -> None:
        for name in ("emissivity", "transmittance"):
            value = getattr(self, name)
            if not 0 < value <= 1:
                raise ValueError(f"object parameters: {name} is {value!r}, expected over 0 to 1")
        for name in ("reflected", "atmosphere"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"object parameters: {name} is {value!r}, expected over 0 K")

    def apparent_radiance(self, temperature: ArrayLike, band: Band) -> Array:
        """Return the radiance that was received of an object which is shown at this temperature."""
        reflected, atmosphere = band.radiance([self.reflected, self.atmosphere])
        left = self.emissivity * band.radiance(np.asarray(temperature, np.float64))
        left += (1 - self.emissivity) * reflected
        return np.asarray(self.transmittance * left + (1 - self.transmittance) * atmosphere)

    def temperature(self, radiance: ArrayLike, band: Band) -> Array:
        """Return the temperature in K that is shown for a received radiance."""
        reflected, atmosphere = band.radiance([self.reflected, self.atmosphere])
        left = np.asarray(radiance, np.float64) - (1 - self.transmittance) * atmosphere
        left = left / self.transmittance - (1 - self.emissivity) * reflected
        return np.asarray(band.temperature(left / self.emissivity), np.float64)
