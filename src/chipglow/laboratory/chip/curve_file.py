"""Curves through a shear band in files."""

import os
from pathlib import Path

from chipglow.io.column_file import read_polyline
from chipglow.quantities import Array


def read_curve(path: str | os.PathLike[str]) -> Array:
    """Read a curve from a CSV file."""
    path = Path(path)
    curve, _ = read_polyline(path)
    if len(curve) < 2:
        raise ValueError(f"{path}: {len(curve)} points, expected 2 or more")
    return curve
