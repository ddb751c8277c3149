"""The analysis grid on the rake face: squares of pixels from the face into the chip."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Final

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from chipglow.camera import UNUSABLE, Measurement
from chipglow.camera.calibration import CALIBRATION
from chipglow.laboratory.chip.band_ridge import ThermalImage
from chipglow.laboratory.chip.frames import (
    FRAMES,
    budget_table,
    frame_mean,
    frame_numbers,
    frame_scatter,
    known_uncertainty,
)
from chipglow.laboratory.chip.tool_position import (
    TOOL_BUDGET,
    ToolUncertainty,
    contribution,
    tool_of,
)
from chipglow.quantities import Array, Brief, quotient
from chipglow.scene import Raster, Tool
from chipglow.scene.tool_outline import tool_attributes
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Estimate, to_xarray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PIXELS: Final = 3.0
"""Side of the paper's squares in pixels."""

DEPTH: Final = 90e-6
"""Default depth of the grid in the chip in m: five rows of 3 pixels of 6 um."""

RAKE_BUDGET: Final = (CALIBRATION, *TOOL_BUDGET)
"""Lines of the budget of a square in one frame."""

_DIMS: Final = ("time", "depth", "along")

_ROUNDING: Final = 1e-6
"""Part of a square that rounding may add to or take from a position."""


@dataclass(frozen=True, eq=False, repr=False)
class RakeGrid(Brief):
    """Radiance temperature in squares beside the rake face (the paper, Figure 7)."""

    along: Array
    """Middles of the squares along the straight rake face in m, from its lower end, shape (n,)."""
    depth: Array
    """Middles of the squares from the rake face into the chip in m, shape (m,)."""
    estimate: Estimate
    """Mean radiance temperature in K of each square's pixels, (frames, m, n); NaN if left out."""
    standard_deviation: Array
    """Standard deviation over the square's pixels in K, of the same shape; NaN for one pixel."""
    count: NDArray[np.int64]
    """Usable pixels in each square, of the same shape."""
    size: float
    """Side of a square in m."""
    tool: Tool
    """The tool, in the measurement's coordinates."""
    times: Array
    """When each frame's integration began in s, shape (frames,)."""

    @property
    def mean(self) -> Array:
        """Values of `estimate` in K, shape (frames, m, n)."""
        return self.estimate.values

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Which squares are not left out, shape (frames, m, n)."""
        return np.isfinite(self.mean)

    @property
    def frame_count(self) -> NDArray[np.int64]:
        """Number of frames in which each square is usable, shape (m, n)."""
        return np.asarray(self.usable.sum(axis=0), dtype=np.int64)

    @cached_property
    def frame_estimate(self) -> Estimate:
        """Mean over the frames that show a square in K, with their scatter, shape (m, n)."""
        mean = frame_mean(self.estimate)
        if self.times.size == 1:
            return mean.with_unevaluated(FRAMES)
        return replace(mean, components=(*mean.components, frame_scatter(self.mean)))

    @property
    def frame_mean(self) -> Array:
        """Values of `frame_estimate` in K, shape (m, n); NaN where no frame has one."""
        return self.frame_estimate.values

    @property
    def frame_standard_deviation(self) -> Array:
        """Standard deviation of `mean` between those frames in K, shape (m, n); NaN for one."""
        away = np.where(self.usable, self.mean - self.frame_mean, 0.0)
        return np.sqrt(quotient((away**2).sum(axis=0), self.frame_count - 1))

    @property
    def bars(self) -> Array:
        """Standard deviation in K between the frames, or in the squares of a single frame."""
        return self.frame_standard_deviation if self.times.size > 1 else self.standard_deviation[0]

    def to_frame(self) -> pd.DataFrame:
        """Return every square of every frame; one row each."""
        names = {
            **{"time": "time_us", "depth": "depth_um", "along": "along_um", "mean": "mean_degC"},
            **{"standard_deviation": "standard_deviation_K", "count": "usable_pixels"},
        }
        return budget_table(self.to_dataset(), names, self.estimate, RAKE_BUDGET)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the mean over the frames along the rake face in °C, one curve for each depth.

        New axes are made by default.
        """
        from chipglow.laboratory.chip.figure import plot_rake_grid

        return plot_rake_grid(self, ax)

    def _repr_html_(self) -> str:
        return result_html("RakeGrid", self.to_frame(), self.notes)

    def to_dataset(self) -> xr.Dataset:
        """Return every square of every frame as arrays in SI units."""
        data = to_xarray(self.estimate, "mean", _DIMS, "K")
        data["mean"].attrs["long_name"] = "radiance temperature"
        variables = {
            "standard_uncertainty": (_DIMS, known_uncertainty(self.estimate), {"units": "K"}),
            "standard_deviation": (_DIMS, self.standard_deviation, {"units": "K"}),
            "count": (_DIMS, self.count, {"units": "1"}),
        }
        coordinates = {
            "time": ("time", self.times, {"units": "s"}),
            "depth": ("depth", self.depth, {"units": "m"}),
            "along": ("along", self.along, {"units": "m"}),
        }
        data = data.assign(variables).assign_coords(coordinates)
        return data.assign_attrs(size=self.size, **tool_attributes(self.tool))

    @property
    def notes(self) -> Notes:
        """Squares without a value, causes that the deviations omit, and warnings."""
        notes, count, frames = Notes(), self.frame_count, self.times.size
        causes = " and ".join(one.cause.name for one in self.estimate.components)
        if causes:
            notes.remarks.append(
                f"Errors of {causes} move all squares together and are not in the deviations."
            )
        if left_out := int((count == 0).sum()):
            notes.remarks.append(
                f"{left_out} of {count.size} squares are left out (–): one of their pixels is "
                "below the camera's lower range limit, saturated, dead or outside the image."
            )
        if partly := int(((count > 0) & (count < frames)).sum()):
            notes.warnings.append(
                f"{partly} squares are usable in only some of the {frames} frames; their means are "
                "of those frames, the hotter ones if the lower range limit is the reason."
            )
        return notes

    def corners(self) -> Array:
        """Return the corners of the squares in m, shape (m + 1, n + 1, 2)."""
        return _corners(self.tool, self.size, self.depth.size, self.along.size)


