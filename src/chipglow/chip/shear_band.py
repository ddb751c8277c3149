"""The shear band: the ridge of the plastic strain rate that leads to the free surface."""

from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from chipglow.chip.ridge import (
    NoShearBandError,
    PolarGrid,
    across_curve,
    arc_length,
    climbed,
    even_steps,
    normals_of,
    off_face,
    strongest_part,
)
from chipglow.quantities import Array, Brief
from chipglow.scene import Line, Raster, Tool, sample, straight_line

BAND_RATE: Final = 6000.0
"""Plastic strain rate in 1/s under which the paper sees no shear band."""

_LONGEST_GAP: Final = 15e-6
"""Longest gap of a band in m."""

_CLIMB_REACH: Final = 15e-6
"""Distance in m to each side at which a point of the band looks for the maximum."""

_CLIMB_BLUR: Final = (3.0, 1.5)
"""Standard deviations of the Gaussian that smooths the profiles, in points along the band and in
samples across."""

_WIDEST: Final = 80e-6
"""Largest half-width of a band in m."""

MIDDLE_HALF: Final = (0.25, 0.75)
"""Middle half of a length, as fractions of it."""

_NO_RIDGE: Final = "shear band: no ridge of the plastic strain rate is off the rake face"


@dataclass(frozen=True, repr=False)
class ShearBand(Brief):
    """A shear band as a curve, away from the cutting edge."""

    ridge: Line
    """Points of largest strain rate; distances in m as in `BandProfile`."""
    normals: Array
    """Unit normals of the curve on the chip's side (upward), shape (n, 2)."""
    rate: Array
    """Plastic strain rate on the ridge in 1/s, shape (n,)."""
    widths: Array
    """Full width at half maximum of the rate across the ridge in m, shape (n,), or NaN."""
    reaches_surface: bool
    """Whether the curve ends at a free surface, not at the border of the field of view."""

    @property
    def length(self) -> float:
        """Length of the curve itself in m, without the way from the edge to where it begins."""
        return float(self.ridge.distance[-1] - self.start)

    @property
    def start(self) -> float:
        """Distance in m from the cutting edge to where the band begins."""
        return float(self.ridge.distance[0])

    @property
    def middle(self) -> int:
        """Index of the point half-way along the curve, from its start."""
        return int(np.argmin(np.abs(self.ridge.distance - self.start - self.length / 2)))

    @property
    def width(self) -> float:
        """Median of the widths over the middle half of the curve in m; NaN if undefined."""
        widths = self.widths[self.middle_half]
        return float(np.nanmedian(widths)) if np.isfinite(widths).any() else float("nan")

    @property
    def middle_rate(self) -> float:
        """Median of the strain rate on the middle half of the curve in 1/s."""
        return float(np.median(self.rate[self.middle_half]))

    @property
    def middle_half(self) -> NDArray[np.bool_]:
        """Which points are on the middle half of the curve, shape (n,)."""
        fraction = (self.ridge.distance - self.start) / self.length
        return (fraction >= MIDDLE_HALF[0]) & (fraction <= MIDDLE_HALF[1])

    def across(self, half_length: float, step: float) -> Line:
        """Return a line across the band's middle, from the workpiece to the chip."""
        count = round(half_length / step)
        distance = step * np.arange(-count, count + 1)
        return straight_line(self.ridge.points[self.middle], self.normals[self.middle], distance)


