"""The result of a correction: temperatures, intervals and what contributes to them."""

from collections.abc import Sequence
from enum import IntFlag
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene import Raster, Region
from chipglow.scene.scene import raster_of
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Cause, Component, Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Place: TypeAlias = Region | tuple[float, float] | NDArray[np.bool_]
"""Pixels of a region, the pixel at x and y in m, or a mask of pixels (y, x)."""

_VARIABLES: Final = ("temperature", "standard_uncertainty", "lower", "upper", "flags", "effect")


class CorrectionFlag(IntFlag):
    """Restrictions of a pixel's corrected temperature."""

    UPPER_BOUND = 1
    """Below the range: only the upper bound is known."""
    LOWER_BOUND = 2
    """Saturated: only the lower bound is known."""
    INTERPOLATED = 4
    """Without a measured value: determined by its neighbours."""
    BORDER = 8
    """Depends most on the radiance beyond the image, which is assumed."""
    NOT_DETERMINED = 16
    """No zone of known emissivity."""


UNDETERMINED: Final = (
    CorrectionFlag.UPPER_BOUND | CorrectionFlag.LOWER_BOUND | CorrectionFlag.NOT_DETERMINED
)
"""Flags of pixels without a corrected temperature."""


class Correction:
    """Corrected frames; made by `chipglow.correct`.

    Parameters
    ----------
    data : xarray.Dataset
        Over ``time``, ``y`` and ``x``: ``temperature``, ``standard_uncertainty``, ``lower`` and
        ``upper`` (95 %) in K, ``flags`` (sums of `CorrectionFlag`), ``zone`` (index, −1: none) and
        ``resolution`` (side in m of the square that one datum determines). ``effect``, over
        ``error`` too, in K: changes by independent errors of one standard uncertainty each, with
        their causes in ``source``. ``fine_temperature`` on cells of half a pixel.
        ``outline_motion``, the displacement of the outlines that was found, and its
        ``outline_uncertainty``.

    Raises
    ------
    ValueError
        If a variable is missing.
    """

    def __init__(self, data: xr.Dataset) -> None:
        missing = [name for name in _VARIABLES if name not in data]
        if missing:
            raise ValueError(f"correction: variable {missing[0]!r} is missing")
        self.data = data

    def __repr__(self) -> str:
        frames, rows, columns = self.data["temperature"].shape
        return f"<Correction: {frames} frames of {columns} x {rows} pixels>"

    def _repr_html_(self) -> str:
        return result_html(repr(self).strip("<>"), self._overview(), self.notes)

    def _overview(self) -> pd.DataFrame:
        """Return one row for each frame: its pixels, its hottest one, and a usual half-width."""
        rows = []
        for frame, time in enumerate(self.data["time"].values.tolist()):
            flags, data = self.flags[frame], self.data.isel(time=frame)
            half = self.half_width(frame)
            celsius = data["temperature"].values - ZERO_CELSIUS
            is_known = np.isfinite(celsius).any()
            rows.append(
                {
                    "time / µs": 1e6 * time,
                    "corrected pixels": int(np.count_nonzero(flags & UNDETERMINED == 0)),
                    "below the range": int(np.count_nonzero(flags & CorrectionFlag.UPPER_BOUND)),
                    "saturated": int(np.count_nonzero(flags & CorrectionFlag.LOWER_BOUND)),
                    "hottest / °C": float(np.nanmax(celsius)) if is_known else np.nan,
                    "median half-width (95 %) / K": float(np.nanmedian(half))
                    if np.isfinite(half).any()
                    else np.nan,
                }
            )
        return pd.DataFrame(rows)

    @property
    def flags(self) -> NDArray[np.uint8]:
        """Sums of `CorrectionFlag`, shape (time, y, x)."""
        return np.asarray(self.data["flags"].values, np.uint8)

    def half_width(self, frame: int = 0) -> Array:
        """Return half the width of the 95 % interval of each pixel in K, shape (y, x)."""
        data = self.data.isel(time=frame)
        return np.asarray((data["upper"].values - data["lower"].values) / 2)

    @property
    def raster(self) -> Raster:
        """Grid of the pixels."""
        return raster_of(self.data, float(self.data.attrs["pitch"]))

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings."""
        return Notes.from_attrs(self.data.attrs)

    def with_notes(self, notes: Notes) -> "Correction":
        """Return a copy with additional notes."""
        data = self.data.copy(deep=False)
        data.attrs = {**self.data.attrs, **(self.notes + notes).attrs()}
        return Correction(data)

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the sources of uncertainty."""
        return tuple(dict.fromkeys(self.data["source"].values.tolist()))

    def contribution(self, source: str, frame: int = 0) -> Array:
        """Return the standard uncertainty of each pixel by one source in K, shape (y, x)."""
        self._check_frame(frame)
        if source not in self.sources:
            raise ValueError(f"source: {source!r}, expected one of {', '.join(self.sources)}")
        own = self.data["source"].values == source
        effects = self.data["effect"][frame].values[own]
        return np.asarray(np.sqrt((effects.astype(np.float64) ** 2).sum(axis=0)))

    def at(self, place: Place, frame: int = 0) -> Estimate:
        """Return the mean true temperature in K over a place, with its uncertainty.

        Raises
        ------
        ValueError
            If there is no such frame, or the place is outside the image or has no pixel with a
            corrected temperature.
        """
        self._check_frame(frame)
        mask = self._mask(place) & (self.data["flags"][frame].values & UNDETERMINED == 0)
        if not mask.any():
            raise ValueError("place: has no pixel with a corrected temperature")
        values = self.data["temperature"][frame].values[mask]
        effects = self.data["effect"][frame].values[:, mask].astype(np.float64).mean(axis=1)
        sources = self.data["source"].values
        freedoms = self.data["degrees_of_freedom"].values
        components = []
        for source in self.sources:
            for freedom in np.unique(freedoms[sources == source]).tolist():
                own = (sources == source) & (freedoms == freedom)
                cause = Cause(source, f"{freedom:g}", int(own.sum()), freedom)
                components.append(Component(cause, effects[own][None]))
        return Estimate(np.array(values.mean()), tuple(components))

    def budget(self, place: Place, frame: int = 0) -> pd.DataFrame:
        """Return the uncertainty budget of a place: one row for each source, largest first."""
        budget = self.at(place, frame).budget().to_dataframe().reset_index()
        return budget.sort_values("standard_uncertainty", ascending=False, ignore_index=True)

    def to_frame(self, frame: int = 0) -> pd.DataFrame:
        """Return one row for each pixel: place in m, temperatures, interval and flags."""
        self._check_frame(frame)
        names = ["temperature", "standard_uncertainty", "lower", "upper", "flags", "resolution"]
        names = [name for name in ("measured", *names) if name in self.data]
        chosen = self.data[names].isel(time=frame).drop_vars("time", errors="ignore")
        return chosen.to_dataframe().reset_index()

    def plot(self, frame: int = 0, ax: "Axes | None" = None) -> "Axes":
        """Plot the corrected temperature of one frame in °C over x and y in µm."""
        from chipglow.scene.figures import plot_image

        self._check_frame(frame)
        celsius = self.data["temperature"][frame].values - ZERO_CELSIUS
        time = float(self.data["time"].values[frame])
        return plot_image(celsius, self.raster, None, "corrected temperature / °C", time, ax)

    def _check_frame(self, frame: int) -> None:
        count = self.data.sizes["time"]
        if not -count <= frame < count:
            raise ValueError(f"frame: is {frame}, expected 0 to {count - 1}")

    def _mask(self, place: Place) -> NDArray[np.bool_]:
        raster = self.raster
        if isinstance(place, Region):
            return place.mask(raster)
        if isinstance(place, tuple):
            return _pixel_at(place, raster)
        mask: Any = np.asarray(place)
        if mask.dtype != np.bool_ or mask.shape != raster.shape:
            raise ValueError(
                "place: expected a region, a tuple of x and y in m, or a mask of shape "
                f"{raster.shape}"
            )
        return np.asarray(mask, np.bool_)


def _pixel_at(point: tuple[float, float], raster: Raster) -> NDArray[np.bool_]:
    x, y = point
    left, right, bottom, top = raster.extent
    if not (left <= x < right and bottom < y <= top):
        raise ValueError(
            f"place: {1e6 * x:.6g}, {1e6 * y:.6g} um is outside the image of "
            f"{1e6 * left:.6g} to {1e6 * right:.6g} um and {1e6 * bottom:.6g} to {1e6 * top:.6g} um"
        )
    mask = np.zeros(raster.shape, np.bool_)
    mask[int((top - y) / raster.spacing), int((x - left) / raster.spacing)] = True
    return mask


def joined(corrections: Sequence[Correction]) -> Correction:
    """Return the frames of several corrections of one camera as one correction."""
    parts = [one.data for one in corrections]
    data = xr.concat(parts, "time", data_vars="all", coords="minimal", compat="override")
    notes = sum((one.notes for one in corrections), Notes())
    data.attrs = {**parts[0].attrs, **notes.attrs()}
    return Correction(data)
