"""Integration of samples over the pixels, by exact area weights."""

from functools import lru_cache
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chipglow.quantities import Array
from chipglow.quantities.units import LENGTH
from chipglow.scene import Raster
from chipglow.text import check_memory

_ROUNDING: Final = 1e-6
"""Lengths below this fraction of a pixel or sample are rounding errors."""

_FEW_PIXELS: Final = 1e6
"""Pixels up to which no memory is compared: no machine lacks the 0.1 GB."""

_BYTES_A_PIXEL: Final = 100.0
"""Memory of a measured exposure a pixel: twelve images in double precision."""

_BYTES_AN_OVERLAP: Final = 40.0
"""Memory a pixel and sample along an axis: five arrays in double precision."""

LEAST_COVERED: Final = 0.05
"""Part of a sample's width that a pixel must cover for the sample to count in its maximum.

Where a whole number of samples makes a pixel, a pitch that was rounded adds up to slivers of the
neighbours' samples. A single hot one would be the reference of the whole pixel.
"""


def overlap_lengths(left: Array, width: float, samples: int, spacing: float) -> Array:
    """Return the overlap in m of each interval with each sample of a line, shape (n, samples).

    Intervals start at `left` (n,) in m from the start of the first sample.
    """
    edges = spacing * np.arange(samples + 1, dtype=np.float64)
    begin = np.maximum(left[:, None], edges[None, :-1])
    end = np.minimum(left[:, None] + width, edges[None, 1:])
    # Edges that coincide overlap by rounding.
    return np.where(end - begin > _ROUNDING * min(width, spacing), end - begin, 0.0)


# Kept because a raster checks its numbers, and one image asks for its pixels six times.
@lru_cache(maxsize=64)
def sensor_raster(
    scene: Raster, pitch: float, offset: tuple[float, float], shape: tuple[int, int] | None
) -> Raster:
    """Return the raster of the pixels; all whole pixels that fit by default."""
    left, right, bottom, top = scene.extent
    room = (top - bottom - offset[1], right - left - offset[0])
    rows, columns = (int(length / pitch + _ROUNDING) for length in room)
    if shape is None and rows * columns > _FEW_PIXELS:
        overlaps = float(rows) * scene.rows + float(columns) * scene.columns
        check_memory(
            f"camera.pitch: {LENGTH.text(pitch)} makes {float(rows) * columns:.2g} pixels and",
            _BYTES_A_PIXEL * rows * columns + _BYTES_AN_OVERLAP * overlaps,
        )
    if min(offset) < 0 or min(rows, columns) < 1:
        raise ValueError(
            f"camera: pitch of {1e6 * pitch:g} um at an offset of {1e6 * offset[0]:g}, "
            f"{1e6 * offset[1]:g} um does not fit the scene of {1e6 * (right - left):g} x "
            f"{1e6 * (top - bottom):g} um"
        )
    if shape is not None and (shape[0] > rows or shape[1] > columns):
        raise ValueError(
            f"camera: shape is {shape[0]} x {shape[1]} pixels, but only {rows} x {columns} pixels "
            f"of {1e6 * pitch:g} um fit the scene of {1e6 * (right - left):g} x "
            f"{1e6 * (top - bottom):g} um"
        )
    rows, columns = shape or (rows, columns)
    return Raster(left + offset[0], top - offset[1], pitch, rows, columns)


def whole_raster(scene: Raster, sensors: Raster) -> tuple[Raster, tuple[slice, slice]]:
    """Extend a raster to all whole pixels that fit a scene; also return its slices in them."""
    pitch = sensors.spacing
    down, right = scene.top - sensors.top, sensors.left - scene.left
    above, before = (int(length / pitch + _ROUNDING) for length in (down, right))
    corner = max(right - before * pitch, 0.0), max(down - above * pitch, 0.0)
    own = slice(above, above + sensors.rows), slice(before, before + sensors.columns)
    return sensor_raster(scene, pitch, corner, None), own


def integrate(radiance: Array, scene: Raster, sensors: Raster, fill_factor: float) -> Array:
    """Return the mean radiance over each pixel's sensitive square, shape `sensors.shape`."""
    down, across = line_weights(scene, sensors, fill_factor)
    # Sparse products do not depend on the number of threads.
    return np.asarray((across @ (down @ radiance).T).T)


def largest(
    values: NDArray[np.floating], scene: Raster, sensors: Raster, fill_factor: float
) -> Array:
    """Return the largest value of the samples in every pixel's sensitive square; NaN for none."""
    known = np.where(np.isnan(values), values.dtype.type(-np.inf), values)
    rows, columns = _samples_under(scene, sensors, fill_factor)
    down = np.stack([known[part].max(axis=0) for part in rows])
    maximum = np.stack([down[:, part].max(axis=1) for part in columns], axis=1)
    return np.where(np.isfinite(maximum), maximum, np.nan).astype(np.float64)


@lru_cache(maxsize=256)  # as `line_weights`
def _samples_under(
    scene: Raster, sensors: Raster, fill_factor: float
) -> tuple[list[slice], list[slice]]:
    """Return the samples under the pixels, down and across."""
    side = sensors.spacing * sqrt(fill_factor)
    down = _covered(scene.top - sensors.y, side, scene.rows, scene.spacing)
    return down, _covered(sensors.x - scene.left, side, scene.columns, scene.spacing)


def _covered(centres: Array, side: float, samples: int, spacing: float) -> list[slice]:
    """Return the samples under each pixel along a line, without slivers."""
    least = LEAST_COVERED * min(spacing, side)
    covered = overlap_lengths(centres - side / 2, side, samples, spacing) > least
    first = covered.argmax(axis=1)
    return [slice(i, i + n) for i, n in zip(first, covered.sum(axis=1), strict=True)]


@lru_cache(maxsize=256)  # an analysis returns to each of its pixel phases many times
def line_weights(
    scene: Raster, sensors: Raster, fill_factor: float
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the weights of samples in pixels down and across; each row has sum 1."""
    side = sensors.spacing * sqrt(fill_factor)

    def along(begin: float, samples: int, count: int) -> sparse.csr_array:
        first = begin + (sensors.spacing - side) / 2
        left = first + sensors.spacing * np.arange(count, dtype=np.float64)
        lengths = overlap_lengths(left, side, samples, scene.spacing)
        return sparse.csr_array(lengths / lengths.sum(axis=1, keepdims=True))

    down = along(scene.top - sensors.top, scene.rows, sensors.rows)
    return down, along(sensors.left - scene.left, scene.columns, sensors.columns)
