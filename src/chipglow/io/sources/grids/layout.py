"""Which array of a file is which field or coordinate, along which axes and in which unit."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import (
    COMMON_NAMES,
    FRAME_NAMES,
    OTHER_NAMES,
    known_unit,
    match_names,
    simple,
    unit_of,
)
from chipglow.io.sources.grids.file_array import FileArray
from chipglow.io.sources.grids.unpacking import PACKING, unpack
from chipglow.io.sources.plausible import LARGEST_WITHOUT_UNIT
from chipglow.io.sources.source import SourceError, naming
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import SI, Unit
from chipglow.text import Notes

AXES: Final = ("time", "y", "x")
COORDINATES: Final = (*AXES, "z")

ROW_0: Final = "Row 0 is the {} edge."
"""Assumption on images without a coordinate y."""

_GRID_NAMES: Final = {**COMMON_NAMES, "material": ("material",)}
_DIMENSIONS: Final[Mapping[str, tuple[str, ...]]] = {
    "time": FRAME_NAMES,
    "y": ("row", "rows", "line", "lines", "height", "lat", "latitude", "ny"),
    "x": ("column", "columns", "col", "cols", "width", "lon", "longitude", "nx"),
}
"""Further names of dimensions."""
_CF_AXES: Final = {
    "t": "time", "time": "time",
    "y": "y", "projection_y_coordinate": "y", "latitude": "y", "grid_latitude": "y",
    "x": "x", "projection_x_coordinate": "x", "longitude": "x", "grid_longitude": "x",
}  # fmt: skip
"""Axes by the attributes ``axis`` and ``standard_name`` of their coordinates."""
_BOTTOM_OR_RIGHT: Final = {"y": ("LL", "LR"), "x": ("UR", "LR")}
"""HDF5's origins of images whose first sample along an axis is the lowest or the rightmost."""
_COLOURS: Final = ("IMAGE_INDEXED", "IMAGE_TRUECOLOR")
_LARGEST_UNEVENNESS: Final = 0.05
"""Maximum distance of a coordinate from its even place, in steps."""


@dataclass(frozen=True, kw_only=True)
class ArrayNumbers(Part):
    """How the numbers of an array in a file are to be read."""

    axes: Annotated[
        tuple[str, ...] | None,
        Parameter(
            "Order of the array's axes, without time for a single frame; none: as the file says.",
            allowed="none, or [time, y, x]",
        ),
    ] = None
    void_value: Annotated[
        float | None, Parameter("Number in the file that stands for no value; NaN always does.")
    ] = None
    scale: Annotated[
        float | None,
        Parameter(
            "Temperature or radiance is scale x number + offset in its unit; none: 1.",
            over=0.0,
            allowed="none, 0.04",
        ),
    ] = None
    offset: Annotated[float | None, Parameter("See scale; none: 0.", allowed="none, -40")] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axes is not None and sorted(self.axes) not in (sorted(AXES), ["x", "y"]):
            raise ValueError(
                f"axes: {self.axes!r}, expected time, y and x in any order, or y and x"
            )


def find_fields(
    arrays: Mapping[str, FileArray], given: Mapping[str, str], known: Sequence[str], notes: Notes
) -> dict[str, FileArray]:
    """Return arrays by fields: those given, and guesses; a file's only array is the first known."""
    path = next(iter(arrays.values())).path
    if "velocity" in given:
        raise SourceError(f"{path}: velocity needs velocity_x and velocity_y, an array each")
    last = [array.short for array in arrays.values()]
    labels = {
        short if last.count(short) == 1 else label: label
        for short, label in zip(last, arrays, strict=True)
    }
    wanted = {name: labels.get(label, label) for name, label in given.items()}
    with naming(path):
        found = match_names(arrays, wanted, (), names=_GRID_NAMES)
        rest = {short: label for short, label in labels.items() if label not in found.values()}
        unknown = [name for name in known if name not in found]
        guessed = match_names(rest, {}, unknown, names=_GRID_NAMES)
    found |= {name: rest[short] for name, short in guessed.items()}
    if not found and len(arrays) == 1:
        found[known[0]] = next(iter(arrays))
        notes.assumed.append(f"The only array {found[known[0]]!r} of {path} is the {known[0]}.")
    if not found:
        listed = ", ".join(sorted(arrays)[:20]) or "none of this kind"
        raise SourceError(
            f"{path}: no array has the name of a field, say which is {known[0]}: it has {listed}"
        )
    return {name: arrays[found[name]] for name in dict.fromkeys((*known, *found)) if name in found}


