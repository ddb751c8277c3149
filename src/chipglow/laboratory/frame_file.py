"""Frames of results as CSV files."""

import os
from pathlib import Path
from typing import Any

import pandas as pd

from chipglow.io.table_file import write_table


def write_frame(frame: pd.DataFrame, path: str | os.PathLike[str]) -> None:
    """Write a result's frame as CSV: the names of its columns, then a line a row.

    Numbers have nine digits; a cell is empty where there is none.

    Parameters
    ----------
    frame : pandas.DataFrame
        What a result's ``to_frame`` gives.
    path : path-like
        The file to write; one that is there is replaced at the end.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    write_table(Path(path), *columns_and_rows(frame))


def columns_and_rows(frame: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Names of a frame's columns, and the text of its cells row by row."""
    return list(frame.columns), [list(map(_cell, row)) for row in frame.itertuples(index=False)]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if value != value else f"{value:.9g}"
    return str(value)
