"""Matrices of numbers in text, as cameras' programs and spreadsheets export them."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from chipglow.text.cells import (
    BLANKS,
    SEPARATORS,
    Kind,
    NumberFormat,
    TableError,
    find_format,
    is_missing,
    kind_of,
    number_or_nan,
    shape_of,
    split,
)
from chipglow.text.notes import Notes
from chipglow.text.text_lines import TextLines, check_last_number, read_lines

Array = NDArray[np.float64]

_FEWEST_COUNTED: Final = 3
"""Two neighbouring numbers are often one apart by chance."""

_FEWEST_EVEN: Final = 5
"""Pixels of a row of which all steps are equal by chance are fewer."""

_COLUMNS_OF_POINTS: Final = range(3, 9)
"""Number of columns of x, y, maybe z, and fields."""

_FEWEST_POINTS: Final = 9
"""Points of a grid; fewer rows of an image may look like one by chance."""

_MOST_DIGITS: Final = 3
"""Digits of a group of thousands; more decimals are rarely written."""

_ROUGHNESS: Final = 2.0
"""Neighbouring pixels differ less than pixels two columns apart, or as much if all is noise."""

_ROUNDING: Final = 1e-6
"""Maximum difference of equal steps of decimal numbers, relative to the step."""


@dataclass(frozen=True)
class Matrix:
    """Matrices of one shape in a text file."""

    values: Array
    """Numbers, shape (frames, rows, columns), NaN if missing."""
    notes: Notes


@dataclass(frozen=True)
class _Line:
    number: int
    """Counted from 1."""
    text: str
    kind: Literal["blank", "gap", "row", "text"]
    """A gap has separators only."""
    cells: int
    """Number of cells; without empty ones at the end for a line of text."""
    numbers: int
    """Number of cells with a number."""


class _Survey:
    """All lines of a file, split at one separator."""

    def __init__(self, lines: Sequence[str], separator: str) -> None:
        self.separator = separator
        self.number_shapes: set[str] = set()
        """Shapes of all numbers in rows."""
        self.lines = [self._line(number, text) for number, text in enumerate(lines, 1)]
        self.rows = [line for line in self.lines if line.kind == "row"]
        self.rows_of_several = sum(line.cells > 1 for line in self.rows)

    def _line(self, number: int, text: str) -> _Line:
        if not text or text.isspace():
            return _Line(number, text, "blank", 0, 0)
        shapes = split(shape_of(text), self.separator)
        counts = Counter(shapes)
        if set(counts) == {""}:
            return _Line(number, text, "gap", len(shapes), 0)
        kinds = {shape: kind_of(shape, self.separator) for shape in counts}
        numbers = sum(count for shape, count in counts.items() if kinds[shape] == "number")
        single = len(shapes) == 1 and not numbers
        if "text" not in kinds.values() and not single:
            self.number_shapes.update(x for x, kind in kinds.items() if kind == "number")
            return _Line(number, text, "row", len(shapes), numbers)
        while not shapes[-1]:
            shapes.pop()
        return _Line(number, text, "text", len(shapes), numbers)

    def cells(self, line: _Line) -> list[str]:
        return split(line.text, self.separator)

    def kind(self, cell: str) -> Kind:
        return kind_of(shape_of(cell), self.separator)


def read_matrix(path: Path) -> Matrix:
    """Read one matrix, or several of one shape with other lines between them.

    Encoding, separator, decimal mark and separator of thousands are found from the whole file.
    Lines of text and a first row or column of indices are left out, and noted.

    Raises
    ------
    TableError
        If a line may be a row but is not one of the matrix, or the file can be read in two ways:
        the message names line and column.
    OSError
        If the file is missing or not accessible.
    """
    source = read_lines(path)
    survey = _survey(source)
    width = _width(path, survey)
    blocks, headers, ignored = _blocks(path, survey, width)
    form, assumed = _format(path, source, survey, [line for block in blocks for line in block])
    _check_end(source, survey, form)
    notes = Notes(remarks=list(source.remarks))
    if assumed:
        notes.assumed.append(assumed)
    if ignored:
        notes.remarks.append(f"Ignored text that is not part of the matrix: {_places(ignored)}.")
    table = _Cells(path, survey, form, blocks)
    table.drop_empty_columns(notes)
    _check_split_numbers(path, survey.separator, table)
    values = table.values()
    rows, columns = _indices_of_all(path, values, table, headers, notes)
    table.note_missing(values, rows, columns, notes)
    values = values[:, rows:, columns:]
    _check_list_of_points(path, blocks[0][0], values)
    if len(values) > 1:
        notes.remarks.append(f"{len(values)} frames are separated by lines without numbers.")
    return Matrix(values, notes)


_SHOWN: Final = 3
"""Ranges of lines that a message lists if there are many."""


def _places(lines: Sequence[_Line]) -> str:
    """Return the numbers of lines as text."""
    numbers = [line.number for line in lines]
    starts = [number for number in numbers if number - 1 not in numbers]
    ends = [number for number in numbers if number + 1 not in numbers]
    ranges = [f"{a}" if a == b else f"{a} to {b}" for a, b in zip(starts, ends, strict=True)]
    shown = [*ranges[:_SHOWN], "..."] if len(ranges) > _SHOWN + 1 else ranges
    return f"line{'s' * (len(numbers) > 1)} {', '.join(shown)}"


def _survey(source: TextLines) -> _Survey:
    """Return the lines, split at the first separator that gives the most rows."""
    surveys = []
    for separator in SEPARATORS:
        if separator == BLANKS or any(separator in line for line in source.lines):
            surveys.append(_Survey(source.lines, separator))
            # A row at this separator is text at the next ones.
            if 2 * len(surveys[-1].rows) > sum(map(bool, source.lines)):
                break
    best = max(surveys, key=lambda survey: survey.rows_of_several)
    if best.rows_of_several == 0:
        _refuse_text(source.path, surveys)
    return best


def _refuse_text(path: Path, surveys: Sequence[_Survey]) -> None:
    """Raise the error for a file without a row of two numbers."""
    longest = {survey: max(survey.lines, key=lambda line: line.cells) for survey in surveys
               if survey.lines}  # fmt: skip
    if not longest or all(line.cells == 0 for line in longest.values()):
        raise TableError(f"{path}: there is no number in it")
    # The first separator that divides most lines; others may be decimal marks.
    survey = max(longest, key=lambda one: sum(line.cells > 1 for line in one.lines))
    line = longest[survey]
    cell, column = _first_text(survey, line)
    raise TableError(
        f"{path}, line {line.number}, column {column}: {cell[:40]!r} is not a number; expected a "
        "matrix of two columns or more"
    )


def _first_text(survey: _Survey, line: _Line) -> tuple[str, int]:
    """Return the first cell that is text, and its column from 1."""
    cells = survey.cells(line)
    kinds = [survey.kind(cell) for cell in cells]
    column = kinds.index("text") if "text" in kinds else 0
    return cells[column], column + 1


def _width(path: Path, survey: _Survey) -> int:
    """Return the number of cells of all rows."""
    widths = Counter(line.cells for line in survey.rows)
    width = max(widths, key=lambda count: widths[count] * count)
    for line in survey.rows:
        if line.cells != width:
            last = "; the file may be truncated" if line is survey.rows[-1] else ""
            raise TableError(
                f"{path}, line {line.number}: has {line.cells} cell{'s' * (line.cells > 1)}, "
                f"expected {width}{last}"
            )
    return width


def _blocks(
    path: Path, survey: _Survey, width: int
) -> tuple[list[list[_Line]], list[_Line], list[_Line]]:
    """Return the rows of each frame, the names of columns above them, and other text."""
    wide = _without_ends(survey, width)
    blocks: list[list[_Line]] = []
    headers: list[_Line] = []
    ignored: list[_Line] = []
    above = ""
    ends = _Line(0, "", "blank", 0, 0)
    for before, line, after in zip([ends, *survey.lines], survey.lines, [*survey.lines[1:], ends],
                                   strict=False):  # fmt: skip
        if line.kind == "row":
            if before.kind != "row":
                blocks.append([])
            blocks[-1].append(line)
        elif line.kind == "gap" and line.cells == width and above != "text":
            # Under text it is an empty line of a spreadsheet.
            raise TableError(
                f"{path}, line {line.number}: all cells are empty: a row of missing values or a "
                "gap; delete the line, or write nan in its cells"
            )
        elif line.kind == "text":
            ignored.append(line)
            begins = after.kind == "row" and before.kind != "row"
            if begins and line.cells in (width, wide) and _names_columns(survey, line):
                headers.append(line)
            else:
                _refuse_row(path, survey, line, {width, wide})
        above = line.kind if line.kind in ("row", "text") else above
    _check_blocks(path, blocks)
    return blocks, headers, ignored


def _without_ends(survey: _Survey, width: int) -> int:
    """Return the number of cells of a row without an empty one at the end of every row."""
    return width - all(not survey.cells(row)[-1] for row in survey.rows)


def _names_columns(survey: _Survey, line: _Line) -> bool:
    """Return whether cells are names, or indices behind one text, as above a matrix."""
    cells = survey.cells(line)[: line.cells]
    if line.numbers == 0:
        return len(set(cells)) == len(cells) > 1
    kinds = [survey.kind(cell) for cell in cells]
    return kinds[0] == "text" and set(kinds[1:]) == {"number"} and _counts(cells[1:])


def _refuse_row(path: Path, survey: _Survey, line: _Line, widths: set[int]) -> None:
    """Raise an error for a line of text that may be a row of the matrix."""
    many_numbers = line.cells > 1 and 2 * line.numbers >= max(widths)
    many_cells = line.cells >= max(2, min(widths))
    if many_numbers or (many_cells and not line.text.startswith("# ")):
        cell, column = _first_text(survey, line)
        raise TableError(
            f"{path}, line {line.number}, column {column}: {cell[:40]!r} is not a number; if the "
            "line is not a row of the matrix, delete it, else the cell"
        )


def _check_blocks(path: Path, blocks: Sequence[Sequence[_Line]]) -> None:
    first = blocks[0]
    for block in blocks:
        if len(block) != len(first):
            raise TableError(
                f"{path}, line {block[0].number}: {len(block)} rows follow, but {len(first)} at "
                f"line {first[0].number}; frames must have the same number of rows"
            )
    if len(blocks) > 1 and len(first) == 1:
        raise TableError(
            f"{path}, line {blocks[1][0].number}: each row is followed by a line without numbers; "
            "delete these lines"
        )


def _format(
    path: Path, source: TextLines, survey: _Survey, rows: Sequence[_Line]
) -> tuple[NumberFormat, str]:
    """Return the format of the numbers of all rows, and what had to be assumed."""
    numbers = survey.number_shapes
    try:
        form, assumed = find_format(numbers, survey.separator, lambda: source.lines)
    except TableError as error:
        raise TableError(f"{path}, {_place_of_mark(survey, rows)}: {error}") from None
    return form, assumed


def _place_of_mark(survey: _Survey, rows: Sequence[_Line]) -> str:
    """Return line, column and content of a cell with the rarer one of the marks."""
    found: dict[str, list[str]] = {",": [], ".": []}
    for row in rows:
        for column, cell in enumerate(survey.cells(row), 1):
            for mark in found.keys() & set(cell):
                found[mark].append(f"line {row.number}, column {column}: {cell[:40]!r}")
    places = min(filter(None, found.values()), key=len, default=[f"line {rows[0].number}"])
    return places[0]


def _check_split_numbers(path: Path, separator: str, table: "_Cells") -> None:
    """Refuse parts of numbers such as 20,25 and 1,050 that are not in quotes between commas."""
    if separator not in (",", BLANKS):
        return
    remedy = f"if {separator!r} is part of the numbers, separate them by semicolons"
    rows = list(table.rows())
    for line, cells in rows:
        for column, cell in enumerate(cells, 1):
            if re.match(r"[-+]?0\d", cell):
                raise TableError(
                    f"{path}, line {line.number}, column {column}: {cell!r} begins with 0; {remedy}"
                )
    firsts = [cell for _, cells in rows for cell in cells[::2]]
    seconds = [cell for _, cells in rows for cell in cells[1::2]]
    if len(rows[0][1]) % 2 == 0 and _are_parts(firsts, seconds):
        raise TableError(
            f"{path}, line {rows[0][0].number}: every second number may be the end of the one "
            f"before it, as in {firsts[0]}{separator}{seconds[0]}; {remedy}"
        )


def _are_parts(firsts: Sequence[str], seconds: Sequence[str]) -> bool:
    """Return whether numbers look like beginnings and ends of others: 20 and 25, or 1 and 050.5."""
    if "." in "".join(firsts):
        return False
    fractions = {"." in cell for cell in seconds if not is_missing(cell)}
    if fractions != {False}:
        return fractions == {True}
    digits, others = ({len(cell) for cell in cells} for cells in (seconds, firsts))
    if len(digits) > 1 or max(digits) > _MOST_DIGITS:
        return False
    if digits != others:
        return True
    if any(is_missing(cell) for cell in (*firsts, *seconds)):
        return False
    before, after = (np.array(cells, np.float64) for cells in (firsts, seconds))
    along = np.median(np.abs(np.diff(before)))
    return bool(np.median(np.abs(before - after)) > _ROUGHNESS * along)


def _check_end(source: TextLines, survey: _Survey, form: NumberFormat) -> None:
    """Refuse a last number without end of line that lacks decimals."""
    *rows, last = survey.rows
    if source.ended or last is not survey.lines[-1]:
        return
    check_last_number(source.path, [survey.cells(row)[-1] for row in rows],
                      survey.cells(last)[-1], form)  # fmt: skip


@dataclass(frozen=True)
class _Edges:
    """First row and column of a frame."""

    line: int
    rows: list[list[str]]
    decimal: str

    @property
    def row(self) -> list[str]:
        return self.rows[0]

    @property
    def column(self) -> list[str]:
        return [row[0] for row in self.rows]

    @property
    def decimals_below(self) -> bool:
        """Whether all numbers outside the first row have decimals."""
        return self._have_decimals(cell for row in self.rows[1:] for cell in row)

    @property
    def decimals_beside(self) -> bool:
        """Whether all numbers outside the first column have decimals."""
        return self._have_decimals(cell for row in self.rows for cell in row[1:])

    def _have_decimals(self, cells: Iterable[str]) -> bool:
        return all(self.decimal in cell or is_missing(cell) for cell in cells)


class _Cells:
    """Cells of all frames."""

    def __init__(
        self, path: Path, survey: _Survey, form: NumberFormat, blocks: Sequence[Sequence[_Line]]
    ) -> None:
        self._path, self._survey, self._form, self._blocks = path, survey, form, blocks
        self._first, self._last = 0, blocks[0][0].cells

    def rows(self) -> Iterator[tuple[_Line, list[str]]]:
        for block in self._blocks:
            for line in block:
                yield line, self._survey.cells(line)[self._first : self._last]

    def drop_empty_columns(self, notes: Notes) -> None:
        """Leave out an empty first or last column, which comes from a separator there."""
        starts_empty = ends_empty = True
        for line, cells in self.rows():
            starts_empty &= not cells[0]
            ends_empty &= not cells[-1]
            if not cells[-1] and not cells[-2]:
                raise TableError(
                    f"{self._path}, line {line.number}, column {len(cells)}: the last cells are "
                    "empty; if values are missing, write nan"
                )
        self._first += starts_empty
        self._last -= ends_empty
        for empty, place in ((starts_empty, "begin"), (ends_empty, "end")):
            if empty:
                notes.remarks.append(f"All rows {place} with a separator, which is left out.")

    def values(self) -> Array:
        """Return all numbers, shape (frames, rows, columns)."""
        columns = self._last - self._first
        values = np.empty((len(self._blocks) * len(self._blocks[0]), columns))
        for row, (line, cells) in enumerate(self.rows()):
            try:
                values[row] = [self._form.number(cell) for cell in cells]
            except ValueError:
                values[row] = [number_or_nan(cell, self._form) for cell in cells]
            if np.isinf(values[row]).any():
                raise TableError(f"{self._path}, line {line.number}: a number is too large")
        return values.reshape(len(self._blocks), -1, columns)

    def note_missing(self, values: Array, first_row: int, first_column: int, notes: Notes) -> None:
        """Note cells without a number in the image, besides the text nan."""
        begin = self._first + first_column
        missing = [
            f"{cell!r} in line {line.number}, column {column}"
            for block, frame in zip(self._blocks, values, strict=True)
            for line, numbers in zip(block[first_row:], frame[first_row:], strict=True)
            if np.isnan(numbers).any()
            for column, cell in enumerate(self._survey.cells(line)[begin : self._last], begin + 1)
            if is_missing(cell) and cell.lower() != "nan"
        ]
        if missing:
            one = len(missing) == 1
            notes.remarks.append(
                f"{len(missing)} {'cell' if one else 'cells'} without a number "
                f"{'is a missing value' if one else 'are missing values'}, the first is "
                f"{missing[0]}."
            )

    def edges(self) -> Iterator[_Edges]:
        """Yield first row and column of each frame."""
        for block in self._blocks:
            rows = [self._survey.cells(line)[self._first : self._last] for line in block]
            yield _Edges(block[0].number, rows, self._form.decimal)


def _counts(cells: Sequence[str]) -> bool:
    """Return whether cells are whole numbers that ascend or descend by one."""
    if len(cells) < 2 or not all(re.fullmatch(r"-?\d{1,9}", cell) for cell in cells):
        return False
    steps = {int(after) - int(before) for before, after in pairwise(cells)}
    return steps in ({1}, {-1})


def _is_even(values: Array) -> bool:
    """Return whether all steps of a row or column are equal and not zero."""
    steps = np.diff(values)
    if len(values) < _FEWEST_EVEN or not np.isfinite(steps).all() or steps[0] == 0:
        return False
    return bool(np.abs(steps / steps[0] - 1).max() < _ROUNDING)


def _indices_of_all(
    path: Path, values: Array, cells: _Cells, headers: Sequence[_Line], notes: Notes
) -> tuple[bool, bool]:
    """Return and note whether first row and column are indices; refuse what may be a pixel."""
    if min(values.shape[1:]) < 2:
        return False, False
    named, corner = bool(headers), any(line.numbers for line in headers)
    frames = zip(values, cells.edges(), strict=True)
    found = {_indices(path, frame, edges, named, corner) for frame, edges in frames}
    if len(found) > 1:
        raise TableError(f"{path}: the first row or column counts in some frames only")
    row, column = found.pop()
    for axis, name in ((row, "row"), (column, "column")):
        if axis:
            notes.remarks.append(f"The first {name} counts the pixels and is left out.")
    return row, column


def _check_list_of_points(path: Path, first: _Line, values: Array) -> None:
    """Refuse lines of a point each, of which two columns are the coordinates of a grid."""
    frame = values[0]
    rows, columns = frame.shape
    if columns not in _COLUMNS_OF_POINTS or rows < _FEWEST_POINTS:
        return
    for one, other in combinations(range(columns), 2):
        sides = [np.unique(frame[:, column]).size for column in (one, other)]
        pairs = np.unique(frame[:, [one, other]], axis=0)
        if min(sides) > 1 and sides[0] * sides[1] == rows == len(pairs):
            raise TableError(
                f"{path}, line {first.number}: each line is a point with its coordinates in "
                f"columns {one + 1} and {other + 1}, expected a matrix; chipglow import reads "
                "points (--set kind=points)"
            )


def _indices(
    path: Path, frame: Array, edges: _Edges, named: bool, corner: bool
) -> tuple[bool, bool]:
    """Return whether the first row and the first column are indices.

    A row of indices may stand above as a line of text with a corner that is text.
    """
    row = _counts(edges.row[1:]) and not _steps_by_one(frame[1, 1:])
    column = _counts(edges.column[1:]) and not _steps_by_one(frame[1:, 1])
    if row and column and min(frame.shape) > _FEWEST_COUNTED:
        return True, True
    if _counts(edges.column) and (named or edges.decimals_beside):
        return False, True
    if _counts(edges.row) and edges.decimals_below:
        return True, False
    _refuse_index(path, edges, "column", edges.column, frame[:, 0], frame[:, 1])
    _refuse_index(path, edges, "row", edges.row, frame[0], frame[1])
    if corner or (np.isnan(frame[0, 0]) and (row or column)):
        raise TableError(
            f"{path}, line {edges.line}, column 1: the columns are numbered, but the first one "
            f"does not count the rows ({', '.join(edges.column[:3])}, ...)"
        )
    return False, False


def _refuse_index(
    path: Path, edges: _Edges, axis: str, cells: Sequence[str], numbers: Array, beside: Array
) -> None:
    """Refuse a first row or column that may be indices or coordinates."""
    from_start = cells[0] in ("0", "1") and len(cells) >= _FEWEST_COUNTED
    special = len(cells) > _FEWEST_COUNTED and not _steps_by_one(beside)
    if _counts(cells) and (from_start or special):
        said = "counts"
    elif _is_even(numbers[1:]) and not _is_even(beside[1:]):
        said = "has equal steps, as coordinates have"
    else:
        return
    raise TableError(
        f"{path}, line {edges.line}, column 1: the first {axis} {said} "
        f"({', '.join(cells[:3])}, ...); delete it if it is not part of the image"
    )


def _steps_by_one(values: Array) -> bool:
    steps = np.diff(values)
    steps = steps[np.isfinite(steps)]
    return bool(steps.size) and bool((steps == 1).all() or (steps == -1).all())