def with_lists(arrays: Mapping[str, FileArray]) -> dict[str, FileArray]:
    """Return arrays, with coordinates that are repeated along other axes as lists.

    Coordinates are repeated in a mesh grid, and in each file of a series.
    """
    return {name: _as_list(array) for name, array in arrays.items()}


def _as_list(array: FileArray) -> FileArray:
    number = len(array.shape)
    axis = next((axis for axis in ("y", "x") if _is_coordinate(array, axis, axis)), None)
    if axis is None or number not in (2, 3) or max(array.shape) == array.size:
        return array
    rest = (slice(None),) * (number - 1)
    values = array.part((slice(1 if number == 3 else None), *rest))
    for index in range(1, array.shape[0] if number == 3 else 0):
        if not np.array_equal(array.part((slice(index, index + 1), *rest)), values):
            return array
    mesh = unpack(values, array.attributes).reshape(array.shape[-2:])
    is_in_each_frame = number == 2 and array.dims[:1] == ("time",)
    mesh = mesh.T if axis == "y" and not is_in_each_frame else mesh
    line = mesh[0]
    if not (mesh == line).all():
        if is_in_each_frame:
            raise SourceError(f"{array}: differs between frames; {axis} must be the same in all")
        return array
    stated = {name: value for name, value in array.attributes.items() if name not in PACKING}
    return replace(array, shape=line.shape, read=lambda key: line[key], dims=(), chunks=None,
                   attributes=stated)  # fmt: skip


def may_be_field(array: FileArray, arrays: Iterable[FileArray]) -> bool:
    """Return whether an array may hold samples: neither bounds of a coordinate nor flags."""
    bounds = {str(one.attributes.get("bounds")) for one in arrays}
    flags = ("flag_values", "flag_masks", "flag_meanings")
    is_flag = any(name in array.attributes for name in flags)
    return array.short not in bounds and not (is_flag and simple(array.short) != "material")


def axes_of(
    array: FileArray, given: Sequence[str] | None, notes: Notes, arrays: Iterable[FileArray] = ()
) -> tuple[str, ...]:
    """Return the axes of an array in their order: ``y``, ``x`` and possibly ``time``.

    The other arrays of the file may state which axis a dimension is.
    """
    shape = array.shape
    if len(shape) not in (2, 3) or (given is not None and len(given) != len(shape)):
        raise SourceError(
            f"{array}: has shape {shape}, expected the axes {', '.join(given or AXES)}"
        )
    if (kind := array.attributes.get("IMAGE_SUBCLASS")) in _COLOURS:
        raise SourceError(f"{array}: its numbers are colours ({kind}), not measured values")
    if array.attributes.get("IMAGE_WHITE_IS_ZERO"):
        notes.warnings.append(
            f"{array.short}: the file states that large numbers are dark (IMAGE_WHITE_IS_ZERO); "
            "the numbers are used as stored."
        )
    if given is not None:
        return tuple(given)
    named = tuple(_axis_of(dim, arrays) for dim in array.dims) or ("",) * len(shape)
    if len(shape) == 3 and not any(named) and array.path.lower().endswith(".mat"):
        raise SourceError(
            f"{array}: has shape {shape}, give the axes: y, x, time as MATLAB orders images, "
            "or time, y, x"
        )
    names = _completed(named)
    if names is None:
        raise SourceError(
            f"{array}: has the dimensions {', '.join(array.dims)}, give its axes, such as y, x"
        )
    if names != named:
        notes.assumed.append(f"The axes of {array.name} are {', '.join(names)}.")
    return names


