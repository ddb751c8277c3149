"""Temperature along the shear band of a measurement, and how far the band has developed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial
from math import isfinite, nan, sqrt
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd
import scipy
import xarray as xr
from numpy.typing import NDArray

from chipglow.camera import Measurement
from chipglow.camera.calibration import CALIBRATION
from chipglow.chip.ridge import NoShearBandError, across_curve, arc_length, normals_of
from chipglow.laboratory.chip.band_ridge import ThermalImage, find_band
from chipglow.laboratory.chip.frames import budget_table, frame_numbers, unit_table
from chipglow.laboratory.chip.stage import Stage
from chipglow.laboratory.chip.tool_position import (
    TOOL_BUDGET,
    ToolUncertainty,
    contribution,
    tool_of,
)
from chipglow.quantities import Array, Brief
from chipglow.scene import Line, Tool, sample
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Estimate, to_xarray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POSITION: Final = "position"
"""Name of the component of uncertainty that the place of a curve makes."""

BAND_BUDGET: Final = (CALIBRATION, POSITION, *TOOL_BUDGET)
"""Lines of the budget of a temperature along the band."""

_DIMS: Final = ("time", "distance")

CALIBRATION_UNKNOWN: Final = (
    "The measurement does not state the uncertainty of its calibration, which is therefore "
    "missing from the uncertainty here."
)
"""Warning of a profile of such a measurement."""

NEAR_THE_EDGE: Final = 15.0
"""Distance from the edge in pixels within which a band has not left it."""

MOVED: Final = 1.0
"""Offset in pixels beyond which a band is not where the reference is."""

_DEEP: Final = 40.0
"""A valley along one band is less deep in K: on bands of a simulated chip it was under 30 K."""

_DEEP_FRACTION: Final = 1.0 / 3.0
"""Nor is it as large a fraction of the range of the temperature along the band."""

_POINT_DISTANCE: Final = 0.5
"""Distance of a curve's points in pixels: two for each pixel."""

_LINES_PER_PIXEL: Final = 4
"""Parallel lines for each pixel of the width over which a profile is averaged."""


@dataclass(frozen=True, eq=False, repr=False)
class BandProfile(Brief):
    """Radiance temperature along the shear band in several frames."""

    reference: Line
    """The curve of the fully developed band, with distances as below."""
    distance: Array
    """Distances in m, shape (n,): straight to the curve's first point, then along the curve."""
    points: Array
    """Points of each frame's band at these distances in m, shape (frames, n, 2), or NaN."""
    estimate: Estimate
    """Mean radiance temperature in K over the width, shape (frames, n), by the lines `BAND_BUDGET`;
    NaN where not usable.
    """
    offset: Array
    """Median distance of each frame's band from the reference in m, positive toward the chip."""
    stage: tuple[Stage, ...]
    """Development of each frame's band."""
    times: Array
    """Start of each frame's integration in s, shape (frames,)."""
    width: float
    """Width of the mean across the curve in m."""
    notes: Notes = field(default_factory=Notes)

    @property
    def temperature(self) -> Array:
        """Values of `estimate` in K, shape (frames, n)."""
        return self.estimate.values

    @property
    def in_place(self) -> NDArray[np.bool_]:
        """Which frames have a band that has not moved, shape (frames,)."""
        kept = (Stage.DEVELOPING, Stage.DEVELOPED)
        return np.array([stage in kept for stage in self.stage], dtype=np.bool_)

    def to_frame(self) -> pd.DataFrame:
        """Return every point of each frame's band; one row each."""
        names = {
            **{"time": "time_us", "stage": "stage", "distance": "distance_um"},
            **{"x": "x_um", "y": "y_um", "temperature": "radiance_temperature_degC"},
        }
        table = budget_table(self.to_dataset(), names, self.estimate, BAND_BUDGET)
        return table.dropna(subset="x_um", ignore_index=True)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the temperature along the band in °C, one curve for each frame.

        New axes are made by default.
        """
        from chipglow.laboratory.chip.figure import plot_band_profile

        return plot_band_profile(self, ax)

    def _repr_html_(self) -> str:
        return result_html("BandProfile", self.to_frame(), self.notes)

    def to_dataset(self) -> xr.Dataset:
        """Return every point of each frame's band as arrays in SI units."""
        data = to_xarray(self.estimate, "temperature", _DIMS, "K")
        data["temperature"].attrs["long_name"] = "radiance temperature"
        metres = {"units": "m"}
        variables = {
            "standard_uncertainty": (_DIMS, self.estimate.standard_uncertainty, {"units": "K"}),
            "x": (_DIMS, self.points[..., 0], metres),
            "y": (_DIMS, self.points[..., 1], metres),
            "offset": ("time", self.offset, metres),
            "stage": ("time", [stage.value for stage in self.stage]),
            "reference_x": ("reference_distance", self.reference.points[:, 0], metres),
            "reference_y": ("reference_distance", self.reference.points[:, 1], metres),
        }
        coordinates = {
            "time": ("time", self.times, {"units": "s"}),
            "distance": ("distance", self.distance, metres),
            "reference_distance": ("reference_distance", self.reference.distance, metres),
        }
        data = data.assign(variables).assign_coords(coordinates)
        return data.assign_attrs(width=self.width, **self.notes.attrs())

    def stage_frame(self) -> pd.DataFrame:
        """Return each frame's band; one row each."""
        points = self.to_frame().dropna(subset="radiance_temperature_degC").groupby("time_us")
        table = points.agg(
            from_um=("distance_um", "min"),
            to_um=("distance_um", "max"),
            mean_degC=("radiance_temperature_degC", "mean"),
            greatest_degC=("radiance_temperature_degC", "max"),
            standard_uncertainty_K=("standard_uncertainty_K", lambda u: np.sqrt((u**2).mean())),
        )
        names = {"time": "time_us", "stage": "stage", "offset": "offset_um"}
        return unit_table(self.to_dataset(), names).join(table, on="time_us")