def rake_grid(
    measurement: Measurement,
    tool: Tool | None = None,
    pixels: float = PIXELS,
    depth: float = DEPTH,
    frames: Sequence[int] | None = None,
    uncertainty: ToolUncertainty | None = None,
) -> RakeGrid:
    """Average a measurement in squares along the rake face.

    Parameters
    ----------
    measurement : Measurement
        Frames of a camera.
    tool : Tool, optional
        The tool, in the measurement's coordinates; the measurement's own by default.
    pixels : float
        Side of a square in pixels; the paper's 3 by default.
    depth : float
        Depth of the grid in the chip from the rake face in m: as many whole squares as
        fit, at least one.
    frames : sequence of int, optional
        Indices of the frames; all by default.
    uncertainty : ToolUncertainty, optional
        Uncertainty of the tool's position, for example from a `FoundTool`.

    Notes
    -----
    A pixel belongs to the square that contains its centre; nothing is resampled. A square is left
    out in a frame if any of its pixels is `UNUSABLE` there, as in the paper, or if it is not whole
    inside the image.

    The mean weights pixels, as little unequally as possible, so that their weighted middle is the
    square's: a field that is linear in x and y comes out exactly. The noise of a mean of 9 pixels
    rises by 6 % on average at a rake angle of -7 degrees, by 18 % at most.

    Each uncertainty of the tool's place displaces the squares to either side by one standard
    uncertainty; half the difference of the temperatures there is its contribution
    (JCGM 100, 5.1.3). Unusable pixels are filled for this as in `ThermalImage`.
    """
    tool, raster = tool_of(measurement, tool), measurement.raster
    size = pixels * raster.spacing
    if not (isfinite(pixels) and pixels >= 1):
        raise ValueError(f"rake grid: pixels is {pixels!r}, expected 1 or more")
    if not (isfinite(depth) and depth >= size * (1 - _ROUNDING)):
        raise ValueError(
            f"rake grid: depth is {depth!r} m, expected a square's {size:.4g} m or more"
        )
    numbers = frame_numbers(frames, measurement.times.size)
    rows = int(depth / size + _ROUNDING)
    whole = _whole(raster, tool, size, rows)
    columns = whole.shape[1]
    squares = _Squares(raster, tool, size, whole)
    temperatures, flags = measurement.data["radiance_temperature"], measurement.data["flags"]
    read = [
        squares.statistics(
            np.asarray(temperatures[number].values, np.float64),
            flags[number].values & UNUSABLE == 0,
        )
        for number in numbers
    ]
    mean, standard_deviation, count = (np.stack(part) for part in zip(*read, strict=True))
    if not np.isfinite(mean[:, 0]).any():
        raise ValueError(
            f"rake grid: none of the {columns} squares beside the rake face is usable, expected a "
            "chip that touches the tool and is hotter than the camera's lower range limit"
        )
    effects = [
        [squares.mean(effect) for effect in measurement.calibration_effects(int(number))]
        for number in numbers
    ]
    estimate = measurement.estimate(mean, effects)
    along, deep = (size * (np.arange(count, dtype=np.float64) + 0.5) for count in (columns, rows))
    if uncertainty is not None:
        middles = tool.rake_point(along) + deep[:, None, None] * np.array(tool.rake_normal)
        places = middles[:, :, None] + _within_square(tool, size, raster.spacing)
        displacements = uncertainty.displacements(tool, places)
        changes = np.full((len(displacements), *mean.shape), np.nan)
        for index in np.flatnonzero(np.isfinite(mean).any(axis=(1, 2))):
            image = ThermalImage.of(measurement, int(numbers[index]))
            for change, displacement in zip(changes, displacements, strict=True):
                change[index] = contribution(image, places, displacement).mean(axis=-1)
        estimate = uncertainty.applied(tool, estimate, changes)
    return RakeGrid(
        along=along,
        depth=deep,
        estimate=estimate,
        standard_deviation=standard_deviation,
        count=count,
        size=size,
        tool=tool,
        times=measurement.times[numbers],
    )


