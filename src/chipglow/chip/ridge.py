"""A ridge that leads from the cutting edge outward: found about the edge, smoothed, climbed."""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, pi, radians
from typing import Final

import numpy as np
import scipy  # its signal part is slow to import, and loaded at its first use
from numba import njit
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.scene import Raster, Tool

_RADIUS_STEP: Final = 2e-6
"""Smallest step of the radius in m."""

_STEPS_A_SAMPLE: Final = 3
"""Radii are 2 µm apart, or a third of a sample that is over 6 µm wide."""

_ANGLES: Final = 401
"""Angles of the polar grid."""

_BELOW_HORIZONTAL: Final = radians(10.0)
"""Angle in rad below the cutting direction to which a band may reach."""

_STEEPEST: Final = 2.0
"""Largest change of a path's direction: distance across over distance along the radius."""

_STRAIGHTNESS: Final = 0.2
"""Price of a path's slope, in units of the score."""

_RAKE_LAYER: Final = 25e-6
"""Thickness in m of the friction layer on the rake face, which is not a shear band."""

_RAKE_LAYER_SHARE: Final = 0.4
"""Thickness of this layer as a fraction of the radius, near the edge."""

_TOLL: Final = 0.8
"""Price of each step of a path, as a fraction of the median score, so that it ends where the band
does."""

_SMOOTHING: Final = 50e-6
"""Length in m over which a curve is smoothed."""

_FEWEST_POINTS: Final = 5
"""Fewest points of a curve, and of a parabola that smooths it: two more than a parabola needs."""

_WEAK: Final = 0.5
"""Fraction of a path's median strength below which there is no ridge."""

_NOWHERE: Final = np.int64(-1)


class NoShearBandError(ValueError):
    """A field in which no band leads from the edge to the chip's surface."""


