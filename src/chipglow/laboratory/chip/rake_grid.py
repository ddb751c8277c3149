"""The analysis grid on the rake face: squares of pixels from the face into the chip."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Final

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from chipglow.camera import UNUSABLE, Measurement
from chipglow.camera.calibration.errors import CALIBRATION
from chipglow.laboratory.chip.band_ridge import ThermalImage
from chipglow.laboratory.chip.frames import (
    FRAMES,
    FrameScatter,
    budget_columns,
    celsius,
    frame_numbers,
    known_uncertainty,
)
from chipglow.laboratory.chip.tool_position import (
    TOOL_BUDGET,
    ToolUncertainty,
    contribution,
    tool_of,
)
from chipglow.quantities import Array
from chipglow.scene import Raster, Tool
from chipglow.scene.tool_attributes import tool_attributes
from chipglow.text import Notes
from chipglow.uncertainty import Component, Estimate, to_xarray

PIXELS: Final = 3.0
"""Side of the paper's squares in pixels."""

DEPTH: Final = 90e-6
"""How far into the chip the grid reaches by default in m: five rows of 3 pixels of 6 um."""

RAKE_BUDGET: Final = (CALIBRATION, *TOOL_BUDGET)
"""Lines of the budget of a square in one frame."""

_ROUNDING: Final = 1e-6


