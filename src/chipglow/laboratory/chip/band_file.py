"""Curves through a shear band, and the temperature along them, in files."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.io.column_file import read_polyline
from chipglow.io.table_file import celsius_text, number_text, write_table_or_dataset
from chipglow.laboratory.chip.band_profile import BAND_BUDGET, BandProfile
from chipglow.laboratory.chip.budget_columns import budget_columns, budget_values
from chipglow.uncertainty import to_xarray

_COLUMNS: Final = (
    "time_us",
    "stage",
    "distance_um",
    "x_um",
    "y_um",
    "radiance_temperature_degC",
    *budget_columns(BAND_BUDGET),
)


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
    write_table_or_dataset(path, _COLUMNS, _rows(profile), lambda: _dataset(profile))


def _rows(profile: BandProfile) -> Iterator[tuple[Any, ...]]:
    budget = budget_values(profile.estimate, BAND_BUDGET)
    for frame, (time, stage) in enumerate(zip(profile.times, profile.stage, strict=True)):
        for n in np.flatnonzero(np.isfinite(profile.points[frame, :, 0])):
            x, y = profile.points[frame, n]
            places = [f"{1e6 * value:.6g}" for value in (profile.distance[n], x, y)]
            value = celsius_text(profile.temperature[frame, n])
            parts = map(number_text, budget[frame, n])
            yield (f"{1e6 * time:.10g}", stage.value, *places, value, *parts)


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
            doubtful="\n".join(profile.warnings),
        )
    )
