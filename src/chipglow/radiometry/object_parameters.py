"""Object parameters that are set in a thermographic camera."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import TEMPERATURE
from chipglow.radiometry.band import Band


def blackbody_radiance(radiance: ArrayLike, emissivity: ArrayLike, reflected: ArrayLike) -> Array:
    """Return the radiance of a blackbody at the temperature of an object, (L − (1 − ε) L_refl) / ε.

    Parameters
    ----------
    radiance : array_like
        Radiance L of the object in W/(m² sr), the reflected part included.
    emissivity : array_like
        Emissivity ε of the object.
    reflected : array_like
        Radiance of the surroundings in W/(m² sr).
    """
    light, fraction = np.asarray(radiance, np.float64), np.asarray(emissivity, np.float64)
    return np.asarray((light - (1 - fraction) * np.asarray(reflected, np.float64)) / fraction)


@dataclass(frozen=True)
class ObjectParameters(Part):
    """Parameters with which a camera computes the temperature that it shows.

    The measured radiance is L = τ (ε L(T) + (1 − ε) L(T_reflected)) + (1 − τ) L(T_atmosphere).
    """

    emissivity: Annotated[float, Parameter("Emissivity ε of the object.", over=0.0, most=1.0)] = 1.0
    reflected: Annotated[float, Parameter("Reflected temperature.", TEMPERATURE)] = 293.15
    transmittance: Annotated[
        float, Parameter("Transmittance τ of atmosphere and window.", over=0.0, most=1.0)
    ] = 1.0
    atmosphere: Annotated[
        float, Parameter("Temperature of atmosphere and window.", TEMPERATURE)
    ] = 293.15

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
        emitted = blackbody_radiance(left / self.transmittance, self.emissivity, reflected)
        return np.asarray(band.temperature(emitted), np.float64)
