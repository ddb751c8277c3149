"""Rows of points from CSV files: outlines of tools, curves."""

import csv
from pathlib import Path
from typing import Final

_HEADER: Final = ["x_um", "y_um"]
_LARGEST_FILE: Final = 1_000_000


def read_points(path: Path) -> list[tuple[float, float]]:
    """Read points from a CSV file.

    Parameters
    ----------
    path : Path
        First line ``x_um,y_um``, then a point a line in um, separated by a comma.

    Returns
    -------
    list of tuple
        x and y in m.

    Raises
    ------
    ValueError
        If the file is no such table; the message names the file and the line.
    OSError
        If it cannot be read.
    """
    if path.stat().st_size > _LARGEST_FILE:
        raise ValueError(f"{path}: expected a file of up to {_LARGEST_FILE // 1000} kB")
    try:
        lines = path.read_text(encoding="utf-8-sig").rstrip().splitlines()
    except UnicodeDecodeError:
        raise ValueError(f"{path}: expected text in UTF-8") from None
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines)] or [[]]
    if rows[0] != _HEADER:
        raise ValueError(
            f"{path}, line 1: {','.join(rows[0])!r}, expected {','.join(_HEADER)!r}, the unit named"
        )
    return [_point(row, f"{path}, line {i + 2}") for i, row in enumerate(rows[1:])]


def _point(row: list[str], place: str) -> tuple[float, float]:
    try:
        x, y = (float(cell) * 1e-6 for cell in row)
    except ValueError:
        raise ValueError(
            f"{place}: {','.join(row)!r}, expected two numbers such as -3.5,12"
        ) from None
    return x, y
