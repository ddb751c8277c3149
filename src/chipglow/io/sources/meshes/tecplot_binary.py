"""Zones of Tecplot, and its binary files (``.plt``), versions 107 to 112.

They follow the appendix on binary files of Tecplot's Data Format Guide; differences
between versions follow Tecplot's library (TecIO): no kind of packing since 112, tables of raw face
neighbours since 108, the type of the file since 111.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import isfinite, prod
from mmap import mmap
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import simple
from chipglow.io.sources.meshes.reader import Block
from chipglow.io.sources.source import SourceError, mapped, naming

ORDERED: Final = "ORDERED"
ELEMENTS: Final[Mapping[str, tuple[int, int]]] = {
    "LINESEG": (2, 3), "TRIANGLE": (3, 5), "QUADRILATERAL": (4, 9), "TETRAHEDRON": (4, 10),
    "BRICK": (8, 12),
}  # fmt: skip
"""Number of nodes of the elements, and their type in VTK."""

MAGIC: Final = b"#!TDV"

_VERSIONS: Final = (*range(107, 113), 191)
"""Versions of the format that are read."""

_ZONE, _GEOMETRY, _TEXT, _LABELS, _RECORD, _ABOUT_FILE, _ABOUT_VARIABLE, _END_OF_HEADER = (
    299.0, 399.0, 499.0, 599.0, 699.0, 799.0, 899.0, 357.0,
)  # fmt: skip
"""Markers of the parts of a header."""

_KINDS: Final = (
    ORDERED, "LINESEG", "TRIANGLE", "QUADRILATERAL", "TETRAHEDRON", "BRICK", "POLYGON",
    "POLYHEDRON",
)  # fmt: skip

_FACES: Final = {"TRIANGLE": 3, "QUADRILATERAL": 4, "TETRAHEDRON": 4, "BRICK": 6}
"""Number of faces of the elements."""

_NUMBERS: Final = {1: "f4", 2: "f8", 3: "i4", 4: "i2", 5: "u1"}
"""NumPy's types of the numbers of a variable, by their code."""

_NEIGHBOURS: Final = {0: 3, 2: 4}
"""Count of numbers in a connection of faces, by its mode."""

_LONGEST_TEXT: Final = 32_000
"""Most letters of a text; a longer one is a damaged file."""

_STATIC: Final = -1
_ALONE: Final = -1
_SOLUTION: Final = 2

_LINE, _RECTANGLE, _ELLIPSE = 0, 1, 4
"""Codes of geometries; lines list points, rectangles and ellipses have two sizes."""

_GRID_3D: Final = 4
"""Code of the coordinates of geometries whose points have three components."""


class Zone(NamedTuple):
    """A zone in a file."""

    time: float | None
    """Its time; None if it exists at all times."""
    load: Callable[[], Block]
    """Reads its mesh and fields."""


def block_of(
    names: tuple[str, ...],
    columns: Mapping[str, NDArray[np.float64]],
    centred: set[str],
    kind: str,
    cells: NDArray[np.int64] | tuple[int, int, int],
) -> Block:
    """Return a block with the variables of a zone, its positions among them.

    Some variables are ``centred`` in elements. The cells are the nodes of each element, from 0, or
    the numbers of points along i, j and k.
    """
    import pyvista

    fields = dict(columns)
    points = _points(fields)
    if isinstance(cells, tuple):
        grid: Any = pyvista.StructuredGrid()
        grid.points = points
        grid.dimensions = cells
        grid = grid.cast_to_unstructured_grid()
    else:
        size, vtk = ELEMENTS[kind]
        if cells.min() < 0 or cells.max() >= len(points):
            raise ValueError(f"elements have nodes {cells.min() + 1} to {cells.max() + 1}")
        table = np.insert(cells, 0, size, axis=1)
        grid = pyvista.UnstructuredGrid(table.ravel(), np.full(len(cells), vtk, np.uint8), points)
    for name, values in fields.items():
        (grid.cell_data if name in centred else grid.point_data)[name] = values
    return Block(names, grid)


