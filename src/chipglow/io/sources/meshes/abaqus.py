"""Meshes of Abaqus: the input file, and tables of fields beside it."""

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from math import cos, radians, sin
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.file_names import natural
from chipglow.io.sources.meshes.reader import Block, MeshReader, grid_of, number_of
from chipglow.io.sources.source import SourceError, reading

if TYPE_CHECKING:
    import pandas as pd

Position: TypeAlias = tuple[float, float, float]

_FLAT: Final = re.compile(
    r"(?:CPE|CPS|CAX|CGAX|COH(?:2D|AX)(?!\d+P)|DC2D|DCAX|DS|M3D|R3D|S|STRI)(\d+)"
)
_SOLID: Final = re.compile(r"(?:C3D(?!\d+V)|COH3D(?!\d+P)|DC3D|SC)(\d+)")
_WITHOUT_AREA: Final = re.compile(
    r"(?:RB?[23]D2|RAX2|MASS|ROTARYI|HEATCAP|SPRING|DASHPOT|CONN[23]D2|GAP|T[23]D|B[23]\d|PIPE[23]"
    r"|DC1D)"
)
"""Rigid lines, points, springs, dashpots, connectors, trusses and beams."""

_VTK_FLAT: Final[Mapping[int, int]] = {3: 5, 4: 9, 6: 22, 8: 23}
"""VTK's cell types of flat elements, by their number of nodes."""

_VTK_SOLID: Final[Mapping[int, int]] = {4: 10, 5: 14, 6: 13, 8: 12, 10: 24, 15: 26, 20: 25}
"""VTK's cell types of solid elements, by their number of nodes."""

_PARTS: Final = ("PART", "END PART", "ASSEMBLY", "END ASSEMBLY", "INSTANCE", "END INSTANCE")
_NOT_READ: Final = (
    "ELCOPY", "IMPERFECTION", "IMPORT", "INCLUDE", "MODEL CHANGE", "NCOPY", "NFILL", "NMAP",
    "SYMMETRIC MODEL GENERATION", "SYSTEM",
)  # fmt: skip
"""Keywords that change nodes or elements; keywords that are not listed do not change the mesh."""

_COMMA: Final = re.compile(r',(?=(?:[^"]*"[^"]*")*[^"]*$)')  # not within quotes
_DIRECTIONS: Final = 3
"""*ELGEN copies an element along a row, the row along rows, and these along layers."""

_POSITIONS: Final = tuple(f"{name}{axis}" for name in ("COOR", "U") for axis in (1, 2, 3))
"""Columns of tables of nodes that state where the nodes are."""

_UNMOVED: Final = "Positions are taken from the input file: its tables have no U1 and no COOR1."


class _Row(NamedTuple):
    """A line of data."""

    line: int
    words: list[str]


class _Keyword(NamedTuple):
    """A keyword with its parameters and lines of data."""

    line: int
    name: str
    options: Mapping[str, str]
    rows: list[_Row]


@dataclass
class _Deck:
    """Mesh of a part, of an instance, or of an input file without parts."""

    nodes: dict[int, Position] = field(default_factory=dict)
    elements: dict[int, tuple[int, tuple[int, ...]]] = field(default_factory=dict)
    """VTK's type and the nodes of each element."""
    without_area: dict[int, str] = field(default_factory=dict)
    """Types of the elements without an area."""
    sets: dict[str, set[int]] = field(default_factory=dict)
    """Labels of elements by the name of their set, as it is spelled first."""


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
        skipped = self._deck(files[0])[1]
        counts = ", ".join(f"{count} {kind}" for kind, count in sorted(skipped.items()))
        self.remarks = [f"Elements without an area are skipped: {counts}."] if counts else []

    def file(self, number: int) -> Path:
        """Return the first table of a frame."""
        return self._frames[number][1][0]

    def read(self, number: int) -> Sequence[Block]:
        file, tables = self._frames[number]
        columns = [_read_table(path) for path in tables]
        if _UNMOVED not in self.remarks and not any(map(_stated_positions, columns)):
            self.remarks.append(_UNMOVED)
        return (_block(file, self._deck(file)[0], dict(zip(tables, columns, strict=True))),)


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


