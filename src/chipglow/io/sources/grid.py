"""Fields on regular grids over time: Zarr, NetCDF, HDF5, NumPy, MATLAB, TIFF and CSV."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from math import isfinite, prod
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import (
    ARRAY_READERS,
    MOST_ON_A_SIDE,
    StoredArray,
    check_samples,
    open_arrays,
)
from chipglow.io.sources.conventions import Placement, Units
from chipglow.io.sources.layout import (
    AXES,
    COORDINATES,
    Chosen,
    axes_of,
    check_even,
    check_times,
    coordinate,
    find_fields,
    read_frames,
    read_list,
    unit_of,
    unused_names,
)
from chipglow.io.sources.source import (
    Source,
    SourceError,
    Survey,
    even_times,
    span_of,
)
from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.units import LENGTH, POSITION, SI, Unit
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.scene.regrid import regrid, taps
from chipglow.text import Notes

Arrays = Mapping[str, StoredArray]

_KNOWN: Final = (*READABLE, "material")
_BLOCK: Final = 64_000_000
"""Most samples of several frames that are read together, if the file keeps them together."""


@dataclass(frozen=True)
class GridSource(Source, Part):
    """Fields on a regular grid over time.

    Parameters
    ----------
    names : mapping
        Name that a field has in its file, by its name in a scene; also of ``material`` (0 void,
        1 workpiece, 2 tool), ``time``, ``x`` and ``y``. Those not named are guessed.
    interval : float, optional
        Time between frames in s; comes before times in the file.
    units : Units
        Units of what is in the files; where one is not SI, it comes before what a file says.
    placement : Placement
        How the grid lies in the scene.

    Raises
    ------
    ValueError
        If an argument is out of range.
    """

    title: ClassVar[str] = "a grid"
    endings: ClassVar[tuple[str, ...]] = tuple(ARRAY_READERS)
    files: Annotated[
        FileBeside | dict[str, FileBeside] | None,
        Parameter(
            "Files by the names of fields, in the place of source.",
            allowed="none, or {temperature: T.npy, plastic_strain: strain.npy}",
        ),
    ] = None
    names: Mapping[str, str] = field(default_factory=dict)
    axes: Annotated[
        tuple[str, ...] | None,
        Parameter(
            "Order of the arrays' axes, without time for a single frame; none: as the file says, "
            "or [time, y, x]."
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
    void_value: Annotated[
        float | None,
        Parameter("Number that stands for no material, in the file's unit; NaN always does."),
    ] = None
    interval: float | None = None
    units: Units = field(default_factory=Units)
    placement: Placement = field(default_factory=Placement)

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.files, dict):
            unknown = sorted(set(self.files) - {*READABLE, "material"})
            if unknown:
                raise ValueError(
                    f"files: unknown field {unknown[0]!r}, expected one of "
                    f"{', '.join((*READABLE, 'material'))}"
                )
        if self.axes is not None and sorted(self.axes) not in (sorted(AXES), ["x", "y"]):
            raise ValueError(
                f"axes: {self.axes!r}, expected time, y and x in any order, or y and x"
            )
        if self.interval is not None and not (isfinite(self.interval) and self.interval > 0):
            raise ValueError(f"interval: {self.interval!r}, expected over 0")
        if self.placement.depth != 2:
            raise ValueError("placement: a grid has the axes x and y, expected no z")

    @property
    def inputs(self) -> tuple[str, ...]:
        """The path or pattern, or those of the fields."""
        return tuple(self.files.values()) if isinstance(self.files, dict) else (str(self.files),)

    def survey(self) -> Survey:
        """Look at what is there; see `Source.survey`."""
        with ExitStack() as stack:
            grid = _open(self, stack)
            temperatures = grid.check_ends()
            return Survey(
                kind=grid.kind,
                times=grid.times,
                extent=grid.extent,
                found={name: layer.chosen.label for name, layer in grid.layers.items()},
                unused=grid.unused,
                spacing=min(grid.steps),
                temperatures=temperatures,
                notes=Notes() + grid.notes,
            )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the frames one after the other; see `Source.frames`."""
        with ExitStack() as stack:
            grid = _open(self, stack)
            across = taps(grid.x, raster.spacing, raster.x)
            down = taps(-grid.y, raster.spacing, -raster.y)
            for index in range(start, len(grid.times)):
                values, material = regrid(*grid.read(index), across, down)
                fields = dict(zip(grid.layers, values, strict=True))
                yield SampledFrame(float(grid.times[index]), fields, material)


