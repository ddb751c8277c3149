"""Determined emissivities in files: maps and regions as NetCDF-4, the table of regions as CSV."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from chipglow.analysis.emissivity import (
    COMMON,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    emissivity_covariance,
)
from chipglow.analysis.observations import Scatter
from chipglow.analysis.temperature import TrueTemperature
from chipglow.camera import Flag
from chipglow.io.measurement_file import Made, read_dataset, write_dataset
from chipglow.io.table_file import write_table
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.surface import MapSurface

_KIND: Final = "emissivity map"
_HEATING: Final = ("environment", "truth_uncertainty", "environment_uncertainty")
_BUDGET: Final = (*COMMON, "drift", "repeatability", "noise")


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
            **{
                name: ("truth", [getattr(one.heating, name) for one in maps], {"units": "K"})
                for name in _HEATING
            },
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


@dataclass(frozen=True)
class StoredEmissivity:
    """An area's emissivity as a file keeps it; fields as `RegionEmissivity` has them."""

    mean: float
    heating: Heating
    common: dict[str, float]
    scatter: Scatter
    drift: float


def read_region_emissivity(path: str | os.PathLike[str]) -> dict[str, StoredEmissivity]:
    """Read the emissivity of areas.

    Parameters
    ----------
    path : path-like
        A file of `write_emissivity`, of one true temperature.

    Returns
    -------
    dict
        By the areas' names.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is cut short, no emissivity map, or of several true temperatures; the message
        names the file.
    """
    found = _read(Path(path), _regions)
    if isinstance(found, int):
        raise ValueError(
            f"{path}: has emissivities at {found} true temperatures, expected those at one "
            "(chipglow emissivity with the images of that temperature alone)"
        )
    return found


def _regions(data: xr.Dataset) -> dict[str, StoredEmissivity] | int:
    """Emissivities at one true temperature, or how many there are."""
    if data.sizes["truth"] != 1:
        return int(data.sizes["truth"])
    one = data.isel(truth=0)
    environment, *spreads = (float(one[name]) for name in _HEATING)
    heating = Heating(float(one["truth"]), environment, *spreads)
    return {
        str(name): _stored(one.isel(region=index), heating)
        for index, name in enumerate(one["region"].values)
    }


def _stored(row: xr.Dataset, heating: Heating) -> StoredEmissivity:
    parts = {cause: float(row[f"region_{cause}_uncertainty"]) for cause in _BUDGET}
    mean = float(row["region_mean"])
    # A hotter object or room than thought makes the emissivity smaller: Equation 2.
    signs = {"truth": -1.0, "environment": -1.0 if mean < 1 else 1.0, "calibration": 1.0}
    scatter = Scatter(parts["repeatability"], parts["noise"], np.inf)
    share = scatter.standard_uncertainty / max(float(row["region_standard_uncertainty"]), 1e-300)
    freedom = float(row["region_degrees_of_freedom"])
    if share > 0 and np.isfinite(freedom):
        scatter = replace(scatter, degrees_of_freedom=freedom * share**4)
    return StoredEmissivity(
        mean,
        heating,
        {cause: signs[cause] * parts[cause] for cause in COMMON},
        scatter,
        parts["drift"],
    )


def read_emissivity_map(path: str | os.PathLike[str], truth: float | None = None) -> MapSurface:
    """Read an emissivity map as a surface.

    Parameters
    ----------
    path : path-like
        A file of `write_emissivity`.
    truth : float, optional
        True temperature in K of the map to take, the nearest; the file's first by default.

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

    def surface(data: xr.Dataset) -> MapSurface:
        index = 0 if truth is None else int(np.abs(data["truth"].values - truth).argmin())
        values = np.clip(data["emissivity"].values[index].astype(np.float64), 0.0, 1.0)
        x, y, pitch = data["x"].values, data["y"].values, float(data.attrs["pitch"])
        raster = Raster(float(x[0]) - pitch / 2, float(y[0]) + pitch / 2, pitch, len(y), len(x))
        return MapSurface(values, raster)

    return _read(Path(path), surface)


def _read(path: Path, made_of: Callable[[xr.Dataset], Made]) -> Made:
    def checked(data: xr.Dataset) -> Made:
        if data.attrs.get("kind") != _KIND:
            raise ValueError("it does not say that it is an emissivity map")
        return made_of(data)

    return read_dataset(path, checked, "an emissivity map", "a file of chipglow emissivity")


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
    write_table(Path(path), head, map(_line, rows))


def _line(row: RegionEmissivity) -> list[str]:
    numbers = [row.heating.truth, row.heating.environment]
    numbers += [_value(row, name) for name in _COLUMNS]
    numbers += [row.budget[cause] for cause in _BUDGET]
    return [row.name, row.feature, *(f"{number:.9g}" for number in numbers)]


def write_temperature_table(rows: Sequence[TrueTemperature], path: str | os.PathLike[str]) -> None:
    """Write true temperatures of regions as CSV, a line each, in K.

    Parameters
    ----------
    rows : sequence of TrueTemperature
        The regions.
    path : path-like
        The file to write; one that is there is replaced at the end.
    """
    numbers = (
        "emissivity", "radiance_temperature", "value", "deviation", "standard_uncertainty",
        "degrees_of_freedom", "coverage_factor", "expanded_uncertainty",
    )  # fmt: skip
    head = ["region", "pixels", "left_out", *numbers]
    head[head.index("value")] = "true_temperature"
    head += [f"{cause}_uncertainty" for cause in (*_BUDGET[:3], "emissivity", *_BUDGET[3:])]

    def line(row: TrueTemperature) -> list[Any]:
        values = [getattr(row, name) for name in numbers]
        values += [row.budget[name.removesuffix("_uncertainty")] for name in head[-7:]]
        return [row.name, row.pixels, row.left_out, *(f"{value:.9g}" for value in values)]

    write_table(Path(path), head, map(line, rows))


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
