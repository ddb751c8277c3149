"""Small tables in text: columns by name, each with its unit."""

import csv
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.quantities.units import SI, Unit, parse_unit
from chipglow.radiometry import TabulatedResponse
from chipglow.text import read_small_text


@dataclass(frozen=True)
class Column:
    """A column of a table."""

    name: str
    example: str = ""  # of a unit; without one it is a plain number
    base: str = ""  # SI unit of the quantity
    difference: bool = False  # the zero of the unit does not count
    required: bool = True
    number_of: Callable[[str], float] | None = None  # of cells of text, such as file names
    blank: bool = False  # cells may be empty, which is NaN

    @property
    def title(self) -> str:
        """Name as a first line has it."""
        return f"{self.name}_{self.example}" if self.example else self.name


TEMPERATURE: Final = Column("temperature", "degC", "K")
_POINT_UNCERTAINTIES: Final = (
    Column("count_uncertainty", required=False),
    Column("temperature_uncertainty", "K", "K", difference=True, required=False),
)
POINT_COLUMNS: Final = (TEMPERATURE, Column("counts"), *_POINT_UNCERTAINTIES)
"""Points of a calibration."""


def read_table(
    path: str | os.PathLike[str], columns: Sequence[Column]
) -> tuple[dict[str, Array], list[int]]:
    """Read a table of numbers from a CSV file, and which line of the file each row is.

    The columns are in SI by name, each of shape (rows,). In the first line the unit follows the
    name: ``temperature_degC,counts``.
    """
    path = Path(path)
    lines = read_small_text(path).splitlines()
    rows = [(number, row) for number, row in enumerate(csv.reader(lines), 1) if any(row)]
    if len(rows) < 2:
        raise ValueError(
            f"{path}: there is no number in it, expected a first line such as "
            f"{','.join(column.title for column in columns)} and lines of numbers"
        )
    first = rows[0][1]
    if len(first) == 1 and len(columns) > 1 and (mark := next(filter(first[0].count, ";\t"), "")):
        raise ValueError(
            f"{path}, line 1: {first[0][:60]!r} is separated by {mark!r}, expected commas"
        )
    found = [_column(path, cell.strip(), columns) for cell in first]
    names = [column.name for column, _ in found]
    for column in columns:
        if names.count(column.name) > 1 or (column.required and column.name not in names):
            raise ValueError(f"{path}, line 1: expected a column {column.title!r}, once")
    numbers = np.array([_numbers(path, number, row, found) for number, row in rows[1:]])
    table = {
        column.name: unit.scale * values + (0.0 if column.difference else unit.offset)
        for (column, unit), values in zip(found, numbers.T, strict=True)
    }
    return table, [number for number, _ in rows[1:]]


def read_calibration_points(
    path: str | os.PathLike[str], counts_of: Callable[[str], float]
) -> dict[str, Array]:
    """Read a table of `POINT_COLUMNS` from a CSV file.

    A column ``file`` may stand for ``counts`` or beside it, where each line fills one of both:
    `counts_of` gives the counts of that recording.
    """
    first = read_small_text(Path(path)).partition("\n")[0]
    if "file" not in map(str.strip, first.split(",")):
        return read_table(path, POINT_COLUMNS)[0]
    counts = Column("counts", required=False, blank=True)
    file = Column("file", number_of=counts_of, blank=True)
    table, lines = read_table(path, (TEMPERATURE, counts, file, *_POINT_UNCERTAINTIES))
    stated = table.pop("counts", np.full(len(lines), nan))
    read = table.pop("file")
    for line, both in zip(lines, np.isfinite(stated) == np.isfinite(read), strict=True):
        if both:
            raise ValueError(f"{path}, line {line}: expected either counts or a file")
    return {**table, "counts": np.fmax(stated, read)}


def _column(path: Path, cell: str, columns: Sequence[Column]) -> tuple[Column, Unit]:
    """Return the column that a cell of the first line names, and its unit."""
    for column in sorted(columns, key=lambda one: -len(one.name)):
        if cell == column.name and not column.base:
            return column, SI
        if cell == column.name:
            raise ValueError(
                f"{path}, line 1: {cell!r} has no unit, expected a name such as {column.title}"
            )
        if cell.startswith(f"{column.name}_") and column.base:
            try:
                return column, parse_unit(cell[len(column.name) + 1 :], column.base, column.name)
            except ValueError as error:
                raise ValueError(f"{path}, line 1: {error}") from None
    expected = ", ".join(column.title for column in columns)
    raise ValueError(f"{path}, line 1: unknown column {cell[:60]!r}, expected {expected}")


def _numbers(
    path: Path, number: int, row: list[str], columns: Sequence[tuple[Column, Unit]]
) -> list[float]:
    if len(row) == len(columns):
        cells = [(cell.strip(), column) for cell, (column, _) in zip(row, columns, strict=True)]
        if all(_fits(cell, column) for cell, column in cells):
            return [(column.number_of or float)(cell) if cell else nan for cell, column in cells]
    what = "numbers" if all(column.number_of is None for column, _ in columns) else "values"
    raise ValueError(
        f"{path}, line {number}: {','.join(row)[:80]!r}, expected {len(columns)} {what} separated "
        "by commas"
    )


def _fits(cell: str, column: Column) -> bool:
    if not cell:
        return column.blank
    try:
        return column.number_of is not None or isfinite(float(cell))
    except ValueError:
        return False


def read_polyline(path: Path) -> tuple[Array, list[int]]:
    """Read corners in m, shape (n, 2), and the line of the file of each: ``x_um,y_um``."""
    table, lines = read_table(path, (Column("x", "um", "m"), Column("y", "um", "m")))
    return np.stack([table["x"], table["y"]], axis=1), lines


def read_response(path: str | os.PathLike[str]) -> TabulatedResponse:
    """Read a camera's spectral response from a CSV file: ``wavelength_um,response``."""
    table, _ = read_table(path, (Column("wavelength", "um", "m"), Column("response")))
    order = np.argsort(table["wavelength"])
    try:
        return TabulatedResponse(
            tuple(table["wavelength"][order].tolist()), tuple(table["response"][order].tolist())
        )
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def read_bad_pixels(path: str | os.PathLike[str], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Read which pixels of an image are bad: ``column,row``, counted from 0 at the upper left."""
    table, _ = read_table(path, (Column("column"), Column("row")))
    mask = np.zeros(shape, np.bool_)
    for column, row in zip(table["column"], table["row"], strict=True):
        if not (column in range(shape[1]) and row in range(shape[0])):
            raise ValueError(
                f"{path}: pixel {column:g},{row:g} is not in the image, expected column and row "
                f"of {shape[1]} x {shape[0]}, counted from 0"
            )
        mask[int(row), int(column)] = True
    return mask
