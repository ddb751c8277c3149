"""The shear band: the ridge of the plastic strain rate from the edge to the free surface."""

from dataclasses import dataclass
from math import ceil, pi, radians
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.signal import savgol_filter

from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.scene import Raster, Tool

BAND_RATE: Final = 6000.0
"""Plastic strain rate in 1/s under which the paper sees no shear band."""

_RADIUS_STEP: Final = 2e-6
_ANGLES: Final = 401
_BELOW_HORIZONTAL: Final = radians(10.0)
_STEEPEST: Final = 2.0
_STRAIGHTNESS: Final = 0.2
_TOLL: Final = 0.8
_RAKE_LAYER: Final = 25e-6
_RAKE_LAYER_SHARE: Final = 0.4
_SMOOTHING: Final = 50e-6
_SEARCH: Final = 15e-6
_CLIMB_BLUR: Final = (3.0, 1.5)
_WIDEST: Final = 80e-6


class NoShearBandError(ValueError):
    """A strain-rate field in which no band leads from the edge to the chip's surface."""


@dataclass(frozen=True)
class ShearBand:
    """A shear band as a curve from the cutting edge outward.

    Parameters
    ----------
    ridge : Line
        Points of greatest strain rate, at even steps; the distance in m counts from the cutting
        edge along the curve.
    normals : ndarray
        Unit normals of the curve on the chip's side (upward), shape (n, 2).
    rate : ndarray
        Plastic strain rate on the ridge in 1/s, shape (n,).
    widths : ndarray
        Full width at half maximum of the strain rate across the ridge in m, shape (n,); NaN where
        the rate does not fall to half on both sides.
    reaches_surface : bool
        Whether the curve ends at a free surface, not at the border of the field of view.
    """

    ridge: Line
    normals: NDArray[np.float64]
    rate: NDArray[np.float64]
    widths: NDArray[np.float64]
    reaches_surface: bool

    @property
    def length(self) -> float:
        """Length of the curve from the edge in m."""
        return float(self.ridge.distance[-1])

    @property
    def middle(self) -> int:
        """Number of the point half-way along the curve."""
        return int(np.argmin(np.abs(self.ridge.distance - self.length / 2)))

    @property
    def width(self) -> float:
        """Median of the widths over the middle half of the curve in m; NaN where there is none."""
        widths = self.widths[self._middle_half]
        return float(np.nanmedian(widths)) if np.isfinite(widths).any() else float("nan")

    @property
    def middle_rate(self) -> float:
        """Median of the strain rate on the middle half of the curve in 1/s."""
        return float(np.median(self.rate[self._middle_half]))

    @property
    def _middle_half(self) -> NDArray[np.bool_]:
        share = self.ridge.distance / self.length
        return np.asarray((share >= 0.25) & (share <= 0.75))

    def across(self, half_length: float, step: float) -> Line:
        """Line across the band's middle; the distance grows from the workpiece to the chip.

        Parameters
        ----------
        half_length : float
            Reach to either side in m.
        step : float
            Distance between points in m.
        """
        count = round(half_length / step)
        distance = step * np.arange(-count, count + 1)
        return straight_line(self.ridge.points[self.middle], self.normals[self.middle], distance)


