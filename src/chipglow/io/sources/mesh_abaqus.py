"""Meshes of Abaqus: the input file, and tables of fields beside it."""

import csv
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.file_order import natural
from chipglow.io.sources.mesh_block import Block, grid_of
from chipglow.io.sources.mesh_reader import MeshReader
from chipglow.io.sources.source import SourceError

_FLAT: Final = ("CPE", "CPS", "CAX", "CGAX", "DC2D", "DCAX", "SAX", "S", "STRI", "R2D", "M3D")
_SOLID: Final = ("C3D", "DC3D", "SC")
_VTK_FLAT: Final[Mapping[int, int]] = {3: 5, 4: 9, 6: 22, 8: 23}
_VTK_SOLID: Final[Mapping[int, int]] = {4: 10, 5: 14, 6: 13, 8: 12, 10: 24, 15: 26, 20: 25}
_POSITIONS: Final = (("COOR1", "COOR2", "COOR3"), ("U1", "U2", "U3"))
_LABELS: Final = ("node", "element")


@dataclass
class _Deck:
    """What an input file says of the mesh."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    sets: defaultdict[str, set[int]] = field(default_factory=lambda: defaultdict(set))


class AbaqusReader(MeshReader):
    """Input files with tables of the same name, or one input file with a table for each frame.

    Beside ``chip.inp`` lie ``chip.csv``, or ``chip_1.csv``, ``chip_2.csv`` and so on. A table's
    first column, ``node`` or ``element``, holds Abaqus's labels, the others are fields; lines of
    the same element are its integration points and are averaged. ``COOR1`` to ``COOR3`` are the
    nodes' positions, ``U1`` to ``U3`` what is added to those of the input file. Tables of elements
    and of nodes of the same frame are told apart by ``_nodes`` or ``_elements`` at the end of
    their names.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, "Abaqus input")
        self._frames = [(file, frame) for file in files for frame in _tables(file)]
        if len(files) > 1 and len(self._frames) != len(files):
            raise SourceError(
                f"{files[0]}: {len(files)} input files with {len(self._frames)} tables, expected "
                "one input file with many tables, or one table for each"
            )
        self.count = len(self._frames)
        self.kind = f"mesh, Abaqus input with {self.count} frame{'s' * (self.count > 1)} of tables"
        self._deck: tuple[Path, _Deck] | None = None

    def file(self, number: int) -> Path:
        """The first table of a frame."""
        return self._frames[number][1][0]

    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame; see `MeshReader.read`."""
        file, tables = self._frames[number]
        if self._deck is None or self._deck[0] != file:
            self._deck = (file, _read_deck(file))
        return (_block(self._deck[1], [(table, *_read_table(table)) for table in tables]),)


def _tables(file: Path) -> list[tuple[Path, ...]]:
    """Tables beside an input file, those of a frame together."""
    frames: defaultdict[str, list[Path]] = defaultdict(list)
    beside = [path for path in file.parent.iterdir() if path.suffix.lower() == ".csv"]
    for path in sorted(beside, key=lambda path: natural(str(path))):
        name = path.stem.removesuffix("_nodes").removesuffix("_elements")
        rest = name.removeprefix(file.stem)
        if name.startswith(file.stem) and rest.strip("_-.").isdigit() | (rest == ""):
            frames[name].append(path)
    if not frames:
        raise SourceError(
            f"{file}: has no fields, expected tables {file.stem}.csv or {file.stem}_1.csv and so "
            "on beside it"
        )
    return [tuple(frame) for frame in frames.values()]


def _read_deck(file: Path) -> _Deck:
    deck = _Deck()
    keyword, options = "", dict[str, str]()
    waiting: list[int] = []
    instances, outside = 0, False
    with file.open(encoding="utf-8", errors="replace") as stream:
        for number, line in enumerate(stream, start=1):
            text = line.strip()
            if not text or text.startswith("**"):
                continue
            if text.startswith("*"):
                keyword, options = _keyword(text)
                waiting = []
                instances += keyword == "INSTANCE"
                # Nodes of the assembly itself are points of reference with labels of their own.
                if keyword in ("ASSEMBLY", "END INSTANCE", "INSTANCE", "END ASSEMBLY"):
                    outside = keyword in ("ASSEMBLY", "END INSTANCE")
                if keyword == "INCLUDE" or instances > 1:
                    raise SourceError(
                        f"{file}: line {number}: *{keyword} is not read, expected an input file "
                        "with all nodes and elements in it and one instance at most"
                    )
                continue
            if keyword == "INSTANCE":
                raise SourceError(
                    f"{file}: line {number}: the instance is moved, expected one that is not"
                )
            if outside and keyword == "NODE":
                continue
            try:
                waiting = _take(deck, keyword, options, waiting, text)
            except (ValueError, KeyError, IndexError) as error:
                raise SourceError(
                    f"{file}: line {number}: {text[:60]!r} is no data of *{keyword} ({error})"
                ) from None
    if not deck.nodes or not deck.elements:
        raise SourceError(f"{file}: has no *NODE and *ELEMENT, expected an Abaqus input file")
    return deck


def _keyword(text: str) -> tuple[str, dict[str, str]]:
    name, *rest = text[1:].split(",")
    pairs = (option.partition("=") for option in rest)
    return name.strip().upper(), {key.strip().upper(): value.strip() for key, _, value in pairs}


def _take(
    deck: _Deck, keyword: str, options: Mapping[str, str], waiting: list[int], text: str
) -> list[int]:
    """Take a line of data; what is left over of an element that goes on in the next line."""
    words = [word for word in (word.strip() for word in text.split(",")) if word]
    if keyword == "NODE":
        x, y, z = (*(float(word) for word in words[1:4]), 0.0, 0.0)[:3]
        deck.nodes[int(words[0])] = (x, y, z)
    elif keyword == "ELEMENT":
        count, kind = _element(options["TYPE"])
        numbers = [*waiting, *(int(word) for word in words)]
        if len(numbers) <= count:
            return numbers
        label, nodes = numbers[0], tuple(numbers[1 : count + 1])
        deck.elements[label] = (kind, nodes)
        if "ELSET" in options:
            deck.sets[options["ELSET"]].add(label)
    elif keyword == "ELSET":
        _take_set(deck, options, words)
    return []


def _take_set(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    members = deck.sets[options["ELSET"]]
    if "GENERATE" in options:
        first, last, step = (*(int(word) for word in words), 1)[:3]
        members |= {label for label in deck.elements if label in range(first, last + 1, step)}
        return
    for word in words:
        members |= {int(word)} if word.isdecimal() else deck.sets.get(word, set())


def _element(name: str) -> tuple[int, int]:
    """Number of nodes, and VTK's type, of an element: CPE4RT has four."""
    kind = name.upper()
    for families, types in ((_SOLID, _VTK_SOLID), (_FLAT, _VTK_FLAT)):
        for family in sorted(families, key=len, reverse=True):
            digits = ""
            for letter in kind.removeprefix(family) if kind.startswith(family) else "":
                if not letter.isdecimal():
                    break
                digits += letter
            if digits and int(digits) in types:
                return int(digits), types[int(digits)]
    raise ValueError(f"the element type {name} is not read")