def band_profile(
    measurement: Measurement,
    tool: Tool | None = None,
    frames: Sequence[int] | None = None,
    curve: Array | None = None,
    reference: int | None = None,
    width: float | None = None,
    position: float | None = None,
    uncertainty: ToolUncertainty | None = None,
) -> BandProfile:
    """Read the radiance temperature along the shear band.

    Parameters
    ----------
    measurement : Measurement
        Frames of a camera.
    tool : Tool, optional
        The tool, in the measurement's coordinates; the measurement's own by default.
    frames : sequence of int, optional
        Indices of the frames; all by default.
    curve : ndarray, optional
        Corners of a polyline along which to read all frames, from the cutting edge outward, x and
        y in m, shape (k, 2). By default the ridge that `find_band` finds in each frame.
    reference : int, optional
        Index of the frame whose band is fully developed. By default the given curve is its place;
        without a curve, the frame in which the band that begins near the edge has the largest
        integral of its temperature over the camera's lower range limit.
    width : float, optional
        Width across the curve in m over which to average; a pixel by default.
    position : float, optional
        Standard uncertainty of the curve's position in m, the same in x and y. Default: the
        uncertainty of one pixel: its side over the root of 12.
    uncertainty : ToolUncertainty, optional
        Uncertainty of the tool's position, for example from a `FoundTool`.

    Raises
    ------
    NoShearBandError
        If no frame has a band.

    Notes
    -----
    As in the paper, a band within one pixel of the reference is fully developed, one on the
    workpiece's side is developing, one on the chip's side has moved.

    A curve that is off by a small random vector of standard uncertainty u reads a temperature of
    the mean square error (grad T)² u² + 3/4 (d²T/dn²)² u⁴, with n across the curve. The uncertainty
    of the edge's place, in the direction to the curve's first point, contributes half the
    difference of the temperatures so far up and down the curve.
    """
    tool, pitch = tool_of(measurement, tool), measurement.raster.spacing
    width = pitch if width is None else width
    position = pitch / sqrt(12.0) if position is None else position
    for name, value in (("width", width), ("position", position)):
        if not (isfinite(value) and value >= 0):
            raise ValueError(f"band profile: {name} is {value!r} m, expected 0 m or more")
    numbers = frame_numbers(frames, measurement.times.size)
    image = cache(partial(ThermalImage.of, measurement))
    found: list[Line | None] = []
    reason = ""
    for number in numbers.tolist():
        try:
            found.append(find_band(image(number), tool))
        except NoShearBandError as error:
            found.append(None)
            reason = str(error)
    notes, lines = Notes(), found
    if measurement.calibration_errors is None:
        notes.warnings.append(CALIBRATION_UNKNOWN)
    if curve is not None:
        base = _given(curve, tool, pitch)
        lines, distance = [base] * numbers.size, base.distance
        if reference is None:
            notes.assumed.append("The given curve is the place of the fully developed band.")
    elif any(found):
        distance = _common(found, pitch)
        if reference is None:
            base = _developed(measurement, found, numbers, notes)
    else:
        several = f"shear band: none is found in any of {numbers.size} frames; in the last: "
        raise NoShearBandError(several * (numbers.size > 1) + reason)
    if reference is not None:
        frame_numbers([reference], measurement.times.size)
        base = find_band(image(reference), tool)
    points = np.stack([_laid(line, distance) for line in lines])
    moves = np.zeros((0, 2))
    if uncertainty is not None:
        moves = uncertainty.displacements(tool, tool.edge_point)
    rows = np.stack(
        [
            _read(image, measurement, k, p, width, position, _toward(moves, line, tool))
            for k, p, line in zip(numbers.tolist(), points, lines, strict=True)
        ]
    )
    temperature, by_position = rows[:, 0], rows[:, 1]
    edge, calibration = rows[:, 2 : 2 + len(moves)], rows[:, 2 + len(moves) :]
    if not np.isfinite(temperature).any():
        raise ValueError(
            "shear band: no point of the curve is on usable pixels in any frame, expected a curve "
            "in the image where the chip is hotter than the camera's lower range limit"
        )
    if curve is None:
        notes.warnings.extend(_joined(temperature, measurement.times[numbers]))
    estimate = measurement.estimate(temperature, calibration)
    by_position = np.where(np.isfinite(temperature), by_position, nan)
    estimate = estimate.with_component(POSITION, by_position, per_element=True)
    if uncertainty is not None:
        estimate = uncertainty.applied(tool, estimate, np.swapaxes(edge, 0, 1))
    offset = np.array([_offset(line, base) for line in found])
    return BandProfile(
        reference=base,
        distance=distance,
        points=points,
        estimate=estimate,
        offset=offset,
        stage=tuple(_stage(value, pitch) for value in offset),
        times=measurement.times[numbers],
        width=width,
        notes=notes,
    )


