"""Meshes of Tecplot: ASCII and binary files, zones of finite elements or of ordered points."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise
from mmap import mmap
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.mesh_reader import Block, MeshReader
from chipglow.io.sources.source import SourceError, head_of, mapped, naming
from chipglow.io.sources.tecplot_binary import (
    ELEMENTS,
    MAGIC,
    ORDERED,
    Zone,
    binary_zones,
    block_of,
)

ENDINGS: Final = (".dat", ".tec", ".plt")

_KEY: Final = r'(\w+)\s*=\s*("[^"]*"|\((?:[^()]|\([^()]*\))*\)|[^\s,]+)'
_ZONE: Final = re.compile(rb"(?mi)^[ \t]*ZONE\b")
_NUMBER: Final = re.compile(rb"(?m)^[ \t]*[-+.]?\d")
_ORDERED: Final = (ORDERED, "POINT", "BLOCK")
_NOT_READ: Final = ("VARSHARELIST", "CONNECTIVITYSHAREZONE", "D", "PASSIVEVARLIST")


class TecplotReader(MeshReader):
    """One file for each frame, or one file with zones of different times.

    Times are ``SOLUTIONTIME`` of ASCII files and the solution times of zones in strands of binary
    ones. Zones without exist at all times.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, f"Tecplot {'binary' if _is_binary(files[0]) else 'ASCII'}")
        self._zones = _zones(files[0]) if len(files) == 1 else ()
        self.times = _times(self._zones) if self._zones else _times_of_series(files)
        self.count = max(len(self.times or ()), len(files))

    def read(self, number: int) -> Sequence[Block]:
        zones = self._zones or _zones(self.file(number))
        if self.times:
            zones = tuple(zone for zone in zones if zone.time in (None, self.times[number]))
        return tuple(zone.load() for zone in zones)


def _is_binary(file: Path) -> bool:
    return head_of(file, len(MAGIC)) == MAGIC


def _times(zones: Sequence[Zone]) -> tuple[float, ...] | None:
    return tuple(sorted({zone.time for zone in zones if zone.time is not None})) or None


def _times_of_series(files: Sequence[Path]) -> tuple[float, ...] | None:
    """Return a time per file, if those are binary: ASCII ones would have to be read as a whole."""
    if not _is_binary(files[0]):
        return None
    times = [_times(_zones(file)) or () for file in files]
    found = tuple(of_file[0] for of_file in times if len(of_file) == 1)
    rising = all(before < after for before, after in pairwise(found))
    return found if rising and len(found) == len(files) else None


def _zones(file: Path) -> tuple[Zone, ...]:
    return binary_zones(file) if _is_binary(file) else _ascii_zones(file)


def _ascii_zones(file: Path) -> tuple[Zone, ...]:
    content = mapped(file)
    starts = [match.start() for match in _ZONE.finditer(content)]
    names = _names(_text(content[: starts[0] if starts else 0]))
    zones = []
    for number, (start, end) in enumerate(pairwise([*starts, len(content)]), start=1):
        data = _NUMBER.search(content, start, end)
        if not names or data is None:
            break
        head = re.sub(r"^\s*ZONE", "", _text(content[start : data.start()]), flags=re.I)
        keys = {key.upper(): value.strip('"') for key, value in re.findall(_KEY, head)}
        with naming(f"{file}: zone {number}: SOLUTIONTIME"):
            time = float(keys["SOLUTIONTIME"]) if "SOLUTIONTIME" in keys else None
        read = partial(_load, file, content, number, names, keys, data.start(), end)
        zones.append(Zone(time, read))
    if not zones or len(zones) < len(starts):
        raise SourceError(
            f"{file}: has no VARIABLES and ZONE with data, expected an ASCII file of Tecplot"
        )
    return tuple(zones)


def _text(content: bytes) -> str:
    return re.sub(rb"(?m)^\s*#.*$", b"", content).decode(errors="replace")


def _names(header: str) -> tuple[str, ...]:
    found = re.search(r"VARIABLES\s*=(.*?)(?=\n\s*[A-Za-z]+\s*=|\Z)", header, re.S | re.I)
    if not found:
        return ()
    words = re.findall(r'"([^"]*)"|([^\s,"]+)', found.group(1))
    return tuple((quoted or plain).strip() for quoted, plain in words)


def _load(
    file: Path,
    content: mmap,
    number: int,
    names: tuple[str, ...],
    keys: Mapping[str, str],
    begin: int,
    end: int,
) -> Block:
    """Read a zone with variables of some names between two bytes of a file."""
    words = re.sub(rb"(?m)^\s*#.*$", b"", content[begin:end]).split()
    kind = keys.get("ZONETYPE", keys.get("ET", keys.get("F", ORDERED))).upper().removeprefix("FE")
    with naming(f"{file}: zone {number}"):
        if unread := [key for key in _NOT_READ if key in keys]:
            raise ValueError(f"{unread[0]} is not read")
        counts = int(keys.get("I", "1")), int(keys.get("J", "1")), int(keys.get("K", "1"))
        if kind in _ORDERED:
            nodes, elements = int(np.prod(counts)), int(np.prod([max(c - 1, 1) for c in counts]))
        else:
            nodes = int(keys.get("N") or keys["NODES"])
            elements = int(keys.get("E") or keys["ELEMENTS"])
        centred = _centred(keys, names)
        sizes = [elements if name in centred else nodes for name in names]
        if min(nodes, elements) < 1 or len(words) < sum(sizes):
            raise ValueError(f"{len(words)} numbers, expected {sum(sizes)} or more")
        values = np.array(words[: sum(sizes)], np.float64)
        if keys.get("DATAPACKING", keys.get("F", "POINT")).upper().endswith("BLOCK"):
            parts = np.split(values, np.cumsum(sizes)[:-1])
        else:
            parts = list(values.reshape(nodes, len(names)).T)
        columns = dict(zip(names, parts, strict=True))
        title = tuple(filter(None, (keys.get("T", "").strip(), str(number))))
        if kind in _ORDERED:
            return block_of(title, columns, centred, ORDERED, counts)
        cells: NDArray[np.int64] = np.array(words[sum(sizes) :], np.int64) - 1
        return block_of(title, columns, centred, kind, cells.reshape(elements, ELEMENTS[kind][0]))


def _centred(keys: Mapping[str, str], names: Sequence[str]) -> set[str]:
    """Return names of the variables with values of elements."""
    centred: set[str] = set()
    for numbers, place in re.findall(r"\[([\d,\s-]+)\]\s*=\s*(\w+)", keys.get("VARLOCATION", "")):
        for word in numbers.split(",") if place.upper() == "CELLCENTERED" else ():
            first, _, last = word.partition("-")
            centred |= set(names[int(first) - 1 : int(last or first)])
    return centred
