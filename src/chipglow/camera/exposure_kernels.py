"""Sums over the sub-frames of an exposure.

The outer loop runs over blocks of rows, the inner one over time, so that the sums of a block stay
in the processor's cache. Blocks are distributed among threads (`in_blocks`); the sums do not depend
on the number of threads.
"""

# Kernels are untyped: Numba infers their types.
# mypy: allow-untyped-defs

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.quantities.units import COLDEST
from chipglow.scene import Frame, Material
from chipglow.scene.kernels import INNER
from chipglow.scene.splines import FILLED_SPLINE, SPLINE_FIELDS, TOOL_SPLINE, SplineFrame, spread
from chipglow.surface import EmissivityStack, Features
from chipglow.surface.blend import SCRATCH, blend_row, in_blocks

STEPS_PER_KELVIN: Final = 32.0
"""Values per kelvin of the radiance table, which is interpolated linearly."""

BATCH: Final = 8
"""Number of frames summed in one pass if their samples are in memory."""

_VOID, _WORKPIECE, _TOOL = int(Material.VOID), int(Material.WORKPIECE), int(Material.TOOL)
_STRAIN, _RATE, _X, _Y = (
    SPLINE_FIELDS.index(name)
    for name in ("plastic_strain", "plastic_strain_rate", "material_x", "material_y")
)

_MEAN: Final = 3
"""Position of the mean in the tuple that `Sums` passes to the kernels."""

_VIEWS: Final = 10
"""Position of the views in this tuple."""

Indices: TypeAlias = NDArray[np.intp]
Check: TypeAlias = Callable[[], None]
"""Called periodically during an exposure; an exception that it raises aborts the exposure."""

_FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}
_INNER: Final = {**_FAST, **INNER}


class Sums:
    """Sums over the sub-frames; see `Exposure`.

    `mean`, `centre` and `peak` of the radiance have the shape (view, y, x). Of the temperature,
    with the shape (y, x), there are the maximum `hottest`, the mean `heat` in which samples without
    material count as 0 K, the fraction `present` of the exposure with material, and `middle`.

    `views` are indices of surface and band, (view, 2); `tables` each band's radiance and its change
    to the next value, (band, n, 2); `environments` the radiance of each view's surroundings.
    """

    def __init__(
        self,
        views: NDArray[np.int64],
        tables: NDArray[np.float32],
        environments: NDArray[np.float32],
        max_emissivity: float,
        shape: tuple[int, int],
        check: Check | None,
    ) -> None:
        self.mean, self.centre = (np.zeros((len(views), *shape)) for _ in range(2))
        self.peak = np.zeros(self.mean.shape, np.float32)
        self.hottest, self.middle = (np.zeros(shape, np.float32) for _ in range(2))
        self.heat, self.present = (np.zeros(shape) for _ in range(2))
        temperatures = self.hottest, self.heat, self.present, self.middle
        sums = self.mean, self.centre, self.peak, *temperatures
        self._sums = tables, environments, np.float32(max_emissivity), *sums, views
        self._check = check

    def add_given(
        self, frames: Sequence[Frame], stack: EmissivityStack, weights: Array, middles: Indices
    ) -> None:
        """Add up to `BATCH` frames.

        `weights` (row, frame) are fractions of each row's exposure; `middles` (row,) is the index
        of the frame in the middle of each row's exposure, if it is in the batch.
        """
        temperature, material = (_batch(frames, name) for name in ("temperature", "material"))
        emissivities = [stack.emissivities(frame) for frame in frames]
        given = _filled([np.ascontiguousarray(e, np.float32) for e in emissivities])
        self._add(_add_given, temperature, material, given, weights, middles)

    def add_features(
        self, frames: Sequence[Frame], stack: Features, weights: Array, middles: Indices
    ) -> None:
        """Add frames like `add_given`, but compute emissivities row by row."""
        temperature, material, strain, rate = (
            _batch(frames, name)
            for name in ("temperature", "material", "plastic_strain", "plastic_strain_rate")
        )
        positions = [stack.positions(frame) for frame in frames]
        x, y = (_filled([np.ascontiguousarray(p[k]) for p in positions]) for k in (0, 1))
        fields = (temperature, material, strain, rate, x, y)
        shifts = np.stack([stack.shift(frame.time) for frame in frames])
        self._add(_add_features, fields, shifts, tuple(stack.textures), weights, middles)

    def add_splines(
        self, frames: Sequence[SplineFrame], stack: Features, weights: Array, middles: Indices
    ) -> None:
        """Add any number of spline frames on one lattice; samples are computed row by row."""
        lattice = frames[0].lattice
        nodes = np.stack([frame.nodes for frame in frames])
        limits = np.stack([frame.limits for frame in frames])
        # Without fixed positions, textures are interpolated at the material coordinates.
        fixed = stack.fixed_positions or (np.empty((0, 0), np.float32),) * 2
        grid = (*lattice.down, *lattice.across, lattice.in_tool)
        shifts, textures = np.stack([stack.shift(frame.time) for frame in frames]), stack.textures
        self._add(
            _add_splines, nodes, limits, grid, fixed, shifts, tuple(textures), weights, middles
        )

    def _add(self, kernel: Callable[..., None], *arguments: Any) -> None:
        def add(first: int, last: int) -> None:
            if self._check is not None:
                self._check()
            kernel(*arguments, first, last, self._sums)

        in_blocks(len(self.hottest), add)


