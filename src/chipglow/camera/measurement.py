"""Frames of radiance temperature, simulated or real."""

from collections.abc import Mapping
from enum import IntFlag
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from chipglow.camera.calibration import CALIBRATION, CalibrationErrors
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.radiometry import Band, TabulatedResponse
from chipglow.scene import Raster, Tool
from chipglow.scene.notebook import frames_text
from chipglow.scene.scene import raster_coordinates, raster_of
from chipglow.scene.tool_outline import stored_tool, tool_attributes
from chipglow.text import Notes
from chipglow.uncertainty import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEASUREMENT_UNITS: Final = {"radiance_temperature": "K", "radiance": "W m-2 sr-1", "flags": "1"}
"""Variables of every measurement, and their units."""

WHOLE: Final = slice(None)
"""All frames, rows or columns."""


class Flag(IntFlag):
    """Pixel faults; of the flagged pixels, only `REPLACED` ones have a radiance temperature."""

    UNDER_RANGE = 1
    """Below the camera's lower range limit, or without radiance."""
    SATURATED = 2
    """At the largest count, or above the calibrated range."""
    DEAD = 4
    """The pixel does not respond to light."""
    REPLACED = 8
    """The pixel does not respond to light; its value is interpolated from its neighbours."""


UNUSABLE: Final = Flag.UNDER_RANGE | Flag.SATURATED | Flag.DEAD
"""Flags of pixels without a radiance temperature."""


def range_flags(
    temperature: NDArray[np.floating],
    lower_limit: float | None,
    flags: NDArray[np.uint8] | None = None,
) -> NDArray[np.uint8]:
    """Return `flags` with `Flag.UNDER_RANGE` for usable pixels below a limit or NaN, in K."""
    flags = np.zeros(temperature.shape, np.uint8) if flags is None else flags
    below = ~(temperature >= (lower_limit or 0.0)) & (flags & UNUSABLE == 0)
    return flags | np.where(below, Flag.UNDER_RANGE, 0).astype(np.uint8)


