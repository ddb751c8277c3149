"""A laboratory procedure: the mean temperature of the hottest pixels, with its uncertainty."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from chipglow import Estimate, Measurement
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import TEMPERATURE_DIFFERENCE


@dataclass(frozen=True)
class HotSpot(Part):
    """The hottest pixels of every frame, averaged over the frames."""

    pixels: Annotated[int, Parameter("Number of pixels of a frame.", least=1)] = 5
    calibration: Annotated[
        float,
        Parameter("Standard uncertainty of the calibration.", TEMPERATURE_DIFFERENCE, least=0.0),
    ] = 2.0

    def determine(self, measurement: Measurement) -> Estimate:
        """Radiance temperature in K.

        Parameters
        ----------
        measurement : Measurement
            Two frames or more.

        Raises
        ------
        ValueError
            If there are fewer frames, or fewer pixels with a temperature.
        """
        frames = measurement.radiance_temperature().reshape(len(measurement.times), -1)
        if len(frames) < 2:
            raise ValueError("measurement: 1 frame, expected 2 or more")
        if (np.isfinite(frames).sum(axis=1) < self.pixels).any():
            raise ValueError(f"measurement: expected {self.pixels} pixels with a temperature")
        hottest = np.sort(np.nan_to_num(frames, nan=-np.inf), axis=1)[:, -self.pixels :]
        means = hottest.mean(axis=1)
        scatter = float(means.std(ddof=1) / np.sqrt(len(means)))
        return (
            Estimate(means.mean())
            .with_component("calibration", self.calibration)
            .with_component("frames", scatter, degrees_of_freedom=len(means) - 1)
        )
