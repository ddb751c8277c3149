"""Determined emissivities in files: maps and regions as NetCDF-4, the table of regions as CSV."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from chipglow.analysis.emissivity import (
    COMMON,
    EmissivityMap,
    RegionEmissivity,
    emissivity_covariance,
)
from chipglow.camera import Flag
from chipglow.io.atomic import atomic_path
from chipglow.io.measurement_file import write_dataset
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.surface import MapSurface

_KIND: Final = "emissivity map"
_BUDGET: Final = (*COMMON, "repeatability", "noise")


def write_emissivity(
    maps: Sequence[EmissivityMap],
    rows: Sequence[Sequence[RegionEmissivity]],
    path: str | os.PathLike[str],
) -> None:
    """Write emissivity maps and their regions to a NetCDF-4 file.

    Parameters
    ----------
    maps : sequence of EmissivityMap
        Of one object, one for each true temperature.
    rows : sequence of sequence of RegionEmissivity
        The same areas of each map.
    path : path-like
        The file to write; one that is there is replaced at the end.
    """
    raster = maps[0].raster
    images: dict[str, Any] = {
        "emissivity": np.stack([one.emissivity for one in maps]),
        "standard_uncertainty": np.stack([one.standard_uncertainty for one in maps]),
        "flags": np.stack([one.flags for one in maps]),
    }
    tables = {f"region_{name}": _column(rows, name) for name in _COLUMNS}
    for cause in _BUDGET:
        tables[f"region_{cause}_uncertainty"] = [[row.budget[cause] for row in of] for of in rows]
    names = np.array([row.name for row in rows[0]], dtype=object)
    data = xr.Dataset(
        {
            **{name: (("truth", "y", "x"), image) for name, image in images.items()},
            **{name: (("truth", "region"), np.array(table)) for name, table in tables.items()},
            "region_covariance": (
                ("truth", "region", "other_region"),
                np.stack([emissivity_covariance(of) for of in rows]),
            ),
            "environment": ("truth", [one.heating.environment for one in maps], {"units": "K"}),
            "feature": ("region", np.array([row.feature for row in rows[0]], dtype=object)),
        },
        coords={
            **raster_coordinates(raster, np.zeros(1)),
            "truth": ("truth", [one.heating.truth for one in maps], {"units": "K"}),
            "other_region": ("other_region", names),
            "region": ("region", names),
        },
        attrs={"kind": _KIND, "pitch": raster.spacing},
    ).drop_vars("time")
    for variable in data.data_vars.values():
        variable.attrs.setdefault("units", "1")
    write_dataset(data, path)


def read_emissivity_map(
    path: str | os.PathLike[str], truth: float | None = None, elsewhere: float = 0.0
) -> MapSurface:
    """Read an emissivity map as a surface.

    Parameters
    ----------
    path : path-like
        A file of `write_emissivity`.
    truth : float, optional
        True temperature in K of the map to take, the nearest; the file's first by default.
    elsewhere : float
        Emissivity off the image.

    Returns
    -------
    MapSurface
        Where noise took a pixel out of 0 to 1, it has the nearer of these.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is cut short or no emissivity map; the message names the file.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file, expected an emissivity map")
    try:
        data = xr.load_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="access")
        if data.attrs.get("kind") != _KIND:
            raise ValueError("it does not say that it is an emissivity map")
        index = 0 if truth is None else int(np.abs(data["truth"].values - truth).argmin())
        values = np.clip(data["emissivity"].values[index].astype(np.float64), 0.0, 1.0)
        x, y, pitch = data["x"].values, data["y"].values, float(data.attrs["pitch"])
        raster = Raster(float(x[0]) - pitch / 2, float(y[0]) + pitch / 2, pitch, len(y), len(x))
        return MapSurface(values, raster, elsewhere)
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        reason = str(error).split("\n", 1)[0]
        raise ValueError(
            f"{path}: not an emissivity map, or cut short, expected a file of chipglow emissivity: "
            f"{reason}"
        ) from error


def write_emissivity_table(rows: Sequence[RegionEmissivity], path: str | os.PathLike[str]) -> None:
    """Write the table of regions as CSV, a line for each region and true temperature.

    Parameters
    ----------
    rows : sequence of RegionEmissivity
        The regions.
    path : path-like
        The file to write; one that is there is replaced at the end.
    """
    head = ["region", "feature", "truth_K", "environment_K", *_COLUMNS]
    head += [f"{cause}_uncertainty" for cause in _BUDGET]
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        for row in rows:
            heating = row.heating
            words = [row.name, row.feature, f"{heating.truth:.9g}", f"{heating.environment:.9g}"]
            numbers = [_value(row, name) for name in _COLUMNS]
            numbers += [row.budget[cause] for cause in _BUDGET]
            writer.writerow([*words, *(f"{number:.9g}" for number in numbers)])


_COLUMNS: Final = (
    "pixels",
    "below_floor",
    "saturated",
    "dead",
    "under_0",
    "over_1",
    "mean",
    "deviation",
    "standard_uncertainty",
    "degrees_of_freedom",
    "coverage_factor",
    "expanded_uncertainty",
)


def _value(row: RegionEmissivity, name: str) -> float:
    special = {
        "below_floor": row.flagged[Flag.BELOW_FLOOR],
        "saturated": row.flagged[Flag.SATURATED],
        "dead": row.flagged[Flag.DEAD],
        "under_0": row.outside[0],
        "over_1": row.outside[1],
    }
    return float(special[name] if name in special else getattr(row, name))


def _column(rows: Sequence[Sequence[RegionEmissivity]], name: str) -> list[list[float]]:
    return [[_value(row, name) for row in of] for of in rows]