class Measurement:
    """Frames of a camera.

    Parameters
    ----------
    data : xarray.Dataset
        Variables ``radiance_temperature`` (NaN where flagged), ``radiance`` and ``flags`` (sums of
        `Flag`, uint8), each with dimensions (time, y, x) and the ``units`` of `MEASUREMENT_UNITS`.
        Coordinates: ``time`` in s, the start of each integration; ``x`` ascending and ``y``
        descending in m, the pixel centres. Attributes: ``pitch``, the distance between pixels in m;
        ``band_lower`` and ``band_upper``, the limits of the band in m. Optional variables:
        ``response`` over ``wavelength`` in m, the relative spectral response;
        ``calibration_errors`` over (``calibration_error``, ``calibration_radiance``) in W/(m² sr),
        the effects of `CalibrationErrors`.

    Raises
    ------
    ValueError
        If a variable, a unit or the pitch is missing.
    """

    def __init__(self, data: xr.Dataset) -> None:
        for name, unit in MEASUREMENT_UNITS.items():
            if name not in data or data[name].dims != ("time", "y", "x"):
                raise ValueError(f"measurement: {name!r} over ('time', 'y', 'x') is missing")
            units = data[name].attrs.get("units")
            if units != unit:
                raise ValueError(f"measurement: units of {name!r} must be {unit!r}, not {units!r}")
        if "pitch" not in data.attrs:
            raise ValueError("measurement: attribute 'pitch' is missing")
        self.data = data

    @classmethod
    def from_radiance(
        cls,
        radiance: NDArray[np.floating],
        band: Band,
        times: Array,
        raster: Raster,
        lower_limit: float | None = None,
        flags: NDArray[np.uint8] | None = None,
        calibration_errors: CalibrationErrors | None = None,
        attributes: Mapping[str, float | str] | None = None,
    ) -> "Measurement":
        """Return a measurement from frames of radiance in W/(m² sr), shape (time, y, x).

        Pixels below `lower_limit` in K or without radiance are flagged in addition to `flags`.
        """
        temperature = band.temperature(radiance)
        flags = range_flags(temperature, lower_limit, flags)
        values = {
            "radiance_temperature": np.where(flags & UNUSABLE, np.nan, temperature),
            "radiance": radiance,
            "flags": flags,
        }
        known: dict[str, float | str] = {**(attributes or {}), "pitch": raster.spacing}
        if lower_limit is not None:
            known["lower_limit"] = lower_limit
        known |= {"band_lower": band.lower, "band_upper": band.upper}
        variables = {
            name: (("time", "y", "x"), values[name], {"units": unit})
            for name, unit in MEASUREMENT_UNITS.items()
        }
        data = xr.Dataset(variables, raster_coordinates(raster, times), known)
        if band.response is not None:
            # The response at the nodes of the band's quadrature keeps the integral.
            data.coords["wavelength"] = "wavelength", band.wavelengths, {"units": "m"}
            response = np.asarray(band.response(band.wavelengths), np.float64)
            data["response"] = "wavelength", response, {"units": "1"}
        if calibration_errors is not None:
            units = {"units": MEASUREMENT_UNITS["radiance"]}
            data.coords[_ERRORS[1]] = _ERRORS[1], calibration_errors.radiance, units
            data["calibration_errors"] = _ERRORS, calibration_errors.effects, units
        return cls(data)

    def __len__(self) -> int:
        return len(self.times)

    def __repr__(self) -> str:
        frames = frames_text(self.times, self.raster, "pixels", self.celsius())
        tool = f"{'with' if self.tool else 'without'} tool"
        count = len(self.notes.warnings)
        warnings = f"; {count} warning{'s' if count > 1 else ''}: see .notes" if count else ""
        return f"<Measurement: {frames}; {tool}{warnings}>"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(repr(self))}</pre>{self.data._repr_html_()}"

    @property
    def notes(self) -> Notes:
        """Assumptions, warnings and statements of the camera file."""
        return Notes.from_attrs(self.data.attrs)

    @cached_property
    def band(self) -> Band:
        """Spectral band of the camera; a ValueError if the attributes do not state it."""
        for name in ("band_lower", "band_upper"):
            if name not in self.data.attrs:
                raise ValueError(f"measurement: attribute {name!r} of the camera's band is missing")
        limits = float(self.data.attrs["band_lower"]), float(self.data.attrs["band_upper"])
        if "response" not in self.data:
            return Band(*limits)
        table = self.data["response"]
        if table.dims != ("wavelength",) or "wavelength" not in self.data.coords:
            raise ValueError("measurement: 'response' over 'wavelength' is missing")
        wavelengths = tuple(np.asarray(table["wavelength"].values, np.float64).tolist())
        values = tuple(np.asarray(table.values, np.float64).tolist())
        return Band(*limits, TabulatedResponse(wavelengths, values))

    @property
    def times(self) -> Array:
        """Start of each frame's integration in s."""
        return np.asarray(self.data["time"].values, dtype=np.float64)

    @cached_property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return raster_of(self.data, float(self.data.attrs["pitch"]))

    @property
    def tool(self) -> Tool | None:
        """Tool in the measurement's coordinates, if stated."""
        return stored_tool(self.data.attrs)

    def with_tool(self, tool: Tool) -> "Measurement":
        """Return a copy with a tool in the measurement's coordinates."""
        other = {k: v for k, v in self.data.attrs.items() if not str(k).startswith("tool_")}
        data = self.data.copy(deep=False)
        data.attrs = {**other, **tool_attributes(tool)}
        return Measurement(data)

    def part(
        self, frames: slice = WHOLE, rows: slice = WHOLE, columns: slice = WHOLE
    ) -> "Measurement":
        """Return some frames, rows and columns; they share the tables of the band."""
        part = Measurement(self.data.isel(time=frames, y=rows, x=columns))
        if "band_lower" in self.data.attrs:
            part.band = self.band
        return part

    @property
    def flags(self) -> NDArray[np.uint8]:
        """Sums of `Flag`, shape (time, y, x)."""
        return np.asarray(self.data["flags"].values, dtype=np.uint8)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Mask of the pixels with a radiance temperature, shape (time, y, x)."""
        return np.asarray(self.flags & UNUSABLE == 0, np.bool_)

    @property
    def radiance(self) -> Array:
        """Radiance in W/(m² sr), shape (time, y, x)."""
        return np.asarray(self.data["radiance"].values, dtype=np.float64)

    def radiance_temperature(self, flagged: bool = False) -> Array:
        """Return the radiance temperature in K, shape (time, y, x); NaN where unusable.

        With `flagged`, unusable pixels return the temperature of their radiance.
        """
        stored = np.asarray(self.data["radiance_temperature"].values, dtype=np.float64)
        if not flagged:
            return stored
        return np.where(self.usable, stored, self.band.temperature(self.radiance))

    def celsius(self, frame: int = 0) -> Array:
        """Return the radiance temperature of one frame in °C, shape (y, x); NaN where unusable."""
        kelvin = self.data["radiance_temperature"][frame].values
        return np.asarray(kelvin, np.float64) - ZERO_CELSIUS

    def plot(self, frame: int = 0, ax: "Axes | None" = None) -> "Axes":
        """Plot the radiance temperature of one frame in °C over x and y in µm, with the tool.

        Pixels without a radiance temperature are grey. New axes are made by default.
        """
        from chipglow.scene.figures import plot_image

        time, label = float(self.times[frame]), "radiance temperature / °C"
        return plot_image(self.celsius(frame), self.raster, self.tool, label, time, ax)

    @cached_property
    def calibration_errors(self) -> CalibrationErrors | None:
        """Effects of the calibration errors on the radiance, if known."""
        if "calibration_errors" not in self.data:
            return None
        table = self.data["calibration_errors"]
        if table.dims != _ERRORS or _ERRORS[1] not in self.data.coords:
            raise ValueError(f"measurement: 'calibration_errors' over {_ERRORS} is missing")
        return CalibrationErrors(table[_ERRORS[1]].values, table.values)

    @property
    def calibration_uncertainty(self) -> Array | None:
        """Standard uncertainty of the radiance due to the calibration in W/(m² sr), if known.

        It is common to all pixels and frames (time, y, x): averaging does not reduce it.
        """
        errors = self.calibration_errors
        return None if errors is None else errors.standard_uncertainty(self.radiance)

    def calibration_effects(self, frame: int) -> Array:
        """Return the signed temperature changes in K due to each calibration error.

        Each error is one standard uncertainty. Shape (errors, y, x); NaN where unusable.
        """
        kelvins = np.asarray(self.data["radiance_temperature"][frame].values, np.float64)
        if self.calibration_errors is None:
            return np.zeros((0, *kelvins.shape))
        slope = self.band.slope(kelvins)
        return self.calibration_errors.at(self.data["radiance"][frame].values) / slope

    def estimate(self, values: Array, effects: ArrayLike) -> Estimate:
        """Return results in K with the uncertainty component ``calibration``.

        `values` (frames, ...) are NaN where undefined; `effects` (frames, errors, ...) are their
        changes with each error, derived from `calibration_effects`. Without errors, the component
        is marked as not evaluated.
        """
        if self.calibration_errors is None:
            return Estimate(values).with_unevaluated(CALIBRATION)
        changes = np.where(np.isfinite(values), np.swapaxes(effects, 0, 1), np.nan)
        return Estimate(values, (self.calibration_errors.component(changes),))


_ERRORS: Final = ("calibration_error", "calibration_radiance")