@dataclass(frozen=True, eq=False)
class RakeGrid:
    """Radiance temperature in squares beside the rake face (the paper, Figure 7)."""

    along: Array
    """Middles of the squares along the rake face in m, from the lower end of the straight face,
    shape (n,).
    """
    depth: Array
    """Middles of the squares from the rake face into the chip in m, shape (m,)."""
    estimate: Estimate
    """Mean radiance temperature in K of each square's pixels, shape (frames, m, n); NaN where
    the square is left out. Its components are ``calibration``, which is the same in all that
    was measured by it, and ``tool``, the same in all that is read by this tool, of which
    `TOOL_BUDGET` are parts.
    """
    standard_deviation: Array
    """Standard deviation over the square's pixels in K, of the same shape; NaN also for a single
    pixel.
    """
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
        """Mean of `mean` over the frames in which a square is usable in K, shape (m, n).

        The component ``frames`` is what they show of their mean (`FrameScatter`): what differs
        from frame to frame, the pixels' noise included. One frame shows nothing of it.
        """
        there = Estimate(
            np.nan_to_num(self.mean),
            tuple(replace(c, effects=np.nan_to_num(c.effects)) for c in self.estimate.components),
            self.estimate.unevaluated,
        )
        mean = there.linear(_averages(self.usable)).reshape(*self.mean.shape[1:])
        if self.times.size == 1:
            return mean.with_unevaluated(FRAMES)
        scatter = FrameScatter.of(self.mean).component()
        return replace(mean, components=(*mean.components, scatter))

    @property
    def frame_mean(self) -> Array:
        """Values of `frame_estimate` in K, shape (m, n); NaN where no frame has one."""
        return self.frame_estimate.values

    @property
    def frame_standard_deviation(self) -> Array:
        """Standard deviation of `mean` between those frames in K, shape (m, n); NaN for one."""
        away = np.where(self.usable, self.mean - self.frame_mean, 0.0)
        return np.sqrt(_ratio((away**2).sum(axis=0), self.frame_count - 1))

    def to_frame(self) -> pd.DataFrame:
        """Every square of every frame; one row each."""
        places = np.meshgrid(self.times, self.depth, self.along, indexing="ij")
        time, depth, along = (1e6 * place.ravel() for place in places)
        return pd.DataFrame(
            {
                "time_us": time,
                "depth_um": depth,
                "along_um": along,
                "mean_degC": celsius(self.mean.ravel()),
                "standard_deviation_K": self.standard_deviation.ravel(),
                "usable_pixels": self.count.ravel(),
                **budget_columns(self.estimate, RAKE_BUDGET),
            }
        )

    def to_dataset(self) -> xr.Dataset:
        """Every square of every frame as arrays in SI units."""
        dimensions = ("time", "depth", "along")
        data = to_xarray(self.estimate, "mean", dimensions, "K")
        data["mean"].attrs["long_name"] = "radiance temperature"
        return (
            data.assign(
                standard_uncertainty=(dimensions, known_uncertainty(self.estimate), {"units": "K"}),
                standard_deviation=(dimensions, self.standard_deviation, {"units": "K"}),
                count=(dimensions, self.count, {"units": "1"}),
            )
            .assign_coords(
                time=("time", self.times, {"units": "s"}),
                depth=("depth", self.depth, {"units": "m"}),
                along=("along", self.along, {"units": "m"}),
            )
            .assign_attrs(size=self.size, **tool_attributes(self.tool))
        )

    def mean_frame(self) -> pd.DataFrame:
        """Every square in the mean over the frames; one row each."""
        depth, along = np.meshgrid(1e6 * self.depth, 1e6 * self.along, indexing="ij")
        several = self.times.size > 1
        standard_deviation = (
            self.frame_standard_deviation if several else self.standard_deviation[0]
        )
        return pd.DataFrame(
            {
                "depth_um": depth.ravel(),
                "along_um": along.ravel(),
                "mean_degC": celsius(self.frame_mean.ravel()),
                "standard_deviation_K": standard_deviation.ravel(),
                "frames": self.frame_count.ravel(),
            }
        )

    @property
    def notes(self) -> Notes:
        """Squares without a value, causes that the deviations omit, and a warning of the means."""
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

    def up_to(self, columns: int) -> "RakeGrid":
        """The same of the first squares along the face."""
        return replace(
            self,
            along=self.along[:columns],
            estimate=self.estimate[:, :, :columns],
            standard_deviation=self.standard_deviation[:, :, :columns],
            count=self.count[:, :, :columns],
        )

    def corners(self) -> Array:
        """Corners of the squares in the measurement's coordinates."""
        sides = (np.arange(self.depth.size + 1), np.arange(self.along.size + 1))
        across, along = (self.size * steps for steps in sides)
        normal = np.array(self.tool.rake_normal)
        return np.asarray(self.tool.rake_point(along)[None] + across[:, None, None] * normal)


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
        How far from the rake face into the chip the grid reaches in m: as many whole squares as
        fit, at least one.
    frames : sequence of int, optional
        Numbers of the frames; all by default.
    uncertainty : ToolUncertainty, optional
        How well the place of the tool is known, such as that of a `FoundTool`.

    Raises
    ------
    ValueError
        If there is no tool, no square is inside the image, or none beside the rake face is usable
        in any frame.

    Notes
    -----
    The squares stand on the rake face and turn with it. A pixel belongs to the square that holds
    its middle, so that every pixel counts once and one that is flagged removes one square; nothing
    is resampled, which would mix pixels of the tool, or such as are under the camera's range,
    into the squares beside them. A square is left out in a frame if any of its pixels is `UNUSABLE`
    there, as in the paper, or if it is not whole inside the image.

    The middles of the pixels in a turned square are not spread evenly about the square's own
    middle. The mean therefore weights them, as little unequally as possible, so that their
    weighted middle is the square's: that is the value which the plane through the pixels, by least
    squares, has in the middle of the square. Where the pixels lie evenly it is the plain mean. A
    field that is linear in x and y comes out exactly, wherever the pixels lie; the noise of a mean
    of 9 pixels rises by 6 % on average at a rake angle of -7 degrees, by 18 % at most.
    `RakeGrid.standard_deviation` is the plain standard deviation.

    What the calibration's errors change in a square is the weighted mean of what they change in its
    pixels. Each uncertainty of the tool's place displaces the squares to either side by one
    standard uncertainty; half the difference of the temperatures there is what it contributes
    (JCGM 100, 5.1.3). Pixels that are not usable are filled as in `ThermalImage`.
    """
    tool, raster = tool_of(measurement, tool), measurement.raster
    size = _checked_size(pixels, depth, raster)
    numbers = frame_numbers(frames, measurement.times.size)
    rows = int(depth / size + _ROUNDING)
    columns = _columns(raster, tool, size, rows)
    squares = _Squares.of(raster, tool, size, rows, columns)
    shape = (numbers.size, rows, columns)
    mean, standard_deviation = np.empty(shape), np.empty(shape)
    count = np.empty(shape, np.int64)
    effects = []
    temperatures = measurement.data["radiance_temperature"]
    flags = measurement.data["flags"]
    for index, number in enumerate(numbers):
        usable = flags[number].values & UNUSABLE == 0
        values = np.asarray(temperatures[number].values, dtype=np.float64)
        mean[index], standard_deviation[index], count[index] = squares.statistics(values, usable)
        effects.append([squares.mean(e) for e in measurement.calibration_effects(int(number))])
    if not np.isfinite(mean[:, 0]).any():
        raise ValueError(
            f"rake grid: none of the {columns} squares beside the rake face is usable, expected a "
            "chip that touches the tool and is hotter than the camera's lower range limit"
        )
    grid = RakeGrid(
        along=size * (np.arange(columns, dtype=np.float64) + 0.5),
        depth=size * (np.arange(rows, dtype=np.float64) + 0.5),
        estimate=measurement.estimate(mean, effects),
        standard_deviation=standard_deviation,
        count=count,
        size=size,
        tool=tool,
        times=measurement.times[numbers],
    )
    if uncertainty is None:
        return grid
    component = _from_tool(measurement, grid, numbers, uncertainty)
    known = (*grid.estimate.components, component)
    return replace(grid, estimate=replace(grid.estimate, components=known))


def _from_tool(
    measurement: Measurement,
    grid: RakeGrid,
    numbers: NDArray[np.int64],
    uncertainty: ToolUncertainty,
) -> Component:
    """What the uncertainties of the tool's place change in the means."""
    places = _places_in_squares(grid, measurement.raster.spacing)
    displacements = uncertainty.displacements(grid.tool, places)
    found = np.zeros((len(displacements), *grid.mean.shape))
    for index in np.flatnonzero(grid.usable.any(axis=(1, 2))):
        image = ThermalImage.of(measurement, int(numbers[index]))
        for kind, displacement in enumerate(displacements):
            found[kind, index] = contribution(image, places, displacement).mean(axis=-1)
    return uncertainty.component(grid.tool, np.where(grid.usable, found, np.nan))


