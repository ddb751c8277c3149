"""Which array of a file is which field or coordinate, along which axes and in which unit."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import FileArray
from chipglow.io.sources.conventions import COMMON_NAMES, OTHER_NAMES, SI_UNITS, match_names, simple
from chipglow.io.sources.source import SourceError, naming
from chipglow.io.sources.unpacking import unpack
from chipglow.quantities.units import SI, Unit, parse_unit
from chipglow.text import Notes

AXES: Final = ("time", "y", "x")
COORDINATES: Final = (*AXES, "z")

_GRID_NAMES: Final = {**COMMON_NAMES, "material": ("material",)}
_LARGEST_UNEVENNESS: Final = 0.05
"""Maximum distance of a coordinate from its even place, in steps."""


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


def axes_of(array: FileArray, given: Sequence[str] | None, notes: Notes) -> tuple[str, ...]:
    """Return the axes of an array in their order: ``y``, ``x`` and possibly ``time``."""
    shape = array.shape
    names = tuple(
        next((axis for axis in COORDINATES if simple(dim) in OTHER_NAMES[axis]), "")
        for dim in array.dims
    )
    if given is not None:
        names = tuple(given)
    elif sorted(names) not in (sorted(AXES), ["x", "y"]):
        names = AXES[-len(shape) :]
        notes.assumed.append(f"The axes of {array.name} are {', '.join(names)}.")
    if len(names) != len(shape) or len(shape) not in (2, 3):
        raise SourceError(
            f"{array}: has shape {shape}, expected the axes {', '.join(given or AXES)}"
        )
    return names


def unit_of(name: str, label: str, text: str | None, own: Unit, notes: Notes) -> Unit:
    """Return and note the unit of a quantity: the user's own if not SI, else the file's text."""
    short = label.rsplit(": ", 1)[-1]
    if own != SI:
        if text is not None:
            notes.remarks.append(f"{short} is in {text!r}; the given unit is used instead.")
        return own
    if text is None:
        if SI_UNITS[name] != "1":
            notes.assumed.append(f"{short} is in {SI_UNITS[name]}: the file states no unit.")
        return own
    with naming(label):
        unit = parse_unit(text, SI_UNITS[name], name)
    if unit != SI:
        notes.remarks.append(f"{short} is in {text!r}.")
    return unit


def coordinate(
    axis: str, arrays: Iterable[FileArray], given: str | None, dim: str, length: int
) -> FileArray | None:
    """Return the array of the coordinate of an axis, which has a length and maybe a name."""
    every = list(arrays)
    lists = [array for array in every if max(array.shape, default=0) == array.size]
    if given is not None:
        match = [array for array in lists if given in (array.name, array.short)]
        if not match:
            raise SourceError(f"{every[0].path}: there is no list {given!r} for {axis}")
    else:
        match = [one for one in lists if one.short == dim or simple(one.short) in OTHER_NAMES[axis]]
        # The most specific of several names: t may be another number.
        match.sort(key=lambda one: simple(one.short) == "t")
    if not match:
        return None
    if match[0].size != length:
        raise SourceError(f"{match[0]}: has {match[0].size} values, expected {length} along {axis}")
    return match[0]


def read_list(axis: str, array: FileArray, own: Unit, notes: Notes) -> NDArray[np.float64]:
    """Return all values of a coordinate in SI; for its unit see `unit_of`."""
    unit = unit_of(axis, str(array), array.unit, own, notes)
    numbers = unpack(array.part(), array.attributes)
    values = np.asarray(numbers, np.float64).reshape(-1) * unit.scale + unit.offset
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise SourceError(f"{array}: value {wrong[0]} is {values[wrong[0]]}, expected a number")
    return values


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


def check_times(name: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return times, which must ascend."""
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise SourceError(
            f"{name}: does not ascend, frame {i + 1} is at {times[i + 1]:.9g} s after "
            f"{times[i]:.9g} s"
        )
    return times
