"""Tables of points over time: text, dumps of LAMMPS, NumPy, HDF5, MATLAB and VTK files."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources import mesh_vtk
from chipglow.io.sources.arrays import (
    StoredArray,
    check_samples,
    open_arrays,
)
from chipglow.io.sources.conventions import COMMON_NAMES, simple
from chipglow.io.sources.file_order import files_of
from chipglow.io.sources.lammps_dump import ENDINGS, LammpsDump, is_dump
from chipglow.io.sources.source import SourceError, reading, required
from chipglow.io.sources.text_table import TextTable, line_of

VTK_SUFFIXES: Final = (".vtk", ".vtp", ".vtu", ".vti", ".vts", ".vtr", ".ply")
TEXT_SUFFIXES: Final = (".csv", ".txt", ".dat", ".tsv")
MOST_POINTS: Final = 10_000_000

_PLACES: Final = ("points", "positions", "position", "coordinates", "coords", "pos", "location")
_TIMES: Final = ("time", "times", "t_s")
_PERHAPS_TIME: Final = "t"
_SURELY_TEMPERATURE: Final = tuple(
    name for name in COMMON_NAMES["temperature"] if name != _PERHAPS_TIME
)
_LETTERS: Final = "xyz"
_ROWS: Final = 200_000


@dataclass(frozen=True)
class PointTable:
    """Points of a frame.

    Parameters
    ----------
    columns : mapping
        Numbers of the points by name, shape (points,) each.
    units : mapping
        Texts of the units that the file says, by the names of the columns.
    texts : mapping
        Columns with text in them: the row of the first such cell in the file, and what it says.
    """

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, tuple[int, str]] = field(default_factory=dict)

    def numbers(self, path: str, label: str) -> NDArray[Any]:
        """Numbers of a column.

        Raises
        ------
        SourceError
            If there is no such column, or text in it.
        """
        if label not in self.columns:
            raise SourceError(f"{path}: there is no column {label!r}")
        if label in self.texts:
            row, cell = self.texts[label]
            raise SourceError(
                f"{path}, line {line_of(Path(path), row)}: {label} is {cell[:40]!r}, expected a "
                "number"
            )
        values = self.columns[label]
        if values.dtype.kind not in "fiub":
            raise SourceError(f"{path}: {label} has text in it, expected numbers")
        return values


class PointFrames(ABC):
    """Frames of points in files that are open."""

    time_unit: str | None = None
    """Unit of the times that the files say."""

    time_label: str = ""
    """Column or list that the times are from."""

    @property
    def times(self) -> NDArray[np.float64] | None:
        """Times as they are in the files; None if they say none."""
        return None

    @property
    @abstractmethod
    def count(self) -> int:
        """Number of frames."""

    @abstractmethod
    def frames(self, start: int = 0) -> Iterator[tuple[str, PointTable]]:
        """Frames one after the other, each with the name of its file."""

    def frame(self, index: int) -> tuple[str, PointTable]:
        """One frame, with the name of its file."""
        return next(self.frames(index))


def open_points(pattern: str, time: str | None, stack: ExitStack) -> PointFrames:
    """Open tables of points.

    Parameters
    ----------
    pattern : str
        A file, or a pattern with ``*``: each file is then a frame.
    time : str, optional
        Name of the column or list of times in a single file; guessed if not given.
    stack : ExitStack
        Closes the files.

    Raises
    ------
    SourceError
        If a file cannot be read or there is none.
    OSError
        If it is missing or not accessible.
    """
    paths = files_of(pattern)
    for path in paths[:1]:
        if path.stat().st_size == 0:
            raise SourceError(f"{path}: is empty")
    if _is_dump(paths[0]):
        return _Dumps(paths)
    if len(paths) == 1 and paths[0].suffix.lower() in TEXT_SUFFIXES:
        table = _TimedTable(paths[0], time)
        return table if table.has_time else _FilePerFrame(paths)
    if len(paths) == 1 and paths[0].suffix.lower() not in VTK_SUFFIXES:
        arrays = _Stacked(str(paths[0]), open_arrays(str(paths[0]), stack), time)
        return arrays if arrays.has_time else _FilePerFrame(paths)
    return _FilePerFrame(paths)


class _FilePerFrame(PointFrames):
    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths

    @property
    def count(self) -> int:
        return len(self._paths)

    def frames(self, start: int = 0) -> Iterator[tuple[str, PointTable]]:
        for path in self._paths[start:]:
            with reading(path):
                table = _read_file(path)
            yield str(path), table


def _read_file(path: Path) -> PointTable:
    suffix = path.suffix.lower()
    if path.stat().st_size == 0:
        raise SourceError(f"{path}: is empty")
    if suffix in TEXT_SUFFIXES:
        return next(_TimedTable(path, None).chunks(None))
    if suffix in VTK_SUFFIXES:
        return _read_vtk(path)
    with ExitStack() as stack:
        arrays = open_arrays(str(path), stack)
        return _Stacked(str(path), arrays, None).whole()


# LAMMPS


def _is_dump(path: Path) -> bool:
    return path.suffix.lower() in (*ENDINGS, *TEXT_SUFFIXES) and is_dump(path)


class _Dumps(PointFrames):
    """Dumps with a frame or many in each file."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._dumps = [LammpsDump(path) for path in paths]
        self._frames = [
            (dump, number) for dump in self._dumps for number in range(len(dump.snapshots))
        ]
        self.time_unit = self._dumps[0].units.get("time")

    @property
    def count(self) -> int:
        return len(self._frames)

    @property
    def times(self) -> NDArray[np.float64] | None:
        times = [dump.snapshots[number].time for dump, number in self._frames]
        known = [time for time in times if time is not None]
        return np.array(known) if len(known) == len(times) else None

    def frames(self, start: int = 0) -> Iterator[tuple[str, PointTable]]:
        for dump, number in self._frames[start:]:
            yield str(dump.path), PointTable(dump.columns(number), dump.units)