def _given(curve: Array, tool: Tool, pitch: float) -> Line:
    """Resample a given polyline at steps of half a pixel."""
    if curve.ndim != 2 or curve.shape[1] != 2 or len(curve) < 2 or not np.isfinite(curve).all():
        raise ValueError(
            f"curve: points of shape {curve.shape}, expected 2 or more of x and y, all finite"
        )
    first, last = np.hypot(*(curve[[0, -1]] - tool.edge_point).T).tolist()
    if first > last:
        raise ValueError(
            f"curve: it begins {first * 1e6:.4g} µm from the cutting edge and ends "
            f"{last * 1e6:.4g} µm from it, expected from the edge outward"
        )
    corners = first + arc_length(curve)
    if (np.diff(corners) <= 0).any():
        raise ValueError("curve: two points are the same, expected each apart from the one before")
    steps = max(round((corners[-1] - first) / (_POINT_DISTANCE * pitch)), 2)
    distance = np.linspace(first, corners[-1], steps + 1)
    columns = [np.interp(distance, corners, curve[:, axis]) for axis in (0, 1)]
    return Line(distance, np.stack(columns, axis=1))


def _joined(temperature: Array, times: Array) -> tuple[str, ...]:
    """Return a warning of found curves that cross a deep valley between two hot places."""
    crossing = []
    for values, time in zip(temperature, times, strict=True):
        known = values[np.isfinite(values)]
        before = np.maximum.accumulate(known)
        after = np.maximum.accumulate(known[::-1])[::-1]
        depth = float(np.max(np.minimum(before, after) - known, initial=0.0))
        if depth > _DEEP and depth > _DEEP_FRACTION * float(np.ptp(known)):
            crossing.append((depth, time))
    if not crossing:
        return ()
    when = ", ".join(f"{time * 1e6:.6g}" for _, time in crossing)
    return (
        f"The curve at {when} µs crosses a valley, up to {max(crossing)[0]:.0f} K deep: "
        "it may join two bands, or a band that has moved and the heat at the edge.",
    )


def _common(lines: Sequence[Line | None], pitch: float) -> Array:
    """Return distances that cover all lines, at steps of half a pixel."""
    first = min(float(line.distance[0]) for line in lines if line)
    last = max(float(line.distance[-1]) for line in lines if line)
    step = _POINT_DISTANCE * pitch
    return step * np.arange(np.ceil(first / step - 1e-6), np.floor(last / step + 1e-6) + 1)


def _laid(line: Line | None, distance: Array) -> Array:
    """Return points of a line at these distances, NaN beyond its ends."""
    if line is None:
        return np.full((distance.size, 2), nan)
    slack = 1e-9 * float(line.distance[-1])  # rounding
    beyond = (distance < line.distance[0] - slack) | (distance > line.distance[-1] + slack)
    columns = [np.interp(distance, line.distance, line.points[:, axis]) for axis in (0, 1)]
    return np.where(beyond[:, None], nan, np.stack(columns, axis=1))