def _filled(arrays: list[NDArray[Any]]) -> tuple[NDArray[Any], ...]:
    """Return `BATCH` arrays, the number that kernels are compiled for; the last ones are unused.

    Kernels are compiled for read-only arrays alone: they would be again for those of a memory map.
    """
    views = [array.view() for array in arrays]
    for view in views:
        view.flags.writeable = False
    return tuple((views + [views[-1]] * BATCH)[:BATCH])


def _batch(frames: Sequence[Frame], name: str) -> tuple[NDArray[Any], ...]:
    values = [getattr(frame, name) for frame in frames]
    if values[0] is None:
        values = [np.zeros(frames[0].material.shape, np.float32)] * len(frames)
    return _filled([np.ascontiguousarray(one) for one in values])


@njit(**_INNER)
def _find(temperature, last, number, past):
    """Compute the table index below each temperature, and the remaining fraction or NaN."""
    for i in range(temperature.size):
        position = (temperature[i] - np.float32(COLDEST)) * np.float32(STEPS_PER_KELVIN)
        inside = min(max(position, np.float32(0.0)), np.float32(last))
        # A non-finite value can become any integer.
        number[i] = min(max(np.int32(inside), np.int32(0)), np.int32(last - 1))
        off = position - inside
        past[i] = inside - np.float32(number[i]) if off == np.float32(0.0) else np.float32(np.nan)


@njit(**_INNER)
def _look_up(table, number, past, black):
    for i in range(black.size):
        k = np.uint32(number[i])
        black[i] = table[k, 0] + past[i] * table[k, 1]


@njit(**_INNER)
def _add_temperature(temperature, kind, weight, hottest, heat, present):
    for i in range(hottest.size):
        is_material = kind[i] != _VOID
        there = temperature[i] if is_material else np.float32(0.0)
        hottest[i] = max(hottest[i], there)
        heat[i] += weight * np.float64(there)
        present[i] += weight * is_material


@njit(**_INNER)
def _apparent(emissivity, black, kind, environment, max_emissivity, apparent):
    for i in range(apparent.size):
        e = emissivity[i]
        radiance = environment + e * (black[i] - environment)
        radiance = radiance if (e >= 0.0) & (e <= max_emissivity) else np.float32(np.nan)
        apparent[i] = radiance if kind[i] != _VOID else np.float32(0.0)


@njit(**_INNER)
def _sum(apparent, weight, mean):
    for i in range(mean.size):
        mean[i] += weight * np.float64(apparent[i])


@njit(**_INNER)
def _raise_peak(apparent, peak):
    for i in range(peak.size):
        peak[i] = max(peak[i], apparent[i])


@njit(**_INNER)
def _copy(source, target):
    """Copy without a check of shapes, which takes longer to compile than all else here."""
    for i in range(target.size):
        target[i] = source[i]


@njit(**_INNER)
def _add_row(temperature, kind, emissivity, weight, is_middle, row, work, number, sums):
    """Add row `row` of a sub-frame, with the emissivities (surface, x), to the sums."""
    (
        tables, environments, max_emissivity, mean, centre, peak, hottest, heat, present, middle,
        views,
    ) = sums  # fmt: skip
    past, black, apparent = work[0], work[1], work[2]
    _find(temperature, tables.shape[1] - 1, number, past)
    _add_temperature(temperature, kind, weight, hottest[row], heat[row], present[row])
    if is_middle:
        for i in range(kind.size):
            middle[row, i] = temperature[i] if kind[i] != _VOID else np.float32(0.0)
    current = -1
    for n in range(views.shape[0]):
        surface, band = views[n]
        if band != current:
            _look_up(tables[band], number, past, black)
            current = band
        _apparent(emissivity[surface], black, kind, environments[n], max_emissivity, apparent)
        _sum(apparent, weight, mean[n, row])
        _raise_peak(apparent, peak[n, row])
        if is_middle:
            _copy(apparent, centre[n, row])