@dataclass(frozen=True)
class PolarGrid:
    """Places about the cutting edge: radii down, angles from the rake face downward across."""

    points: Array
    """x and y in m, shape (radii, angles, 2)."""
    index: Array
    """Row and column of the raster at these places, shape (2, radii, angles)."""
    on_raster: NDArray[np.bool_]
    """Whether a place lies between the outermost centres of the raster."""
    off_face: NDArray[np.bool_]
    """Whether it lies beyond the layer along the rake face, which friction shears and heats."""
    slopes: Array
    """Way across to the next angle over the step outward, shape (radii,)."""

    @classmethod
    @lru_cache(maxsize=2)
    def about(cls, tool: Tool, raster: Raster) -> "PolarGrid":
        """Return the grid about a tool's edge that covers a raster."""
        edge = tool.edge_point
        left, right, _, top = raster.extent
        # At least 1 µm upward, for an edge above the image.
        reach = float(np.hypot(max(edge[0] - left, right - edge[0]), max(top - edge[1], 1e-6)))
        step = max(_RADIUS_STEP, raster.spacing / _STEPS_A_SAMPLE)
        radii = np.arange(max(tool.corner_radius, step), reach + 2 * step, step)
        up = np.arctan2(tool.rake_direction[1], tool.rake_direction[0])
        angles = np.linspace(up, pi + _BELOW_HORIZONTAL, _ANGLES)
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        points = edge + radii[:, None, None] * rays
        index = raster.index(points)
        slopes = radii * float(angles[1] - angles[0]) / step
        return cls(points, index, raster.covers(index), off_face(points, tool), slopes)

    def slopes_from_face(self, values: Array) -> NDArray[np.bool_]:
        """Return where values only fall, at one radius, from the layer along the rake face on."""
        rises = np.zeros_like(self.off_face)
        rises[:, 1:] = self.off_face[:, :-1] & (np.diff(values, axis=1) > 0)
        return ~np.logical_or.accumulate(rises, axis=1)

    def best_path(
        self, score: Array, allowed: NDArray[np.bool_], ends: NDArray[np.bool_], anywhere: bool
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Find the path of the largest sum, one angle at every radius (dynamic programming)."""
        first = self._best(score, allowed, ends, anywhere)
        after = score - _TOLL * float(np.median(score[first]))
        return self._best(after, allowed, ends, anywhere)

    def _best(
        self, score: Array, allowed: NDArray[np.bool_], ends: NDArray[np.bool_], anywhere: bool
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        total = np.where(allowed, score, -np.inf)
        came_from = _add_up(total, self.slopes, anywhere)
        ends = ends & np.isfinite(total)
        if not ends.any():
            raise NoShearBandError("shear band: no path leads from the edge through the chip")
        best = np.where(ends, total, -np.inf)
        last, column = map(int, np.unravel_index(int(np.argmax(best)), best.shape))
        columns = [column]
        while came_from[last + 1 - len(columns), columns[-1]] != _NOWHERE:
            columns.append(int(came_from[last + 1 - len(columns), columns[-1]]))
        return np.arange(last + 1 - len(columns), last + 1), np.array(columns[::-1])


@njit(cache=True, nogil=True)
def _add_up(total, slopes, anywhere):  # type: ignore[no-untyped-def]
    """Add to each place the largest sum within reach at the radius before; return its index."""
    radii, angles = total.shape
    came_from = np.full(total.shape, _NOWHERE)
    for i in range(1, radii):
        reach = max(1, min(ceil(_STEEPEST / slopes[i]), angles - 1))
        penalty = _STRAIGHTNESS * (np.arange(-reach, reach + 1) * slopes[i]) ** 2
        for column in range(angles):
            low = max(column - reach, 0)
            best, choice = total[i - 1, low] - penalty[low - column + reach], low
            for j in range(low + 1, min(column + reach + 1, angles)):
                value = total[i - 1, j] - penalty[j - column + reach]
                if value > best:
                    best, choice = value, j
            if best > 0.0 or not anywhere:
                came_from[i, column] = choice
                total[i, column] += best
    return came_from


def off_face(points: Array, tool: Tool) -> NDArray[np.bool_]:
    """Return which points lie beyond the layer along the rake face, which friction heats."""
    radius = np.linalg.norm(points - tool.edge_point, axis=-1)
    depth = tool.signed_distance(points[..., 0], points[..., 1])
    return np.asarray(depth > np.minimum(_RAKE_LAYER, _RAKE_LAYER_SHARE * radius))


def strongest_part(points: Array, strength: Array, longest: float) -> slice:
    """Return the strongest part of a path between stretches without a ridge that are too long."""
    weak = strength < _WEAK * np.median(strength)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], weak, [False]]).astype(np.int8)))
    along = arc_length(points)
    gaps = [(a, b) for a, b in ends.reshape(-1, 2) if along[b - 1] - along[a] > longest]
    bounds = [0, *(int(end) for gap in gaps for end in gap), strength.size]
    parts = [slice(a, b) for a, b in zip(bounds[::2], bounds[1::2], strict=True)]
    best = max(parts, key=lambda part: float(strength[part].sum()))
    strong = best.start + np.flatnonzero(~weak[best])
    return slice(int(strong[0]), int(strong[-1]) + 1)


def even_steps(points: Array, step: float) -> Array:
    """Resample a curve at even steps of arc length in m and smooth it by local parabolas."""
    along = arc_length(points)
    even = np.linspace(0.0, along[-1], max(ceil(along[-1] / step) + 1, _FEWEST_POINTS))
    resampled = np.stack([np.interp(even, along, points[:, axis]) for axis in (0, 1)], axis=1)
    window = min(2 * round(_SMOOTHING / step / 2) + 1, (even.size - 1) // 2 * 2 + 1)
    if window < _FEWEST_POINTS:
        return resampled
    return np.asarray(scipy.signal.savgol_filter(resampled, window, 2, axis=0), np.float64)


def arc_length(points: Array) -> Array:
    """Return the distance along a polyline from its first point in m, shape (n,)."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def normals_of(points: Array) -> Array:
    """Return unit normals of a curve, shape (n, 2): those that point up if it runs to the left."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    return np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)


def across_curve(points: Array, offsets: Array) -> Array:
    """Return places at offsets in m across every point of a curve, shape (n, offsets, 2)."""
    return np.asarray(points[:, None] + offsets[:, None] * normals_of(points)[:, None])


def climbed(points: Array, offsets: Array, profiles: Array) -> Array:
    """Move each point of a curve to the maximum of its profile, by a parabola, if it has one."""
    peak = profiles.argmax(axis=1)
    inside = (peak > 0) & (peak < offsets.size - 1)
    peak = np.clip(peak, 1, offsets.size - 2)
    index = np.arange(peak.size)
    left, top, right = (profiles[index, peak + k] for k in (-1, 0, 1))
    bend = left - 2 * top + right
    shift = np.divide(0.5 * (left - right), bend, out=np.zeros_like(bend), where=bend < 0)
    place = offsets[peak] + (offsets[1] - offsets[0]) * shift
    # A parabola of nearly equal values may leave its interval.
    moved = np.where(inside, np.clip(place, offsets[0], offsets[-1]), 0.0)
    return np.asarray(points + moved[:, None] * normals_of(points))