def _averages(usable: NDArray[np.bool_]) -> "sparse.csr_array":
    """What makes means over the frames of flat values of shape (frames, ...).

    Of what is not usable in any frame it makes NaN.
    """
    frames, squares = len(usable), usable[0].size
    flat = usable.reshape(frames, squares)
    count = flat.sum(axis=0)
    weights = np.where(count > 0, flat / np.maximum(count, 1), np.nan)
    places = (np.tile(np.arange(squares), frames), np.arange(usable.size))
    return sparse.csr_array((weights.ravel(), places), shape=(squares, usable.size))


def _places_in_squares(grid: RakeGrid, pitch: float) -> Array:
    """Places spread evenly over each square, about one a pixel, in m, shape (m, n, k, 2)."""
    count = round(grid.size / pitch)
    steps = grid.size * ((np.arange(count) + 0.5) / count - 0.5)
    normal, direction = np.array(grid.tool.rake_normal), np.array(grid.tool.rake_direction)
    within = (steps[:, None, None] * direction + steps[:, None] * normal).reshape(-1, 2)
    middles = grid.tool.rake_point(grid.along) + grid.depth[:, None, None] * normal
    return np.asarray(middles[:, :, None] + within)


@dataclass(frozen=True)
class _Squares:
    """Which pixels belong to which square, and with what weight."""

    shape: tuple[int, int]
    whole: NDArray[np.bool_]
    """Which squares are whole inside the image, flat."""
    pixel: NDArray[np.int64]
    square: NDArray[np.int64]
    """Flat numbers of the pixels in the grid and of their squares, shape (k,)."""
    weight: Array
    """Weights, of sum 1 in each square, shape (k,)."""

    @classmethod
    def of(cls, raster: Raster, tool: Tool, size: float, rows: int, columns: int) -> "_Squares":
        along, across = tool.face_coordinates(_middles(raster))
        column = np.floor(along / size + _ROUNDING).astype(np.int64)
        row = np.floor(across / size + _ROUNDING).astype(np.int64)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        square = (row * columns + column)[inside]
        off = np.stack([along - size * (column + 0.5), across - size * (row + 0.5)], axis=-1)
        weight = _centred_weights(off[inside], square, rows * columns)
        whole = _whole(raster, tool, size, rows, columns).ravel()
        return cls((rows, columns), whole, np.flatnonzero(inside), square, weight)

    def statistics(
        self, values: Array, usable: NDArray[np.bool_]
    ) -> tuple[Array, Array, NDArray[np.int64]]:
        """Mean, standard deviation and number of usable pixels, each of `shape`."""
        good = usable.ravel()[self.pixel]
        value = np.where(good, values.ravel()[self.pixel], 0.0)
        number = self._sum(np.ones(good.size))
        kept = self._sum(good)
        left_out = (kept < number) | (number == 0) | ~self.whole
        weighted = self._sum(self.weight * value)
        mean = np.where(left_out, np.nan, weighted)
        plain = _ratio(self._sum(value), number)
        away = value - plain[self.square]
        standard_deviation = np.sqrt(_ratio(self._sum(away**2), number - 1))
        standard_deviation = np.where(left_out, np.nan, standard_deviation)
        number_kept = kept.astype(np.int64).reshape(self.shape)
        return mean.reshape(self.shape), standard_deviation.reshape(self.shape), number_kept

    def mean(self, values: Array) -> Array:
        """Mean of values of all pixels, NaN counting as 0, of `shape`."""
        good = np.nan_to_num(values.ravel()[self.pixel])
        return self._sum(self.weight * good).reshape(self.shape)

    def _sum(self, values: NDArray[np.generic]) -> Array:
        total = np.bincount(self.square, values.astype(np.float64), minlength=self.whole.size)
        return np.asarray(total, dtype=np.float64)


