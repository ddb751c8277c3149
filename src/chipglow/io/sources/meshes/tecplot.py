"""Meshes of Tecplot: ASCII and binary files, zones of finite elements or of ordered points."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from math import prod
from mmap import mmap
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.meshes.reader import Block, MeshReader, number_of
from chipglow.io.sources.meshes.tecplot_binary import (
    ELEMENTS,
    MAGIC,
    ORDERED,
    Zone,
    binary_zones,
    block_of,
)
from chipglow.io.sources.source import SourceError, head_of, mapped, naming

ENDINGS: Final = (".dat", ".tec", ".plt")

_RECORD: Final = re.compile(
    rb"(?mi)^[ \t]*(TITLE|FILETYPE|VARIABLES|ZONE|TEXT|GEOMETRY|CUSTOMLABELS|DATASETAUXDATA"
    rb"|VARAUXDATA)\b"
)
"""First words of the records of an ASCII file; only variables and zones are read."""

_KEY: Final = r'(\w+)\s*=\s*("[^"]*"|\((?:[^()]|\([^()]*\))*\)|[^\s,]+)'
_AUXILIARY: Final = r"(?mi)^\s*AUXDATA\b.*$"
_COMMENT: Final = r'("[^"]*")|#.*'
_NUMBER: Final = re.compile(rb"(?m)^[ \t]*[-+.]?\d")
_LOCATION: Final = r"\[([\d,\s-]+)\]=(\w+)"
_LOCATIONS: Final = ("NODAL", "CELLCENTERED")
_PACKINGS: Final = ("POINT", "BLOCK")
_MOST_NUMBERS: Final = 1 << 40  # of a repetition, so that sums of them cannot overflow
_NOT_READ: Final = (
    "VARSHARELIST", "CONNECTIVITYSHAREZONE", "D", "PASSIVEVARLIST", "NV", "FACENEIGHBORCONNECTIONS",
)  # fmt: skip


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
        if self.times is None and len(self._zones) > 1:
            self.remarks.append(
                f"The {len(self._zones)} zones state no SOLUTIONTIME: they are parts of one mesh."
            )

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
    records = [
        (match[1].upper(), match.start(), match.end()) for match in _RECORD.finditer(content)
    ]
    ends = [start for _, start, _ in records[1:]]
    names: tuple[str, ...] = ()
    zones: list[Zone] = []
    for (kind, _, begin), end in zip(records, [*ends, len(content)], strict=True):
        if kind == b"VARIABLES":
            with naming(f"{file}: VARIABLES"):
                if names:
                    raise ValueError("there are several; only one is allowed")
                names = _names(_text(content[begin:end]))
        elif kind == b"ZONE":
            zones.append(_ascii_zone(file, content, 1 + len(zones), names, begin, end))
    if not zones:
        raise _no_zone(file)
    return tuple(zones)


def _no_zone(file: Path) -> SourceError:
    return SourceError(
        f"{file}: has no VARIABLES and ZONE with data, expected an ASCII file of Tecplot"
    )


def _ascii_zone(
    file: Path, content: mmap, number: int, names: tuple[str, ...], begin: int, end: int
) -> Zone:
    """Return a zone of a record between two bytes of a file."""
    data = _NUMBER.search(content, begin, end)
    if not names or data is None:
        raise _no_zone(file)
    head = re.sub(_AUXILIARY, "", _text(content[begin : data.start()]))
    keys = {key.upper(): value.strip('"') for key, value in re.findall(_KEY, head)}
    with naming(f"{file}: zone {number}: SOLUTIONTIME"):
        time = number_of(keys["SOLUTIONTIME"]) if "SOLUTIONTIME" in keys else None
    return Zone(time, partial(_load, file, content, number, names, keys, data.start(), end))


def _text(content: bytes) -> str:
    """Return a header without comments."""
    return re.sub(_COMMENT, lambda match: match[1] or "", content.decode(errors="replace"))


def _names(record: str) -> tuple[str, ...]:
    """Return the names of a record of variables, which may be quoted."""
    words = re.findall(r'"([^"]*)"|([^\s,"]+)', record.strip().removeprefix("="))
    names = tuple((quoted or plain).strip() for quoted, plain in words)
    if wrong := next((plain for _, plain in words if "=" in plain), None):
        raise ValueError(f"{wrong!r} is not a name")
    if repeated := next((name for name in names if names.count(name) > 1), None):
        raise ValueError(f"{repeated!r} is repeated")
    return names


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
    with naming(f"{file}: zone {number}"):
        if unread := [key for key in _NOT_READ if key in keys]:
            raise ValueError(f"{unread[0]} is not read")
        kind, centred = _kind(keys), _centred(keys, names)
        is_block = _is_block(keys, centred)
        counts = (1, 1, 1)
        if kind == ORDERED:
            counts = (
                _count(keys, "I"),
                _count(keys, "J", default="1"),
                _count(keys, "K", default="1"),
            )
            nodes, elements, corners = prod(counts), prod(max(c - 1, 1) for c in counts), 0
        else:
            nodes, elements = _count(keys, "N", "NODES"), _count(keys, "E", "ELEMENTS")
            corners = ELEMENTS[kind][0]
        sizes = [elements if name in centred else nodes for name in names]
        values = _numbers(content[begin:end], sum(sizes) + elements * corners)
        if is_block:
            parts = np.split(values[: sum(sizes)], np.cumsum(sizes)[:-1])
        else:
            parts = list(values[: sum(sizes)].reshape(nodes, len(names)).T)
        columns = dict(zip(names, parts, strict=True))
        title = tuple(filter(None, (keys.get("T", "").strip(), str(number))))
        if kind == ORDERED:
            return block_of(title, columns, centred, ORDERED, counts)
        corner_nodes = values[sum(sizes) :].reshape(elements, corners)
        cells = corner_nodes.astype(np.int64) - 1
        if (cells + 1 != corner_nodes).any():
            raise ValueError("nodes of elements are not whole numbers")
        return block_of(title, columns, centred, kind, cells)


def _kind(keys: Mapping[str, str]) -> str:
    """Return the type of the elements of a zone, or `ORDERED`."""
    if "ZONETYPE" in keys:
        kind = keys["ZONETYPE"].upper().removeprefix("FE")
    elif "ET" in keys:
        kind = keys["ET"].upper()
    elif keys.get("F", "").upper().startswith("FE"):
        raise ValueError("ET is not stated, expected the type of the elements")
    else:
        kind = ORDERED
    if kind != ORDERED and kind not in ELEMENTS:
        raise ValueError(
            f"elements of the type {kind} are not read, expected {', '.join(ELEMENTS)}"
        )
    return kind


def _count(keys: Mapping[str, str], *names: str, default: str = "not stated") -> int:
    """Return a positive number that a zone states under one of some names."""
    stated = next((keys[name] for name in names if name in keys), default)
    if not stated.isdecimal() or int(stated) < 1:
        raise ValueError(f"{names[-1]} is {stated}, expected 1 or more")
    return int(stated)


def _is_block(keys: Mapping[str, str], centred: Collection[str]) -> bool:
    """Return whether a zone has all values of one variable together."""
    stated = keys.get("DATAPACKING", keys.get("F", "not stated")).upper().removeprefix("FE")
    if stated not in _PACKINGS:
        # Older versions take POINT for granted, newer ones BLOCK.
        raise ValueError(f"DATAPACKING is {stated.lower()}, expected POINT or BLOCK")
    if centred and stated != "BLOCK":
        raise ValueError("VARLOCATION has values of elements, expected DATAPACKING=BLOCK")
    return stated == "BLOCK"


def _numbers(content: bytes, expected: int) -> NDArray[np.float64]:
    """Return as many numbers; ``3*0`` are three zeros."""
    words = re.sub(rb"#.*", b"", content).replace(b",", b" ").split()
    try:
        values = np.array(words, np.float64)
        repeats = np.ones(len(words), np.int64)
    except ValueError:
        pairs = [word.decode(errors="replace").rpartition("*") for word in words]
        values = np.array([number_of(number) for _, _, number in pairs])
        repeats = np.array([_repeat(count) if star else 1 for count, star, _ in pairs])
    if repeats.sum() != expected:
        raise ValueError(f"{repeats.sum()} numbers, expected {expected}")
    return np.repeat(values, repeats)


def _repeat(count: str) -> int:
    if not count.isdecimal():
        raise ValueError(f"{count!r} before * is not a number of repetitions")
    return min(int(count), _MOST_NUMBERS)


def _centred(keys: Mapping[str, str], names: Sequence[str]) -> set[str]:
    """Return names of the variables with values of elements."""
    stated = "".join(keys.get("VARLOCATION", "").upper().split())
    found: dict[int, str] = {}
    if "[" in stated:
        for numbers, place in re.findall(_LOCATION, stated):
            found |= dict.fromkeys(_members(numbers, len(names)), place)
        rest = re.sub(_LOCATION, "", stated)
    else:
        found = dict(enumerate(filter(None, re.split("[(),]", stated))))
        rest = "" if len(found) in (0, len(names)) else stated
    if rest.strip("(,)") or not set(found.values()) <= set(_LOCATIONS):
        raise ValueError(f"VARLOCATION={stated} is not read, expected such as ([3-4]=CELLCENTERED)")
    return {names[at] for at, place in found.items() if place == "CELLCENTERED"}


def _members(text: str, count: int) -> Iterator[int]:
    """Yield the indices of variables such as 3-5,7, which count from 1."""
    for word in text.split(","):
        first, _, last = word.partition("-")
        numbers = range(int(first), int(last or first) + 1)
        if not numbers or numbers[0] < 1 or numbers[-1] > count:
            raise ValueError(f"VARLOCATION: there is no variable {word}, expected 1 to {count}")
        yield from (number - 1 for number in numbers)