def find_shear_band(
    raster: Raster,
    strain_rate: NDArray[np.floating],
    workpiece: NDArray[np.bool_],
    tool: Tool,
) -> ShearBand:
    """Find the shear band as the ridge of the strain rate from the edge to the free surface.

    Parameters
    ----------
    raster : Raster
        Where the samples are.
    strain_rate : ndarray
        Plastic strain rate in 1/s, shape (y, x), such as the mean over an exposure.
    workpiece : ndarray of bool
        Where there is workpiece or chip.
    tool : Tool
        The tool; the ridge starts at its edge.

    Raises
    ------
    NoShearBandError
        If no connected path through the material leads from the edge to a surface or to the
        border of the field, or the rate on the best one stays under `BAND_RATE`.

    Notes
    -----
    In polar coordinates about the edge the band has one angle at every radius. Dynamic
    programming finds the path of the greatest sum of log(1 + rate / 6000 s⁻¹): the logarithm
    keeps a single hot spot from outweighing a stretch of band. A layer along the rake face is left
    out, since friction shears it too. The path is then moved to the maximum across it and
    smoothed by local parabolas, which leave a straight or evenly curved ridge where it is.
    """
    rate = np.where(workpiece, strain_rate, 0.0).astype(np.float64)
    edge = tool.edge_point
    polar = _Polar.of(raster, rate, workpiece, tool, edge)
    path, reaches_surface = polar.best_path()
    points = _even_steps(np.concatenate([edge[None], path]), 2 * raster.spacing)
    for _ in range(3):
        points = _even_steps(_climb(points, raster, rate), 2 * raster.spacing)
    normals = _normals(points)
    ridge_rate = np.nan_to_num(sample(rate, raster, points))
    if not ridge_rate.max() >= BAND_RATE:
        raise NoShearBandError(
            f"shear band: the greatest plastic strain rate on the best path is "
            f"{ridge_rate.max():.3g} 1/s, expected {BAND_RATE:g} 1/s or more"
        )
    steps = np.hypot(*np.diff(points, axis=0).T)
    distance = np.concatenate([[0.0], np.cumsum(steps)]) + float(np.hypot(*(points[0] - edge)))
    return ShearBand(
        ridge=Line(distance, points),
        normals=normals,
        rate=ridge_rate,
        widths=_widths(points, normals, raster, rate),
        reaches_surface=reaches_surface,
    )


