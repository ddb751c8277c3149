"""The shear band in a measured image: the ridge of the radiance temperature."""

from contextlib import suppress
from dataclasses import dataclass, replace
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates, spline_filter

from chipglow.camera import Flag, Measurement
from chipglow.chip.ridge import (
    NoShearBandError,
    PolarGrid,
    across_curve,
    arc_length,
    climbed,
    even_steps,
    strongest_part,
)
from chipglow.quantities import Array, Brief
from chipglow.scene import Line, Raster, Tool
from chipglow.scene.lines import nearest

LEAST_PROMINENCE: Final = 10.0
"""Smallest height in K of a band's ridge above the higher of its two sides."""

SHORTEST: Final = 15.0
"""Smallest length of a band's ridge in pixels."""

_FEWEST_POINTS: Final = 5
"""Fewest points of a ridge: the number that local parabolas smooth."""

_SCALES: Final = (6e-6, 12e-6, 18e-6)
"""Standard deviations in m of the Gaussians whose second derivatives detect ridges: for bands of
different widths."""

_FACE_ANGLES: Final = (10.0, 30.0)
"""Angles to the rake face in degrees up to which a ridge does not count, and from which it counts
in full."""

_RESPONSE_SCALE: Final = 5.0
"""Response in K beyond which a score grows by the logarithm, so that no single hot place decides.
"""

_POINT_DISTANCE: Final = 0.5
"""Distance of a ridge's points in pixels: two for each pixel."""

_LONGEST_GAP: Final = 10.0
"""Longest gap of a ridge in pixels."""

_CLIMB_REACH: Final = 1.5
"""Distance in pixels, to each side, at which a point of the ridge looks for the maximum."""

_SIDE_REACH: Final = 10.0
"""Distance in pixels, to each side, at which a ridge is compared with its surroundings."""

_SAMPLES_PER_PIXEL: Final = 4
"""Samples for each pixel of the profiles across a ridge."""

_CLIMB_BLUR: Final = (2.0, 4.0)
"""Standard deviations of the Gaussian that smooths the profiles, in points along the ridge and in
samples across."""

_NOISE_FACTOR: Final = 3.0
"""Smallest height of a ridge in standard deviations of the noise."""

_NO_RIDGE: Final = "shear band: the radiance temperature has no ridge"


@dataclass(frozen=True, repr=False)
class ThermalImage(Brief):
    """A frame in which every pixel has a temperature, so that slopes and bends exist."""

    temperature: Array
    """Radiance temperature in K, shape (y, x), filled by the lower limit or the nearest pixel."""
    usable: NDArray[np.bool_]
    raster: Raster

    @classmethod
    def of(cls, measurement: Measurement, frame: int) -> "ThermalImage":
        """Fill a frame of a measurement."""
        known = np.asarray(measurement.data["radiance_temperature"][frame].values, dtype=np.float64)
        usable = np.isfinite(known)
        if not usable.any():
            raise NoShearBandError("shear band: no pixel of the frame has a radiance temperature")
        lower_limit = float(measurement.data.attrs.get("lower_limit", known[usable].min()))
        index = distance_transform_edt(~usable, return_distances=False, return_indices=True)
        filled = np.where(usable, known, known[tuple(index)])
        filled[measurement.data["flags"][frame].values & Flag.UNDER_RANGE > 0] = lower_limit
        return cls(filled, usable, measurement.raster)

    def read(self, points: Array) -> Array:
        """Return temperatures at points in m, bilinear; outside those of the nearest pixel."""
        index = self.raster.index(points)
        values = map_coordinates(self.temperature, index, order=1, mode="nearest")
        return np.asarray(values, np.float64)

    def noise(self) -> float:
        """Estimate the standard deviation of the noise in K by the method of Immerkaer (1996)."""
        t = self.temperature
        rows = t[:-2] - 2 * t[1:-1] + t[2:]
        both = rows[:, :-2] - 2 * rows[:, 1:-1] + rows[:, 2:]
        inner = self.usable[1:-1, 1:-1]
        if not inner.any():
            return 0.0
        return float(np.sqrt(np.pi / 2) / 6 * np.abs(both[inner]).mean())


def find_band(image: ThermalImage, tool: Tool) -> Line:
    """Find the shear band in a measured image: the best path along ridges off the rake face.

    A ridge is where the second derivative across it is negative (Lindeberg 1998). Where the path
    leads to no band, the border of a cold strip below the edge may have drawn it: the search is
    repeated without what lies below the edge.
    """
    _check_edge(image.raster, tool)
    try:
        return _ridge(image, tool, _response(image, tool))
    except NoShearBandError:
        with suppress(NoShearBandError):
            return _ridge(image, tool, _response(_without_below(image, tool), tool))
        raise


def _without_below(image: ThermalImage, tool: Tool) -> ThermalImage:
    """Replace the pixels below the cutting edge by those just over it."""
    above = np.flatnonzero(image.raster.y > tool.edge_point[1])
    if not above.size:
        return image
    temperature = image.temperature.copy()
    temperature[above[-1] + 1 :] = temperature[above[-1]]
    return replace(image, temperature=temperature)


