"""Binary files of Tecplot, versions 107 to 112 (``.plt``).

After the appendix on binary files of Tecplot's Data Format Guide; what differs between versions is
as Tecplot's own library (TecIO) has it: no kind of packing from 112 on, tables of raw face
neighbours from 108, the type of the file from 111.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.source import SourceError
from chipglow.io.sources.tecplot_zone import ELEMENTS, ORDERED, Zone, block_of

MAGIC: Final = b"#!TDV"

_VERSIONS: Final = (*range(107, 113), 191)
_ZONE, _GEOMETRY, _TEXT, _LABELS, _RECORD, _ABOUT_FILE, _ABOUT_VARIABLE, _END_OF_HEADER = (
    299.0, 399.0, 499.0, 599.0, 699.0, 799.0, 899.0, 357.0,
)  # fmt: skip
_KINDS: Final = (
    ORDERED, "LINESEG", "TRIANGLE", "QUADRILATERAL", "TETRAHEDRON", "BRICK", "POLYGON",
    "POLYHEDRON",
)  # fmt: skip
_FACES: Final = {"TRIANGLE": 3, "QUADRILATERAL": 4, "TETRAHEDRON": 4, "BRICK": 6}
_NUMBERS: Final = {1: "f4", 2: "f8", 3: "i4", 4: "i2", 5: "u1"}
_NEIGHBOURS: Final = {0: 3, 2: 4}
"""Numbers of a connection of faces by its mode; those from one face to many vary."""
_LONGEST_TEXT: Final = 32_000
_PART_OF_TEXT: Final = 32
_STATIC: Final = -1
_ALONE: Final = -1
_SOLUTION: Final = 2
_LINE, _RECTANGLE, _ELLIPSE = 0, 1, 4
_GRID_3D: Final = 4


@dataclass(frozen=True)
class _Stored:
    """Where numbers are in a file."""

    kind: str
    begin: int
    count: int

    def read(self, file: Path) -> NDArray[Any]:
        return np.fromfile(file, self.kind, self.count, offset=self.begin)


@dataclass(frozen=True)
class _Header:
    """What the header of a file says of a zone."""

    name: str
    strand: int
    time: float
    kind: str
    shape: tuple[int, int, int]
    elements: int
    centred: tuple[bool, ...]
    neighbours: int

    @property
    def nodes(self) -> int:
        across, down, deep = self.shape
        return across * down * deep

    @property
    def is_empty(self) -> bool:
        return not self.nodes or (self.kind != ORDERED and not self.elements)

    def padded(self, ghosts: bool) -> tuple[int, int, int]:
        """Values of elements of an ordered zone as they are stored, along i, j and k."""
        # The guide has as many as points, TecIO leaves out the last ones along the slowest index.
        sides = list(self.shape)
        slowest = max((axis for axis in range(3) if sides[axis] > 1), default=0)
        sides[slowest] -= 0 if ghosts else min(sides[slowest] - 1, 1)
        return sides[0], sides[1], sides[2]

    def count(self, variable: int, ghosts: bool) -> int:
        """How many values a variable has in the file."""
        if not self.centred[variable]:
            return self.nodes
        across, down, deep = self.padded(ghosts)
        return across * down * deep if self.kind == ORDERED else self.elements


@dataclass(frozen=True)
class BinaryZone(Zone):
    """A zone, and where its numbers are in the file."""

    file: Path
    number: int
    names: tuple[str, ...]
    header: _Header
    columns: tuple[_Stored | None, ...]
    cells: _Stored | None
    ghosts: bool

    @property
    def time(self) -> float | None:
        """Its time; None for what Tecplot calls static: it is there at all times."""
        return None if self.header.strand == _STATIC else self.header.time

    def _block(self) -> Block:
        """Its mesh and fields; variables that are passive here are not among them."""
        header = self.header
        columns = {
            name: self._values(variable, stored)
            for variable, (name, stored) in enumerate(zip(self.names, self.columns, strict=True))
            if stored is not None
        }
        centred = {name for name, is_so in zip(self.names, header.centred, strict=True) if is_so}
        called = tuple(filter(None, (header.name.strip(), str(self.number))))
        if self.cells is None:
            return block_of(called, columns, centred, ORDERED, header.shape)
        cells = self.cells.read(self.file).reshape(header.elements, -1).astype(np.int64)
        return block_of(called, columns, centred, header.kind, cells)

    def _values(self, variable: int, stored: _Stored) -> NDArray[np.float64]:
        values = stored.read(self.file).astype(np.float64)
        if self.header.kind != ORDERED or not self.header.centred[variable]:
            return values
        shape = self.header.padded(self.ghosts)
        kept = tuple(slice(max(side - 1, 1)) for side in self.header.shape)
        inner: NDArray[np.float64] = values.reshape(shape, order="F")[kept].ravel(order="F")
        return inner


def binary_zones(file: Path) -> tuple[BinaryZone, ...]:
    """Zones of a binary file, without their numbers.

    Raises
    ------
    SourceError
        If it is damaged, of another version, or has zones of a kind that is not read.
    """
    with file.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as content:
        cursor = _Cursor(file, content)
        version = cursor.version()
        names = cursor.variables(version)
        headers = _headers(cursor, version, len(names))
        begin = cursor.at
        try:
            return _located(cursor, names, headers, ghosts=False)
        except SourceError:
            if not any(header.kind == ORDERED and any(header.centred) for header in headers):
                raise
        cursor.at = begin
        return _located(cursor, names, headers, ghosts=True)


class _Cursor:
    """A place in a file that moves on; nothing beyond the file's end is asked for."""

    def __init__(self, file: Path, content: mmap) -> None:
        self.file, self.at = file, 0
        self._content, self._order = content, "<"

    def damaged(self, said: str) -> SourceError:
        return SourceError(f"{self.file}: {said}, expected a binary file of Tecplot that is whole")

    def refused(self, said: str) -> SourceError:
        return SourceError(f"{self.file}: {said}")

    @property
    def left(self) -> int:
        return len(self._content) - self.at

    def skip(self, kind: str, count: int) -> _Stored:
        """Where as many numbers are that begin here."""
        stored = _Stored(self._order + kind, self.at, count)
        size = np.dtype(kind).itemsize * count
        if count < 0 or size > self.left:
            raise self.damaged(f"{count} numbers at byte {self.at} of {len(self._content)}")
        self.at += size
        return stored

    def numbers(self, kind: str, count: int) -> list[Any]:
        stored = self.skip(kind, count)
        values: list[Any] = np.frombuffer(
            self._content[stored.begin : self.at], stored.kind
        ).tolist()
        return values

    def integer(self) -> int:
        return int(self.numbers("i4", 1)[0])

    def marker(self) -> float:
        return float(self.numbers("f4", 1)[0])

    def text(self) -> str:
        """Letters of 32 bits each, up to a zero."""
        letters: list[int] = []
        while not letters or letters[-1]:
            if len(letters) > _LONGEST_TEXT:
                raise self.damaged(f"a text of over {_LONGEST_TEXT} letters at byte {self.at}")
            part = self.numbers("i4", min(_PART_OF_TEXT, max(self.left // 4, 1)))
            end = part.index(0) + 1 if 0 in part else len(part)
            self.at -= 4 * (len(part) - end)
            letters += part[:end]
        return bytes(letter & 0xFF for letter in letters[:-1]).decode("utf-8", "replace")

    def version(self) -> int:
        """Version, and which byte of a number is first."""
        magic = self._content[:8]
        digits = magic[len(MAGIC) :].decode("ascii", "replace").strip()
        if not digits.isdecimal() or int(digits) not in _VERSIONS:
            raise self.refused(
                f"is binary Tecplot of version {digits!r}, expected "
                f"{_VERSIONS[0]} to {_VERSIONS[-2]}: save it anew, or as ASCII"
            )
        self.at = 8
        if self.integer() != 1:
            self.at, self._order = 8, ">"
            if self.integer() != 1:
                raise self.damaged("its order of bytes is unknown")
        return int(digits)

    def variables(self, version: int) -> tuple[str, ...]:
        if version >= 111 and self.integer() == _SOLUTION:
            raise self.refused("is a solution without its grid, expected a file with both")
        self.text()
        count = self.integer()
        if not 0 < count <= self.left // 4:
            raise self.damaged(f"{count} variables")
        return tuple(self.text().strip() for _ in range(count))


def _headers(cursor: _Cursor, version: int, variables: int) -> list[_Header]:
    """What is said of the zones, up to the end of the header."""
    found: list[_Header] = []
    while (marker := cursor.marker()) != _END_OF_HEADER:
        if marker == _ZONE:
            found.append(_header(cursor, version, variables, 1 + len(found)))
        elif marker == _GEOMETRY:
            _skip_geometry(cursor)
        elif marker == _TEXT:
            _skip_text(cursor)
        elif marker == _LABELS:
            for _ in range(cursor.integer()):
                cursor.text()
        elif marker == _RECORD:
            cursor.text()
        elif marker in (_ABOUT_FILE, _ABOUT_VARIABLE):
            cursor.skip("i4", 1 if marker == _ABOUT_VARIABLE else 0)
            _skip_remark(cursor)
        else:
            raise cursor.damaged(f"mark {marker:g} at byte {cursor.at - 4}")
    if not found:
        raise cursor.damaged("no zone")
    return _in_strands(found)


def _in_strands(headers: list[_Header]) -> list[_Header]:
    """Zones with a strand, if none has one and each has a time of its own.

    To Tecplot they would be there at all times, but who writes such a file means their times.
    """
    static = all(header.strand == _STATIC for header in headers)
    if static and len({header.time for header in headers}) == len(headers):
        return [replace(header, strand=_STATIC + 1) for header in headers]
    return headers


def _header(cursor: _Cursor, version: int, variables: int, number: int) -> _Header:
    name = cursor.text()
    _, strand = cursor.numbers("i4", 2)
    (time,) = cursor.numbers("f8", 1)
    _, kind_number = cursor.numbers("i4", 2)
    if not 0 <= kind_number < len(_KINDS):
        raise cursor.damaged(f"zone {number} is of the kind {kind_number}")
    kind = _KINDS[kind_number]
    if kind != ORDERED and kind not in ELEMENTS:
        raise cursor.refused(
            f"zone {number} has elements of the kind FE{kind}, expected points in order, "
            "triangles, quadrilaterals, tetrahedra or bricks"
        )
    if version < 112 and cursor.integer():
        raise cursor.refused(f"zone {number} is packed by points, expected by blocks")
    centred = cursor.numbers("i4", variables) if cursor.integer() else [0] * variables
    raw = cursor.integer() if version >= 108 else 0
    connections = cursor.integer()
    mode = cursor.integer() if connections else 0
    if connections and kind != ORDERED and version >= 108:
        cursor.integer()
    if mode not in _NEIGHBOURS:
        raise cursor.refused(f"zone {number} has faces with many neighbours, which are not read")
    if kind == ORDERED:
        across, down, deep = cursor.numbers("i4", 3)
        elements = 0
    else:
        across, elements = cursor.numbers("i4", 2)
        down, deep = 1, 1
        cursor.skip("i4", 3)
    if not isfinite(time):
        raise cursor.damaged(f"zone {number} is at the time {time}")
    if min(across, down, deep, elements, connections) < 0:
        raise cursor.damaged(f"zone {number} has {across} points and {elements} elements")
    while cursor.integer():
        _skip_remark(cursor)
    return _Header(
        name,
        strand,
        time,
        kind,
        (across, down, deep),
        elements,
        tuple(bool(place) for place in centred),
        connections * _NEIGHBOURS[mode] + (elements * _FACES.get(kind, 0) if raw else 0),
    )


def _skip_remark(cursor: _Cursor) -> None:
    cursor.text()
    cursor.skip("i4", 1)
    cursor.text()


def _skip_geometry(cursor: _Cursor) -> None:
    system, *_ = cursor.numbers("i4", 3)
    cursor.skip("f8", 3)
    *_, shape, _ = cursor.numbers("i4", 6)
    cursor.skip("f8", 2)
    cursor.skip("i4", 3)
    cursor.skip("f8", 2)
    cursor.text()
    precision, _ = cursor.numbers("i4", 2)
    kind = "f4" if precision == 1 else "f8"
    if shape != _LINE:
        cursor.skip(kind, 2 if shape in (_RECTANGLE, _ELLIPSE) else 1)
        return
    for _ in range(cursor.integer()):
        cursor.skip(kind, cursor.integer() * (3 if system == _GRID_3D else 2))


def _skip_text(cursor: _Cursor) -> None:
    for kind, count in (("i4", 2), ("f8", 3), ("i4", 2), ("f8", 1), ("i4", 1), ("f8", 2),
                        ("i4", 2), ("f8", 2), ("i4", 3)):  # fmt: skip
        cursor.skip(kind, count)
    cursor.text()
    cursor.skip("i4", 1)
    cursor.text()


def _located(
    cursor: _Cursor, names: tuple[str, ...], headers: Sequence[_Header], ghosts: bool
) -> tuple[BinaryZone, ...]:
    """Where the numbers of the zones are; each zone has to begin where the one before ends."""
    zones: list[BinaryZone] = []
    for header in headers:
        if (marker := cursor.marker()) != _ZONE:
            raise cursor.damaged(f"mark {marker:g} in place of zone {1 + len(zones)}")
        zones.append(_zone(cursor, names, header, zones, ghosts))
    if cursor.left:
        raise cursor.damaged(f"{cursor.left} bytes after the last zone")
    return tuple(zone for zone in zones if not zone.header.is_empty)


def _zone(
    cursor: _Cursor,
    names: tuple[str, ...],
    header: _Header,
    before: Sequence[BinaryZone],
    ghosts: bool,
) -> BinaryZone:
    number, variables = 1 + len(before), len(names)
    kinds = cursor.numbers("i4", variables)
    passive = cursor.numbers("i4", variables) if cursor.integer() else [0] * variables
    shared = cursor.numbers("i4", variables) if cursor.integer() else [_ALONE] * variables
    with_cells_of = cursor.integer()
    own = [not is_passive and of == _ALONE for is_passive, of in zip(passive, shared, strict=True)]
    cursor.skip("f8", 2 * sum(own))
    columns: list[_Stored | None] = []
    for variable in range(variables):
        count = header.count(variable, ghosts)
        if own[variable]:
            if kinds[variable] not in _NUMBERS:
                raise cursor.refused(
                    f"zone {number}: {names[variable]!r} has numbers of the kind "
                    f"{kinds[variable]}, expected 1 to {len(_NUMBERS)}"
                )
            columns.append(cursor.skip(_NUMBERS[kinds[variable]], count))
        elif passive[variable]:
            columns.append(None)
        else:
            stored = _other(cursor, before, shared[variable]).columns[variable]
            if stored is not None and stored.count != count:
                raise cursor.damaged(
                    f"zone {number} shares {stored.count} numbers of {names[variable]!r}, "
                    f"it has {count}"
                )
            columns.append(stored)
    cells = _cells(cursor, header, before, with_cells_of)
    return BinaryZone(cursor.file, number, names, header, tuple(columns), cells, ghosts)


def _cells(
    cursor: _Cursor, header: _Header, before: Sequence[BinaryZone], of: int
) -> _Stored | None:
    if of != _ALONE and header.kind != ORDERED:
        other = _other(cursor, before, of)
        if (other.header.kind, other.header.elements) != (header.kind, header.elements):
            raise cursor.damaged(f"zone {1 + len(before)} shares elements of another kind")
        return other.cells
    cells = None
    if header.kind != ORDERED:
        cells = cursor.skip("i4", header.elements * ELEMENTS[header.kind][0])
    if of == _ALONE:
        cursor.skip("i4", header.neighbours)
    return cells


def _other(cursor: _Cursor, before: Sequence[BinaryZone], number: int) -> BinaryZone:
    if not 0 <= number < len(before):
        raise cursor.damaged(
            f"zone {1 + len(before)} shares with zone {number + 1}, expected one before it"
        )
    return before[number]
