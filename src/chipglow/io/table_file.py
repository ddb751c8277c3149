"""Names of files for results: tables for spreadsheets (CSV) or arrays (NetCDF-4)."""

from pathlib import Path
from typing import Final

from chipglow.io.atomic import check_output

_KINDS: Final = (".csv", ".nc")


def check_table_path(path: Path) -> None:
    """Check that a file for results can be written, .csv or .nc, before anything is computed."""
    if path.suffix.lower() not in _KINDS:
        raise ValueError(f"{path}: expected a file that ends in {' or '.join(_KINDS)}")
    check_output(path)