def _read_table(file: Path) -> tuple[str, NDArray[np.int64], dict[str, NDArray[np.float64]]]:
    """What the labels are of, the labels, and the fields."""
    with file.open(newline="", encoding="utf-8-sig", errors="replace") as stream:
        rows = csv.reader(stream, skipinitialspace=True)
        header = [name.strip() for name in next(rows, [])]
        if not header or header[0].lower() not in _LABELS or len(set(header)) < len(header):
            raise SourceError(
                f"{file}: begins with {','.join(header)[:60]!r}, expected a table whose first "
                "column is node or element, and names that differ"
            )
        try:
            values = np.array([[float(word) for word in row] for row in rows if row], np.float64)
            labels = values[:, 0].astype(np.int64)
        except (ValueError, IndexError, csv.Error) as error:
            raise SourceError(f"{file}: is no table of numbers ({error})") from None
    if values.shape[1] != len(header):
        raise SourceError(f"{file}: {values.shape[1]} columns, expected {len(header)}")
    columns = {name: values[:, at] for at, name in enumerate(header) if at}
    return header[0].lower(), labels, columns


def _block(
    deck: _Deck, tables: Sequence[tuple[Path, str, NDArray[np.int64], Mapping[str, Any]]]
) -> Block:
    at_node = {label: at for at, label in enumerate(deck.nodes)}
    at_element = {label: at for at, label in enumerate(deck.elements)}
    points = np.array(list(deck.nodes.values()))
    try:
        cells = [
            (len(nodes), *(at_node[node] for node in nodes)) for _, nodes in deck.elements.values()
        ]
    except KeyError as error:
        raise SourceError(f"{tables[0][0]}: an element has node {error}, which is none") from None
    of_nodes: dict[str, NDArray[np.float64]] = {}
    of_elements: dict[str, NDArray[np.float64]] = {}
    for file, kind, labels, columns in tables:
        index = at_node if kind == "node" else at_element
        found = of_nodes if kind == "node" else of_elements
        for name, values in columns.items():
            found[name] = _by_label(file, index, labels, values)
    points = _moved(points, of_nodes)
    kinds = np.array([kind for kind, _ in deck.elements.values()], np.uint8)
    table = np.concatenate([np.array(cell) for cell in cells])
    grid = grid_of(table, kinds, points, of_nodes, of_elements)
    sets = {
        name: np.array([label in members for label in deck.elements])
        for name, members in deck.sets.items()
    }
    return Block((), grid, sets)


def _by_label(
    file: Path, index: Mapping[int, int], labels: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean of the values of each label, NaN where there is none."""
    try:
        at = np.array([index[int(label)] for label in labels])
    except KeyError as error:
        raise SourceError(f"{file}: label {error} is not in the input file") from None
    counts = np.bincount(at, minlength=len(index))
    sums = np.bincount(at, weights=values, minlength=len(index))
    with np.errstate(invalid="ignore"):
        mean: NDArray[np.float64] = sums / counts
    return mean


def _moved(
    points: NDArray[np.float64], of_nodes: dict[str, NDArray[np.float64]]
) -> NDArray[np.float64]:
    moved = points.copy()
    for names, base in zip(_POSITIONS, (0.0, 1.0), strict=True):
        for axis, name in enumerate(names):
            if name in of_nodes:
                moved[:, axis] = base * moved[:, axis] + of_nodes.pop(name)
    return moved