def _toward(moves: Array, line: Line | None, tool: Tool) -> Array:
    """Return how far the edge moves toward a line's first point in m, shape (k,)."""
    if line is None:
        return np.zeros(len(moves))
    way = line.points[0] - tool.edge_point
    if not way.any():
        way = line.points[1] - line.points[0]
    return np.asarray(moves @ way / np.hypot(*way))


def _developed(
    measurement: Measurement, found: Sequence[Line | None], numbers: NDArray[np.int64], notes: Notes
) -> Line:
    """Choose the fully developed one of the bands found."""

    def heat(line: Line, number: int) -> float:
        """Integrate the temperature over the lower range limit along a line in K m."""
        frame = measurement.data["radiance_temperature"][number].values
        lower_limit = float(measurement.data.attrs.get("lower_limit", np.nanmin(frame)))
        values = np.nan_to_num(sample(frame, measurement.raster, line.points) - lower_limit)
        return float(scipy.integrate.trapezoid(values, line.distance))

    bands = [(line, k) for line, k in zip(found, numbers.tolist(), strict=True) if line]
    limit = NEAR_THE_EDGE * measurement.raster.spacing
    near = [band for band in bands if band[0].distance[0] < limit]
    if not near:
        notes.warnings.append(
            "No band begins near the cutting edge, so all may have moved; the stages are "
            "judged against the hottest and longest one."
        )
    line, number = max(near or bands, key=lambda band: heat(*band))
    if len(bands) == 1:
        notes.warnings.append("Only one frame has a band; its stage cannot be judged.")
    elif near:
        notes.assumed.append(
            f"The band at {measurement.times[number] * 1e6:.6g} µs is fully developed: "
            "it is the hottest and longest of those that begin near the cutting edge."
        )
    return line


def _read(
    image: Callable[[int], ThermalImage],
    measurement: Measurement,
    number: int,
    points: Array,
    width: float,
    position: float,
    nearer: Array,
) -> Array:
    """Return temperature and its changes by the curve's place, `nearer` and the calibration."""
    effects, pitch = measurement.calibration_effects(number), measurement.raster.spacing
    rows = np.full((2 + nearer.size + len(effects), len(points)), nan)
    there = np.isfinite(points[:, 0])
    if there.sum() < 2:
        return rows
    curve = points[there]
    tangent = normals_of(curve)[:, ::-1] * [-1.0, 1.0]
    count = max(round(width / pitch * _LINES_PER_PIXEL), 1)
    places = across_curve(curve, width * ((np.arange(count) + 0.5) / count - 0.5))
    frame = measurement.data["radiance_temperature"][number].values
    mean, *calibration = (
        sample(one, measurement.raster, places).mean(axis=-1) for one in (frame, *effects)
    )
    edge = [contribution(image(number), curve, step * tangent) for step in nearer]
    rows[:, there] = [mean, _by_position(image(number), curve, position), *edge, *calibration]
    return rows


def _by_position(image: ThermalImage, curve: Array, u: float) -> Array:
    """Return the standard uncertainty in K by a place of the curve that is uncertain by u in m."""
    pitch = image.raster.spacing
    slopes: Any = np.gradient(image.temperature, pitch)
    down, right = (replace(image, temperature=slope).read(curve) for slope in slopes)
    behind, here, ahead = (image.read(curve + pitch * k * normals_of(curve)) for k in (-1, 0, 1))
    bend = (behind - 2 * here + ahead) / pitch**2
    # Of a normal displacement d, the mean square of bend d² / 2 is 3/4 bend² u⁴.
    return np.asarray(np.sqrt((down**2 + right**2) * u**2 + 0.75 * bend**2 * u**4))


def _offset(line: Line | None, reference: Line) -> float:
    """Return the median distance of a band from the reference in m, positive toward the chip."""
    if line is None:
        return nan
    nearest = ((line.points[:, None] - reference.points) ** 2).sum(axis=-1).argmin(axis=1)
    beside = (nearest > 0) & (nearest < reference.distance.size - 1)
    if not beside.any():
        beside[:] = True
    shortest = line.points - reference.points[nearest]
    distance = (shortest * normals_of(reference.points)[nearest]).sum(axis=1)
    return float(np.median(distance[beside]))


def _stage(offset: float, pitch: float) -> Stage:
    if not isfinite(offset):
        return Stage.NONE
    if abs(offset) <= MOVED * pitch:
        return Stage.DEVELOPED
    return Stage.MOVED if offset > 0 else Stage.DEVELOPING
