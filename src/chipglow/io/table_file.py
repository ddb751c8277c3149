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
    """Check the name of a file for results before anything is computed.

    Raises
    ------
    ValueError
        If it ends in something else than .csv or .nc.
    OSError
        As `check_output`.
    """
    if path.suffix.lower() not in _KINDS:
        raise ValueError(f"{path}: expected a file that ends in {' or '.join(_KINDS)}")
    check_output(path)


def write_table_or_dataset(
    path: Path,
    columns: Sequence[str],
    rows: Iterable[Sequence[Any]],
    dataset: Callable[[], xr.Dataset],
) -> None:
    """Write results as what the file's name says.

    Parameters
    ----------
    path : Path
        The file to write, .csv or .nc; one that is there is replaced at the end.
    columns : sequence of str
        Names of the table's columns, with their units.
    rows : iterable of sequence
        The table.
    dataset : callable
        Makes the arrays.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
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
