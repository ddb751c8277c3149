"""Results as tables for spreadsheets (CSV) or as arrays (NetCDF-4), by the name of the file."""

import csv
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Final

import xarray as xr

from chipglow.io.atomic import atomic_path, check_output
from chipglow.io.measurement_file import write_dataset

_KINDS: Final = (".csv", ".nc")


def check_table_path(path: Path) -> None:
    """Check that a file for results can be written, .csv or .nc, before anything is computed."""
    if path.suffix.lower() not in _KINDS:
        raise ValueError(f"{path}: expected a file that ends in {' or '.join(_KINDS)}")
    check_output(path)


def write_table_or_dataset(
    path: Path,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    dataset: Callable[[], xr.Dataset],
) -> None:
    """Write rows as CSV or the dataset as NetCDF, by the suffix of the file."""
    check_table_path(path)
    if path.suffix.lower() == ".nc":
        write_dataset(dataset(), path)
        return
    write_table(path, columns, rows)


def write_table(path: Path, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table as CSV, its first line the names of the columns; it is whole or not there."""
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(columns)
        table.writerows(rows)
