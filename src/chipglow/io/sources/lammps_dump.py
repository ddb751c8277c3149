"""Dumps of LAMMPS in text: points over time, as ``dump custom`` writes them."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import check_samples
from chipglow.io.sources.source import SourceError

ENDINGS: Final = (".dump", ".lammpstrj", ".lammpsdump")

_ITEM: Final = "ITEM: "
_HEAD: Final = 200
_LONGEST_LINE: Final = 100_000
_LENGTHS: Final[Mapping[str, tuple[str, str]]] = {
    "si": ("m", "s"), "cgs": ("cm", "s"), "micro": ("um", "us"), "nano": ("nm", "ns"),
    "metal": ("angstrom", "ps"), "real": ("angstrom", "fs"),
}  # fmt: skip
"""Units of length and time by LAMMPS's names of its systems of units."""


@dataclass(frozen=True)
class Snapshot:
    """Where a frame is in a dump, and what is said before its atoms.

    Parameters
    ----------
    start : int
        Byte at which the lines of its atoms begin.
    count : int
        Number of atoms.
    labels : sequence of str
        Names of the columns.
    box : ndarray
        Lowest and highest place along x, y and z, shape (3, 2).
    tilted : bool
        Whether the box is oblique.
    time : float, optional
        Time, in the dump's unit.
    """

    start: int
    count: int
    labels: Sequence[str]
    box: NDArray[np.float64]
    tilted: bool
    time: float | None


@dataclass(frozen=True)
class LammpsDump:
    """A dump in text.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    SourceError
        If it is no dump, or cut short.
    """

    path: Path
    _found: dict[str, str] = field(default_factory=dict)

    @cached_property
    def snapshots(self) -> tuple[Snapshot, ...]:
        """All frames of the file."""
        with self.path.open("rb") as stream:
            return tuple(self._snapshots(stream))

    @property
    def units(self) -> dict[str, str]:
        """Units of places, velocities and times, if the dump says its system of units."""
        found = _LENGTHS.get(self._found.get("UNITS", "") if self.snapshots else "")
        if found is None:
            return {}
        length, time = found
        places = dict.fromkeys("xyz", length)
        return {**places, **dict.fromkeys(("vx", "vy", "vz"), f"{length}/{time}"), "time": time}

    def columns(self, number: int) -> dict[str, NDArray[Any]]:
        """Numbers of the atoms of a frame, by column; places as ``x``, ``y``, ``z``."""
        one = self.snapshots[number]
        check_samples(f"{self.path}: a frame", one.count * len(one.labels))
        with self.path.open("rb") as stream:
            stream.seek(one.start)
            rows = [line.split() for line in islice(stream, one.count)]
        wrong = next((row for row in rows if len(row) != len(one.labels)), None)
        if wrong is not None:
            raise SourceError(
                f"{self.path}: frame {number}: {len(wrong)} numbers for an atom, expected "
                f"{len(one.labels)}"
            )
        table = dict(zip(one.labels, zip(*rows, strict=True), strict=True))
        columns = {label: _numbers(cells) for label, cells in table.items()}
        return self._placed(one, {label: of for label, of in columns.items() if of is not None})

    def _placed(self, one: Snapshot, columns: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """With places, which may be unwrapped or fractions of the box."""
        for (low, high), axis in zip(one.box, "xyz", strict=True):
            names = [
                name for name in (axis, f"{axis}u", f"{axis}s", f"{axis}su") if name in columns
            ]
            if not names:
                continue
            values = columns.pop(names[0])
            if "s" in names[0]:
                if one.tilted:
                    raise SourceError(
                        f"{self.path}: {names[0]} in an oblique box, expected places as {axis}"
                    )
                values = low + values * (high - low)
            columns[axis] = values
        return columns

    def _snapshots(self, stream: IO[bytes]) -> Iterator[Snapshot]:
        items: dict[str, list[str]] = {}
        while line := self._line(stream):
            if not line.startswith(_ITEM):
                raise SourceError(f"{self.path}: {line[:40]!r}, expected ITEM: as LAMMPS writes it")
            name = re.split(r" (?=[a-z])|(?<=BOUNDS)", line.removeprefix(_ITEM).strip())[0]
            if name != "ATOMS":
                lines = 3 if name == "BOX BOUNDS" else 1
                items[name] = [line, *(self._line(stream) for _ in range(lines))]
                continue
            one = self._snapshot(items, line, stream.tell())
            self._skip(stream, one.count)
            yield one
            items = {}

    def _snapshot(self, items: Mapping[str, list[str]], atoms: str, start: int) -> Snapshot:
        try:
            count = int(items["NUMBER OF ATOMS"][1])
            bounds = items["BOX BOUNDS"]
            box = np.array([[float(cell) for cell in line.split()[:2]] for line in bounds[1:]])
            time = float(items["TIME"][1]) if "TIME" in items else None
        except (KeyError, ValueError, IndexError):
            raise SourceError(f"{self.path}: a frame's head is damaged") from None
        if count < 1 or box.shape != (3, 2):
            raise SourceError(f"{self.path}: a frame with {count} atoms, expected 1 or more")
        if "UNITS" in items:
            self._found["UNITS"] = items["UNITS"][1].strip()
        labels = atoms.removeprefix(f"{_ITEM}ATOMS").split()
        if not labels or len(set(labels)) < len(labels):
            raise SourceError(f"{self.path}: {atoms[:60]!r}, expected names of columns")
        return Snapshot(start, count, labels, box, " xy " in bounds[0], time)

    def _skip(self, stream: IO[bytes], count: int) -> None:
        last = b"\n"
        for number in range(count):
            last = stream.readline(_LONGEST_LINE)
            if not last or last.startswith(_ITEM.encode()):
                raise SourceError(
                    f"{self.path}: a frame has {number} of {count} atoms, it is cut short"
                )
        if not last.endswith(b"\n"):
            raise SourceError(f"{self.path}: its last line has no end, it is cut short")

    def _line(self, stream: IO[bytes]) -> str:
        return stream.readline(_LONGEST_LINE).decode("utf-8", "replace").rstrip("\r\n")


def is_dump(path: Path) -> bool:
    """Whether a file begins as a dump of LAMMPS in text does."""
    with path.open("rb") as stream:
        return stream.read(_HEAD).startswith(_ITEM.encode())


def _numbers(cells: Sequence[bytes]) -> NDArray[np.float64] | None:
    """Numbers of a column; None if it has text, such as names of elements."""
    try:
        return np.array(cells, dtype=np.float64)
    except ValueError:
        return None