def _ridge(image: ThermalImage, tool: Tool, response: Array) -> Line:
    """Return the ridge of the strongest path through a response."""
    points = _path(image, response, tool)
    coefficients = spline_filter(image.temperature, order=3)
    for _ in range(3):
        points = climbed(points, *_profiles(points, image, coefficients, _CLIMB_REACH))
        points = even_steps(points, _POINT_DISTANCE * image.raster.spacing)
    points = _within(points, image)
    _check(points, image, coefficients)
    return Line(arc_length(points) + float(np.hypot(*(points[0] - tool.edge_point))), points)


def _check_edge(raster: Raster, tool: Tool) -> None:
    x, y = tool.edge_point
    left, right, bottom, top = raster.extent
    away = max(left - x, x - right, bottom - y, y - top)
    if away > max(right - left, top - bottom):
        raise ValueError(
            f"tool: its edge at x {x * 1e6:.4g} µm, y {y * 1e6:.4g} µm is {away * 1e6:.4g} µm "
            "outside the image, expected in it or near it"
        )


def _response(image: ThermalImage, tool: Tool) -> Array:
    """Return the height in K of ridges that do not run along the rake face, shape (y, x)."""
    x, y = tool.rake_direction
    best = np.zeros(image.temperature.shape)
    for scale in _SCALES:
        width = max(scale / image.raster.spacing, 1.0)
        across, down, both = (
            gaussian_filter(image.temperature, width, order=order, mode="nearest")
            for order in ((0, 2), (2, 0), (1, 1))
        )
        # Rows go down: the mixed derivative changes its sign.
        mean, half = (across + down) / 2, (across - down) / 2
        least = mean - np.hypot(half, both)
        turn = 0.5 * np.arctan2(-both, half) + np.pi / 2
        off_face = np.degrees(np.arcsin(np.clip(abs(np.cos(turn) * x + np.sin(turn) * y), 0, 1)))
        fraction = np.clip((off_face - _FACE_ANGLES[0]) / (_FACE_ANGLES[1] - _FACE_ANGLES[0]), 0, 1)
        best = np.maximum(best, fraction * width**2 * np.maximum(-least, 0.0))
    return best


def _path(image: ThermalImage, response: Array, tool: Tool) -> Array:
    polar = PolarGrid.about(tool, image.raster)
    allowed = map_coordinates(image.usable.astype(np.uint8), polar.index, order=0) > 0
    allowed &= polar.on_raster & polar.off_face
    if not allowed.any():
        raise NoShearBandError("shear band: no usable pixel is beside the tool")
    score = np.log1p(map_coordinates(response, polar.index, order=1) / _RESPONSE_SCALE)
    if allowed[0].any():
        i, j = polar.best_path(score, allowed, allowed, anywhere=False)
        points = polar.points[i, j]
        # It begins where the ridge does: near the edge the heat of the rake face may hide it.
        points = points[strongest_part(points, score[i, j], _LONGEST_GAP * image.raster.spacing)]
        if arc_length(points)[-1] >= SHORTEST * image.raster.spacing:
            return points
    i, j = polar.best_path(score, allowed, allowed, anywhere=True)
    if i.size < 2:
        raise NoShearBandError(_NO_RIDGE)
    return polar.points[i, j]


def _profiles(
    points: Array, image: ThermalImage, coefficients: Array, reach: float
) -> tuple[Array, Array]:
    """Return offsets in m up to a reach in pixels, and the smoothed temperature across points."""
    count = ceil(reach * _SAMPLES_PER_PIXEL)
    offsets = (
        image.raster.spacing / _SAMPLES_PER_PIXEL * np.arange(-count, count + 1, dtype=np.float64)
    )
    index = image.raster.index(across_curve(points, offsets))
    values = map_coordinates(coefficients, index, order=3, mode="nearest", prefilter=False)
    return offsets, gaussian_filter(values, _CLIMB_BLUR, mode="nearest")


def _within(points: Array, image: ThermalImage) -> Array:
    """Return the points from the first to the last whose pixel is usable."""
    kept = np.flatnonzero(nearest(image.usable, image.raster, points) == 1)
    if kept.size < _FEWEST_POINTS:
        raise NoShearBandError(_NO_RIDGE)
    return points[kept[0] : kept[-1] + 1]


def _check(points: Array, image: ThermalImage, coefficients: Array) -> None:
    length = float(arc_length(points)[-1]) / image.raster.spacing
    if length < SHORTEST:
        raise NoShearBandError(
            f"shear band: the longest ridge of the radiance temperature is {length:.3g} pixels "
            f"long, expected {SHORTEST:g} or more"
        )
    _, profiles = _profiles(points, image, coefficients, _SIDE_REACH)
    middle = profiles.shape[1] // 2
    sides = np.maximum(profiles[:, : middle + 1].min(axis=1), profiles[:, middle:].min(axis=1))
    height = float(np.median(profiles[:, middle] - sides))
    least = max(LEAST_PROMINENCE, _NOISE_FACTOR * image.noise())
    if height < least:
        raise NoShearBandError(
            f"shear band: the best ridge stands {height:.3g} K over its sides, "
            f"expected {least:.3g} K or more"
        )
