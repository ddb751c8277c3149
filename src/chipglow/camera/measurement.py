"""What a camera saw: frames of radiance temperature, simulated or real."""

from enum import IntFlag
from functools import cached_property
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.radiometry import Band
from chipglow.scene import Raster

MEASUREMENT_UNITS: Final = {"radiance_temperature": "K", "radiance": "W m-2 sr-1", "flags": "1"}
"""The variables that every measurement has, and their units."""


class Flag(IntFlag):
    """Why a pixel has no radiance temperature."""

    BELOW_FLOOR = 1
    """Colder than the camera measures at its integration time, or without any radiance."""


class Measurement:
    """Frames of a camera.

    Parameters
    ----------
    data : xarray.Dataset
        Variables of `MEASUREMENT_UNITS` with dimensions (time, y, x) and a ``units`` attribute
        each: ``radiance_temperature``, NaN where flagged; ``radiance``; ``flags``, a sum of
        `Flag`, uint8. Coordinates as a scene's: ``time`` in s, when each integration began;
        ``x`` ascending and ``y`` descending in m, the middles of the sensors. Attributes tell the
        camera; ``pitch`` is the distance between sensors in m.

    Raises
    ------
    ValueError
        If a variable, a unit or the pitch is missing.
    """

    def __init__(self, data: xr.Dataset) -> None:
        for name, unit in MEASUREMENT_UNITS.items():
            if name not in data or data[name].dims != ("time", "y", "x"):
                raise ValueError(f"measurement: {name!r} over ('time', 'y', 'x') is missing")
            found = data[name].attrs.get("units")
            if found != unit:
                raise ValueError(f"measurement: {name!r} has units {found!r}, expected {unit!r}")
        if "pitch" not in data.attrs:
            raise ValueError("measurement: attribute 'pitch' is missing")
        self.data = data

    @property
    def times(self) -> NDArray[np.float64]:
        """When each frame's integration began, in s."""
        return np.asarray(self.data["time"].values, dtype=np.float64)

    @cached_property
    def raster(self) -> Raster:
        """The grid of the sensors."""
        x, y, pitch = self.data["x"].values, self.data["y"].values, float(self.data.attrs["pitch"])
        return Raster(float(x[0]) - pitch / 2, float(y[0]) + pitch / 2, pitch, len(y), len(x))

    @property
    def flags(self) -> NDArray[np.uint8]:
        """Sums of `Flag`, shape (time, y, x)."""
        return np.asarray(self.data["flags"].values, dtype=np.uint8)

    @property
    def radiance(self) -> NDArray[np.float64]:
        """Radiance in W/(m² sr), shape (time, y, x)."""
        return np.asarray(self.data["radiance"].values, dtype=np.float64)

    def radiance_temperature(self, flagged: bool = False) -> NDArray[np.float64]:
        """Radiance temperature.

        Parameters
        ----------
        flagged : bool
            Whether to give flagged pixels the temperature of their radiance, instead of NaN.

        Returns
        -------
        ndarray
            Radiance temperature in K, shape (time, y, x).

        Raises
        ------
        ValueError
            If flagged pixels are asked for and the attributes do not tell the camera's band.
        """
        stored = np.asarray(self.data["radiance_temperature"].values, dtype=np.float64)
        if not flagged:
            return stored
        if "band_lower" not in self.data.attrs:
            raise ValueError(
                "measurement: flagged pixels need the limits of a box-shaped band, and the "
                "attribute 'band_lower' is missing"
            )
        band = Band(float(self.data.attrs["band_lower"]), float(self.data.attrs["band_upper"]))
        return np.where(self.flags == 0, stored, band.temperature(self.radiance))
