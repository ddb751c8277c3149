"""Temperatures of places over time, along lines, and by their frequency."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Final

import numpy as np
import pandas as pd
from contourpy import LineType, contour_generator
from numpy.typing import NDArray

from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.scene import Raster, Region, sample

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_BINS: Final = 100
"""Bins of a histogram: more are narrower than a pixel of a figure."""


@dataclass(frozen=True, eq=False, repr=False)
class PlaceCurves(Brief):
    """Temperatures of places over time; made by `place_curves`."""

    times: Array
    """Start of each frame in s, shape (time,)."""
    places: tuple[str, ...]
    mean: Array
    """Mean over the usable pixels of each place in K, NaN without any, shape (place, time)."""
    minimum: Array
    maximum: Array

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each frame: the time, and mean, minimum and maximum of each place."""
        columns = {"time_s": self.times}
        for number, place in enumerate(self.places):
            for name in ("mean", "minimum", "maximum"):
                columns[f"{place} {name}_degC"] = getattr(self, name)[number] - ZERO_CELSIUS
        return pd.DataFrame(columns)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Plot the mean of each place in °C over the time in µs. New axes are made by default."""
        from chipglow.laboratory.readings.figure import plot_curves

        return plot_curves(self, ax)


def place_curves(
    kelvins: Callable[[int], Array],
    times: Array,
    raster: Raster,
    places: Sequence[Region],
    check: Callable[[float], None] | None = None,
) -> PlaceCurves:
    """Read places in every frame.

    Parameters
    ----------
    kelvins : callable
        Takes the index of a frame and returns its temperatures in K, NaN where unusable, shape
        (y, x).
    times : ndarray
        Start of each frame in s.
    raster : Raster
        Grid of the pixels.
    places : sequence of Region
        Regions, points and lines.
    check : callable, optional
        Called with the completed fraction after each frame. An exception raised here stops the
        reading.
    """
    pixels = [np.flatnonzero(place.mask(raster)) for place in places]
    values = np.full((3, len(places), len(times)), np.nan)
    for frame in range(len(times)):
        image = kelvins(frame).ravel()
        for number, chosen in enumerate(pixels):
            inside = image[chosen]
            known = inside[np.isfinite(inside)]
            if known.size:
                values[:, number, frame] = known.mean(), known.min(), known.max()
        if check is not None:
            check((frame + 1) / len(times))
    names = tuple(place.name for place in places)
    return PlaceCurves(np.asarray(times, np.float64), names, *values)


@dataclass(frozen=True, eq=False, repr=False)
class Profile(Brief):
    """Temperature along a line; made by `profile`."""

    place: str
    distance: Array
    """Distance from the first corner in m, every half pixel, shape (n,)."""
    points: Array
    """x and y in m, shape (n, 2)."""
    kelvins: Array
    """Temperature in K, bilinear between the centres of pixels; NaN next to unusable ones."""

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each point."""
        x, y = 1e6 * self.points.T
        return pd.DataFrame(
            {
                "place": self.place,
                "distance_um": 1e6 * self.distance,
                "x_um": x,
                "y_um": y,
                "temperature_degC": self.kelvins - ZERO_CELSIUS,
            }
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Plot the temperature in °C over the distance in µm. New axes are made by default."""
        from chipglow.laboratory.readings.figure import plot_profile

        return plot_profile(self, ax)


def profile(kelvins: Array, raster: Raster, line: Region) -> Profile:
    """Return the temperature along a line of an image in K, shape (y, x)."""
    along = line.line(raster)
    values = sample(kelvins, raster, along.points)
    return Profile(line.name, along.distance, along.points, values)


@dataclass(frozen=True, eq=False, repr=False)
class Histogram(Brief):
    """Frequency of the temperatures of a place; made by `histogram`."""

    place: str
    edges: Array
    """Limits of the bins in K, ascending, shape (n + 1,)."""
    pixels: NDArray[np.int_]
    """Number of pixels in each bin, shape (n,)."""

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each bin."""
        edges = self.edges - ZERO_CELSIUS
        return pd.DataFrame(
            {
                "place": self.place,
                "from_degC": edges[:-1],
                "to_degC": edges[1:],
                "pixels": self.pixels,
            }
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Plot the number of pixels over the temperature in °C. New axes are made by default."""
        from chipglow.laboratory.readings.figure import plot_histogram

        return plot_histogram(self, ax)


def histogram(kelvins: Array, mask: NDArray[np.bool_], place: str) -> Histogram:
    """Return the frequency of the usable temperatures in K of a place, shape (y, x).

    The number of bins is the square root of the number of pixels, at most 100. A place without
    usable pixels has no bins.
    """
    values = kelvins[mask]
    known = values[np.isfinite(values)]
    if known.size == 0:
        return Histogram(place, np.zeros(1), np.zeros(0, np.int_))
    bins = min(max(round(sqrt(known.size)), 1), _MOST_BINS)
    pixels, edges = np.histogram(known, bins)
    return Histogram(place, edges, pixels)


def isotherm(kelvins: Array, raster: Raster, level: float) -> list[Array]:
    """Return the lines at which an image in K has a temperature, each as x and y in m, (n, 2).

    They end at unusable pixels (NaN) and are straight between neighbouring pixels.
    """
    if not np.isfinite(kelvins).any():
        return []
    contours = contour_generator(
        raster.x, raster.y, np.ma.masked_invalid(kelvins), line_type=LineType.Separate
    )
    return [np.asarray(line, np.float64) for line in contours.lines(level)]