def _checked_size(pixels: float, depth: float, raster: Raster) -> float:
    if not (isfinite(pixels) and pixels >= 1):
        raise ValueError(f"rake grid: pixels is {pixels!r}, expected 1 or more")
    size = pixels * raster.spacing
    if not (isfinite(depth) and depth >= size * (1 - _ROUNDING)):
        raise ValueError(
            f"rake grid: depth is {depth!r} m, expected a square's {size:.4g} m or more"
        )
    return size


def _middles(raster: Raster) -> Array:
    """Middles of the pixels, x and y in m, shape (y * x, 2)."""
    return np.stack(np.meshgrid(raster.x, raster.y), axis=-1).reshape(-1, 2)


def _columns(raster: Raster, tool: Tool, size: float, rows: int) -> int:
    """Number of squares along the face up to the last that is whole inside the image."""
    left, right, bottom, top = raster.extent
    corners = np.array([[left, bottom], [left, top], [right, bottom], [right, top]])
    furthest = float(tool.face_coordinates(corners)[0].max())
    most = max(int(furthest / size + _ROUNDING), 0)
    whole = np.flatnonzero(_whole(raster, tool, size, rows, most).any(axis=0))
    if whole.size == 0:
        x, y = 1e6 * tool.rake_foot
        edges = ", ".join(f"{1e6 * edge:.6g}" for edge in raster.extent)
        raise ValueError(
            f"rake grid: no square on the rake face is inside the image; the face begins at x "
            f"{x:.6g} um, y {y:.6g} um, expected it in the image from left, right, bottom, top "
            f"{edges} um"
        )
    return int(whole[-1]) + 1


def _whole(raster: Raster, tool: Tool, size: float, rows: int, columns: int) -> NDArray[np.bool_]:
    """Which squares are whole inside the image, shape (rows, columns)."""
    across, along = size * np.arange(rows + 1), size * np.arange(columns + 1)
    normal = np.array(tool.rake_normal)
    corners = tool.rake_point(along)[None] + across[:, None, None] * normal
    left, right, bottom, top = raster.extent
    slack = _ROUNDING * size
    x, y = corners[..., 0], corners[..., 1]
    inside = (x > left - slack) & (x < right + slack) & (y > bottom - slack) & (y < top + slack)
    return np.asarray(inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:])


def _centred_weights(off: Array, square: NDArray[np.int64], squares: int) -> Array:
    """Weights of sum 1 whose weighted middle is the square's, nearest to equal ones."""
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


def _ratio(total: Array, count: NDArray[np.generic]) -> Array:
    """Quotient; NaN where the divisor is not positive."""
    divisor = np.asarray(count, dtype=np.float64)
    quotient = np.full(total.shape, np.nan)
    np.divide(total, divisor, out=quotient, where=divisor > 0)
    return quotient
