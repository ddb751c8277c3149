"""Results in files: their frames as CSV, their arrays as NetCDF-4."""

import csv
import os
from pathlib import Path
from typing import Any, Protocol

import pandas as pd
import xarray as xr

from chipglow.io import atomic_path, write_dataset


class Result(Protocol):
    """What can be written as a table and as arrays."""

    def to_frame(self) -> pd.DataFrame:
        """A row for each value, with the units in the names of the columns."""

    def to_dataset(self) -> xr.Dataset:
        """Arrays in SI units."""


def write_result(result: Result, path: str | os.PathLike[str]) -> None:
    """Write a result in the format that the file suffix names."""
    suffix = Path(path).suffix.lower()
    if suffix == ".nc":
        write_dataset(result.to_dataset(), path)
    elif suffix == ".csv":
        write_frame(result.to_frame(), path)
    else:
        raise ValueError(f"{path}: expected a file that ends in .csv or .nc")


def write_frame(frame: pd.DataFrame, path: str | os.PathLike[str]) -> None:
    """Write a result's frame as CSV: the names of its columns, then a line a row.

    Numbers have nine digits; NaN is an empty cell.
    """
    columns, rows = columns_and_rows(frame)
    with atomic_path(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(rows)


def columns_and_rows(frame: pd.DataFrame) -> tuple[list[str], list[list[str]]]:
    """Names of a frame's columns, and the text of its cells row by row."""
    return list(frame.columns), [list(map(_cell, row)) for row in frame.itertuples(index=False)]


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "" if value != value else f"{value:.9g}"
    return str(value)