# Text


class _TimedTable(PointFrames):
    """A table in text; with a column of times, the points of a time follow each other."""

    def __init__(self, path: Path, time: str | None) -> None:
        self._path = path
        with reading(path):
            self._table = TextTable.look_at(path)
        self._labels = [_label(cell) for cell in self._table.cells]
        self._units = {_label(cell): unit for cell in self._table.cells if (unit := _unit(cell))}
        if not any(re.match(r"[A-Za-z]", label) for label in self._labels):
            raise SourceError(
                f"{path}, line 1: {self._table.first[:60]!r}, expected names of columns such as "
                "x,y,temperature"
            )
        if len(set(self._labels)) < len(self._labels):
            raise SourceError(f"{path}, line 1: two columns have one name")
        if time is not None and time not in self._labels:
            raise SourceError(f"{path}: there is no column {time!r} for time")
        self._time = self.time_label = time or _time_in(self._labels)
        self.has_time = bool(self._time)
        self.time_unit = self._units.get(self._time)

    @property
    def count(self) -> int:
        return len(self._starts)

    @property
    def times(self) -> NDArray[np.float64]:
        return self._index[0]

    @property
    def _starts(self) -> NDArray[np.int64]:
        return self._index[1]

    @cached_property
    def _index(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Times of the frames, and the number of the first row of each."""
        times: list[NDArray[np.float64]] = []
        starts: list[NDArray[np.int64]] = []
        row, before = 0, np.nan
        for part in self.chunks(_ROWS, [self._time]):
            values = np.asarray(part.columns[self._time], np.float64)
            new = np.flatnonzero(values != np.concatenate([[before], values[:-1]]))
            times.append(values[new])
            starts.append(new + row)
            row, before = row + len(values), values[-1]
        found = np.concatenate(times) if times else np.empty(0)
        return found, np.append(np.concatenate(starts), row)[:-1] if starts else np.empty(0, int)

    def frames(self, start: int = 0) -> Iterator[tuple[str, PointTable]]:
        times = self.times[start:]
        wanted, kept = 0, PointTable({}, self._units)
        skip = int(self._starts[start]) if start < self.count else 0
        for part in self.chunks(_ROWS, skip=skip):
            kept = _joined(kept, part)
            while wanted < len(times) - 1:
                at = np.asarray(kept.columns[self._time], np.float64)
                end = np.flatnonzero(at != times[wanted])
                if not end.size:
                    break
                yield str(self._path), _cut(kept, slice(0, int(end[0])))
                kept, wanted = _cut(kept, slice(int(end[0]), None)), wanted + 1
            check_samples(str(self._path), _length(kept))
        if wanted < len(times):
            yield str(self._path), kept

    def chunks(
        self, rows: int | None, only: list[str] | None = None, skip: int = 0
    ) -> Iterator[PointTable]:
        """Parts of the table, as many rows each."""
        import pandas as pd

        with reading(self._path), self._path.open(encoding="utf-8-sig") as stream:
            reader = pd.read_csv(
                stream,
                names=self._labels,
                header=0,
                index_col=False,
                usecols=only,
                chunksize=rows,
                skiprows=range(1, skip + 1),
                on_bad_lines="error",
                **self._table.options,
            )
            with reader if rows is not None else ExitStack():
                for part in reader if rows is not None else [reader]:
                    yield self._checked(part, skip)

    def _checked(self, part: Any, skip: int) -> PointTable:
        columns = {label: part[label].to_numpy() for label in part.columns}
        first = skip + int(part.index[0]) if len(part) else skip
        texts = {
            label: (first + text[0], text[1])
            for label, values in columns.items()
            if (text := self._first_text(values)) is not None
        }
        table = PointTable(columns, self._units, texts)
        if self._time in columns:
            table.numbers(str(self._path), self._time)
        return table

    def _first_text(self, values: NDArray[Any]) -> tuple[int, str] | None:
        """Row and content of the first cell that is no number."""
        if values.dtype.kind in "fiub":
            return None
        for row, cell in enumerate(values):
            try:
                float(str(cell).replace(self._table.options["decimal"], "."))
            except ValueError:
                return row, str(cell)
        return None


def _time_in(labels: Sequence[str]) -> str:
    """The column of times; ``t`` is one beside a column that surely is the temperature."""
    match = [label for label in labels if simple(label) in _TIMES]
    if not match and any(simple(label) in _SURELY_TEMPERATURE for label in labels):
        match = [label for label in labels if simple(label) == _PERHAPS_TIME]
    return match[0] if match else ""


def _label(cell: str) -> str:
    return re.split(r"[\[(]", cell)[0].strip() or cell


def _unit(cell: str) -> str | None:
    match = re.search(r"[\[(]([^\])]*)[\])]\s*$", cell)
    return match[1].strip() if match else None


def _length(table: PointTable) -> int:
    return len(next(iter(table.columns.values()), ()))


def _joined(first: PointTable, second: PointTable) -> PointTable:
    if not first.columns:
        return second
    names = first.columns
    joined = {n: np.concatenate([first.columns[n], second.columns[n]]) for n in names}
    return PointTable(joined, first.units, {**second.texts, **first.texts})


def _cut(table: PointTable, part: slice) -> PointTable:
    columns = {name: values[part] for name, values in table.columns.items()}
    return PointTable(columns, table.units, table.texts)


# Arrays


class _Stacked(PointFrames):
    """Arrays of shape (points,) or (points, 2 or 3); with a list of times, time comes first."""

    def __init__(self, path: str, arrays: Mapping[str, StoredArray], time: str | None) -> None:
        self._path = path
        self._arrays = {_last(label): array for label, array in arrays.items()}
        if time is not None and time not in self._arrays:
            raise SourceError(f"{path}: there is no list {time!r} for time")
        names = [time] if time else self._like_times()
        lists = [name for name in names if max(self._arrays[name].shape, default=0) > 0]
        self._time = self.time_label = lists[0] if lists else ""
        depth = max((self._depth(name) for name in self._arrays if name != self._time), default=1)
        self.has_time = bool(self._time) and depth == 2
        self._times: NDArray[np.float64] | None = None
        if self.has_time:
            array = self._arrays[self._time]
            check_samples(f"{path}: {self._time}", int(np.prod(array.shape, dtype=float)))
            self._times = np.asarray(self._read(self._time, None), np.float64).reshape(-1)
            self.time_unit = _text(array.attributes.get("units"))
        self._check_lengths()

    @property
    def times(self) -> NDArray[np.float64] | None:
        return self._times

    @property
    def count(self) -> int:
        return 1 if self._times is None else len(self._times)

    def frames(self, start: int = 0) -> Iterator[tuple[str, PointTable]]:
        for index in range(start, self.count):
            yield self._path, self._table(index)

    def whole(self) -> PointTable:
        """The only frame."""
        return self._table(None)

    def _like_times(self) -> list[str]:
        """Arrays by the name of times; ``t`` only if others have more axes than it has."""
        known = [name for name in self._arrays if simple(name) in _TIMES]
        lists = [name for name, array in self._arrays.items() if len(array.shape) == 1]
        deeper = any(self._depth(name) == 2 for name in self._arrays)
        return known or [name for name in lists if deeper and simple(name) == _PERHAPS_TIME]

    def _check_lengths(self) -> None:
        for name in self._columns:
            length = self._arrays[name].shape[0]
            if self.has_time and length != self.count:
                raise SourceError(
                    f"{self._path}: {name} has {length} frames, expected {self.count} "
                    f"as {self._time}"
                )

    @property
    def _columns(self) -> list[str]:
        """Names of the arrays that have a number for every point."""
        depth = 2 if self.has_time else 1
        return [n for n in self._arrays if n != self._time and self._depth(n) == depth]

    def _depth(self, name: str) -> int:
        """Number of axes, without that of the components."""
        shape = self._arrays[name].shape
        return len(shape) - (1 if self._is_vector(name) else 0)

    def _is_vector(self, name: str) -> bool:
        shape = self._arrays[name].shape
        known = simple(name) in _PLACES or "vel" in simple(name)
        return len(shape) > 1 and shape[-1] in (2, 3) and (known or shape[-2] > 3)

    def _table(self, index: int | None) -> PointTable:
        columns: dict[str, NDArray[Any]] = {}
        units: dict[str, str] = {}
        for name in self._columns:
            values = self._read(name, index)
            unit = _text(self._arrays[name].attributes.get("units"))
            parts = _components(name, values)
            columns.update(parts)
            units.update({part: unit for part in parts if unit is not None})
        return PointTable(columns, units)

    def _read(self, name: str, index: int | None) -> NDArray[Any]:
        array = self._arrays[name]
        rest = (slice(None),) * (len(array.shape) - 1)
        shape = array.shape if index is None else array.shape[1:]
        check_samples(f"{self._path}: {name}", int(np.prod(shape, dtype=float)))
        check_samples(
            f"{self._path}: {name}: a chunk", int(np.prod(array.chunks or 1, dtype=float))
        )
        with reading(f"{self._path}: {name}"):
            first = slice(None) if index is None else slice(index, index + 1)
            values = array.read((first, *rest)) if array.shape else array.read(())
        return values if index is None else values[0]


def _last(label: str) -> str:
    return label.rsplit("/", 1)[-1]


def _text(value: Any) -> str | None:
    return value if isinstance(value, str) else None


def _components(name: str, values: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """A column for every component, named ``x``, ``y``, ``z`` for places."""
    if values.ndim == 1:
        return {name: values}
    prefix = "" if simple(name) in _PLACES else f"{name}_"
    return {f"{prefix}{_LETTERS[i]}": values[:, i] for i in range(values.shape[1])}


# VTK


def _read_vtk(path: Path) -> PointTable:
    pyvista = required("pyvista", path, "mesh", "PyVista")
    mesh = mesh_vtk.read_data(path)
    if not isinstance(mesh, pyvista.DataSet) or mesh.n_points == 0:
        raise SourceError(f"{path}: has no points")
    columns = _components("points", np.asarray(mesh.points, np.float64))
    for name in mesh.point_data:
        values = np.asarray(mesh.point_data[name])
        if values.dtype.kind in "fiub" and (values.ndim == 1 or values.shape[1] in (2, 3)):
            columns.update(_components(name, values))
    return PointTable(columns)
