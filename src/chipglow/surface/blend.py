"""Emissivity of a row of samples from the features that it shows; for kernels.

Each step is a loop over the row without branches, which becomes vector instructions. Of the
textures, whose nodes lie scattered, the four by four about a sample are vectors instead.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, Final, NamedTuple

import numpy as np
from numba import get_num_threads, njit
from numpy.typing import NDArray

from chipglow.scene import Material
from chipglow.scene.kernels import INNER
from chipglow.surface.texture import PADDED_SIZE, WRAP, emissivity_at, patch

STRAIN_OF_WORKPIECE: Final = 0.3
"""Plastic strain up to which the workpiece's map holds alone."""
STRAIN_OF_CHIP: Final = 0.5
"""Plastic strain from which the chip's map holds alone."""
RATE_OF_CHIP: Final = 6_000.0
"""Plastic strain rate in 1/s up to which the shear band's map has no fraction."""
RATE_OF_SHEAR_BAND: Final = 30_000.0
"""Plastic strain rate in 1/s from which the shear band's map holds alone."""

SCRATCH: Final = 5
"""Rows of float32 that `blend_row` works on, before those of the seeds."""

_WORKPIECE, _TOOL = int(Material.WORKPIECE), int(Material.TOOL)
_FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, **INNER}


class Textures(NamedTuple):
    """Textures of several surfaces with the same motion, for `blend_row`."""

    scale: np.float32
    """Nodes per m."""
    maps: NDArray[np.float32]
    """`padded` deviates of workpiece, chip and shear band, shape (feature, seed, nodes)."""
    seed_numbers: NDArray[np.int64]
    """Index of each surface's seed."""
    linear: NDArray[np.float32]
    """Mean and standard deviation, shape (surface, feature, 2); NaN where the table holds."""
    tables: NDArray[np.float32]
    """Emissivity by deviate, shape (surface, feature, entry)."""
    tool_maps: NDArray[np.float32]
    """Emissivity of the tool, shape (surface, y, x)."""


@njit(forceinline=True, **_FAST)
def fraction_between(value, none, full):  # type: ignore[no-untyped-def]
    """Return how far a value has come from `none` to `full`, 0 to 1."""
    result = (value - np.float32(none)) * np.float32(1.0 / (full - none))
    return min(max(result, np.float32(0.0)), np.float32(1.0))


@njit(**_FAST)
def _place(x, y, shift, scale, corner, across, down):  # type: ignore[no-untyped-def]
    """Corner of the four by four nodes about each sample, and how far it is past the second."""
    for i in range(corner.size):
        u, v = (x[i] - shift[0]) * scale, (y[i] - shift[1]) * scale
        before, above = np.floor(u), np.floor(v)
        across[i], down[i] = u - before, v - above
        corner[i] = (np.int32(above) & WRAP) * np.int32(PADDED_SIZE) + (np.int32(before) & WRAP)


@njit(**_FAST)
def _deviates(nodes, corner, across, down, fractions, deviates):  # type: ignore[no-untyped-def]
    """Deviate of the enlarged map wherever the feature has a fraction."""
    for i in range(corner.size):
        if fractions[i] > np.float32(0.0):
            deviates[i] = patch(nodes, np.int64(corner[i]), across[i], down[i])


@njit(**_FAST)
def _divide(kind, strain, rate, workpiece, chip, band):  # type: ignore[no-untyped-def]
    for i in range(kind.size):
        there = np.float32(1.0) if kind[i] == _WORKPIECE else np.float32(0.0)
        formed = fraction_between(strain[i], STRAIN_OF_WORKPIECE, STRAIN_OF_CHIP)
        sheared = fraction_between(rate[i], RATE_OF_CHIP, RATE_OF_SHEAR_BAND) * there
        rest = there - sheared
        workpiece[i], chip[i], band[i] = rest - rest * formed, rest * formed, sheared


@njit(**_FAST)
def _positive(values):  # type: ignore[no-untyped-def]
    count = 0
    for i in range(values.size):
        count += values[i] > np.float32(0.0)
    return count


@njit(**_FAST)
def _tool_emissivity(kind, tool_map, result):  # type: ignore[no-untyped-def]
    for i in range(kind.size):
        result[i] = tool_map[i] if kind[i] == _TOOL else np.float32(0.0)


@njit(**_FAST)
def _add_linear(fractions, deviates, mean, deviation, result):  # type: ignore[no-untyped-def]
    for i in range(result.size):
        value = min(max(mean + deviation * deviates[i], np.float32(0.0)), np.float32(1.0))
        result[i] += fractions[i] * value


@njit(**_FAST)
def _add_tabled(fractions, deviates, table, result):  # type: ignore[no-untyped-def]
    for i in range(result.size):
        if fractions[i] > np.float32(0.0):
            result[i] += fractions[i] * emissivity_at(deviates[i], table)


@njit(**_FAST)
def blend_row(  # type: ignore[no-untyped-def]
    kind, strain, rate, x, y, shifts, textures, row, scratch, corner, result
):
    """Emissivity of one row for every surface: fractions of the features times their textures.

    The fields belong to row `row` of the samples; `textures` are `Textures`, `shifts` of shape
    (feature, 2), and `scratch` has `SCRATCH` rows and one for each seed, of finite numbers.
    """
    scale, maps, seed_numbers, linear, tables, tool_maps = textures
    _divide(kind, strain, rate, scratch[0], scratch[1], scratch[2])
    for n in range(result.shape[0]):
        _tool_emissivity(kind, tool_maps[n, row], result[n])
    across, down, found = scratch[3], scratch[4], -1
    for k in range(3):
        if _positive(scratch[k]) == 0:
            continue
        if found < 0 or shifts[k, 0] != shifts[found, 0] or shifts[k, 1] != shifts[found, 1]:
            _place(x, y, shifts[k], scale, corner, across, down)
            found = k
        for seed in range(maps.shape[1]):
            deviates = scratch[SCRATCH + seed]
            _deviates(maps[k, seed], corner, across, down, scratch[k], deviates)
        for n in range(result.shape[0]):
            deviates = scratch[SCRATCH + seed_numbers[n]]
            mean, deviation = linear[n, k, 0], linear[n, k, 1]
            if deviation == deviation:
                _add_linear(scratch[k], deviates, mean, deviation, result[n])
            else:
                _add_tabled(scratch[k], deviates, tables[n, k], result[n])


_BLOCK_ROWS: Final = 16
"""Rows of a block if several threads share the work."""


def in_blocks(count: int, work: Callable[[int, int], None], size: int | None = None) -> None:
    """Work on rows (or columns) from a first up to a last number, a block in each call.

    A block has `size` rows; by default `_BLOCK_ROWS`, or all with one thread.
    """
    size = size or (count if get_num_threads() == 1 else _BLOCK_ROWS)
    blocks = [(first, min(first + size, count)) for first in range(0, count, size)]
    if get_num_threads() == 1 or len(blocks) == 1:
        for first, last in blocks:
            work(first, last)
        return
    with ThreadPoolExecutor(get_num_threads()) as pool:
        list(pool.map(work, *zip(*blocks, strict=True)))