def is_reversed(axis: str, array: FileArray, notes: Notes) -> bool:
    """Return and note whether an image's first row is its lowest, or first column the rightmost.

    HDF5's attribute DISPLAY_ORIGIN states it for images without coordinates.
    """
    origin = array.attributes.get("DISPLAY_ORIGIN")
    if origin not in _BOTTOM_OR_RIGHT[axis]:
        return False
    side = "lower edge is row 0" if axis == "y" else "right edge is column 0"
    notes.remarks.append(
        f"{array.short}: its {side}, as the file states (DISPLAY_ORIGIN {origin})."
    )
    return True


def _axis_of(dim: str, arrays: Iterable[FileArray]) -> str:
    """Return the axis that a dimension is, by its name or by its coordinate; "" if unknown."""
    for axis in COORDINATES:
        if simple(dim) in (*OTHER_NAMES[axis], *_DIMENSIONS.get(axis, ())):
            return axis
    own = (array for array in arrays if array.short == dim)
    return next((axis for array in own if (axis := _stated_axis(array))), "")


def _stated_axis(array: FileArray) -> str:
    """Return the axis that attributes of the CF conventions state for a coordinate."""
    axis, name = (str(array.attributes.get(key, "")).lower() for key in ("axis", "standard_name"))
    return _CF_AXES.get(axis) or _CF_AXES.get(name, "")


def _completed(names: tuple[str, ...]) -> tuple[str, ...] | None:
    """Return axes with those that are unknown filled in; None if that would be a guess."""
    usual = AXES[-len(names) :]
    rest = [axis for axis in usual if axis not in names]
    known = {axis for axis in names if axis}
    moved = any(axis and axis != place for axis, place in zip(names, usual, strict=True))
    if not known <= set(usual) or len(rest) != names.count("") or (len(rest) > 1 and moved):
        return None
    return tuple(axis or rest.pop(0) for axis in names)


def scaled(unit: Unit, scale: float | None, offset: float | None) -> Unit:
    """Return the unit of numbers n that stand for ``scale * n + offset`` in another unit."""
    factor = 1.0 if scale is None else scale
    return Unit(unit.scale * factor, unit.scale * (offset or 0.0) + unit.offset, unit.text)


def without(values: NDArray[Any], void_value: float | None) -> NDArray[Any]:
    """Return numbers with NaN instead of the one that stands for no value."""
    if void_value is None:
        return values
    # Numbers of 32 bits differ from their decimal text by 6e-8.
    void = np.isclose(values, void_value, rtol=1e-6, atol=0.0)
    return np.where(void, np.nan, values) if void.any() else values


def coordinate(
    axis: str,
    arrays: Iterable[FileArray],
    length: int,
    dim: str,
    notes: Notes,
    given: str | None = None,
    own: Unit = SI,
) -> FileArray | None:
    """Return the coordinate of an axis, which has a length and maybe a name; None without one.

    A list that only counts the samples, of which neither the file nor the user states the unit,
    is none.
    """
    every = list(arrays)
    lists = [array for array in every if max(array.shape, default=0) == array.size]
    if given is not None:
        match = [array for array in lists if given in (array.name, array.short)]
        if not match:
            raise SourceError(f"{every[0].path}: there is no list {given!r} for {axis}")
    else:
        match = [one for one in lists if _is_coordinate(one, axis, dim)]
        # The most specific of several names: t may be another number.
        match.sort(key=lambda one: (one.short != dim, simple(one.short) == "t"))
    if not match:
        for one in every:
            if axis != "time" and 1 < len(one.shape) < 4 and _is_coordinate(one, axis, dim):
                notes.warnings.append(
                    f"{one.short} does not vary along {axis} alone: it is not used as a coordinate."
                )
        return None
    found = match[0]
    if found.size != length:
        raise SourceError(f"{found}: has {found.size} values, expected {length} along {axis}")
    if given is None and own == SI and _only_counts(axis, found):
        notes.remarks.append(f"{found.short} only counts along {axis}: it is not used.")
        return None
    return found


