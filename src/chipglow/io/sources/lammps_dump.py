"""Dumps of LAMMPS in text: points over time, as ``dump custom`` writes them."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.arrays import check_samples
from chipglow.io.sources.source import SourceError, reading

ENDINGS: Final = (".dump", ".lammpstrj", ".lammpsdump")

_ITEM: Final = b"ITEM: "
_ATOMS: Final = re.compile(rb"(?m)^ITEM: ATOMS ([^\r\n]*)\r?\n")
_LENGTHS: Final[Mapping[str, tuple[str, str]]] = {
    "si": ("m", "s"), "cgs": ("cm", "s"), "micro": ("um", "us"), "nano": ("nm", "ns"),
    "metal": ("angstrom", "ps"), "real": ("angstrom", "fs"),
}  # fmt: skip
"""Units of length and time by LAMMPS's names of its systems of units."""


@dataclass(frozen=True)
class Snapshot:
    """Frame of a dump."""

    path: Path
    rows: slice
    """Bytes of the lines of its atoms."""
    count: int
    """Number of atoms."""
    labels: tuple[str, ...]
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
        with reading(self.path), _mapped(self.path) as content:
            table = pd.read_csv(BytesIO(content[self.rows]), sep=r"\s+", header=None)
        shape = self.count, len(self.labels)
        if table.shape != shape or table.iloc[:, -1].isna().any():
            raise SourceError(
                f"{self.path}: a frame has {table.shape[0]} atoms of {table.shape[1]} numbers, "
                f"expected {shape[0]} of {shape[1]}: it is truncated"
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
    """Return whether a file begins as a dump of LAMMPS in text does."""
    with path.open("rb") as stream:
        return stream.read(len(_ITEM)) == _ITEM


def _mapped(path: Path) -> mmap:
    with path.open("rb") as stream:
        return mmap(stream.fileno(), 0, access=ACCESS_READ)


def snapshots(path: Path) -> list[Snapshot]:
    """Return all frames of a dump, whose atoms are not read yet."""
    with _mapped(path) as content:
        if content[-1:] != b"\n":
            raise SourceError(f"{path}: its last line has no end, it is truncated")
        return list(_snapshots(path, content))


def _snapshots(path: Path, content: mmap) -> Iterator[Snapshot]:
    begin, units = 0, _units("")
    for atoms in _ATOMS.finditer(content):
        head = content[begin : atoms.start()].decode("utf-8", "replace")
        begin = content.find(b"\n" + _ITEM, atoms.end() - 1) + 1 or len(content)
        items = dict(re.findall(r"ITEM: ([A-Z ]+)[^\n]*\n((?:(?!ITEM: ).*\n)*)", head))
        items = {name.strip(): value.strip() for name, value in items.items()}
        units = _units(items["UNITS"]) if "UNITS" in items else units
        try:
            count = int(items["NUMBER OF ATOMS"])
            box = np.array([line.split()[:2] for line in items["BOX BOUNDS"].split("\n")], float)
            time = float(items["TIME"]) if "TIME" in items else None
        except (KeyError, ValueError):
            raise SourceError(f"{path}: a frame's head is damaged") from None
        labels = tuple(atoms[1].decode("utf-8", "replace").split())
        if count < 1 or box.shape != (3, 2) or len(set(labels)) < max(len(labels), 1):
            raise SourceError(f"{path}: a frame's head is damaged")
        rows = slice(atoms.end(), begin)
        yield Snapshot(path, rows, count, labels, box, " xy " in head, time, units)


def _units(system: str) -> dict[str, str]:
    if system not in _LENGTHS:
        return {}
    length, time = _LENGTHS[system]
    places = dict.fromkeys("xyz", length)
    return {**places, **dict.fromkeys(("vx", "vy", "vz"), f"{length}/{time}"), "time": time}
