"""Fields on regular grids over time: Zarr, NetCDF, HDF5, NumPy, MATLAB, TIFF and CSV."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import OTHER_NAMES, NamedSource, simple, unit_in_name, unit_of
from chipglow.io.sources.grids.arrays import ARRAY_READERS, open_arrays
from chipglow.io.sources.grids.file_array import FileArray
from chipglow.io.sources.grids.layout import (
    AXES,
    COORDINATES,
    ROW_0,
    ArrayNumbers,
    ascends,
    axes_of,
    coordinate,
    even_positions,
    find_fields,
    is_reversed,
    may_be_field,
    read_frames,
    read_list,
    scaled,
    with_lists,
    without,
)
from chipglow.io.sources.plausible import check_sides, check_tenths
from chipglow.io.sources.source import (
    SourceError,
    Survey,
    check_times,
    even_times,
    extent_of,
    span_of,
)
from chipglow.quantities import FileBeside, Parameter
from chipglow.quantities.units import LENGTH, POSITION, SI, Unit
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.scene.regrid import regrid, taps
from chipglow.text import Notes

_KNOWN: Final = (*READABLE, "material")
_LARGEST_BLOCK: Final = 64_000_000
"""Maximum samples of several frames that are read together, if the file keeps them together."""


@dataclass(frozen=True)
class GridSource(ArrayNumbers, NamedSource):
    """Fields on a regular grid over time.

    ``names`` maps names in a scene to names in the file; also of ``material``
    (0 void, 1 workpiece, 2 tool), ``time``, ``x`` and ``y``; those not named are guessed. An
    ``interval`` in s replaces times in the file, and ``units`` that are not SI those that a file
    states.
    """

    title: ClassVar[str] = "a grid"
    endings: ClassVar[tuple[str, ...]] = tuple(ARRAY_READERS)
    files: Annotated[
        FileBeside | dict[str, FileBeside] | None,
        Parameter(
            "Files by the names of fields, instead of source.",
            allowed="none, or {temperature: T.npy, plastic_strain: strain.npy}",
        ),
    ] = None
    top_first: Annotated[
        bool, Parameter("Whether row 0 is the top one, without a coordinate y.")
    ] = True
    spacing: Annotated[
        float | None,
        Parameter("Distance of the columns; none: as the file says.", LENGTH, over=0.0),
    ] = None
    row_spacing: Annotated[
        float | None,
        Parameter("Distance of the rows, with spacing; none: the same.", LENGTH, over=0.0),
    ] = None
    left: Annotated[float, Parameter("Left edge of the grid, with spacing.", POSITION)] = 0.0
    top: Annotated[float, Parameter("Upper edge of the grid, with spacing.", POSITION)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        unknown = sorted(set(self.files) - set(_KNOWN)) if isinstance(self.files, dict) else []
        if unknown:
            raise ValueError(
                f"files: unknown field {unknown[0]!r}, expected one of {', '.join(_KNOWN)}"
            )
        if self.placement.depth != 2:
            raise ValueError("placement: a grid has the axes x and y, expected no z")

    @property
    def own_files(self) -> Any:
        return self.files

    def survey(self) -> Survey:
        with ExitStack() as stack:
            grid = _Grid(self, stack)
            return Survey(
                kind=grid.kind,
                times=grid.times,
                extent=extent_of(grid.x, grid.y),
                found={name: layer.array.name for name, layer in grid.layers.items()},
                unused=grid.unused,
                spacing=min(abs(float(np.ptp(one)) / (one.size - 1)) for one in (grid.x, grid.y)),
                temperatures=grid.check_ends(),
                notes=sum((layer.array.notes for layer in grid.layers.values()), grid.notes),
            )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        with ExitStack() as stack:
            grid = _Grid(self, stack)
            across = taps(grid.x, raster.spacing, raster.x)
            down = taps(-grid.y, raster.spacing, -raster.y)
            for index in range(start, len(grid.times)):
                values, material = regrid(*grid.read(index), across, down)
                fields = dict(zip(grid.layers, values, strict=True))
                yield SampledFrame(float(grid.times[index]), fields, material)


class _Layer:
    """Field of a grid."""

    def __init__(self, array: FileArray, axes: tuple[str, ...], unit: Unit) -> None:
        self.array, self.axes, self.unit = array, axes, unit
        self.shape = tuple(array.shape[axes.index(axis)] if axis in axes else 1 for axis in AXES)
        """Number of samples along `AXES`."""
        self.dims = dict(zip(axes, array.dims, strict=False))
        """Names of the axes in the file, if it states them."""
        samples = self.shape[1] * self.shape[2]
        check_sides(array, *self.shape[1:])
        if self.shape[0] < 1:
            raise SourceError(f"{array}: has no frame")
        self._first, self._block = 0, np.empty((0, 0, 0), np.float32)
        together = array.chunks[axes.index("time")] if array.chunks and "time" in axes else 1
        self._together = max(1, min(together, _LARGEST_BLOCK // samples))

    def read(self, index: int) -> NDArray[np.float32]:
        """Return numbers of a frame as they are in the file, shape (y, x), NaN if missing."""
        if not self._first <= index < self._first + len(self._block):
            self._first = index - index % self._together
            last = min(self._first + self._together, self.shape[0])
            frames = read_frames(self.array, self.axes, slice(self._first, last))
            self._block = np.asarray(frames, np.float32)
        return np.asarray(self._block[index - self._first])


class _Grid:
    """Open source."""

    def __init__(self, source: GridSource, stack: ExitStack) -> None:
        self._source, self.notes = source, Notes()
        files = source.files
        paths = tuple(files.values()) if isinstance(files, dict) else (str(files),)
        self._files = {path: list(with_lists(open_arrays(path, stack)).values()) for path in paths}
        self._arrays = [array for arrays in self._files.values() for array in arrays]
        layers = {name: self._layer(name, array) for name, array in self._choose().items()}
        used = {layer.array.name for layer in layers.values()} | set(source.names.values())
        self._first = first = next(iter(layers.values()))
        for layer in layers.values():
            if layer.shape != first.shape:
                raise SourceError(
                    f"{layer.array}: has {list(layer.shape)} samples along {', '.join(AXES)}, "
                    f"expected {list(first.shape)} as {first.array}"
                )
        self._material = layers.pop("material", None)
        if not layers:
            raise SourceError(f"{first.array}: is a material, expected a temperature too")
        self.layers = {source.placement.in_file(name): layer for name, layer in layers.items()}
        placed = source.placement.grid(self._positions("x"), self._positions("y"))
        self.x, self.y, self._turned = placed
        self.times = self._find_times()
        _, rows, columns = first.shape
        self.kind = f"grid of {rows} x {columns} samples, {', '.join(self._files)}"
        axes = {name for axis in COORDINATES for name in OTHER_NAMES[axis]}
        others = (one for one in self._arrays if simple(one.short) not in axes)
        self.unused = tuple(one.name for one in others if one.name not in used)
        """Arrays that are neither field nor coordinate."""

    def _layer(self, name: str, array: FileArray) -> _Layer:
        self.notes += array.notes
        source = self._source
        axes = axes_of(array, source.axes, self.notes, self._arrays)
        unit = SI
        if name != "material":
            text = unit_in_name(array.short, name) if array.unit is None else array.unit
            unit = unit_of(name, str(array), text, source.units.unit_given(name), self.notes)
        if name == "temperature":
            unit = scaled(unit, source.scale, source.offset)
        return _Layer(array, axes, unit)

    def _choose(self) -> dict[str, FileArray]:
        """Return the array of every field."""
        source = self._source
        given = {name: label for name, label in source.names.items() if name not in COORDINATES}
        if not isinstance(source.files, dict):
            return find_fields(self._candidates(str(source.files)), given, _KNOWN, self.notes)
        chosen: dict[str, FileArray] = {}
        for name, path in source.files.items():
            candidates = self._candidates(path)
            own = {name: given[name]} if name in given else {}
            if len(candidates) == 1 and not own:
                own = {name: next(iter(candidates))}
            chosen |= find_fields(candidates, own, (name,), self.notes)
        return chosen

    def _candidates(self, path: str) -> dict[str, FileArray]:
        """Return the arrays of a file that may be a field, by their number of axes."""
        every, named = self._files[path], self._source.names.values()
        arrays = [one for one in every if may_be_field(one, every) or one.name in named]
        solid = any(len(array.shape) == 3 for array in arrays)
        number = len(self._source.axes or (AXES if solid else AXES[1:]))
        result = {
            array.name: array
            for array in arrays
            if len(array.shape) == number and (number == 3 or min(array.shape) != 1)
        }
        if not result:
            shapes = ", ".join(f"{array.name} {array.shape}" for array in arrays[:10])
            raise SourceError(f"{path}: expected an array with {number} axes, it has {shapes}")
        return result

    def _coordinate(self, axis: str) -> FileArray | None:
        source = self._source
        own = source.units.time if axis == "time" else source.units.length
        count = self._first.shape[AXES.index(axis)]
        dim = self._first.dims.get(axis, "")
        given = source.names.get(axis)
        return coordinate(axis, self._arrays, count, dim, self.notes, given, own)

    def _positions(self, axis: str) -> NDArray[np.float64]:
        """Return the centres of the columns or rows in m, in the order of the file."""
        source, array = self._source, self._coordinate(axis)
        if source.spacing is None:
            if array is None:
                raise SourceError(
                    f"{self._first.array.path}: has no coordinate {axis!r}, expected grid.spacing"
                )
            return even_positions(axis, array, source.units.length, self.notes)
        is_ascending = axis == "x" or not source.top_first
        if array is not None:
            is_ascending = ascends(array)
            self.notes.remarks.append(
                f"The spacing is given; the coordinate {axis} determines only the direction."
            )
        elif is_reversed(axis, self._first.array, self.notes):
            is_ascending = axis == "y"
        elif axis == "y":
            self.notes.assumed.append(ROW_0.format("upper" if source.top_first else "lower"))
        number = np.arange(self._first.shape[AXES.index(axis)], dtype=np.float64) + 0.5
        if axis == "x":
            return source.left + source.spacing * (number if is_ascending else number[::-1])
        down = source.row_spacing or source.spacing
        return source.top - down * (number[::-1] if is_ascending else number)

    def _find_times(self) -> NDArray[np.float64]:
        source = self._source
        array = self._coordinate("time") if source.interval is None else None
        if array is None:
            return even_times(self._first.shape[0], source.interval, self.notes)
        return check_times(str(array), read_list("time", array, source.units.time, self.notes))

    def check_ends(self) -> tuple[float, float] | None:
        """Return the range of temperature of the first and the last frame, or of one with any."""
        last = len(self.times) - 1
        found: list[float] = []
        for index in dict.fromkeys((0, last, *range(last))):
            if index not in (0, last) and (found or "temperature" not in self.layers):
                break
            values, material = self.read(index)
            if "temperature" in self.layers:
                heat = values[list(self.layers).index("temperature")][material != Material.VOID]
                if (layer := self.layers["temperature"]).unit == SI and self._source.scale is None:
                    check_tenths(str(layer.array), heat)
                found += [value for value in span_of(heat) if isfinite(value)]
        return span_of(found) if "temperature" in self.layers else None

    def read(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return fields in SI, shape (fields, y, x), and material of a frame in the scene."""
        raw = {name: layer.read(index) for name, layer in self.layers.items()}
        material = np.full(self._first.shape[1:], Material.WORKPIECE, np.uint8)
        if self._material is not None:
            material = self._read_material(self._material, index)
        material = np.where(self._void(raw), np.uint8(Material.VOID), material)
        values = np.stack([self._in_scene(name, raw[name]) for name in raw])
        return self._turned(values), self._turned(material)

    def _void(self, raw: Mapping[str, NDArray[np.float32]]) -> NDArray[np.bool_]:
        """Return where the temperature, or else the first field, has no number."""
        name = "temperature" if "temperature" in raw else next(iter(raw))
        if np.isinf(raw[name]).any():
            raise SourceError(
                f"{self.layers[name].array}: has infinite numbers, expected finite ones or NaN"
            )
        return np.asarray(np.isnan(without(raw[name], self._source.void_value)))

    def _read_material(self, layer: _Layer, index: int) -> NDArray[np.uint8]:
        kinds = np.nan_to_num(layer.read(index), nan=float(Material.VOID))
        wrong = ~np.isin(kinds, [float(kind) for kind in Material])
        if wrong.any():
            raise SourceError(
                f"{layer.array}: material is {kinds[wrong][0]:g} in frame {index}, "
                "expected 0 (void), 1 (workpiece) or 2 (tool)"
            )
        return np.asarray(kinds, np.uint8)

    def _in_scene(self, name: str, raw: NDArray[np.float32]) -> NDArray[np.float32]:
        converted = self.layers[name].unit.to_si(raw)
        values = np.asarray(self._source.placement.field(name, converted), np.float32)
        values[~np.isfinite(values)] = np.nan
        return values