def _is_coordinate(array: FileArray, axis: str, dim: str) -> bool:
    name = simple(array.short)
    return array.short == dim or name in OTHER_NAMES[axis] or _stated_axis(array) == axis


def _only_counts(axis: str, array: FileArray) -> bool:
    """Return whether a list is 0, 1, 2, ... or 1, 2, 3, ... without a unit of its axis."""
    if array.unit is not None and known_unit(array.unit, axis) is not None:
        return False
    numbers = _numbers(array)
    return bool(numbers[0] in (0.0, 1.0) and (np.diff(numbers) == 1.0).all() and numbers.size > 1)


def _numbers(array: FileArray) -> NDArray[np.float64]:
    """Return all values of a coordinate as they are in the file."""
    return np.asarray(unpack(array.part(), array.attributes), np.float64).reshape(-1)


def read_list(axis: str, array: FileArray, own: Unit, notes: Notes) -> NDArray[np.float64]:
    """Return all values of a coordinate in SI; for its unit see `unit_of`."""
    unit = unit_of(axis, str(array), array.unit, own, notes)
    values = _numbers(array) * unit.scale + unit.offset
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise SourceError(f"{array}: value {wrong[0]} is {values[wrong[0]]}, expected a number")
    return values


def even_positions(axis: str, array: FileArray, own: Unit, notes: Notes) -> NDArray[np.float64]:
    """Return the centres of columns or rows in m, in the order of the file, by a coordinate."""
    values = check_even(str(array), read_list(axis, array, own, notes))
    size = abs(values[-1] - values[0])
    if array.unit is None and own == SI and size > LARGEST_WITHOUT_UNIT:
        raise SourceError(
            f"{array}: extends over {size:.4g} and states no unit, expected up to "
            f"{LARGEST_WITHOUT_UNIT:g} m"
        )
    return values


def ascends(array: FileArray) -> bool:
    """Return whether a coordinate ascends; refuse one that does neither."""
    steps = np.diff(_numbers(array))
    if not ((steps > 0).all() or (steps < 0).all()):
        raise SourceError(f"{array}: neither ascends nor descends")
    return bool((steps > 0).all())


def read_frames(array: FileArray, axes: Sequence[str], frames: slice) -> NDArray[Any]:
    """Return frames as they are in the file, shape (time, y, x), NaN where a number is missing."""
    lengths = dict(zip(axes, array.shape, strict=True))
    key = tuple(frames if axis == "time" else slice(None) for axis in axes)
    values = unpack(array.part(key), array.attributes)
    values = values.transpose([axes.index(axis) for axis in AXES if axis in axes])
    values = values if "time" in axes else values[None]
    expected = (len(range(lengths.get("time", 1))[frames]), lengths["y"], lengths["x"])
    if values.shape != expected:
        raise SourceError(f"{array}: has shape {values.shape}, expected {expected}")
    return values


def check_even(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a coordinate with its steps made even; refuse steps that differ much."""
    steps = np.diff(values)
    if not ((steps > 0).all() or (steps < 0).all()):
        wrong = int(np.flatnonzero(np.sign(steps) != np.sign(values[-1] - values[0]))[0]) + 1
        raise SourceError(
            f"{name}: not monotonic, value {wrong} is {values[wrong]:.9g} m after "
            f"{values[wrong - 1]:.9g} m"
        )
    even = np.linspace(values[0], values[-1], values.size)
    if np.abs(values - even).max() > _LARGEST_UNEVENNESS * abs(even[1] - even[0]):
        raise SourceError(
            f"{name}: steps from {np.abs(steps).min():.6g} m to {np.abs(steps).max():.6g} m, "
            "expected even ones"
        )
    return even
