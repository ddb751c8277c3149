"""Meshes of Tecplot: ASCII files with zones of finite elements or of ordered points."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.mesh_reader import MeshReader
from chipglow.io.sources.source import SourceError

ENDINGS: Final = (".dat", ".tec", ".plt")

_BINARY: Final = b"#!TD"
_KEY: Final = r'(\w+)\s*=\s*("[^"]*"|\((?:[^()]|\([^()]*\))*\)|[^\s,]+)'
_NUMBER: Final = re.compile(rb"\s*[-+.]?\d")
_ELEMENTS: Final[Mapping[str, tuple[int, int]]] = {
    "TRIANGLE": (3, 5), "QUADRILATERAL": (4, 9), "TETRAHEDRON": (4, 10), "BRICK": (8, 12),
}  # fmt: skip
_ORDERED: Final = ("ORDERED", "POINT", "BLOCK")
_NOT_READ: Final = ("VARSHARELIST", "CONNECTIVITYSHAREZONE", "D", "PASSIVEVARLIST")


@dataclass(frozen=True)
class _Zone:
    """Where a zone is in a file, and what its header says."""

    file: Path
    number: int
    names: tuple[str, ...]
    keys: Mapping[str, str]
    begin: int
    end: int


class TecplotReader(MeshReader):
    """One file for each frame, or one file with zones whose ``SOLUTIONTIME`` differs.

    Parameters
    ----------
    files : sequence of Path
        The files.

    Raises
    ------
    SourceError
        If a file is no ASCII file of Tecplot.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._files = files
        self._zones = _zones(files[0]) if len(files) == 1 else ()
        times = sorted({time for zone in self._zones if (time := _time(zone)) is not None})
        self.times = tuple(times) or None
        self.count = max(len(times), len(files))
        self.kind = f"mesh, {len(files)} file{'s' * (len(files) > 1)} of Tecplot ASCII"

    def file(self, number: int) -> Path:
        """The file of a frame."""
        return self._files[min(number, len(self._files) - 1)]

    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame; see `MeshReader.read`."""
        zones = self._zones or _zones(self.file(number))
        if self.times:
            wanted = self.times[number]
            zones = tuple(zone for zone in zones if _time(zone) in (None, wanted))
        return tuple(_read(zone) for zone in zones)


def _zones(file: Path) -> tuple[_Zone, ...]:
    header, begins, ends, texts = b"", list[int](), list[int](), list[bytes]()
    inside = False
    with file.open("rb") as stream:
        if stream.read(4) == _BINARY:
            raise SourceError(f"{file}: is a binary Tecplot file, expected an ASCII one")
        stream.seek(0)
        at = 0
        for line in stream:
            if line.lstrip().startswith(b"#"):
                at += len(line)
                continue
            if line.lstrip()[:4].upper() == b"ZONE":
                ends.append(at)
                texts.append(line)
                inside = True
            elif inside and _NUMBER.match(line):
                begins.append(at)
                inside = False
            elif inside:
                texts[-1] += line
            elif not texts:
                header += line
            at += len(line)
    names = _names(header.decode(errors="replace"))
    if not names or not texts or len(begins) != len(texts):
        raise SourceError(
            f"{file}: has no VARIABLES and ZONE with data, expected an ASCII file of Tecplot"
        )
    keys = [_keys(text.decode(errors="replace")) for text in texts]
    rows = zip(keys, begins, [*ends[1:], at], strict=True)
    return tuple(_Zone(file, 1 + k, names, *row) for k, row in enumerate(rows))


def _names(header: str) -> tuple[str, ...]:
    found = re.search(r"VARIABLES\s*=(.*?)(?=\n\s*[A-Za-z]+\s*=|\Z)", header, re.S | re.I)
    if not found:
        return ()
    words = re.findall(r'"([^"]*)"|([^\s,"]+)', found.group(1))
    return tuple((quoted or plain).strip() for quoted, plain in words)


def _keys(text: str) -> dict[str, str]:
    pairs = re.findall(_KEY, re.sub(r"^\s*ZONE", "", text, flags=re.I))
    return {key.upper(): value.strip('"') for key, value in pairs}


def _time(zone: _Zone) -> float | None:
    text = zone.keys.get("SOLUTIONTIME")
    try:
        return None if text is None else float(text)
    except ValueError:
        raise SourceError(
            f"{zone.file}: zone {zone.number}: SOLUTIONTIME is {text!r}, expected a number"
        ) from None


def _read(zone: _Zone) -> Block:
    try:
        return _block(zone)
    except (ValueError, KeyError, IndexError) as error:
        if isinstance(error, SourceError):
            raise
        said = " ".join(f"{type(error).__name__}: {error}".split())[:120]
        raise SourceError(
            f"{zone.file}: zone {zone.number} is damaged or of a kind that is not read ({said})"
        ) from None


def _block(zone: _Zone) -> Block:
    import pyvista

    keys = zone.keys
    for key in _NOT_READ:
        if key in keys:
            raise ValueError(f"{key} is not read")
    kind = keys.get("ZONETYPE", keys.get("ET", keys.get("F", "ORDERED"))).upper()
    kind = kind.removeprefix("FE")
    with zone.file.open("rb") as stream:
        stream.seek(zone.begin)
        text = stream.read(zone.end - zone.begin)
        words = re.sub(rb"(?m)^\s*#.*$", b"", text).split()
    if kind in _ORDERED:
        counts = tuple(int(keys.get(axis, "1")) for axis in "IJK")
        nodes, elements = int(np.prod(counts)), int(np.prod([max(c - 1, 1) for c in counts]))
    else:
        nodes = int(keys.get("N") or keys["NODES"])
        elements = int(keys.get("E") or keys["ELEMENTS"])
    columns, rest = _columns(zone, words, nodes, elements)
    points = np.zeros((nodes, 3))
    for axis, name in enumerate("XYZ"):
        own = next((own for own in columns if own.split("[")[0].strip().upper() == name), None)
        if own is not None:
            points[:, axis] = columns.pop(own)
        elif axis < 2:
            raise ValueError(f"there is no {name}")
    if kind in _ORDERED:
        grid: Any = pyvista.StructuredGrid()
        grid.points = points
        grid.dimensions = counts
        grid = grid.cast_to_unstructured_grid()
    else:
        size, vtk = _ELEMENTS[kind]
        cells = np.array(rest, np.int64).reshape(elements, size) - 1
        if cells.min() < 0 or cells.max() >= nodes:
            raise ValueError(f"elements have nodes {cells.min() + 1} to {cells.max() + 1}")
        table = np.insert(cells, 0, size, axis=1)
        grid = pyvista.UnstructuredGrid(table.ravel(), np.full(elements, vtk, np.uint8), points)
    centred = _centred(keys, zone.names)
    for name, values in columns.items():
        (grid.cell_data if name in centred else grid.point_data)[name] = values
    return Block(tuple(filter(None, (keys.get("T", "").strip(), str(zone.number)))), grid)


def _columns(
    zone: _Zone, words: Sequence[bytes], nodes: int, elements: int
) -> tuple[dict[str, NDArray[np.float64]], Sequence[bytes]]:
    """Values of each variable, and the words after them."""
    packing = zone.keys.get("DATAPACKING", zone.keys.get("F", "POINT")).upper()
    names = zone.names
    centred = _centred(zone.keys, names)
    counts = [elements if name in centred else nodes for name in names]
    total = sum(counts)
    if min(nodes, elements) < 1 or len(words) < total:
        raise ValueError(f"{len(words)} numbers, expected {total} or more")
    values = np.array(words[:total], np.float64)
    if packing.endswith("BLOCK"):
        parts = np.split(values, np.cumsum(counts)[:-1])
    else:
        parts = list(values.reshape(nodes, len(names)).T)
    return dict(zip(names, parts, strict=True)), words[total:]


def _centred(keys: Mapping[str, str], names: Sequence[str]) -> set[str]:
    """Names of the variables whose values are those of elements."""
    centred: set[str] = set()
    for numbers, place in re.findall(r"\[([\d,\s-]+)\]\s*=\s*(\w+)", keys.get("VARLOCATION", "")):
        for word in numbers.split(",") if place.upper() == "CELLCENTERED" else ():
            first, _, last = word.partition("-")
            centred |= set(names[int(first) - 1 : int(last or first)])
    return centred
