"""Outlines of tools from files."""

import os
from pathlib import Path

from chipglow.io.column_file import read_polyline
from chipglow.scene import ToolOutline, ToolOutlineError


def read_tool_outline(path: str | os.PathLike[str]) -> ToolOutline:
    """Read a tool's outline from a CSV file and place it.

    Parameters
    ----------
    path : path-like
        First line ``x_um,y_um``, then a point a line in um, separated by a comma: from the rake
        face round the edge to the flank face, x with the workpiece's motion, y upward. Where
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
    points, lines = read_polyline(path)
    try:
        return ToolOutline.placed(points)
    except ToolOutlineError as error:
        raise ValueError(f"{path}, line {lines[error.point]}: {error}") from None
