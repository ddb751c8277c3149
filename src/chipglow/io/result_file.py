"""Results in files: their frames as CSV, their arrays as NetCDF-4."""

import os
from pathlib import Path
from typing import Protocol

import pandas as pd
import xarray as xr

from chipglow.io.atomic import atomic_path
from chipglow.io.measurement_file import write_dataset


class Result(Protocol):
    """Result that can be written as a table and as arrays."""

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each value, with the units in the names of the columns."""

    def to_dataset(self) -> xr.Dataset:
        """Return arrays in SI units."""


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
    """Write a result's frame as CSV: numbers have nine digits, NaN is an empty cell."""
    with atomic_path(path) as temporary:
        frame.to_csv(temporary, index=False, float_format="%.9g", lineterminator="\r\n")