def _read_deck(file: Path) -> tuple[_Deck, Counter[str]]:
    """Return the only mesh of an input file that has an area, and the types of other elements."""
    keywords = _keywords(file.read_text(encoding="utf-8-sig", errors="replace"))
    meshes = _meshes(file, keywords)
    decks = {name: _deck(file, of_mesh) for name, of_mesh in meshes.items()}
    with_area = [name for name, deck in decks.items() if deck.elements]
    if len(with_area) > 1:
        raise SourceError(
            f"{file}: {', '.join(with_area)} have elements with an area; only one part "
            "with one instance can be read, because tables state no instance"
        )
    if not with_area:
        raise SourceError(
            f"{file}: has no *NODE and *ELEMENT with an area, expected an Abaqus input file"
        )
    (name,) = with_area
    skipped = Counter(kind for deck in decks.values() for kind in deck.without_area.values())
    _move(file, decks[name], meshes[name])
    return decks[name], skipped


def _keywords(text: str) -> list[_Keyword]:
    """Split an input file; a keyword line that ends with a comma continues in the next one."""
    found: list[_Keyword] = []
    continues = False
    for line, content in enumerate(text.splitlines(), start=1):
        stripped = content.strip()
        if not stripped or stripped.startswith("**"):
            continue
        parts = _COMMA.split(stripped) if '"' in stripped else stripped.split(",")
        words = [part.strip() for part in parts]
        if stripped.startswith("*"):
            name = " ".join(words.pop(0).removeprefix("*").upper().split())
            found.append(_Keyword(line, name, _options(words), []))
            continues = stripped.endswith(",")
        elif continues:
            found[-1] = found[-1]._replace(options={**found[-1].options, **_options(words)})
            continues = stripped.endswith(",")
        elif found:
            found[-1].rows.append(_Row(line, words))
    return found


def _options(words: Iterable[str]) -> dict[str, str]:
    pairs = (word.partition("=") for word in words if word)
    return {key.strip().upper(): value.strip().strip('"') for key, _, value in pairs}


def _meshes(file: Path, keywords: Iterable[_Keyword]) -> dict[str, list[_Keyword]]:
    """Return the keywords of each instance, or of each part in a file without instances."""
    parts: dict[str, list[_Keyword]] = {"the file": []}
    instances: dict[str, list[_Keyword]] = {}
    assembly: list[_Keyword] = []
    inside = parts["the file"]
    for keyword in keywords:
        _check_read(file, keyword)
        name = keyword.options.get("NAME", "").upper()
        if keyword.name == "PART":
            inside = parts[name] = []
        elif keyword.name == "INSTANCE":
            part = keyword.options.get("PART", "").upper()
            if part not in parts:
                raise _refused(file, keyword, f"PART={part} is not a part of this file")
            inside = instances[name] = [keyword, *parts[part]]
        elif keyword.name in ("ASSEMBLY", "END INSTANCE"):
            inside = assembly
        elif keyword.name in ("END PART", "END ASSEMBLY"):
            inside = parts["the file"]
        elif keyword.name not in _STEPS:
            continue
        elif inside is not assembly:
            inside.append(keyword)
        elif keyword.name == "ELSET":
            instances.get(keyword.options.get("INSTANCE", "").upper(), []).append(keyword)
        else:
            assembly.append(keyword)
    return {**instances, "the assembly": assembly} if instances else parts


def _check_read(file: Path, keyword: _Keyword) -> None:
    """Refuse a keyword that changes the mesh in a way that is not read."""
    name, options = keyword.name, keyword.options
    without_effect = (name == "SYSTEM" and not keyword.rows) or (
        name == "MODEL CHANGE"
        and ("REMOVE" not in options or options.get("TYPE", "").upper() == "CONTACT PAIR")
    )
    if name in _NOT_READ and not without_effect:
        raise _refused(file, keyword, "is not read, expected all nodes and elements in the file")
    known = (*_STEPS, *_PARTS, *_NOT_READ)
    if name not in known and (full := [word for word in known if word.startswith(name)]):
        raise _refused(file, keyword, f"is abbreviated, expected such as *{full[0]}")
    if name in _STEPS and "INPUT" in options:
        raise _refused(
            file, keyword, f"INPUT={options['INPUT']} is not read, expected its lines in the file"
        )


def _refused(file: Path, keyword: _Keyword, why: object, line: int | None = None) -> SourceError:
    return SourceError(f"{file}: line {line or keyword.line}: *{keyword.name}: {why}")


def _move(file: Path, deck: _Deck, keywords: Sequence[_Keyword]) -> None:
    """Translate the nodes of an instance; the second line of its data is a rotation."""
    instance = next((keyword for keyword in keywords if keyword.name == "INSTANCE"), None)
    if instance is None or not instance.rows:
        return
    if len(instance.rows) > 1:
        raise _refused(file, instance, "an instance that is rotated is not read")
    try:
        by = _position(instance.rows[0].words)
    except ValueError as error:
        raise _refused(file, instance, error, instance.rows[0].line) from None
    for label, (x, y, z) in deck.nodes.items():
        deck.nodes[label] = (x + by[0], y + by[1], z + by[2])


