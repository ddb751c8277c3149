"""Curves through a shear band, and the temperature along them, in files."""

import os
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.io.polyline_file import read_polyline
from chipglow.io.table_file import write_table_or_dataset
from chipglow.laboratory.chip.band_profile import BandProfile
from chipglow.laboratory.frame_file import columns_and_rows
from chipglow.uncertainty import to_xarray


def read_curve(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Read a curve from a CSV file.

    Parameters
    ----------
    path : path-like
        First line ``x_um,y_um``, then a corner of the polyline a line in um, in the coordinates of
        the measurement.

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
    points = read_polyline(path)
    if len(points) < 2:
        raise ValueError(f"{path}: {len(points)} points, expected 2 or more")
    curve = np.array(points)
    finite = np.isfinite(curve).all(axis=1)
    if not finite.all():
        raise ValueError(f"{path}, line {int(finite.argmin()) + 2}: expected finite numbers")
    return curve


def write_band_profile(profile: BandProfile, path: Path) -> None:
    """Write the temperature along a shear band to a file.

    Parameters
    ----------
    profile : BandProfile
        What to write.
    path : Path
        ``.csv``: a line for each point of each frame's band, with its units in the names of the
        columns; what is not known of its uncertainty is empty. ``.nc``: NetCDF-4 in SI units with
        the dimensions (time, distance), ``temperature`` with its components as
        `chipglow.uncertainty.from_xarray` reads them. A file that is there is replaced at the end.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    write_table_or_dataset(path, *columns_and_rows(profile.to_frame()), lambda: _dataset(profile))


def _dataset(profile: BandProfile) -> xr.Dataset:
    both = ("time", "distance")
    data = to_xarray(profile.estimate, "temperature", both, "K")
    data["temperature"].attrs["long_name"] = "radiance temperature"
    metres = {"units": "m"}
    return (
        data.assign(
            standard_uncertainty=(both, profile.estimate.standard_uncertainty, {"units": "K"}),
            x=(both, profile.points[..., 0], metres),
            y=(both, profile.points[..., 1], metres),
            offset=("time", profile.offset, metres),
            stage=("time", [stage.value for stage in profile.stage]),
            reference_x=("reference_distance", profile.reference.points[:, 0], metres),
            reference_y=("reference_distance", profile.reference.points[:, 1], metres),
        )
        .assign_coords(
            time=("time", profile.times, {"units": "s"}),
            distance=("distance", profile.distance, metres),
            reference_distance=("reference_distance", profile.reference.distance, metres),
        )
        .assign_attrs(
            width=profile.width,
            assumed="\n".join(profile.assumptions),
            warnings="\n".join(profile.warnings),
        )
    )
