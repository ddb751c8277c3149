"""The shear band: the ridge of the plastic strain rate that leads to the free surface."""

from dataclasses import dataclass
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from chipglow.laboratory.chip.ridge import (
    NoShearBandError,
    PolarGrid,
    arc_length,
    even_steps,
    highest,
    normals_of,
    off_face,
    strongest_part,
)
from chipglow.quantities import Array
from chipglow.scene import Line, Raster, Tool, sample, straight_line

BAND_RATE: Final = 6000.0
"""Plastic strain rate in 1/s under which the paper sees no shear band."""

_TOLL: Final = 0.8
_GAP: Final = 15e-6
_SEARCH: Final = 15e-6
_CLIMB_BLUR: Final = (3.0, 1.5)
_WIDEST: Final = 80e-6
_NO_RIDGE: Final = "shear band: no ridge of the plastic strain rate is off the rake face"


@dataclass(frozen=True)
class ShearBand:
    """A shear band as a curve, away from the cutting edge."""

    ridge: Line
    """Points of largest strain rate, at even steps. The distance in m counts from the cutting
    edge: straight to the first point, where the band begins, then along the curve. A band
    that has left the edge with the chip begins where it comes out of the layer along the rake
    face.
    """
    normals: Array
    """Unit normals of the curve on the chip's side (upward), shape (n, 2)."""
    rate: Array
    """Plastic strain rate on the ridge in 1/s, shape (n,)."""
    widths: Array
    """Full width at half maximum of the strain rate across the ridge in m, shape (n,); NaN where
    the rate does not fall to half on both sides.
    """
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
        """Number of the point half-way along the curve, from where it begins."""
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
        return (fraction >= 0.25) & (fraction <= 0.75)

    def across(self, half_length: float, step: float) -> Line:
        """Line across the band's middle; the distance grows from the workpiece to the chip."""
        count = round(half_length / step)
        distance = step * np.arange(-count, count + 1)
        return straight_line(self.ridge.points[self.middle], self.normals[self.middle], distance)


def find_shear_band(
    raster: Raster,
    strain_rate: NDArray[np.floating],
    workpiece: NDArray[np.bool_],
    tool: Tool,
) -> ShearBand:
    """Find the shear band as the ridge of the strain rate that leads to the free surface.

    In polar coordinates about the edge the band has one angle at every radius. Dynamic
    programming finds the path of the largest sum of log(1 + rate / 6000 s⁻¹): the logarithm
    keeps a single hot spot from outweighing a stretch of band. A layer along the rake face is left
    out, since friction shears it too, and its slope, which falls from there, counts nothing. The
    path begins where the band does, at the edge or away from it; what leads over a stretch of
    more than 15 µm without a ridge, such as from the next band to one that has left the edge, is
    no part of it. The path is then moved to the maximum across it and smoothed by local
    parabolas, which leave a straight or evenly curved ridge where it is.
    """
    rate = np.where(workpiece, strain_rate, 0.0).astype(np.float64)
    path, reaches_surface = _best_path(raster, rate, workpiece, tool)
    points = even_steps(path, 2 * raster.spacing)
    for _ in range(3):
        points = even_steps(_climb(points, raster, rate), 2 * raster.spacing)
    points = _beyond_layer(points, tool)
    normals = normals_of(points)
    distance = arc_length(points) + float(np.hypot(*(points[0] - tool.edge_point)))
    return ShearBand(
        ridge=Line(distance, points),
        normals=normals,
        rate=np.nan_to_num(sample(rate, raster, points)),
        widths=_widths(points, normals, raster, rate),
        reaches_surface=reaches_surface,
    )