def _deck(file: Path, keywords: Sequence[_Keyword]) -> _Deck:
    """Return the mesh of some keywords, whatever their order."""
    deck = _Deck()
    for name, take in _STEPS.items():
        for keyword in keywords:
            if keyword.name == name:
                for line, words in _rows(file, keyword):
                    try:
                        take(deck, keyword.options, words)
                    except ValueError as error:
                        raise _refused(file, keyword, error, line) from None
    return deck


def _rows(file: Path, keyword: _Keyword) -> Iterator[_Row]:
    """Yield lines of data; the nodes of an element may continue in the next lines."""
    kind = keyword.options.get("TYPE", "").upper()
    if keyword.name != "ELEMENT" or _has_no_area(kind):
        yield from keyword.rows
        return
    try:
        expected = 1 + _element(kind)[0]
    except ValueError as error:
        raise _refused(file, keyword, error) from None
    words: list[str] = []
    for row in keyword.rows:
        words += row.words if row.words[-1] else row.words[:-1]
        if len(words) >= expected:
            yield _Row(row.line, words)
            words = []
    if words:
        yield _Row(keyword.rows[-1].line, words)


def _take_node(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    first, second, third = _position(words[1:4])
    system = options.get("SYSTEM", "R").upper()
    if system == "C":  # radius, angle in degrees, z
        angle = radians(second)
        first, second = first * cos(angle), first * sin(angle)
    elif system != "R":
        raise ValueError(f"SYSTEM={system} is not read, expected R or C")
    deck.nodes[int(words[0])] = (first, second, third)


def _position(words: Sequence[str]) -> Position:
    """Return three coordinates; those that are blank or missing are 0."""
    x, y, z = (*(number_of(word) if word else 0.0 for word in words), 0.0, 0.0, 0.0)[:3]
    return x, y, z


def _take_node_line(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    """Take evenly spaced nodes on the straight line between two nodes."""
    if "LINE" in options:
        raise ValueError(f"LINE={options['LINE']} is not read, expected a straight line")
    first, last, step = _integers(words, 3)
    ends = np.array([_known(deck.nodes, "node", label) for label in (first, last)])
    if (last - first) % step or (last - first) // step < 1:
        raise ValueError(f"{first} to {last} is not a multiple of the increment {step}")
    labels = range(first, last + np.sign(step), step)
    for label, part in zip(labels, np.linspace(0.0, 1.0, len(labels)), strict=True):
        x, y, z = ends[0] + part * (ends[1] - ends[0])
        deck.nodes.setdefault(label, (float(x), float(y), float(z)))


def _take_element(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    kind, label = options["TYPE"].upper(), int(words[0])
    if _has_no_area(kind):
        deck.without_area[label] = kind
    else:
        count, vtk = _element(kind)
        if len(words) != count + 1:
            raise ValueError(f"element {label} has {len(words) - 1} nodes, {kind} has {count}")
        deck.elements[label] = (vtk, tuple(int(word) for word in words[1:]))
    _set_of(deck, options).add(label)


def _take_element_copies(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    """Copy an element along up to three directions; labels and nodes rise by increments."""
    if "ALL NODES" in options:
        raise ValueError("ALL NODES is not read, expected elements with constant increments")
    label, *given = _integers(words, 1 + 3 * _DIRECTIONS)
    vtk, nodes = _known(deck.elements, "element with an area", label)
    counts, of_nodes, of_labels = given[::3], given[1::3], given[2::3]
    for steps in product(*(range(count) for count in counts)):
        copy = label + sum(n * by for n, by in zip(steps, of_labels, strict=True))
        moved = sum(n * by for n, by in zip(steps, of_nodes, strict=True))
        deck.elements[copy] = (vtk, tuple(node + moved for node in nodes))
        _set_of(deck, options).add(copy)


def _take_set(deck: _Deck, options: Mapping[str, str], words: Sequence[str]) -> None:
    members = _set_of(deck, options)
    words = [word for word in words if word]
    if "GENERATE" in options:
        first, last, step = _integers(words, 3)
        members |= deck.elements.keys() & range(first, last + 1, step)
        return
    for word in words:
        name = word.strip('"')
        if word.lstrip("+").isdecimal():
            members.add(int(word))
        elif (spelled := _spelled(deck, name)) in deck.sets:
            members |= deck.sets[spelled]
        else:
            raise ValueError(f"the set {name} is not defined before")


_STEPS: Final[Mapping[str, Callable[[_Deck, Mapping[str, str], Sequence[str]], None]]] = {
    "NODE": _take_node,
    "NGEN": _take_node_line,
    "ELEMENT": _take_element,
    "ELGEN": _take_element_copies,
    "ELSET": _take_set,
}
"""Functions that add a data line of a keyword to a mesh, in the order of processing."""


def _set_of(deck: _Deck, options: Mapping[str, str]) -> set[int]:
    """Return the set of elements that a keyword names; names differ in more than case."""
    name = options.get("ELSET", "")
    return deck.sets.setdefault(_spelled(deck, name), set()) if name else set()


def _spelled(deck: _Deck, name: str) -> str:
    return next((known for known in deck.sets if known.upper() == name.upper()), name)


_Found = TypeVar("_Found")


def _known(among: Mapping[int, _Found], what: str, label: int) -> _Found:
    if label not in among:
        raise ValueError(f"{what} {label} is not defined")
    return among[label]


def _integers(words: Sequence[str], count: int) -> list[int]:
    """Return as many integers; those that are blank or missing are 1, but the first is needed."""
    given = [int(word) if word or at == 0 else 1 for at, word in enumerate(words)]
    return (given + count * [1])[:count]


def _has_no_area(kind: str) -> bool:
    return _WITHOUT_AREA.match(kind) is not None


def _element(kind: str) -> tuple[int, int]:
    """Return the number of nodes, and VTK's type, of an element: CPE4RT has four."""
    for family, types in ((_SOLID, _VTK_SOLID), (_FLAT, _VTK_FLAT)):
        match = family.match(kind)
        if match and int(match[1]) in types:
            return int(match[1]), types[int(match[1])]
    raise ValueError(f"the element type TYPE={kind} is not read")


def _block(file: Path, deck: _Deck, tables: Mapping[Path, "pd.DataFrame"]) -> Block:
    used = dict.fromkeys(node for _, nodes in deck.elements.values() for node in nodes)
    if missing := used.keys() - deck.nodes.keys():
        raise SourceError(f"{file}: an element has node {min(missing)}, which is not defined")
    labels = {"node": list(used), "element": list(deck.elements)}
    known = {"node": deck.nodes.keys(), "element": deck.elements.keys() | deck.without_area.keys()}
    fields: dict[str, dict[str, NDArray[np.float64]]] = {"node": {}, "element": {}}
    for path, table in tables.items():
        kind = str(table.index.name)
        unknown = table.index.difference(list(known[kind]))
        if len(unknown):
            raise SourceError(f"{path}: label {unknown[0]:.12g} is not in the input file")
        # Lines of one label are averaged; a label without a line is NaN.
        means = table.groupby(level=0).mean().reindex(labels[kind])
        fields[kind] |= {str(name): means[name].to_numpy(np.float64) for name in means}
    points = np.array([deck.nodes[node] for node in used])
    for axis in range(3):
        points[:, axis] = fields["node"].pop(f"COOR{axis + 1}", points[:, axis])
        points[:, axis] += fields["node"].pop(f"U{axis + 1}", 0.0)
    at_node = {label: at for at, label in enumerate(used)}
    cells = [
        (len(nodes), *(at_node[node] for node in nodes)) for _, nodes in deck.elements.values()
    ]
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
    table = table.rename(columns=str.strip).rename_axis(index=label)
    if label == "node":
        _check_positions(file, table)
    return table


def _stated_positions(table: "pd.DataFrame") -> list[str]:
    return [name for name in table if name in _POSITIONS]


def _check_positions(file: Path, table: "pd.DataFrame") -> None:
    """Refuse positions that are stated in two ways, or differently for one node."""
    stated = _stated_positions(table)
    if len({name[:-1] for name in stated}) > 1:
        raise SourceError(
            f"{file}: has the columns {', '.join(stated)}, expected positions (COOR) or "
            "displacements (U)"
        )
    if not stated:
        return
    of_nodes = table[stated].groupby(level=0)
    differing = table[stated].index[
        (of_nodes.transform("max") > of_nodes.transform("min")).any(axis=1)
    ]
    if len(differing):
        raise SourceError(
            f"{file}: node {differing[0]:.12g} has several positions, expected the nodes of one "
            "instance"
        )
