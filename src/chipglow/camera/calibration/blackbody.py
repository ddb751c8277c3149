"""Radiation of a blackbody that is not quite one."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import TEMPERATURE
from chipglow.radiometry import Band


@dataclass(frozen=True)
class Blackbody(Part):
    """The source of a calibration."""

    emissivity: Annotated[
        float, Parameter("Emissivity in the camera's band.", over=0.0, most=1.0)
    ] = 1.0
    emissivity_uncertainty: Annotated[
        float,
        Parameter("Its standard uncertainty, common to all points.", least=0.0, under=1.0),
    ] = 0.0
    surroundings: Annotated[float, Parameter("What it reflects.", TEMPERATURE, over=0.0)] = 293.15

    def radiance_temperatures(self, kelvins: Array, band: Band) -> Array:
        """Return the temperatures in K of the ideal blackbodies that radiate as much."""
        if self.emissivity == 1.0:
            return kelvins
        own = self.emissivity * np.asarray(band.radiance(kelvins), np.float64)
        radiance = own + (1 - self.emissivity) * self._reflected(band)
        return np.asarray(band.temperature(radiance), np.float64)

    def sensitivity(self, kelvins: Array, band: Band) -> tuple[Array, Array]:
        """Return the change of `radiance_temperatures` with temperature and with emissivity."""
        slope = band.slope(self.radiance_temperatures(kelvins, band))
        by_temperature = self.emissivity * band.slope(kelvins) / slope
        return by_temperature, np.asarray((band.radiance(kelvins) - self._reflected(band)) / slope)

    def _reflected(self, band: Band) -> float:
        return float(band.radiance(self.surroundings))