def _points(fields: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Take the positions of the nodes out of the fields."""
    found: list[NDArray[np.float64]] = []
    for axis in "xyz":
        own = next((own for own in fields if simple(own) in (axis, f"coordinate{axis}")), None)
        if own is None and axis != "z":
            raise ValueError(f"there is no {axis.upper()}")
        found.append(np.zeros_like(found[0]) if own is None else fields.pop(own))
    return np.stack(found, axis=1)


@dataclass
class _Zone:
    """Header of a zone, and its numbers, which are read from the file when they are used."""

    name: str
    strand: int
    time: float
    kind: str
    shape: tuple[int, int, int]
    elements: int
    centred: list[bool]
    neighbours: int
    """Numbers in the tables of neighbours of its faces."""
    columns: list[NDArray[Any] | None] = field(default_factory=list)
    cells: NDArray[Any] | None = None

    def stored_shape(self, ghosts: bool) -> tuple[int, int, int]:
        """Return how values of elements of an ordered zone are stored along i, j and k."""
        # The guide has as many as points, TecIO leaves out the last ones along the slowest index.
        sides = list(self.shape)
        slowest = max((axis for axis in range(3) if sides[axis] > 1), default=0)
        sides[slowest] -= 0 if ghosts else min(sides[slowest] - 1, 1)
        return sides[0], sides[1], sides[2]

    def count(self, variable: int, ghosts: bool) -> int:
        """Return how many values of a variable are in the file."""
        if not self.centred[variable]:
            return prod(self.shape)
        return prod(self.stored_shape(ghosts)) if self.kind == ORDERED else self.elements


def binary_zones(file: Path) -> tuple[Zone, ...]:
    """Return the zones of a binary file, whose numbers are not read yet."""
    with naming(file):
        cursor = _Cursor(mapped(file))
        version = cursor.version()
        names = cursor.variables(version)
        zones = _headers(cursor, version, len(names))
        begin, ghosts = cursor.at, False
        try:
            _locate(cursor, names, zones, ghosts)
        except SourceError:
            if not any(zone.kind == ORDERED and any(zone.centred) for zone in zones):
                raise
            cursor.at, ghosts = begin, True
            _locate(cursor, names, zones, ghosts)
    # Zones without strands exist at all times, but whoever gives each another time means it.
    timed = all(zone.strand == _STATIC for zone in zones)
    timed = timed and len({zone.time for zone in zones}) == len(zones)
    return tuple(
        Zone(
            zone.time if timed or zone.strand != _STATIC else None,
            partial(_block, file, number, names, zone, ghosts),
        )
        for number, zone in enumerate(zones, start=1)
        if prod(zone.shape) and (zone.kind == ORDERED or zone.elements)
    )


def _block(file: Path, number: int, names: Sequence[str], zone: _Zone, ghosts: bool) -> Block:
    """Return a zone's mesh and fields, without variables that are passive in it."""
    columns = {}
    for name, values, centred in zip(names, zone.columns, zone.centred, strict=True):
        if values is not None:
            columns[name] = values.astype(np.float64)
            if zone.kind == ORDERED and centred:
                kept = tuple(slice(max(side - 1, 1)) for side in zone.shape)
                shaped = columns[name].reshape(zone.stored_shape(ghosts), order="F")
                columns[name] = shaped[kept].ravel(order="F")
    of_elements = {name for name, is_so in zip(names, zone.centred, strict=True) if is_so}
    called = tuple(filter(None, (zone.name.strip(), str(number))))
    with naming(f"{file}: zone {number}"):
        if zone.cells is None:
            return block_of(called, columns, of_elements, ORDERED, zone.shape)
        cells = zone.cells.reshape(zone.elements, -1).astype(np.int64)
        return block_of(called, columns, of_elements, zone.kind, cells)


def _damaged(said: str) -> SourceError:
    return SourceError(f"{said}, expected a binary file of Tecplot that is whole")


class _Cursor:
    """Position in a file that moves on and never beyond the file's end."""

    def __init__(self, content: mmap) -> None:
        self.at = 0
        self._content, self._order = content, "<"

    @property
    def left(self) -> int:
        return len(self._content) - self.at

    def skip(self, kind: str, count: int) -> NDArray[Any]:
        """Move on by as many numbers, and return them without reading them."""
        dtype = np.dtype(self._order + kind)
        if count < 0 or dtype.itemsize * count > self.left:
            raise _damaged(f"{count} numbers at byte {self.at} of {len(self._content)}")
        values: NDArray[Any] = np.ndarray((count,), dtype, self._content, self.at)
        self.at += dtype.itemsize * count
        return values

    def take(self, layout: str) -> list[Any]:
        """Return numbers: i is an integer of 32 bits, f and d are floats of 32 and 64 bits."""
        return [self.skip(kind, 1)[0].item() for kind in layout]

    def integer(self) -> int:
        return int(self.take("i")[0])

    def text(self) -> str:
        """Return letters of 32 bits each, up to a zero."""
        begin = self.at
        letters = self.skip("i4", min(self.left // 4, _LONGEST_TEXT))
        ends = np.flatnonzero(letters == 0)
        if not ends.size:
            raise _damaged(f"a text without an end at byte {begin}")
        self.at = begin + 4 * (int(ends[0]) + 1)
        return (letters[: ends[0]] & 0xFF).astype(np.uint8).tobytes().decode("utf-8", "replace")

    def version(self) -> int:
        """Return the version, and find out which byte of a number is first."""
        magic = self._content[:8]
        digits = magic[len(MAGIC) :].decode("ascii", "replace").strip()
        if not digits.isdecimal() or int(digits) not in _VERSIONS:
            raise SourceError(
                f"is binary Tecplot of version {digits!r}, expected "
                f"{_VERSIONS[0]} to {_VERSIONS[-2]}: save it again, or as ASCII"
            )
        self.at = 8
        if self.integer() != 1:
            self.at, self._order = 8, ">"
            if self.integer() != 1:
                raise _damaged("its order of bytes is unknown")
        return int(digits)

    def variables(self, version: int) -> tuple[str, ...]:
        if version >= 111 and self.integer() == _SOLUTION:
            raise SourceError("is a solution without its grid, expected a file with both")
        self.text()
        count = self.integer()
        if not 0 < count <= self.left // 4:
            raise _damaged(f"{count} variables")
        return tuple(self.text().strip() for _ in range(count))

    def flags(self, count: int, without: int = 0) -> list[int]:
        """Return a number for each variable if the file contains them."""
        return self.take("i" * count) if self.integer() else [without] * count


def _headers(cursor: _Cursor, version: int, variables: int) -> list[_Zone]:
    """Return the headers of the zones, up to the end of the file's header."""
    found: list[_Zone] = []
    while (marker := cursor.take("f")[0]) != _END_OF_HEADER:
        if marker == _ZONE:
            found.append(_header(cursor, version, variables, 1 + len(found)))
        elif marker == _GEOMETRY:
            _skip_geometry(cursor)
        elif marker == _TEXT:
            cursor.take("iidddiididdiiddiii")
            _skip_remark(cursor)
        elif marker == _LABELS:
            for _ in range(cursor.integer()):
                cursor.text()
        elif marker == _RECORD:
            cursor.text()
        elif marker in (_ABOUT_FILE, _ABOUT_VARIABLE):
            cursor.take("i" if marker == _ABOUT_VARIABLE else "")
            _skip_remark(cursor)
        else:
            raise _damaged(f"mark {marker:g} at byte {cursor.at - 4}")
    if not found:
        raise _damaged("no zone")
    return found


def _header(cursor: _Cursor, version: int, variables: int, number: int) -> _Zone:
    name = cursor.text()
    _, strand, time, _, kind_number = cursor.take("iidii")
    if not 0 <= kind_number < len(_KINDS):
        raise _damaged(f"zone {number} is of the kind {kind_number}")
    kind = _KINDS[kind_number]
    if kind != ORDERED and kind not in ELEMENTS:
        raise SourceError(
            f"zone {number} has elements of the kind FE{kind}, expected points in order, "
            "triangles, quadrilaterals, tetrahedra or bricks"
        )
    if version < 112 and cursor.integer():
        raise SourceError(f"zone {number} is packed by points, expected by blocks")
    centred = cursor.flags(variables)
    raw = cursor.integer() if version >= 108 else 0
    connections = cursor.integer()
    mode = cursor.integer() if connections else 0
    if connections and kind != ORDERED and version >= 108:
        cursor.integer()
    if mode not in _NEIGHBOURS:
        raise SourceError(f"zone {number} has faces with many neighbours, which are not read")
    if kind == ORDERED:
        across, down, deep = cursor.take("iii")
        elements = 0
    else:
        across, elements, *_ = cursor.take("iiiii")
        down, deep = 1, 1
    if not isfinite(time):
        raise _damaged(f"zone {number} is at the time {time}")
    if min(across, down, deep, elements, connections) < 0:
        raise _damaged(f"zone {number} has {across} points and {elements} elements")
    while cursor.integer():
        _skip_remark(cursor)
    neighbours = connections * _NEIGHBOURS[mode] + (elements * _FACES.get(kind, 0) if raw else 0)
    shape = (across, down, deep)
    return _Zone(name, strand, time, kind, shape, elements, list(map(bool, centred)), neighbours)


def _skip_remark(cursor: _Cursor) -> None:
    cursor.text()
    cursor.integer()
    cursor.text()


def _skip_geometry(cursor: _Cursor) -> None:
    system, *_ = cursor.take("iiiddd")
    *_, shape, _ = cursor.take("iiiiii")
    cursor.take("ddiiidd")
    cursor.text()
    precision, _ = cursor.take("ii")
    kind = "f4" if precision == 1 else "f8"
    if shape != _LINE:
        cursor.skip(kind, 2 if shape in (_RECTANGLE, _ELLIPSE) else 1)
        return
    for _ in range(cursor.integer()):
        cursor.skip(kind, cursor.integer() * (3 if system == _GRID_3D else 2))


def _locate(cursor: _Cursor, names: Sequence[str], zones: Sequence[_Zone], ghosts: bool) -> None:
    """Find the numbers of the zones; each zone has to begin where the one before ends."""
    for number, zone in enumerate(zones, start=1):
        if (marker := cursor.take("f")[0]) != _ZONE:
            raise _damaged(f"mark {marker:g} in place of zone {number}")
        kinds = cursor.take("i" * len(names))
        passive = cursor.flags(len(names))
        shared = cursor.flags(len(names), _ALONE)
        cells_of = cursor.integer()
        own = [not skip and of == _ALONE for skip, of in zip(passive, shared, strict=True)]
        cursor.skip("f8", 2 * sum(own))
        zone.columns = []
        for variable, name in enumerate(names):
            count = zone.count(variable, ghosts)
            if own[variable]:
                if kinds[variable] not in _NUMBERS:
                    raise SourceError(
                        f"zone {number}: {name!r} has numbers of the kind {kinds[variable]}, "
                        f"expected 1 to {len(_NUMBERS)}"
                    )
                values: NDArray[Any] | None = cursor.skip(_NUMBERS[kinds[variable]], count)
            elif passive[variable]:
                values = None
            else:
                values = _before(zones, number, shared[variable]).columns[variable]
                if values is not None and len(values) != count:
                    raise _damaged(
                        f"zone {number} shares {len(values)} numbers of {name!r}, it has {count}"
                    )
            zone.columns.append(values)
        zone.cells = _cells(cursor, zones, number, cells_of)
    if cursor.left:
        raise _damaged(f"{cursor.left} bytes after the last zone")


def _cells(cursor: _Cursor, zones: Sequence[_Zone], number: int, of: int) -> NDArray[Any] | None:
    zone, cells = zones[number - 1], None
    if of != _ALONE and zone.kind != ORDERED:
        other = _before(zones, number, of)
        if (other.kind, other.elements) != (zone.kind, zone.elements):
            raise _damaged(f"zone {number} shares elements of another kind")
        return other.cells
    if zone.kind != ORDERED:
        cells = cursor.skip("i4", zone.elements * ELEMENTS[zone.kind][0])
    if of == _ALONE:
        cursor.skip("i4", zone.neighbours)
    return cells


def _before(zones: Sequence[_Zone], number: int, of: int) -> _Zone:
    """Return the zone whose numbers a zone shares."""
    if not 0 <= of < number - 1:
        raise _damaged(f"zone {number} shares with zone {of + 1}, which is not before it")
    return zones[of]
