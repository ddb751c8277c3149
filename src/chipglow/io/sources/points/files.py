"""Tables of points over time: text, NumPy, HDF5, MATLAB and VTK files."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import COMMON_NAMES, OTHER_NAMES, simple, unit_in_name
from chipglow.io.sources.file_names import files_of
from chipglow.io.sources.grids.arrays import open_arrays
from chipglow.io.sources.grids.file_array import FileArray
from chipglow.io.sources.meshes import vtk
from chipglow.io.sources.source import SourceError, required, table_errors
from chipglow.text import NamedTable, Notes, read_named_table

VTK_SUFFIXES: Final = (".vtk", ".vtp", ".vtu", ".vti", ".vts", ".vtr", ".ply")
TEXT_SUFFIXES: Final = (".csv", ".txt", ".dat", ".tsv")

MOST_POINTS: Final = 10_000_000
"""Most points of a file; limits memory."""

_PLACES: Final = ("points", "positions", "position", "coordinates", "coords", "pos", "location")
_PERHAPS_TIME: Final = "t"
_TIMES: Final = tuple(name for name in OTHER_NAMES["time"] if name != _PERHAPS_TIME)
_TEMPERATURES: Final = tuple(name for name in COMMON_NAMES["temperature"] if name != _PERHAPS_TIME)


@dataclass(frozen=True)
class PointTable:
    """Points of a frame."""

    path: str
    columns: Mapping[str, NDArray[Any]]
    """Values of the points by name, shape (points,) each."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Units that the file states, by the names of the columns."""
    wrong: Mapping[str, str] = field(default_factory=dict)
    """Errors about columns of text."""
    notes: Notes = field(default_factory=Notes)

    @property
    def count(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def check(self) -> None:
        """Refuse columns of different length, and too few or too many points."""
        lengths = {len(values) for values in self.columns.values()}
        if len(lengths) != 1 or not 0 < max(lengths) <= MOST_POINTS:
            raise SourceError(
                f"{self.path}: columns of {sorted(lengths)} points; all must have the same number "
                f"of points, from 1 to {MOST_POINTS}"
            )

    def numbers(self, label: str) -> NDArray[np.float64]:
        """Return the numbers of a column; raise an error if it is missing or text."""
        if label not in self.columns:
            raise SourceError(f"{self.path}: there is no column {label!r}")
        if label in self.wrong:
            raise SourceError(self.wrong[label])
        return np.asarray(self.columns[label], np.float64)


@dataclass(frozen=True)
class PointFrames:
    """Frames of points in files that are open."""

    tables: Sequence[Callable[[], PointTable]]
    """Each reads the points of a frame."""
    times: NDArray[np.float64] | None = None
    """Times as they are in the files; None if these contain none."""
    time_unit: str | None = None
    """Unit of the times that the files state."""
    time_label: str = ""
    """Column or list of the times."""


def open_points(pattern: str, time: str | None, stack: ExitStack) -> PointFrames:
    """Open a file of points, or by a pattern with ``*`` a file for each frame.

    The column or list of times in a single file is guessed if its name is not given. The stack
    closes the files.
    """
    paths = files_of(pattern)
    path, suffix = paths[0], paths[0].suffix.lower()
    _check_empty(path)
    if len(paths) == 1 and suffix in TEXT_SUFFIXES:
        return _split(_read_text(path), time)
    if len(paths) == 1 and suffix not in VTK_SUFFIXES:
        return _stacked(str(path), open_arrays(str(path), stack), time)
    return PointFrames([partial(_read_file, path) for path in paths])


def _check_empty(path: Path) -> None:
    if path.stat().st_size == 0:
        raise SourceError(f"{path}: is empty")


def _read_file(path: Path) -> PointTable:
    """Read a file that is a frame."""
    _check_empty(path)
    suffix = path.suffix.lower()
    if suffix in TEXT_SUFFIXES:
        return _read_text(path)
    if suffix in VTK_SUFFIXES:
        return _read_vtk(path)
    with ExitStack() as stack:
        return _stacked(str(path), open_arrays(str(path), stack), None, one_frame=True).tables[0]()


# Text


def _read_text(path: Path) -> PointTable:
    with table_errors():
        table = read_named_table(path)
        labels = [re.split(r"[\[(]", name)[0].strip() or name for name in table.names]
        _check_labels(table, labels)
        columns, errors = table.columns()
    units = [unit_in_name(name) for name in table.names]
    known = {label: unit for label, unit in zip(labels, units, strict=True) if unit is not None}
    wrong = {labels[index]: error for index, error in errors.items()}
    numbers = dict(zip(labels, columns, strict=True))
    return PointTable(str(path), numbers, known, wrong, table.notes)


def _check_labels(table: NamedTable, labels: Sequence[str]) -> None:
    place = f"{table.path}, line {table.first}"
    if not any(re.match(r"[A-Za-z]", label) for label in labels):
        raise SourceError(
            f"{place}: {', '.join(labels)[:60]!r}, expected names of columns such as "
            "x,y,temperature"
        )
    if len(set(labels)) < len(labels):
        raise SourceError(f"{place}: two columns have one name")


def _split(table: PointTable, time: str | None) -> PointFrames:
    """Return the frames of a table; with a column of times, points of one time are adjacent."""
    if time is not None and time not in table.columns:
        raise SourceError(f"{table.path}: there is no column {time!r} for time")
    label = time or _time_in(table.columns)
    if not label or not table.count:
        return PointFrames([lambda: table])
    times = table.numbers(label)
    starts = np.flatnonzero(np.append(True, times[1:] != times[:-1]))
    ends = [*starts[1:], len(times)]
    parts = [partial(_rows, table, slice(*of)) for of in zip(starts, ends, strict=True)]
    return PointFrames(parts, times[starts], table.units.get(label), label)


def _rows(table: PointTable, rows: slice) -> PointTable:
    return replace(table, columns={label: values[rows] for label, values in table.columns.items()})


def _time_in(labels: Iterable[str]) -> str:
    """Return the column of times; ``t`` is one beside a column that surely is the temperature."""
    by_name = {simple(label): label for label in reversed(list(labels))}
    match = [by_name[name] for name in _TIMES if name in by_name]
    if not match and any(name in by_name for name in _TEMPERATURES):
        match = [by_name[name] for name in (_PERHAPS_TIME,) if name in by_name]
    return match[0] if match else ""


# Arrays


def _stacked(
    path: str, arrays: Mapping[str, FileArray], time: str | None, *, one_frame: bool = False
) -> PointFrames:
    """Return frames of arrays of shape (points,) or (points, 2 or 3), behind an axis of time."""
    named = {array.short: array for array in arrays.values()}
    if time is not None and time not in named:
        raise SourceError(f"{path}: there is no list {time!r} for time")
    lists = [name for name in ([time] if time else _lists_of_times(named)) if named[name].size]
    label = lists[0] if lists else ""
    depths = {name: _depth(name, array) for name, array in named.items() if name != label}
    timed = bool(label) and not one_frame and max(depths.values(), default=1) == 2
    columns = [named[name] for name, depth in depths.items() if depth == 1 + timed]
    if not timed:
        return PointFrames([partial(_of_arrays, path, columns, None)], time_label=label)
    times = np.asarray(named[label].part(), np.float64).reshape(-1)
    for array in columns:
        if array.shape[0] != len(times):
            raise SourceError(
                f"{path}: {array.short} has {array.shape[0]} frames, expected {len(times)} as "
                f"{label}"
            )
    frames = [partial(_of_arrays, path, columns, index) for index in range(len(times))]
    return PointFrames(frames, times, named[label].unit, label)


def _lists_of_times(arrays: Mapping[str, FileArray]) -> list[str]:
    """Return arrays by the name of times; ``t`` only if others have more axes than it has."""
    known = [name for name in arrays if simple(name) in _TIMES]
    lists = [name for name, array in arrays.items() if len(array.shape) == 1]
    deeper = any(_depth(name, array) == 2 for name, array in arrays.items())
    return known or [name for name in lists if deeper and simple(name) == _PERHAPS_TIME]


def _depth(name: str, array: FileArray) -> int:
    """Return the number of axes, without that of the components of a vector."""
    shape = array.shape
    known = simple(name) in _PLACES or "vel" in simple(name)
    vector = len(shape) > 1 and shape[-1] in (2, 3) and (known or shape[-2] > 3)
    return len(shape) - vector


def _of_arrays(path: str, arrays: Sequence[FileArray], index: int | None) -> PointTable:
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    for array in arrays:
        frames = slice(index, None if index is None else index + 1)
        values = array.part((frames, *(slice(None),) * len(array.shape[1:])))
        parts = _components(array.short, values if index is None else values[0])
        columns |= parts
        if array.unit:
            units |= dict.fromkeys(parts, array.unit)
    return PointTable(path, columns, units)


def _components(name: str, values: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Return a column for every component, named ``x``, ``y``, ``z`` for places."""
    if values.ndim == 1:
        return {name: values}
    prefix = "" if simple(name) in _PLACES else f"{name}_"
    return {f"{prefix}{'xyz'[i]}": values[:, i] for i in range(values.shape[1])}


def _read_vtk(path: Path) -> PointTable:
    pyvista = required("pyvista", path, "mesh", "PyVista")
    mesh = vtk.read_data(path)
    if not isinstance(mesh, pyvista.DataSet) or mesh.n_points == 0:
        raise SourceError(f"{path}: has no points")
    columns = _components("points", np.asarray(mesh.points, np.float64))
    for name in mesh.point_data:
        values = np.asarray(mesh.point_data[name])
        if values.dtype.kind in "fiub" and (values.ndim == 1 or values.shape[1] in (2, 3)):
            columns |= _components(name, values)
    return PointTable(str(path), columns)