def _within_square(tool: Tool, size: float, pitch: float) -> Array:
    """Return even positions in a square relative to its centre, about one per pixel, (k, 2)."""
    count = round(size / pitch)
    steps = size * ((np.arange(count) + 0.5) / count - 0.5)
    normal, direction = np.array(tool.rake_normal), np.array(tool.rake_direction)
    return np.asarray((steps[:, None, None] * direction + steps[:, None] * normal).reshape(-1, 2))


class _Squares:
    """Flat numbers of the pixels in the grid and of their squares, and their weights."""

    def __init__(self, raster: Raster, tool: Tool, size: float, whole: NDArray[np.bool_]) -> None:
        rows, columns = whole.shape
        self.whole = whole
        along, across = tool.face_coordinates(raster.centres.reshape(-1, 2))
        column = np.floor(along / size + _ROUNDING).astype(np.int64)
        row = np.floor(across / size + _ROUNDING).astype(np.int64)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        self.square = (row * columns + column)[inside]
        off = np.stack([along - size * (column + 0.5), across - size * (row + 0.5)], axis=-1)
        self.weight = _centred_weights(off[inside], self.square, whole.size)
        self.pixel = np.flatnonzero(inside)

    def statistics(
        self, values: Array, usable: NDArray[np.bool_]
    ) -> tuple[Array, Array, NDArray[np.int64]]:
        """Compute mean, standard deviation and number of usable pixels, shape (rows, columns)."""
        good = usable.ravel()[self.pixel]
        value = np.where(good, values.ravel()[self.pixel], 0.0)
        number = self._sum(np.ones(good.size))
        kept = self._sum(good)
        left_out = (kept < number) | (number == 0) | ~self.whole
        mean = np.where(left_out, np.nan, self._sum(self.weight * value))
        plain = quotient(self._sum(value), number)
        away = value - plain.ravel()[self.square]
        deviation = np.sqrt(quotient(self._sum(away**2), number - 1))
        return mean, np.where(left_out, np.nan, deviation), kept.astype(np.int64)

    def mean(self, values: Array) -> Array:
        """Compute the mean of values of all pixels, NaN counting as 0, shape (rows, columns)."""
        return self._sum(self.weight * np.nan_to_num(values.ravel()[self.pixel]))

    def _sum(self, values: NDArray[np.generic]) -> Array:
        total = np.bincount(self.square, values.astype(np.float64), minlength=self.whole.size)
        return np.asarray(total, np.float64).reshape(self.whole.shape)


def _corners(tool: Tool, size: float, rows: int, columns: int) -> Array:
    """Return the corners of squares in m, shape (rows + 1, columns + 1, 2)."""
    across, along = size * np.arange(rows + 1), size * np.arange(columns + 1)
    normal = np.array(tool.rake_normal)
    return np.asarray(tool.rake_point(along)[None] + across[:, None, None] * normal)


def _whole(raster: Raster, tool: Tool, size: float, rows: int) -> NDArray[np.bool_]:
    """Return which squares are whole inside the image, up to the last column that has one."""
    left, right, bottom, top = raster.extent
    ends = np.array([[left, bottom], [left, top], [right, bottom], [right, top]])
    columns = max(int(float(tool.face_coordinates(ends)[0].max()) / size + _ROUNDING), 0)
    slack = _ROUNDING * size
    x, y = np.moveaxis(_corners(tool, size, rows, columns), -1, 0)
    inside = (x > left - slack) & (x < right + slack) & (y > bottom - slack) & (y < top + slack)
    whole = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
    shown = np.flatnonzero(whole.any(axis=0))
    if shown.size == 0:
        foot_x, foot_y = 1e6 * tool.rake_foot
        edges = ", ".join(f"{1e6 * edge:.6g}" for edge in raster.extent)
        raise ValueError(
            f"rake grid: no square on the rake face is inside the image; the face begins at x "
            f"{foot_x:.6g} um, y {foot_y:.6g} um, outside the image: left, right, bottom, top "
            f"{edges} um"
        )
    return np.asarray(whole[:, : shown[-1] + 1])


def _centred_weights(off: Array, square: NDArray[np.int64], squares: int) -> Array:
    """Return weights of sum 1 whose weighted middle is the square's, nearest to equal ones."""
    number = np.maximum(np.bincount(square, minlength=squares), 1)
    middle = np.stack([np.bincount(square, part, squares) / number for part in off.T], axis=-1)
    spread = off - middle[square]
    products = spread[:, :, None] * spread[:, None, :]
    moments = np.stack(
        [np.bincount(square, part, squares) for part in products.reshape(-1, 4).T], axis=-1
    ).reshape(squares, 2, 2)
    # Pixels in one row can only be centred along it: the pseudo-inverse leaves the rest.
    slope = np.einsum("sij,sj->si", np.linalg.pinv(moments, rcond=1e-9, hermitian=True), -middle)
    return np.asarray(1 / number[square] + (spread * slope[square]).sum(axis=-1))
