"""Curves through a shear band, and the temperature along them, in files."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.io.polyline_file import read_polyline
from chipglow.io.table_file import celsius_text, number_text, write_table_or_dataset
from chipglow.laboratory.chip.band_profile import BandProfile

_COLUMNS: Final = (
    "time_us",
    "stage",
    "distance_um",
    "x_um",
    "y_um",
    "radiance_temperature_degC",
    "standard_uncertainty_K",
)


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
        columns. ``.nc``: NetCDF-4 in SI units with the dimensions (time, distance). A file that is
        there is replaced at the end.

    Raises
    ------
    ValueError
        If the name ends in something else.
    OSError
        If the file cannot be written.
    """
    write_table_or_dataset(path, _COLUMNS, _rows(profile), lambda: _dataset(profile))


def _rows(profile: BandProfile) -> Iterator[tuple[Any, ...]]:
    uncertainty = profile.uncertainty
    for frame, (time, stage) in enumerate(zip(profile.times, profile.stage, strict=True)):
        for n in np.flatnonzero(np.isfinite(profile.points[frame, :, 0])):
            x, y = profile.points[frame, n]
            places = [f"{1e6 * value:.6g}" for value in (profile.distance[n], x, y)]
            values = (
                celsius_text(profile.temperature[frame, n]),
                number_text(uncertainty[frame, n]),
            )
            yield (f"{1e6 * time:.10g}", stage.value, *places, *values)


def _dataset(profile: BandProfile) -> xr.Dataset:
    both, kelvin = ("time", "distance"), {"units": "K"}
    name = {"long_name": "radiance temperature"}
    return xr.Dataset(
        {
            "temperature": (both, profile.temperature, kelvin | name),
            "uncertainty": (both, profile.uncertainty, kelvin),
            "uncertainty_calibration": (both, profile.calibration, kelvin),
            "uncertainty_position": (both, profile.position, kelvin),
            "uncertainty_tool": (both, profile.tool_uncertainty, kelvin),
            "x": (both, profile.points[..., 0], {"units": "m"}),
            "y": (both, profile.points[..., 1], {"units": "m"}),
            "offset": ("time", profile.offset, {"units": "m"}),
            "stage": ("time", [stage.value for stage in profile.stage]),
            "reference_x": ("reference_distance", profile.reference.points[:, 0], {"units": "m"}),
            "reference_y": ("reference_distance", profile.reference.points[:, 1], {"units": "m"}),
        },
        coords={
            "time": ("time", profile.times, {"units": "s"}),
            "distance": ("distance", profile.distance, {"units": "m"}),
            "reference_distance": (
                "reference_distance",
                profile.reference.distance,
                {"units": "m"},
            ),
        },
        attrs={
            "width": profile.width,
            "assumed": "\n".join(profile.assumptions),
            "doubtful": "\n".join(profile.warnings),
        },
    )