@njit(cache=True, **_FAST)
def _add_given(temperature, material, emissivities, weights, middles, first, last, sums):
    columns = sums[_MEAN].shape[2]
    work = np.empty((3, columns), np.float32)
    number = np.empty(columns, np.int32)
    for row in range(first, last):
        for k in range(weights.shape[1]):
            if weights[row, k] == 0.0:
                continue
            _add_row(
                temperature[k][row], material[k][row], emissivities[k][:, row], weights[row, k],
                k == middles[row], row, work, number, sums,
            )  # fmt: skip


@njit(cache=True, **_FAST)
def _add_features(fields, shifts, textures, weights, middles, first, last, sums):
    temperature, material, strain, rate, x, y = fields
    surfaces, columns = sums[_VIEWS][:, 0].max() + 1, sums[_MEAN].shape[2]
    scratch = np.zeros((SCRATCH + textures[1].shape[1], columns), np.float32)
    corner = np.empty(columns, np.int32)
    emissivity = np.empty((surfaces, columns), np.float32)
    work = np.empty((3, columns), np.float32)
    number = np.empty(columns, np.int32)
    for row in range(first, last):
        for k in range(weights.shape[1]):
            if weights[row, k] == 0.0:
                continue
            blend_row(
                material[k][row], strain[k][row], rate[k][row], x[k][row], y[k][row], shifts[k],
                textures, row, scratch, corner, emissivity,
            )  # fmt: skip
            _add_row(
                temperature[k][row], material[k][row], emissivity, weights[row, k],
                k == middles[row], row, work, number, sums,
            )  # fmt: skip


@njit(**_INNER)
def _combine(wide, base, u, v, w, result):
    upper, middle, lower = wide[base], wide[base + 1], wide[base + 2]
    for i in range(result.size):
        result[i] = u * upper[i] + v * middle[i] + w * lower[i]


@njit(**_INNER)
def _classify(filled, in_tool, kind):
    for i in range(kind.size):
        outside = np.uint8(_WORKPIECE) if filled[i] > np.float32(0.5) else np.uint8(_VOID)
        kind[i] = np.uint8(_TOOL) if in_tool[i] else outside


@njit(**_INNER)
def _limit(values, lower, upper):
    for i in range(values.size):
        values[i] = min(max(values[i], lower), upper)


@njit(**_INNER)
def _set_tool(tool, kind, temperature):
    for i in range(kind.size):
        temperature[i] = tool[i] if kind[i] == _TOOL else temperature[i]


@njit(cache=True, **_FAST)
def _add_splines(nodes, limits, grid, fixed, shifts, textures, weights, middles, first, last, sums):
    first_down, down, first_across, across, in_tool = grid
    surfaces, columns = sums[_VIEWS][:, 0].max() + 1, sums[_MEAN].shape[2]
    scratch = np.zeros((SCRATCH + textures[1].shape[1], columns), np.float32)
    corner = np.empty(columns, np.int32)
    emissivity = np.empty((surfaces, columns), np.float32)
    work = np.empty((3, columns), np.float32)
    number = np.empty(columns, np.int32)
    top = first_down[first]
    count = first_down[last - 1] + 3 - top
    wide = np.empty((nodes.shape[1], count, columns), np.float32)
    values = np.zeros((nodes.shape[1], columns), np.float32)
    kind = np.empty(columns, np.uint8)
    for k in range(weights.shape[1]):
        if not weights[first:last, k].any():
            continue
        for f in (0, _STRAIN, _RATE, _X, _Y, FILLED_SPLINE, TOOL_SPLINE):
            for j in range(count):
                spread(nodes[k, f, top + j], first_across, across, 0, columns, wide[f, j])
        for row in range(first, last):
            if weights[row, k] == 0.0:
                continue
            base = first_down[row] - top
            u, v, w = down[0, row], down[1, row], down[2, row]
            _combine(wide[FILLED_SPLINE], base, u, v, w, values[FILLED_SPLINE])
            _classify(values[FILLED_SPLINE], in_tool[row], kind)
            for f in (0, _STRAIN, _RATE, _X, _Y):
                _combine(wide[f], base, u, v, w, values[f])
                _limit(values[f], limits[k, f, 0], limits[k, f, 1])
            if in_tool[row].any():
                _combine(wide[TOOL_SPLINE], base, u, v, w, values[TOOL_SPLINE])
                _set_tool(values[TOOL_SPLINE], kind, values[0])
            if fixed[0].size > 0:
                _copy(fixed[0][row], values[_X])
                _copy(fixed[1][row], values[_Y])
            blend_row(
                kind, values[_STRAIN], values[_RATE], values[_X], values[_Y], shifts[k],
                textures, row, scratch, corner, emissivity,
            )  # fmt: skip
            _add_row(
                values[0], kind, emissivity, weights[row, k], k == middles[row], row, work, number,
                sums,
            )  # fmt: skip