def find_shear_band(
    raster: Raster, strain_rate: NDArray[np.floating], workpiece: NDArray[np.bool_], tool: Tool
) -> ShearBand:
    """Find the shear band as the ridge of the strain rate that leads to the free surface.

    It is the path, with one angle at every radius about the edge, of the largest sum of
    log(1 + rate / 6000 s⁻¹) off the rake face, moved to the maximum across it and smoothed.
    """
    rate = np.where(workpiece, strain_rate, 0.0).astype(np.float64)
    path, reaches_surface = _best_path(raster, rate, workpiece, tool)
    points = even_steps(path, 2 * raster.spacing)
    count = ceil(_CLIMB_REACH / raster.spacing)
    offsets = raster.spacing * np.arange(-count, count + 1, dtype=np.float64)
    for _ in range(3):
        profiles = np.nan_to_num(sample(rate, raster, across_curve(points, offsets)))
        points = climbed(points, offsets, gaussian_filter(profiles, _CLIMB_BLUR))
        points = even_steps(points, 2 * raster.spacing)
    within = np.flatnonzero(~off_face(points, tool))
    points = points[within[-1] + 1 :] if within.size else points
    if len(points) < 2:
        raise NoShearBandError(_NO_RIDGE)
    distance = arc_length(points) + float(np.hypot(*(points[0] - tool.edge_point)))
    return ShearBand(
        ridge=Line(distance, points),
        normals=normals_of(points),
        rate=np.nan_to_num(sample(rate, raster, points)),
        widths=_widths(points, raster, rate),
        reaches_surface=reaches_surface,
    )


def _best_path(
    raster: Raster, rate: Array, workpiece: NDArray[np.bool_], tool: Tool
) -> tuple[Array, bool]:
    """Return points from where the band begins to the surface, and whether that is free."""
    polar = PolarGrid.about(tool, raster)
    values = map_coordinates(rate, polar.index, order=1)
    material = map_coordinates(workpiece.astype(np.uint8), polar.index, order=0) > 0
    material &= polar.on_raster
    allowed, outside = material & polar.off_face, ~material & polar.off_face
    ends = np.zeros_like(allowed)
    ends[:-1] = allowed[:-1] & outside[1:]
    score = np.log1p(np.maximum(values, 0.0) / BAND_RATE)
    score[polar.slopes_from_face(score)] = 0.0
    i, j = polar.best_path(score, allowed, ends, anywhere=True)
    first = i[strongest_part(polar.points[i, j], score[i, j], _LONGEST_GAP).start]
    if first > i[0]:
        # The path leads from one band to another: the band is the best path beyond the gap.
        beyond = allowed & (np.arange(len(allowed)) >= first)[:, None]
        i, j = polar.best_path(score, beyond, ends, anywhere=True)
    largest = values[i, j].max()
    if not largest >= BAND_RATE:
        raise NoShearBandError(
            f"shear band: the largest plastic strain rate on the best path is "
            f"{largest:.3g} 1/s, expected {BAND_RATE:g} 1/s or more"
        )
    if i.size < 2:
        raise NoShearBandError(_NO_RIDGE)
    path = polar.points[i, j]
    if i[0] == 0:
        path = np.concatenate([tool.edge_point[None], path])
    return path, bool(polar.on_raster[i[-1] + 1, j[-1]])


def _widths(points: Array, raster: Raster, rate: Array) -> Array:
    """Compute the full width at half maximum across each point of the curve."""
    step = raster.spacing / 2
    offsets = step * np.arange(ceil(_WIDEST / step) + 1, dtype=np.float64)
    below, above = (
        np.nan_to_num(sample(rate, raster, across_curve(points, sign * offsets)))
        for sign in (-1.0, 1.0)
    )
    left, right = (first_crossing(side, offsets, side[:, 0] / 2) for side in (below, above))
    return np.asarray(left + right)


def first_crossing(values: Array, places: Array, level: ArrayLike) -> Array:
    """Return the place where each row first falls to its level, straight between samples.

    Parameters
    ----------
    values : ndarray
        Rows of samples, shape (row, n).
    places : ndarray
        Places of the samples of a row, shape (n,).
    level : array_like
        The level, of all rows or shape (row,).

    Returns
    -------
    ndarray
        Places, shape (row,); NaN where a row does not begin above its level or never falls to it.
    """
    levels = np.broadcast_to(np.asarray(level, np.float64), len(values))
    below = values <= levels[:, None]
    first = np.maximum(below.argmax(axis=1), 1)
    index = np.arange(first.size)
    upper, lower = values[index, first - 1], values[index, first]
    drop = upper - lower
    fraction = np.divide(upper - levels, drop, out=np.zeros_like(drop), where=drop > 0)
    crossing = places[first - 1] + fraction * (places[first] - places[first - 1])
    return np.where(below.any(axis=1) & (values[:, 0] > levels), crossing, np.nan)
