"""Curves through a shear band in files."""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipglow.io.column_file import read_polyline


def read_curve(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read a curve from a CSV file.

    Parameters
    ----------
    path : path-like
        First line ``x_um,y_um``, or another unit of length, then a corner of the polyline a line,
        in the coordinates of the measurement.

    Returns
    -------
    ndarray
        x and y in m, shape (n, 2).

    Raises
    ------
    ValueError
        If the file is no such table or has less than two points; the message names the file.
    OSError
        If it cannot be read.
    """
    path = Path(path)
    curve, _ = read_polyline(path)
    if len(curve) < 2:
        raise ValueError(f"{path}: {len(curve)} points, expected 2 or more")
    return curve
