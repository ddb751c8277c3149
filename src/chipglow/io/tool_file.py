"""Outlines of tools from files."""

import csv
import os
from pathlib import Path
from typing import Final

from chipglow.scene import ToolOutline, ToolOutlineError

_HEADER: Final = ["x_um", "y_um"]
_LARGEST_FILE: Final = 1_000_000


def read_tool_outline(path: str | os.PathLike[str]) -> ToolOutline:
    """Read a tool's outline from a CSV file and place it.

    Parameters
    ----------
    path : path-like
        First line ``x_um,y_um``, then a point a line in um, separated by a comma: from the rake
        face round the edge to the clearance face, x with the workpiece's motion, y upward. Where
        the origin is does not matter: see `ToolOutline.placed`.

    Raises
    ------
    ValueError
        If the file is no such table, or no tool can have this outline; the message names the file
        and the line.
    OSError
        If it cannot be read.
    """
    path = Path(path)
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
    try:
        return ToolOutline.placed([_point(row, i) for i, row in enumerate(rows[1:])])
    except ToolOutlineError as error:
        raise ValueError(f"{path}, line {error.point + 2}: {error}") from None


def _point(row: list[str], number: int) -> tuple[float, float]:
    try:
        x, y = (float(cell) * 1e-6 for cell in row)
    except ValueError:
        raise ToolOutlineError(
            f"{','.join(row)!r}, expected two numbers such as -3.5,12", number
        ) from None
    return x, y
