"""Which array of a file is which field or coordinate, along which axes and in which unit."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import StoredArray, check_samples
from chipglow.io.sources.conventions import SI_UNITS, match_names, simple
from chipglow.io.sources.source import SourceError, naming, reading
from chipglow.quantities.units import SI, Unit, parse_unit
from chipglow.text import Notes

AXES: Final = ("time", "y", "x")
COORDINATES: Final[Mapping[str, tuple[str, ...]]] = {
    "time": ("time", "times", "t"),
    "x": ("x", "x_coordinate", "xc"),
    "y": ("y", "y_coordinate", "yc"),
    "z": ("z", "z_coordinate", "zc"),
}
"""Names of coordinates, simplified by `simple`."""

_EVEN: Final = 0.05
"""Most that a coordinate may be off its even place, in steps."""


@dataclass(frozen=True)
class Chosen:
    """An array, and the file it is from."""

    path: str
    label: str
    array: StoredArray

    @property
    def unit(self) -> object:
        """Unit that the file says."""
        return self.array.attributes.get("units")

    def __str__(self) -> str:
        """What errors call it."""
        return f"{self.path}: {self.label}"


def find_fields(
    path: str,
    arrays: Mapping[str, StoredArray],
    given: Mapping[str, str],
    known: Sequence[str],
    notes: Notes,
) -> dict[str, Chosen]:
    """Which of a file's arrays are which fields.

    Parameters
    ----------
    path : str
        The file.
    arrays : mapping
        Arrays that may be a field.
    given : mapping
        Names that the user gave; see `match_names`.
    known : sequence of str
        Fields to look for, ``material`` among them if it may be there. If the file has one array
        only, it is the first of them.
    notes : Notes
        Receives the assumptions.

    Raises
    ------
    SourceError
        If a name is not there, or no field is found.
    """
    labels = _short_names(arrays)
    if "velocity" in given:
        raise SourceError(f"{path}: velocity needs velocity_x and velocity_y, an array each")
    wanted = {name: labels.get(label, label) for name, label in given.items()}
    material = wanted.pop("material", None)
    with_fields = [name for name in known if name != "material"]
    with naming(path):
        found = match_names(arrays, wanted, ()) if wanted else {}
        rest = {short: label for short, label in labels.items() if label not in found.values()}
        matched = match_names(rest, {}, [name for name in with_fields if name not in found])
        found.update({name: rest[short] for name, short in matched.items()})
    if material is None and "material" in known:
        material = next(
            (label for short, label in labels.items() if simple(short) == "material"), None
        )
    if material is not None:
        if material not in arrays:
            raise SourceError(f"{path}: there is no array {material!r} for material")
        found["material"] = material
    if not found and len(arrays) == 1:
        found[known[0]] = next(iter(arrays))
        notes.assumed.append(f"The only array {found[known[0]]!r} of {path} is the {known[0]}.")
    if not found:
        listed = ", ".join(sorted(arrays)[:20]) or "none of this kind"
        raise SourceError(
            f"{path}: no array has the name of a field, say which is {known[0]}: it has {listed}"
        )
    order = [name for name in (*known, *found) if name in found]
    return {name: Chosen(path, found[name], arrays[found[name]]) for name in dict.fromkeys(order)}


def _short_names(labels: Collection[str]) -> dict[str, str]:
    """Full names by the last part of them, or by the full one where the last is not unique."""
    last = [label.rsplit("/", 1)[-1] for label in labels]
    return {
        short if last.count(short) == 1 else label: label
        for short, label in zip(last, labels, strict=True)
    }


def axes_of(chosen: Chosen, given: Sequence[str] | None, notes: Notes) -> tuple[str, ...]:
    """What the axes of an array are: ``time``, ``y`` and ``x`` in their order.

    Parameters
    ----------
    chosen : Chosen
        The array.
    given : sequence of str, optional
        What the user says.
    notes : Notes
        Receives the assumptions.

    Raises
    ------
    SourceError
        If their number is another than that of the array.
    """
    shape = chosen.array.shape
    names = tuple(_axis(dim) for dim in chosen.array.dims)
    if given is not None:
        names = tuple(given)
    elif sorted(names) not in (sorted(AXES), ["x", "y"]):
        names = AXES[-len(shape) :]
        notes.assumed.append(f"The axes of {chosen.label} are {', '.join(names)}.")
    if len(names) != len(shape) or len(shape) not in (2, 3):
        raise SourceError(
            f"{chosen}: has shape {shape}, expected the axes {', '.join(given or AXES)}"
        )
    return names


def _axis(dim: str) -> str:
    return next((axis for axis, names in COORDINATES.items() if simple(dim) in names), "")


def unit_of(name: str, label: str, text: object, own: Unit, notes: Notes) -> Unit:
    """Unit of a field or coordinate: as given if that is not SI, else as the file says.

    Parameters
    ----------
    name : str
        Its name in a scene, or ``time``, ``x``, ``y``, ``z``.
    label : str
        File and name there.
    text : object
        What the file says; anything but text is nothing said.
    own : Unit
        What the user says.
    notes : Notes
        Receives the assumed unit, or the one that the file states.

    Raises
    ------
    SourceError
        If the file says a unit that is unknown or another quantity's.
    """
    short = label.rsplit(": ", 1)[-1]
    if own != SI:
        if isinstance(text, str):
            notes.remarks.append(f"{short} is in {text!r}; the given unit is used instead.")
        return own
    if not isinstance(text, str):
        if SI_UNITS[name] != "1":
            notes.assumed.append(f"{short} is in {SI_UNITS[name]}: the file states no unit.")
        return own
    with naming(label):
        unit = parse_unit(text, SI_UNITS[name], name)
    if unit != SI:
        notes.remarks.append(f"{short} is in {text!r}.")
    return unit


def coordinate(
    axis: str,
    files: Mapping[str, Mapping[str, StoredArray]],
    given: str | None,
    dim: str,
    length: int,
) -> Chosen | None:
    """Array of the coordinate of an axis, if a file has one.

    Parameters
    ----------
    axis : str
        ``time``, ``x`` or ``y``.
    files : mapping
        Arrays by name, by file.
    given : str, optional
        Name that the user gave.
    dim : str
        Name of the axis in the file; empty if it says none.
    length : int
        Number of samples along the axis.

    Raises
    ------
    SourceError
        If the given name is not there, or the array has another length.
    """
    every = [
        Chosen(path, label, array)
        for path, arrays in files.items()
        for label, array in arrays.items()
        if max(array.shape, default=0) == np.prod(array.shape, dtype=np.float64)
    ]
    if given is not None:
        match = [one for one in every if given in (one.label, one.label.rsplit("/", 1)[-1])]
        if not match:
            raise SourceError(f"{next(iter(files))}: there is no list {given!r} for {axis}")
    else:
        match = [one for one in every if _is_coordinate(one.label, axis, dim)]
        # Of several names the surest: t may be a number of another kind.
        match.sort(key=lambda one: simple(one.label.rsplit("/", 1)[-1]) == "t")
    if not match:
        return None
    count = int(np.prod(match[0].array.shape, dtype=np.float64))
    if count != length:
        raise SourceError(f"{match[0]}: has {count} values, expected {length} along {axis}")
    return match[0]


def _is_coordinate(label: str, axis: str, dim: str) -> bool:
    short = label.rsplit("/", 1)[-1]
    return short == dim or simple(short) in COORDINATES[axis]


def read_list(axis: str, chosen: Chosen, own: Unit, notes: Notes) -> NDArray[np.float64]:
    """All values of a coordinate in SI; for its unit see `unit_of`.

    Raises
    ------
    SourceError
        If one is not finite, or the unit is unknown.
    """
    unit = unit_of(axis, str(chosen), chosen.unit, own, notes)
    check_samples(str(chosen), int(np.prod(chosen.array.shape, dtype=np.float64)))
    with reading(chosen):
        raw = chosen.array.read((slice(None),) * len(chosen.array.shape))
    values = np.asarray(raw, np.float64).reshape(-1) * unit.scale + unit.offset
    check_finite(str(chosen), values)
    return values


def read_frames(chosen: Chosen, axes: Sequence[str], frames: slice) -> NDArray[Any]:
    """Numbers of frames as they are in the file, shape (time, y, x); NaN where there is none.

    Parameters
    ----------
    chosen : Chosen
        The array.
    axes : sequence of str
        What its axes are, as `axes_of` has them.
    frames : slice
        Which frames; an array without time has one.

    Raises
    ------
    SourceError
        If they cannot be read, or have another shape than the file says.
    """
    lengths = dict(zip(axes, chosen.array.shape, strict=True))
    key = tuple(frames if axis == "time" else slice(None) for axis in axes)
    with reading(chosen):
        values = _unpacked(chosen.array.read(key), chosen.array.attributes)
        values = values.transpose([axes.index(axis) for axis in AXES if axis in axes])
    values = values if "time" in axes else values[None]
    expected = (len(range(lengths.get("time", 1))[frames]), lengths["y"], lengths["x"])
    if values.shape != expected:
        raise SourceError(f"{chosen}: has shape {values.shape}, expected {expected}")
    return values


def _unpacked(raw: NDArray[Any], attributes: Mapping[str, Any]) -> NDArray[Any]:
    """Numbers that may be packed as NetCDF's conventions say; NaN where there is none."""
    values = raw
    scale, offset = (attributes.get(name) for name in ("scale_factor", "add_offset"))
    if scale is not None or offset is not None:
        values = raw * float(1.0 if scale is None else scale) + float(offset or 0.0)
    for name in ("_FillValue", "missing_value"):
        if attributes.get(name) is not None:
            values = np.where(raw == raw.dtype.type(attributes[name]), np.nan, values)
    return values


