"""Corrections in NetCDF-4 files."""

import os
from pathlib import Path

from chipglow.correction.correction import Correction
from chipglow.io.measurement_file import read_dataset, write_dataset


def write_correction(correction: Correction, path: str | os.PathLike[str]) -> None:
    """Write a correction to a NetCDF-4 file."""
    write_dataset(correction.data, path)


def read_correction(path: str | os.PathLike[str]) -> Correction:
    """Read a correction that `write_correction` wrote.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is truncated or not a correction; the message names the file.
    """
    return read_dataset(Path(path), Correction, "a correction", "a NetCDF-4 file")
