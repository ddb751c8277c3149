"""Polylines from CSV files: outlines of tools, curves."""

import csv
from pathlib import Path
from typing import Final

from chipglow.text import read_small_text

_HEADER: Final = ["x_um", "y_um"]


def read_polyline(path: Path) -> list[tuple[float, float]]:
    """Read the corners of a polyline from a CSV file.

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
    lines = read_small_text(path).rstrip().splitlines()
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