class _Layer:
    """A field of the grid: where its numbers are and what they mean."""

    def __init__(self, chosen: Chosen, axes: tuple[str, ...], unit: Unit) -> None:
        self.chosen, self.axes, self.unit = chosen, axes, unit
        self.array = array = chosen.array
        self.frames = self.length("time")
        self._first, self._block = 0, np.empty((0, 0, 0), np.float32)
        together = array.chunks[axes.index("time")] if array.chunks and "time" in axes else 1
        self._together = max(1, min(together, _BLOCK // max(1, self.samples)))

    def length(self, axis: str) -> int:
        """Number of samples along an axis."""
        return self.array.shape[self.axes.index(axis)] if axis in self.axes else 1

    @property
    def samples(self) -> int:
        """Number of samples of a frame."""
        return self.length("x") * self.length("y")

    def check(self) -> None:
        """Refuse a frame that is empty or too large to be read."""
        for axis in ("x", "y"):
            if not 2 <= self.length(axis) <= MOST_ON_A_SIDE:
                raise SourceError(
                    f"{self.chosen}: has {self.length(axis)} samples along {axis}, "
                    f"expected 2 to {MOST_ON_A_SIDE}"
                )
        check_samples(f"{self.chosen}: a frame", self.samples)
        check_samples(f"{self.chosen}: a chunk", prod(self.array.chunks or (1,)))
        if self.frames < 1:
            raise SourceError(f"{self.chosen}: has no frame")

    def check_like(self, other: "_Layer") -> None:
        """Refuse fields of different shape."""
        own, expected = ([one.length(axis) for axis in AXES] for one in (self, other))
        if own != expected:
            raise SourceError(
                f"{self.chosen}: has {own} samples along {', '.join(AXES)}, "
                f"expected {expected} as {other.chosen}"
            )

    def dim(self, axis: str) -> str:
        """Name of an axis in the file; empty if it says none."""
        if axis not in self.axes or not self.array.dims:
            return ""
        return self.array.dims[self.axes.index(axis)]

    def read(self, index: int) -> NDArray[np.float32]:
        """Numbers of a frame as they are in the file, shape (y, x); NaN where there is none."""
        if not self._first <= index < self._first + len(self._block):
            self._first = index - index % self._together
            self._block = self._load(self._first, min(self._first + self._together, self.frames))
        values: NDArray[np.float32] = self._block[index - self._first]
        return values

    def _load(self, first: int, last: int) -> NDArray[np.float32]:
        return np.asarray(read_frames(self.chosen, self.axes, slice(first, last)), np.float32)


@dataclass(frozen=True)
class _Grid:
    """A source that is open."""

    kind: str
    layers: Mapping[str, _Layer]
    material: _Layer | None
    source: GridSource
    times: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    turned: tuple[bool, bool, bool]
    unused: tuple[str, ...]
    notes: Notes

    @property
    def steps(self) -> tuple[float, float]:
        """Distance of the columns and of the rows in m."""
        return (
            float((self.x[-1] - self.x[0]) / (self.x.size - 1)),
            float((self.y[0] - self.y[-1]) / (self.y.size - 1)),
        )

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top edge in m."""
        across, down = (step / 2 for step in self.steps)
        return (
            float(self.x[0] - across),
            float(self.x[-1] + across),
            float(self.y[-1] - down),
            float(self.y[0] + down),
        )

    def check_ends(self) -> tuple[float, float] | None:
        """Read the first and the last frame: what is wrong there is found before all are read.

        And the others until one has a temperature. Gives the least and the greatest.
        """
        last = len(self.times) - 1
        found: list[float] = []
        for index in dict.fromkeys((0, last, *range(last))):
            if index not in (0, last) and (found or "temperature" not in self.layers):
                break
            values, material = self.read(index)
            if "temperature" in self.layers:
                heat = values[list(self.layers).index("temperature")][material != Material.VOID]
                found += [value for value in span_of(heat) if isfinite(value)]
        return span_of(found) if "temperature" in self.layers else None

    def read(self, index: int) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Fields in SI, shape (fields, y, x), and material of a frame, as they lie in the scene."""
        raw = {name: layer.read(index) for name, layer in self.layers.items()}
        void = self._void(raw)
        if self.material is None:
            material = np.where(void, np.uint8(Material.VOID), np.uint8(Material.WORKPIECE))
        else:
            material = np.where(void, np.uint8(Material.VOID), self._material(index))
        values = np.stack([self._in_scene(name, raw[name]) for name in raw])
        turn = partial(_turn, turned=self.turned)
        return np.ascontiguousarray(turn(values)), np.ascontiguousarray(turn(material))

    def _void(self, raw: Mapping[str, NDArray[np.float32]]) -> NDArray[np.bool_]:
        """Where the temperature, or else the first field, has no number."""
        values = raw["temperature"] if "temperature" in raw else next(iter(raw.values()))
        if np.isinf(values).any():
            first = next(iter(self.layers.values()))
            raise SourceError(f"{first.chosen}: has infinite numbers, expected finite ones or NaN")
        void: NDArray[np.bool_] = np.isnan(values)
        if self.source.void_value is not None:
            void |= np.isclose(values, self.source.void_value, rtol=1e-6, atol=0.0)
        return void

    def _material(self, index: int) -> NDArray[np.uint8]:
        assert self.material is not None
        found = self.material.read(index)
        kinds = np.nan_to_num(found, nan=float(Material.VOID))
        wrong = ~np.isin(kinds, [float(kind) for kind in Material])
        if wrong.any():
            raise SourceError(
                f"{self.material.chosen}: material is {kinds[wrong][0]:g} in frame {index}, "
                "expected 0 (void), 1 (workpiece) or 2 (tool)"
            )
        return np.asarray(kinds, np.uint8)

    def _in_scene(self, name: str, raw: NDArray[np.float32]) -> NDArray[np.float32]:
        layer, placement = self.layers[name], self.source.placement
        values = np.asarray(placement.field(name, layer.unit.to_si(raw)), np.float32)
        values[~np.isfinite(values)] = np.nan
        return values


def _turn(values: NDArray[Any], turned: tuple[bool, bool, bool]) -> NDArray[Any]:
    """Rows and columns swapped, then columns and rows in the scene's order."""
    swapped, across, down = turned
    values = values.swapaxes(-1, -2) if swapped else values
    values = values[..., ::-1] if across else values
    return values[..., ::-1, :] if down else values


def _open(source: GridSource, stack: ExitStack) -> _Grid:
    notes = Notes()
    files, chosen = _choose(source, stack, notes)
    layers: dict[str, _Layer] = {}
    for name, one in chosen.items():
        axes = axes_of(one, source.axes, notes)
        unit = (
            SI
            if name == "material"
            else unit_of(name, str(one), one.unit, source.units.of(name), notes)
        )
        layers[name] = _Layer(one, axes, unit)
        layers[name].check()
    first = next(iter(layers.values()))
    for layer in layers.values():
        layer.check_like(first)
    material = layers.pop("material", None)
    if not layers:
        raise SourceError(f"{first.chosen}: is a material, expected a temperature too")
    x, y = (_positions(source, axis, files, first, notes) for axis in ("x", "y"))
    x, y, turned = _placed(source.placement, x, y)
    used = {one.label for one in chosen.values()} | set(source.names.values())
    return _Grid(
        kind=f"grid of {first.length('y')} x {first.length('x')} samples, {', '.join(files)}",
        layers={source.placement.in_file(name): layer for name, layer in layers.items()},
        material=material,
        source=source,
        times=_times(source, files, first, notes),
        x=x,
        y=y,
        turned=turned,
        unused=unused_names((label for arrays in files.values() for label in arrays), used),
        notes=notes,
    )


def _choose(
    source: GridSource, stack: ExitStack, notes: Notes
) -> tuple[dict[str, Arrays], dict[str, Chosen]]:
    """Open the files and find every field: arrays by file, and fields by name."""
    given = {name: label for name, label in source.names.items() if name not in COORDINATES}
    if isinstance(source.files, str):
        path = source.files
        arrays = open_arrays(path, stack)
        candidates = _candidates(path, arrays, source)
        return {path: arrays}, find_fields(path, candidates, given, _KNOWN, notes)
    files: dict[str, Arrays] = {}
    chosen: dict[str, Chosen] = {}
    for name, path in (source.files or {}).items():
        files[path] = files.get(path) or open_arrays(path, stack)
        candidates = _candidates(path, files[path], source)
        own = {name: given[name]} if name in given else {}
        if len(candidates) == 1 and not own:
            own = {name: next(iter(candidates))}
        chosen.update(find_fields(path, candidates, own, (name,), notes))
    return files, chosen


def _candidates(path: str, arrays: Arrays, source: GridSource) -> Arrays:
    """Arrays that can be a field: of as many axes as there should be."""
    flat = {label: array for label, array in arrays.items() if min(array.shape, default=0) != 1}
    solid = {label: array for label, array in arrays.items() if len(array.shape) == 3}
    number = len(source.axes or (AXES if solid else AXES[1:]))
    pool = solid if number == 3 else flat
    result = {label: array for label, array in pool.items() if len(array.shape) == number}
    if not result:
        shapes = ", ".join(f"{label} {array.shape}" for label, array in list(arrays.items())[:10])
        raise SourceError(f"{path}: expected an array with {number} axes, it has {shapes}")
    return result


def _positions(
    source: GridSource,
    axis: str,
    files: Mapping[str, Arrays],
    layer: _Layer,
    notes: Notes,
) -> NDArray[np.float64]:
    """Centres of the columns or rows in m, as they follow in the file."""
    count = layer.length(axis)
    number = np.arange(count, dtype=np.float64) + 0.5
    if source.spacing is None:
        one = coordinate(axis, files, source.names.get(axis), layer.dim(axis), count)
        if one is None:
            raise SourceError(
                f"{layer.chosen.path}: has no coordinate {axis!r}, expected grid.spacing"
            )
        return check_even(str(one), read_list(axis, one, source.units.length, notes))
    if coordinate(axis, files, source.names.get(axis), layer.dim(axis), count) is not None:
        notes.remarks.append(f"The coordinate {axis} is not used, as the spacing is given.")
    if axis == "x":
        return source.left + source.spacing * number
    notes.assumed.append(f"Row 0 is the {'upper' if source.top_first else 'lower'} edge.")
    down = source.row_spacing or source.spacing
    return source.top - down * (number if source.top_first else number[::-1])


def _times(
    source: GridSource, files: Mapping[str, Arrays], layer: _Layer, notes: Notes
) -> NDArray[np.float64]:
    one = None
    if source.interval is None:
        dim = layer.dim("time")
        one = coordinate("time", files, source.names.get("time"), dim, layer.frames)
    if one is None:
        return even_times(layer.frames, source.interval, notes)
    return check_times(str(one), read_list("time", one, source.units.time, notes))


def _placed(
    placement: Placement, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], tuple[bool, bool, bool]]:
    """Coordinates in the scene, x ascending and y descending, and how the fields are turned."""
    along, up = (
        ((x, y)[axis] - origin) * sign
        for axis, origin, sign in zip(
            placement.axes, placement.origin, placement.signs, strict=True
        )
    )
    back, rising = bool(along[0] > along[-1]), bool(up[0] < up[-1])
    turned = (placement.axes == (1, 0), back, rising)
    return along[::-1] if back else along, up[::-1] if rising else up, turned
