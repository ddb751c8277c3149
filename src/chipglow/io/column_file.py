"""Small tables in text: columns by name, each with its unit."""

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
from chipglow.text import NamedTable, read_named_table


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
    path: str | os.PathLike[str] | NamedTable, columns: Sequence[Column]
) -> tuple[dict[str, Array], list[int]]:
    """Read a table of numbers from a CSV file, and which line of the file each row is.

    The columns are in SI by name, each of shape (rows,). In the first line the unit follows the
    name: ``temperature_degC,counts``. Semicolons and tabs separate cells as well, then also with
    a decimal comma.
    """
    table = path if isinstance(path, NamedTable) else read_named_table(Path(path))
    if not table.rows:
        raise ValueError(
            f"{table.path}: there is no number in it, expected a first line such as "
            f"{','.join(column.title for column in columns)} and lines of numbers"
        )
    place = f"{table.path}, line {table.first}"
    found = [_column(place, name, columns) for name in table.names]
    names = [column.name for column, _ in found]
    for column in columns:
        if names.count(column.name) > 1 or (column.required and column.name not in names):
            raise ValueError(f"{place}: expected a column {column.title!r}, once")
    if table.notes.assumed and table.separator != ",":
        raise ValueError(
            f"{table.path}: the decimal mark is not certain; separate the cells by commas"
        )
    numbers = np.array([_numbers(table, line, cells, found) for line, cells in table.cells()])
    values = {
        column.name: unit.scale * values + (0.0 if column.difference else unit.offset)
        for (column, unit), values in zip(found, numbers.T, strict=True)
    }
    return values, [line for line, _ in table.rows]


def read_calibration_points(
    path: str | os.PathLike[str], counts_of: Callable[[str], float]
) -> dict[str, Array]:
    """Read a table of `POINT_COLUMNS` from a CSV file.

    A column ``file`` may stand for ``counts`` or beside it, where each line fills one of both:
    `counts_of` gives the counts of that recording.
    """
    points = read_named_table(Path(path))
    if "file" not in points.names:
        return read_table(points, POINT_COLUMNS)[0]
    counts = Column("counts", required=False, blank=True)
    file = Column("file", number_of=counts_of, blank=True)
    table, lines = read_table(points, (TEMPERATURE, counts, file, *_POINT_UNCERTAINTIES))
    stated = table.pop("counts", np.full(len(lines), nan))
    read = table.pop("file")
    for line, both in zip(lines, np.isfinite(stated) == np.isfinite(read), strict=True):
        if both:
            raise ValueError(f"{path}, line {line}: expected either counts or a file")
    return {**table, "counts": np.fmax(stated, read)}


def _column(place: str, cell: str, columns: Sequence[Column]) -> tuple[Column, Unit]:
    """Return the column that a cell of the first line names, and its unit."""
    for column in sorted(columns, key=lambda one: -len(one.name)):
        if cell == column.name and not column.base:
            return column, SI
        if cell == column.name:
            raise ValueError(
                f"{place}: {cell!r} has no unit, expected a name such as {column.title}"
            )
        if cell.startswith(f"{column.name}_") and column.base:
            try:
                return column, parse_unit(cell[len(column.name) + 1 :], column.base, column.name)
            except ValueError as error:
                raise ValueError(f"{place}: {error}") from None
    expected = ", ".join(column.title for column in columns)
    raise ValueError(f"{place}: unknown column {cell[:60]!r}, expected {expected}")


def _numbers(
    table: NamedTable, line: int, cells: list[str], columns: Sequence[tuple[Column, Unit]]
) -> list[float]:
    return [
        _number(table, line, cell, column) for cell, (column, _) in zip(cells, columns, strict=True)
    ]


def _number(table: NamedTable, line: int, cell: str, column: Column) -> float:
    if not cell and column.blank:
        return nan
    if column.number_of is not None and cell:
        return column.number_of(cell)
    try:
        number = table.number(cell)
    except ValueError:
        number = nan
    if not isfinite(number):
        raise ValueError(
            f"{table.path}, line {line}: {column.name} is {cell[:40]!r}, expected a number"
        )
    return number


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


def read_curve(path: str | os.PathLike[str]) -> Array:
    """Read a curve from a CSV file."""
    path = Path(path)
    curve, _ = read_polyline(path)
    if len(curve) < 2:
        raise ValueError(f"{path}: {len(curve)} points, expected 2 or more")
    return curve