@dataclass(frozen=True)
class _Polar:
    """Strain rate about the edge: radii down, angles across."""

    points: NDArray[np.float64]
    score: NDArray[np.float64]
    allowed: NDArray[np.bool_]
    outside: NDArray[np.bool_]
    on_raster: NDArray[np.bool_]
    radii: NDArray[np.float64]
    angle_step: float

    @classmethod
    def of(
        cls,
        raster: Raster,
        rate: NDArray[np.float64],
        workpiece: NDArray[np.bool_],
        tool: Tool,
        edge: NDArray[np.float64],
    ) -> "_Polar":
        left, right, _, top = raster.extent
        reach = float(np.hypot(max(edge[0] - left, right - edge[0]), max(top - edge[1], 1e-6)))
        first = max(tool.corner_radius, _RADIUS_STEP)
        radii = np.arange(first, reach + 2 * _RADIUS_STEP, _RADIUS_STEP)
        up = np.arctan2(tool.rake_direction[1], tool.rake_direction[0])
        angles = np.linspace(up, pi + _BELOW_HORIZONTAL, _ANGLES)
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        points = edge + radii[:, None, None] * rays
        column = (points[..., 0] - left) / raster.spacing - 0.5
        row = (top - points[..., 1]) / raster.spacing - 0.5
        on_raster = (column >= 0) & (column <= raster.columns - 1)
        on_raster &= (row >= 0) & (row <= raster.rows - 1)
        values = map_coordinates(np.asarray(rate, np.float64), [row, column], order=1)
        material = map_coordinates(workpiece.astype(np.uint8), [row, column], order=0) > 0
        material &= on_raster
        depth = tool.signed_distance(points[..., 0], points[..., 1])
        layer = np.minimum(_RAKE_LAYER, _RAKE_LAYER_SHARE * radii)[:, None]
        return cls(
            points=points,
            score=np.log1p(np.maximum(values, 0.0) / BAND_RATE),
            allowed=material & (depth > layer),
            outside=~material & (depth > layer),
            on_raster=on_raster,
            radii=radii,
            angle_step=float(angles[1] - angles[0]),
        )

    def best_path(self) -> tuple[NDArray[np.float64], bool]:
        """Points from the first radius to the surface, and whether it is a free surface."""
        first = self._best(0.0)
        # Once more, so that what is well under the band's strength costs: else the path would
        # gain by running on along the surface where the band has ended.
        i, j = self._best(_TOLL * float(np.median(self.score[first])))
        return np.asarray(self.points[i, j]), bool(self.on_raster[i[-1] + 1, j[-1]])

    def _best(self, toll: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Indices of the path with the greatest sum of score less toll."""
        total = np.where(self.allowed, self.score - toll, -np.inf)
        came_from = np.zeros(total.shape, dtype=np.int64)
        for i in range(1, self.radii.size):
            before, came_from[i] = self._best_before(total[i - 1], i)
            total[i] += before
        ends = np.zeros_like(self.allowed)
        ends[:-1] = self.allowed[:-1] & self.outside[1:]
        ends &= np.isfinite(total)
        if not ends.any():
            raise NoShearBandError("shear band: no path leads from the edge through the chip")
        best = np.where(ends, total, -np.inf)
        last, column = np.unravel_index(int(np.argmax(best)), best.shape)
        columns = np.empty(int(last) + 1, dtype=np.int64)
        columns[-1] = column
        for k in range(int(last), 0, -1):
            columns[k - 1] = came_from[k, columns[k]]
        return np.arange(columns.size), columns

    def _best_before(
        self, total: NDArray[np.float64], i: int
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Greatest sum within reach at the radius before, less a little for turning."""
        slope = self.radii[i] * self.angle_step / _RADIUS_STEP
        reach = max(1, min(ceil(_STEEPEST / slope), total.size - 1))
        padded = np.pad(total, reach, constant_values=-np.inf)
        windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
        turns = np.arange(-reach, reach + 1)
        candidates = windows - _STRAIGHTNESS * (turns * slope) ** 2
        choice = candidates.argmax(axis=1)
        best = candidates[np.arange(total.size), choice]
        came_from = np.clip(np.arange(total.size) + choice - reach, 0, total.size - 1)
        return best, came_from.astype(np.int64)


def _even_steps(points: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Smoothed by local parabolas and laid out anew at even steps of arc length."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    even = np.linspace(0.0, along[-1], max(ceil(along[-1] / step) + 1, 5))
    resampled = np.stack([np.interp(even, along, points[:, axis]) for axis in (0, 1)], axis=1)
    window = min(2 * round(_SMOOTHING / step / 2) + 1, (even.size - 1) // 2 * 2 + 1)
    if window < 5:
        return resampled
    return np.asarray(savgol_filter(resampled, window, 2, axis=0, mode="interp"))


def _normals(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals of a curve that runs to the left: those that point up."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.hypot(tangent[:, 0], tangent[:, 1])[:, None]
    return np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)


def _climb(
    points: NDArray[np.float64], raster: Raster, rate: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Move each point to the maximum of the strain rate across the curve, if there is one."""
    normals = _normals(points)
    count = ceil(_SEARCH / raster.spacing)
    offsets = raster.spacing * np.arange(-count, count + 1)
    across = points[:, None] + offsets[:, None] * normals[:, None]
    values = gaussian_filter(np.nan_to_num(sample(rate, raster, across)), _CLIMB_BLUR)
    peak = values.argmax(axis=1)
    inside = (peak > 0) & (peak < offsets.size - 1)
    peak = np.clip(peak, 1, offsets.size - 2)
    index = np.arange(peak.size)
    left, top, right = (values[index, peak + k] for k in (-1, 0, 1))
    bend = left - 2 * top + right
    shift = np.divide(0.5 * (left - right), bend, out=np.zeros_like(bend), where=bend < 0)
    moved = np.where(inside, offsets[peak] + raster.spacing * shift, 0.0)
    return np.asarray(points + moved[:, None] * normals)


def _widths(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    raster: Raster,
    rate: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Full width at half maximum across each point of the curve."""
    step = raster.spacing / 2
    offsets = step * np.arange(ceil(_WIDEST / step) + 1, dtype=np.float64)
    sides = []
    for sign in (-1.0, 1.0):
        places = points[:, None] + sign * offsets[:, None] * normals[:, None]
        values = np.nan_to_num(sample(rate, raster, places))
        sides.append(_half_crossing(values, offsets))
    return np.asarray(sides[0] + sides[1])


def _half_crossing(
    values: NDArray[np.float64], offsets: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Offset where each row first falls to half its first value; NaN where it never does."""
    half = values[:, :1] / 2
    below = values <= half
    first = np.maximum(below.argmax(axis=1), 1)
    index = np.arange(first.size)
    upper, lower = values[index, first - 1], values[index, first]
    drop = upper - lower
    share = np.divide(upper - half[:, 0], drop, out=np.zeros_like(drop), where=drop > 0)
    crossing = offsets[first - 1] + share * (offsets[first] - offsets[first - 1])
    found = below.any(axis=1) & (values[:, 0] > 0)
    return np.where(found, crossing, np.nan)