def _best_path(
    raster: Raster, rate: Array, workpiece: NDArray[np.bool_], tool: Tool
) -> tuple[Array, bool]:
    """Points from where the band begins to the surface, and whether it is a free surface."""
    polar = PolarGrid.about(tool, raster)
    values = map_coordinates(rate, polar.index, order=1)
    material = map_coordinates(workpiece.astype(np.uint8), polar.index, order=0) > 0
    material &= polar.on_raster
    allowed, outside = material & polar.off_face, ~material & polar.off_face
    ends = np.zeros_like(allowed)
    ends[:-1] = allowed[:-1] & outside[1:]
    score = np.log1p(np.maximum(values, 0.0) / BAND_RATE)
    score[polar.slopes_from_face(score)] = 0.0
    i, j = _path_of_one_band(polar, score, allowed, ends)
    _check(values[i, j])
    path = polar.points[i, j]
    if i[0] == 0:
        path = np.concatenate([tool.edge_point[None], path])
    return path, bool(polar.on_raster[i[-1] + 1, j[-1]])


def _path_of_one_band(
    polar: PolarGrid,
    score: Array,
    allowed: NDArray[np.bool_],
    ends: NDArray[np.bool_],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The best path; if that leads from one band to another, the best beyond the gap."""
    i, j = polar.best_path(score, allowed, ends, _TOLL, anywhere=True)
    first = i[strongest_part(polar.points[i, j], score[i, j], _GAP).start]
    if first == i[0]:
        return i, j
    beyond = allowed & (np.arange(polar.radii.size) >= first)[:, None]
    return polar.best_path(score, beyond, ends, _TOLL, anywhere=True)


def _check(rate: Array) -> None:
    if not rate.max() >= BAND_RATE:
        raise NoShearBandError(
            f"shear band: the greatest plastic strain rate on the best path is "
            f"{rate.max():.3g} 1/s, expected {BAND_RATE:g} 1/s or more"
        )
    if rate.size < 2:
        raise NoShearBandError(_NO_RIDGE)


def _climb(points: Array, raster: Raster, rate: Array) -> Array:
    """Move each point to the maximum of the strain rate across the curve, if there is one."""
    normals = normals_of(points)
    count = ceil(_SEARCH / raster.spacing)
    offsets = raster.spacing * np.arange(-count, count + 1, dtype=np.float64)
    across = points[:, None] + offsets[:, None] * normals[:, None]
    values = gaussian_filter(np.nan_to_num(sample(rate, raster, across)), _CLIMB_BLUR)
    place, inside = highest(values, offsets)
    moved = np.where(inside, place, 0.0)
    return points + moved[:, None] * normals


def _beyond_layer(points: Array, tool: Tool) -> Array:
    """The points after the last that climbed to a maximum in the layer along the rake face."""
    within = np.flatnonzero(~off_face(points, tool))
    beyond = points[within[-1] + 1 :] if within.size else points
    if len(beyond) < 2:
        raise NoShearBandError(_NO_RIDGE)
    return beyond


def _widths(points: Array, normals: Array, raster: Raster, rate: Array) -> Array:
    """Full width at half maximum across each point of the curve."""
    step = raster.spacing / 2
    offsets = step * np.arange(ceil(_WIDEST / step) + 1, dtype=np.float64)
    sides = []
    for sign in (-1.0, 1.0):
        places = points[:, None] + sign * offsets[:, None] * normals[:, None]
        values = np.nan_to_num(sample(rate, raster, places))
        sides.append(_half_crossing(values, offsets))
    return sides[0] + sides[1]


def _half_crossing(values: Array, offsets: Array) -> Array:
    """Offset where each row first falls to half its first value; NaN where it never does."""
    half = values[:, :1] / 2
    below = values <= half
    first = np.maximum(below.argmax(axis=1), 1)
    index = np.arange(first.size)
    upper, lower = values[index, first - 1], values[index, first]
    drop = upper - lower
    fraction = np.divide(upper - half[:, 0], drop, out=np.zeros_like(drop), where=drop > 0)
    crossing = offsets[first - 1] + fraction * (offsets[first] - offsets[first - 1])
    found = below.any(axis=1) & (values[:, 0] > 0)
    return np.where(found, crossing, np.nan)
