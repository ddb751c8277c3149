"""Numbers in the cells of text tables, in any regional format."""

import csv
import re
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import isfinite, nan
from typing import Final, Literal


class TableError(ValueError):
    """A text table that cannot be read, or that can be read in more than one way."""


BLANKS: Final = " "
"""Separator of cells that are separated by any number of blanks and tabs."""

SEPARATORS: Final = (";", "\t", "|", ",", BLANKS)
"""Separators of cells; one that cannot be part of a number comes first."""

_GROUPING: Final = (",", ".", "'", "’", " ", "\u00a0", "\u202f", "\u2009")
"""Marks between groups of three digits, with the blanks of fixed and narrow width."""

_AROUND: Final = " \t'\u00a0"
"""Marks that may be around a number in a cell, besides double quotes."""

_SHAPE: Final = str.maketrans(dict.fromkeys("0123456789", "9"))
_PLAIN: Final = re.compile(r"[-+.,0-9eE]+\Z")
_MISSING: Final = re.compile(
    r"|-+|[–—]+|\*+|#+|#?n\.?/?a\.?n?|#nv|1\.#(?:qnan|ind)|null|[<>≤≥]=?\s*[-+]?[9.,]+",
    re.IGNORECASE,
)
"""Cells of pixels without a value, or outside the range of the camera."""

Kind = Literal["number", "missing", "text"]


def shape_of(text: str) -> str:
    """Return a text with 9 for each digit: cells of one shape are read in the same way."""
    return text.translate(_SHAPE)


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line, without quotes and the blanks around them."""
    if separator == BLANKS:
        cells = re.split(r"[ \t]+", line.strip(" \t"))
    elif '"' in line:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        except csv.Error as error:
            raise TableError(str(error)) from None
    else:
        cells = line.split(separator)
        if not any(mark in line for mark in _AROUND if mark != separator):
            return cells
    return [cell.strip().strip("\"'") for cell in cells]


@dataclass(frozen=True)
class NumberFormat:
    """How numbers are written."""

    decimal: str
    thousands: str = ""
    """Mark between groups of three digits; empty without one."""

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        # 300. is a number, but 300, is the end of a cell.
        fraction = r"(?:\.9*)?" if self.decimal == "." else "(?:,9+)?"
        bare = rf"{re.escape(self.decimal)}9+"
        if self.thousands:
            whole = f"9{{1,3}}(?:{re.escape(self.thousands)}999)*"
            return re.compile(f"[-+]?(?:{whole}{fraction}|{bare})")
        return re.compile(f"[-+]?(?:9+{fraction}|{bare})(?:[eE][-+]?9+)?")

    def fits(self, shape: str) -> bool:
        """Return whether cells of a shape are numbers in this format."""
        return self._pattern.fullmatch(shape) is not None

    def number(self, cell: str) -> float:
        """Return the number in a cell of a shape that fits."""
        if self.thousands:
            cell = cell.replace(self.thousands, "")
        return float(cell.replace(",", ".") if self.decimal == "," else cell)


_FORMATS: Final = [
    NumberFormat(decimal, mark) for decimal in ".," for mark in ("", *_GROUPING) if mark != decimal
]


def is_missing(cell: str) -> bool:
    """Return whether a cell is empty, out of range or stands for no number."""
    return _MISSING.fullmatch(shape_of(cell)) is not None


@lru_cache(maxsize=100_000)
def kind_of(shape: str, separator: str) -> Kind:
    """Return what cells of a shape contain; a number in some format is a number."""
    if _MISSING.fullmatch(shape):
        return "missing"
    # 20,25 222,25 is not 20 and 25222 and 25.
    parted = " " in shape and separator == ","
    return "number" if not parted and any(one.fits(shape) for one in _FORMATS) else "text"


def number_or_nan(cell: str, form: NumberFormat) -> float:
    """Return the number in a cell, or NaN for a missing one; a ValueError for text."""
    with suppress(ValueError):
        if not form.thousands and isfinite(value := form.number(cell)) and _PLAIN.match(cell):
            return value
    shape = shape_of(cell)
    if is_missing(cell):
        return nan
    if not form.fits(shape):
        raise ValueError(cell)
    return form.number(cell)


def find_format(
    shapes: Collection[str], separator: str, lines: Callable[[], Iterable[str]]
) -> tuple[NumberFormat, str]:
    """Return the only format that fits all numbers, and what had to be assumed.

    Parameters
    ----------
    shapes : collection of str
        Shapes of all numbers of the table.
    separator : str
        Separator of the cells.
    lines : callable
        Returns all lines of the file, which may decide between formats.

    Raises
    ------
    TableError
        If no format fits, or the file does not decide between two.
    """
    fitting = [form for form in _candidates(shapes) if all(map(form.fits, shapes))]
    if not fitting:
        raise TableError("no decimal mark fits all numbers")
    if len(fitting) > 1:
        mark = "," if any("," in shape for shape in shapes) else "."
        if mark != separator and _is_decimal(mark, lines()):
            fitting = [form for form in fitting if form.decimal == mark]
        elif mark == "." and all(mark in shape for shape in shapes):
            text = "'.' is the decimal mark: each number has three digits after it."
            return NumberFormat("."), text
        else:
            raise TableError(
                f"{mark!r} may be the decimal mark or separate thousands; write a number with "
                "another number of decimals, or without separators of thousands"
            )
    return fitting[0], ""


def _candidates(shapes: Collection[str]) -> Iterator[NumberFormat]:
    """Yield formats that differ for these numbers."""
    marks = set("".join(shapes))
    for form in _FORMATS:
        if form.thousands and form.thousands not in marks:
            continue
        if form.decimal == "." or "," in marks or form.thousands == ".":
            yield form


def _is_decimal(mark: str, lines: Iterable[str]) -> bool:
    """Return whether the file has a number, such as 0,950 or 20,0 °C, with this decimal mark."""
    after = re.escape(mark)
    evidence = re.compile(
        rf"(?<![\d.,:])(?:0{after}\d+|\d+{after}(?:\d{{1,2}}|\d{{4,}}))(?![\d.,])"
    )
    return any(evidence.search(line) for line in lines)
