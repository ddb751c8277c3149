"""Dumps of LAMMPS in text: points over time, as ``dump custom`` writes them."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import check_samples
from chipglow.io.sources.source import SourceError, reading

ENDINGS: Final = (".dump", ".lammpstrj", ".lammpsdump")

_ITEM: Final = "ITEM: "
_LONGEST_LINE: Final = 100_000
_LENGTHS: Final[Mapping[str, tuple[str, str]]] = {
    "si": ("m", "s"), "cgs": ("cm", "s"), "micro": ("um", "us"), "nano": ("nm", "ns"),
    "metal": ("angstrom", "ps"), "real": ("angstrom", "fs"),
}  # fmt: skip
"""Units of length and time by LAMMPS's names of its systems of units."""


@dataclass(frozen=True)
class Snapshot:
    """Frame of a dump."""

    path: Path
    start: int
    """Byte at which the lines of its atoms begin."""
    count: int
    """Number of atoms."""
    labels: Sequence[str]
    """Names of the columns."""
    box: NDArray[np.float64]
    """Lowest and highest place along x, y and z, shape (3, 2)."""
    tilted: bool
    """Whether the box is oblique."""
    time: float | None
    """Time in the dump's unit."""
    units: Mapping[str, str]
    """Units of places, velocities and times, if the dump states its system of units."""

    def columns(self) -> dict[str, NDArray[Any]]:
        """Return the numbers of the atoms by column, with their places as ``x``, ``y``, ``z``."""
        import pandas as pd

        check_samples(f"{self.path}: a frame", self.count * len(self.labels))
        with self.path.open("rb") as stream, reading(self.path):
            stream.seek(self.start)
            table = pd.read_csv(stream, sep=r"\s+", header=None, nrows=self.count)
        if table.shape[1] != len(self.labels):
            raise SourceError(
                f"{self.path}: {table.shape[1]} numbers for an atom, expected {len(self.labels)}"
            )
        table.columns = pd.Index(self.labels)
        numbers = table.select_dtypes("number")
        columns = {label: numbers[label].to_numpy(np.float64) for label in numbers}
        for (low, high), axis in zip(self.box, "xyz", strict=True):
            # Places may be unwrapped or fractions of the box.
            names = [
                name for name in (axis, f"{axis}u", f"{axis}s", f"{axis}su") if name in columns
            ]
            if names:
                values = columns.pop(names[0])
                scaled = "s" in names[0]
                if scaled and self.tilted:
                    raise SourceError(
                        f"{self.path}: {names[0]} in an oblique box, expected places as {axis}"
                    )
                columns[axis] = low + values * (high - low) if scaled else values
        return columns


def is_dump(path: Path) -> bool:
    """Whether a file begins as a dump of LAMMPS in text does."""
    with path.open("rb") as stream:
        return stream.read(len(_ITEM)) == _ITEM.encode()


def snapshots(path: Path) -> list[Snapshot]:
    """Return all frames of a dump, whose atoms are not read yet."""
    found: list[Snapshot] = []
    items: dict[str, list[str]] = {}
    units: dict[str, str] = {}
    with path.open("rb") as stream:
        while line := _line(stream):
            if not line.startswith(_ITEM):
                raise SourceError(f"{path}: {line[:40]!r}, expected ITEM: as LAMMPS writes it")
            name = re.split(r" (?=[a-z])|(?<=BOUNDS)", line.removeprefix(_ITEM).strip())[0]
            if name != "ATOMS":
                lines = 3 if name == "BOX BOUNDS" else 1
                items[name] = [line, *(_line(stream) for _ in range(lines))]
                continue
            if "UNITS" in items:
                units = _units(items["UNITS"][1].strip())
            found.append(_snapshot(path, items, line, stream.tell(), units))
            _skip(found[-1], stream)
            items = {}
    return found


def _units(system: str) -> dict[str, str]:
    if system not in _LENGTHS:
        return {}
    length, time = _LENGTHS[system]
    places = dict.fromkeys("xyz", length)
    return {**places, **dict.fromkeys(("vx", "vy", "vz"), f"{length}/{time}"), "time": time}


def _snapshot(
    path: Path,
    items: Mapping[str, list[str]],
    atoms: str,
    start: int,
    units: Mapping[str, str],
) -> Snapshot:
    try:
        count = int(items["NUMBER OF ATOMS"][1])
        bounds = items["BOX BOUNDS"]
        box = np.array([[float(cell) for cell in line.split()[:2]] for line in bounds[1:]])
        time = float(items["TIME"][1]) if "TIME" in items else None
    except (KeyError, ValueError, IndexError):
        raise SourceError(f"{path}: a frame's head is damaged") from None
    if count < 1 or box.shape != (3, 2):
        raise SourceError(f"{path}: a frame with {count} atoms, expected 1 or more")
    labels = atoms.removeprefix(f"{_ITEM}ATOMS").split()
    if not labels or len(set(labels)) < len(labels):
        raise SourceError(f"{path}: {atoms[:60]!r}, expected names of columns")
    return Snapshot(path, start, count, labels, box, " xy " in bounds[0], time, units)


def _skip(frame: Snapshot, stream: IO[bytes]) -> None:
    last = b"\n"
    for number in range(frame.count):
        last = stream.readline(_LONGEST_LINE)
        if last.startswith(_ITEM.encode()) or len(last.split()) < len(frame.labels):
            raise SourceError(
                f"{frame.path}: a frame has {number} of {frame.count} atoms, it is cut short"
            )
    if not last.endswith(b"\n"):
        raise SourceError(f"{frame.path}: its last line has no end, it is cut short")


def _line(stream: IO[bytes]) -> str:
    return stream.readline(_LONGEST_LINE).decode("utf-8", "replace").rstrip("\r\n")
