"""Tables in text whose first line names the columns."""

from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.text.cells import (
    BLANKS,
    SEPARATORS,
    NumberFormat,
    TableError,
    find_format,
    kind_of,
    number_or_nan,
    shape_of,
    split,
)
from chipglow.text.notes import Notes
from chipglow.text.text_lines import TextLines, check_last_number, first_lines, read_lines

_JUDGED: Final = 100
"""Number of rows whose decimals the last number is compared with."""


@dataclass(frozen=True)
class NamedTable:
    """Rows below a line of names; lines that are blank or begin with # are left out."""

    path: Path
    first: int
    """Line number of the column names, from 1."""
    names: tuple[str, ...]
    rows: list[tuple[int, str]]
    """Number and text of the line of each row."""
    separator: str
    form: NumberFormat
    notes: Notes

    def cells(self) -> Iterator[tuple[int, list[str]]]:
        """Yield number and cells of the line of each row."""
        for number, line in self.rows:
            yield number, split(line, self.separator)[: len(self.names)]

    def number(self, cell: str) -> float:
        """Return the number in a cell, NaN for a missing one; raise a ValueError for text."""
        return number_or_nan(cell, self.form)

    def columns(self) -> tuple[list[NDArray[np.float64]], dict[int, str]]:
        """Return the numbers of each column, NaN for text, and an error by column with text."""
        columns = [array("d") for _ in self.names]
        wrong: dict[int, str] = {}
        missing, first = 0, ""
        for line, cells in self.cells():
            for index, (column, cell) in enumerate(zip(columns, cells, strict=True)):
                try:
                    value = self.number(cell)
                except ValueError:
                    value = np.nan
                    wrong.setdefault(
                        index,
                        f"{self.path}, line {line}: {self.names[index]} is {cell[:40]!r}, expected "
                        "a number",
                    )
                else:
                    if np.isnan(value) and cell.lower() != "nan":
                        missing += 1
                        first = first or f"{cell!r} in line {line}, column {index + 1}"
                column.append(value)
        if missing:
            self.notes.remarks.append(
                f"{missing} cell{'s' * (missing > 1)} without a number are missing values, the "
                f"first is {first}."
            )
        return [np.array(column) for column in columns], wrong


def read_named_table(path: Path) -> NamedTable:
    """Read a table whose first line names the columns.

    Encoding, separator, decimal mark and separator of thousands are found from the whole file.

    Raises
    ------
    TableError
        If a row has more or fewer cells than the first line, or numbers can be read in two ways.
    OSError
        If the file is missing or not accessible.
    """
    source = read_lines(path)
    lines = [
        (number, line)
        for number, line in enumerate(source.lines, 1)
        if line.strip() and not line.startswith("#")
    ]
    if not lines:
        raise TableError(f"{path}: there is no number in it")
    (first, head), *rows = lines
    separator, width = _separator(path, head, rows)
    names = tuple(split(head, separator))[:width]
    form, assumed = _format(path, source, rows, separator, width)
    if rows and not source.ended and rows[-1][1] == source.lines[-1]:
        *others, last = [split(line, separator)[width - 1] for _, line in rows[-_JUDGED:]]
        check_last_number(path, others, last, form)
    notes = Notes([assumed] if assumed else [], remarks=list(source.remarks))
    return NamedTable(path, first, names, rows, separator, form, notes)


def _separator(path: Path, head: str, rows: list[tuple[int, str]]) -> tuple[str, int]:
    """Return the separator that gives all rows as many cells as names, and their number."""
    wrong = ""
    several = [separator for separator in SEPARATORS if len(split(head, separator)) > 1]
    for separator in several or [BLANKS]:
        names = split(head, separator)
        different = next(
            (
                (number, len(cells))
                for number, line in rows
                if len(cells := split(line, separator)) != len(names)
            ),
            None,
        )
        if different is None:
            ends = not names[-1] and not any(split(line, separator)[-1] for _, line in rows)
            return separator, len(names) - ends
        number, count = different
        last = "; the file may be truncated" if number == rows[-1][0] else ""
        wrong = wrong or (
            f"{path}, line {number}: has {count} cell{'s' * (count > 1)} separated by "
            f"{separator!r}, expected {len(names)} as the names of columns{last}"
        )
    raise TableError(wrong)


def _format(
    path: Path, source: TextLines, rows: list[tuple[int, str]], separator: str, width: int
) -> tuple[NumberFormat, str]:
    """Return the format of all numbers, and what had to be assumed."""
    places: dict[str, str] = {}
    for number, line in rows:
        for column, shape in enumerate(split(shape_of(line), separator)[:width], 1):
            if shape not in places:
                places[shape] = f"line {number}, column {column}"
    numbers = {shape for shape in places if kind_of(shape, separator) == "number"}
    try:
        return find_format(numbers, separator, lambda: source.lines)
    except TableError as error:
        marks = [[shape for shape in numbers if mark in shape] for mark in ",."]
        rarest = min(filter(None, marks), key=len, default=sorted(numbers))
        place = min(rarest, key=list(places).index)
        raise TableError(f"{path}, {places[place]}: {error}") from None


def has_names_of_columns(path: Path) -> bool:
    """Return whether a file begins with a line of names above a line of numbers."""
    if not path.is_file():
        return False
    lines = [line for line in first_lines(path) if line.strip() and not line.startswith("#")]
    return len(lines) > 1 and any(_is_header(lines[0], lines[1], mark) for mark in SEPARATORS)


def _is_header(names: str, numbers: str, separator: str) -> bool:
    heads, below = (
        [kind_of(shape, separator) for shape in split(shape_of(line), separator)]
        for line in (names, numbers)
    )
    return len(heads) > 1 and set(heads) == {"text"} and 2 * below.count("number") > len(below)
