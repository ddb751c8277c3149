"""Meshes of Abaqus: the input file, and tables of fields beside it."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.file_names import natural
from chipglow.io.sources.mesh_reader import Block, MeshReader, grid_of
from chipglow.io.sources.source import SourceError, reading

if TYPE_CHECKING:
    import pandas as pd

_SOLID: Final = re.compile(r"(?:C3D|DC3D|SC)(\d+)")
_FLAT: Final = re.compile(r"(?:CPE|CPS|CAX|CGAX|DC2D|DCAX|SAX|S|STRI|R2D|M3D)(\d+)")
_VTK_FLAT: Final[Mapping[int, int]] = {3: 5, 4: 9, 6: 22, 8: 23}
_VTK_SOLID: Final[Mapping[int, int]] = {4: 10, 5: 14, 6: 13, 8: 12, 10: 24, 15: 26, 20: 25}
_ASSEMBLY: Final = ("ASSEMBLY", "END INSTANCE", "INSTANCE", "END ASSEMBLY")


@dataclass
class _Deck:
    """Mesh of an input file."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    """VTK's type and the nodes of each element."""
    sets: defaultdict[str, set[int]] = field(default_factory=lambda: defaultdict(set))


class AbaqusReader(MeshReader):
    """Input files with tables of the same name, or one input file with a table for each frame.

    Next to ``chip.inp`` lie ``chip.csv``, or ``chip_1.csv``, ``chip_2.csv`` and so on. A table's
    first column, ``node`` or ``element``, holds Abaqus's labels, the others are fields; lines of
    the same element are its integration points and are averaged. ``COOR1`` to ``COOR3`` are the
    nodes' positions, ``U1`` to ``U3`` are added to those of the input file. The names of tables of
    elements and of nodes of the same frame end with ``_nodes`` or ``_elements``.
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
        self._deck = lru_cache(1)(_read_deck)

    def file(self, number: int) -> Path:
        """Return the first table of a frame."""
        return self._frames[number][1][0]

    def read(self, number: int) -> Sequence[Block]:
        file, tables = self._frames[number]
        return (_block(self._deck(file), tables),)


def _tables(file: Path) -> list[tuple[Path, ...]]:
    """Return the tables beside an input file, those of a frame together."""
    frames: defaultdict[str, list[Path]] = defaultdict(list)
    beside = [path for path in file.parent.iterdir() if path.suffix.lower() == ".csv"]
    for path in sorted(beside, key=lambda path: natural(str(path))):
        name = path.stem.removesuffix("_nodes").removesuffix("_elements")
        rest = name.removeprefix(file.stem)
        if name.startswith(file.stem) and (rest == "" or rest.strip("_-.").isdigit()):
            frames[name].append(path)
    if not frames:
        raise SourceError(
            f"{file}: has no fields, expected tables {file.stem}.csv or {file.stem}_1.csv and so "
            "on beside it"
        )
    return [tuple(frame) for frame in frames.values()]


def _read_deck(file: Path) -> _Deck:
    text = re.sub(r"(?m)^\s*\*\*.*$", "", file.read_text(encoding="utf-8", errors="replace"))
    deck, instances, outside = _Deck(), 0, False
    for part in re.split(r"(?m)^\s*\*", text)[1:]:
        head, *lines = part.split("\n")
        words = ([word.strip() for word in line.split(",") if word.strip()] for line in lines)
        rows = filter(None, words)
        keyword, options = _keyword(head)
        instances += keyword == "INSTANCE"
        # Nodes of the assembly itself are reference points with separate labels.
        if keyword in _ASSEMBLY:
            outside = keyword in ("ASSEMBLY", "END INSTANCE")
        if keyword == "INCLUDE" or instances > 1:
            raise SourceError(
                f"{file}: *{keyword} is not read, expected an input file with all nodes and "
                "elements in it and one instance at most"
            )
        if keyword == "INSTANCE" and any(rows):
            raise SourceError(f"{file}: an instance that is moved is not supported")
        try:
            if not (outside and keyword == "NODE"):
                _take(deck, keyword, options, rows)
        except (ValueError, KeyError, IndexError) as error:
            raise SourceError(f"{file}: *{keyword}: {error}") from None
    if not deck.nodes or not deck.elements:
        raise SourceError(f"{file}: has no *NODE and *ELEMENT, expected an Abaqus input file")
    return deck


def _keyword(text: str) -> tuple[str, dict[str, str]]:
    name, *rest = text.split(",")
    pairs = (option.partition("=") for option in rest)
    return name.strip().upper(), {key.strip().upper(): value.strip() for key, _, value in pairs}


def _take(
    deck: _Deck, keyword: str, options: Mapping[str, str], rows: Iterable[Sequence[str]]
) -> None:
    """Take the lines of data of a keyword; those of an element may continue in the next line."""
    if keyword == "NODE":
        for label, *words in rows:
            x, y, z = (*(float(word) for word in words[:3]), 0.0, 0.0)[:3]
            deck.nodes[int(label)] = (x, y, z)
    elif keyword == "ELEMENT":
        count, kind = _element(options["TYPE"])
        numbers = np.fromiter((int(word) for row in rows for word in row), np.int64)
        table = numbers.reshape(-1, count + 1).tolist()
        found = {label: (kind, tuple(nodes)) for label, *nodes in table}
        deck.elements |= found
        if "ELSET" in options:
            deck.sets[options["ELSET"]] |= found.keys()
    elif keyword == "ELSET":
        members = deck.sets[options["ELSET"]]
        for row in rows:
            if "GENERATE" in options:
                first, last, step = (*(int(word) for word in row), 1)[:3]
                members |= deck.elements.keys() & range(first, last + 1, step)
            else:
                for word in row:
                    members |= {int(word)} if word.isdecimal() else deck.sets.get(word, set())


def _element(name: str) -> tuple[int, int]:
    """Return the number of nodes, and VTK's type, of an element: CPE4RT has four."""
    for family, types in ((_SOLID, _VTK_SOLID), (_FLAT, _VTK_FLAT)):
        match = family.match(name.upper())
        if match and int(match[1]) in types:
            return int(match[1]), types[int(match[1])]
    raise ValueError(f"the element type {name} is not read")