def check_finite(name: str, values: NDArray[np.float64]) -> None:
    """Refuse a coordinate that is not finite.

    Raises
    ------
    SourceError
        If a value is not.
    """
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise SourceError(f"{name}: value {wrong[0]} is {values[wrong[0]]}, expected a number")


def check_even(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A coordinate with its steps made even.

    Raises
    ------
    SourceError
        If it goes back and forth or its steps differ.
    """
    steps = np.diff(values)
    if not ((steps > 0).all() or (steps < 0).all()):
        wrong = int(np.flatnonzero(np.sign(steps) != np.sign(values[-1] - values[0]))[0]) + 1
        raise SourceError(
            f"{name}: does not go one way, value {wrong} is {values[wrong]:.9g} m after "
            f"{values[wrong - 1]:.9g} m"
        )
    even = np.linspace(values[0], values[-1], values.size)
    if np.abs(values - even).max() > _EVEN * abs(even[1] - even[0]):
        raise SourceError(
            f"{name}: steps from {np.abs(steps).min():.6g} m to {np.abs(steps).max():.6g} m, "
            "expected even ones"
        )
    return even


def check_times(name: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Refuse times that do not ascend.

    Raises
    ------
    SourceError
        If a frame is not later than the one before.
    """
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if wrong.size:
        i = int(wrong[0])
        raise SourceError(
            f"{name}: does not ascend, frame {i + 1} is at {times[i + 1]:.9g} s after "
            f"{times[i]:.9g} s"
        )
    return times


def unused_names(labels: Iterable[str], used: Collection[str]) -> tuple[str, ...]:
    """Names of arrays that are neither field nor coordinate."""
    names = {name for known in COORDINATES.values() for name in known}
    return tuple(
        label
        for label in labels
        if label not in used and simple(label.rsplit("/", 1)[-1]) not in names
    )
