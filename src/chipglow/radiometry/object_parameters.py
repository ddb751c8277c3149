"""The object parameters set in a thermographic camera, and how to take it back."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.radiometry.band import Band


@dataclass(frozen=True)
class ObjectParameters:
    """What a camera takes into account when it shows a temperature.

    The measured radiance is L = τ (ε L(T) + (1 − ε) L(T_reflected)) + (1 − τ) L(T_atmosphere).

    Parameters
    ----------
    emissivity : float
        Emissivity ε of the object, over 0 to 1.
    reflected : float
        Temperature of the surroundings that the object reflects in K.
    transmittance : float
        Transmission τ of atmosphere and window, over 0 to 1.
    atmosphere : float
        Temperature of atmosphere and window in K.

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    emissivity: float = 1.0
    reflected: float = 293.15
    transmittance: float = 1.0
    atmosphere: float = 293.15

    def __post_init__(self) -> None:
        for name in ("emissivity", "transmittance"):
            value = getattr(self, name)
            if not 0 < value <= 1:
                raise ValueError(f"object parameters: {name} is {value!r}, expected over 0 to 1")
        for name in ("reflected", "atmosphere"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"object parameters: {name} is {value!r}, expected over 0 K")

    def apparent_radiance(self, temperature: ArrayLike, band: Band) -> NDArray[np.float64]:
        """Radiance that the camera received of an object which it shows at this temperature.

        Parameters
        ----------
        temperature : array_like
            Temperature that the camera shows in K, of any shape.
        band : Band
            The camera's band.

        Returns
        -------
        ndarray
            In-band radiance in W/(m² sr), of the same shape.
        """
        reflected, atmosphere = band.radiance([self.reflected, self.atmosphere])
        left = self.emissivity * band.radiance(np.asarray(temperature, np.float64))
        left += (1 - self.emissivity) * reflected
        return np.asarray(self.transmittance * left + (1 - self.transmittance) * atmosphere)

    def temperature(self, radiance: ArrayLike, band: Band) -> NDArray[np.float64]:
        """Temperature that the camera shows for a received radiance: the inverse.

        Parameters
        ----------
        radiance : array_like
            Received in-band radiance in W/(m² sr), of any shape.
        band : Band
            The camera's band.

        Returns
        -------
        ndarray
            Temperature in K, of the same shape; NaN where the surroundings alone give more.
        """
        reflected, atmosphere = band.radiance([self.reflected, self.atmosphere])
        left = np.asarray(radiance, np.float64) - (1 - self.transmittance) * atmosphere
        left = left / self.transmittance - (1 - self.emissivity) * reflected
        return np.asarray(band.temperature(left / self.emissivity), np.float64)