def _block(deck: _Deck, tables: Sequence[Path]) -> Block:
    at_node = {label: at for at, label in enumerate(deck.nodes)}
    try:
        cells = [
            (len(nodes), *(at_node[node] for node in nodes)) for _, nodes in deck.elements.values()
        ]
    except KeyError as error:
        raise SourceError(f"{tables[0]}: an element has node {error}, which is none") from None
    labels = {"node": deck.nodes.keys(), "element": deck.elements.keys()}
    fields: dict[str, dict[str, NDArray[np.float64]]] = {"node": {}, "element": {}}
    for file in tables:
        table = _read_table(file)
        kind = str(table.index.name)
        unknown = table.index.difference(list(labels[kind]))
        if len(unknown):
            raise SourceError(f"{file}: label {unknown[0]:.12g} is not in the input file")
        # Lines of one label are averaged; a label without a line is NaN.
        means = table.groupby(level=0).mean().reindex(list(labels[kind]))
        fields[kind] |= {str(name).strip(): means[name].to_numpy(np.float64) for name in means}
    points = np.array(list(deck.nodes.values()))
    for axis in range(3):
        points[:, axis] = fields["node"].pop(f"COOR{axis + 1}", points[:, axis])
        points[:, axis] += fields["node"].pop(f"U{axis + 1}", 0.0)
    kinds = np.array([kind for kind, _ in deck.elements.values()], np.uint8)
    table_of_cells = np.concatenate([np.array(cell) for cell in cells])
    grid = grid_of(table_of_cells, kinds, points, fields["node"], fields["element"])
    sets = {
        name: np.array([label in members for label in deck.elements])
        for name, members in deck.sets.items()
    }
    return Block((), grid, sets)


def _read_table(file: Path) -> "pd.DataFrame":
    """Return a table of fields, whose index of labels has the name node or element."""
    import pandas as pd

    with reading(file, "a table of numbers"):
        # An empty cell, or a truncated row, is not a number.
        table = pd.read_csv(
            file, index_col=0, skipinitialspace=True, encoding_errors="replace", dtype=np.float64,
            keep_default_na=False, na_values=["nan", "NaN"],
        )  # fmt: skip
    label = str(table.index.name).strip().lower()
    if label not in ("node", "element"):
        raise SourceError(f"{file}: expected a table whose first column is node or element")
    if table.empty:
        raise SourceError(f"{file}: has no row of numbers")
    return table.rename_axis(index=label)
