"""Determined emissivities in files: maps and regions as NetCDF-4, the table of regions as CSV."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

import numpy as np
import xarray as xr

from chipglow.camera import Flag
from chipglow.io import write_dataset
from chipglow.io.measurement_file import Made, read_dataset
from chipglow.io.table_file import write_table
from chipglow.laboratory.emissivity.emissivity import (
    BUDGET,
    COMMON,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    emissivity_covariance,
)
from chipglow.laboratory.emissivity.observations import RANDOM
from chipglow.laboratory.emissivity.temperature import TEMPERATURE_BUDGET, TrueTemperature
from chipglow.quantities import FileBeside, Parameter
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.surface import SURFACES, MapSurface, SurfaceChoice
from chipglow.uncertainty import Cause, Component, Estimate

_KIND: Final = "emissivity map"
_HEATING: Final = ("reflected", "reference_uncertainty", "reflected_uncertainty")


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
        "standard_uncertainty": np.stack([one.estimate.standard_uncertainty for one in maps]),
        "flags": np.stack([one.flags for one in maps]),
    }
    tables = {f"region_{name}": _column(rows, name) for name in _COLUMNS}
    for cause in BUDGET:
        effect = _effect if cause in COMMON else Estimate.contribution
        tables[f"region_{cause}_uncertainty"] = [
            [float(effect(row.estimate, cause)) for row in of] for of in rows
        ]
    tables["region_random_degrees_of_freedom"] = [
        [float(row.estimate.only(RANDOM).degrees_of_freedom) for row in of] for of in rows
    ]
    names = np.array([row.name for row in rows[0]], dtype=object)
    data = xr.Dataset(
        {
            **{name: (("reference", "y", "x"), image) for name, image in images.items()},
            **{name: (("reference", "region"), np.array(table)) for name, table in tables.items()},
            "region_covariance": (
                ("reference", "region", "other_region"),
                np.stack([emissivity_covariance(of) for of in rows]),
            ),
            **{
                name: ("reference", [getattr(one.heating, name) for one in maps], {"units": "K"})
                for name in _HEATING
            },
            "region_warnings": (
                ("reference", "region"),
                np.array([["\n".join(row.estimate.warnings) for row in of] for of in rows], object),
            ),
            "observations": ("reference", np.array([one.identity for one in maps], dtype=object)),
            "feature": ("region", np.array([row.feature for row in rows[0]], dtype=object)),
        },
        coords={
            **raster_coordinates(raster, np.zeros(1)),
            "reference": ("reference", [one.heating.reference for one in maps], {"units": "K"}),
            "other_region": ("other_region", names),
            "region": ("region", names),
        },
        attrs={"kind": _KIND, "pitch": raster.spacing},
    ).drop_vars("time")
    _say_correlations(data)
    for variable in data.data_vars.values():
        variable.attrs.setdefault("units", "1")
    write_dataset(data, path)


_FORMS: Final = {
    **dict.fromkeys(COMMON, ("systematic", "systematic")),
    "drift": ("random", "systematic"),
    "repeatability": ("random", "random"),
    "noise": ("random", "random"),
}
"""How errors of the regions correlate along truth and region, as obsarray names it."""


def _say_correlations(data: xr.Dataset) -> None:
    """Give the regions' means the attributes of obsarray."""
    known = []
    for cause, forms in _FORMS.items():
        part = data[f"region_{cause}_uncertainty"]
        part.attrs["pdf_shape"] = "gaussian"
        for number, (dim, form) in enumerate(zip(("reference", "region"), forms, strict=True), 1):
            start = f"err_corr_{number}"
            part.attrs |= {f"{start}_dim": dim, f"{start}_form": form}
            part.attrs |= {f"{start}_params": [], f"{start}_units": []}
        if np.isfinite(part.values).all():
            known.append(part.name)
    data["region_mean"].attrs["unc_comps"] = known


def _effect(estimate: Estimate, cause: str) -> Any:
    return estimate.effect(cause)


@dataclass(frozen=True)
class StoredEmissivity:
    """An area's emissivity as a file keeps it; fields as `RegionEmissivity` has them."""

    heating: Heating
    estimate: Estimate


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
    if data.sizes["reference"] != 1:
        return int(data.sizes["reference"])
    if "observations" not in data:
        raise ValueError("it is of an earlier version, expected one that is written anew")
    one = data.isel(reference=0)
    reflected, *spreads = (float(one[name]) for name in _HEATING)
    heating = Heating(float(one["reference"]), reflected, *spreads)
    return {
        str(name): _stored(one.isel(region=index), heating)
        for index, name in enumerate(one["region"].values)
    }


def _stored(row: xr.Dataset, heating: Heating) -> StoredEmissivity:
    parts = {cause: float(row[f"region_{cause}_uncertainty"]) for cause in BUDGET}
    observations = str(row["observations"].values)
    estimate = Estimate(np.array(float(row["region_mean"])))
    for cause in COMMON:
        estimate = estimate.with_component(cause, parts[cause])
    if np.isfinite(parts["drift"]):
        estimate = estimate.with_component(
            "drift", parts["drift"], independent="common", identity=observations
        )
    names = [cause for cause in ("repeatability", "noise") if np.isfinite(parts[cause])]
    freedom = float(row["region_random_degrees_of_freedom"])
    identity = f"{observations} {row['region'].values}"
    random = Cause(RANDOM, identity, len(names), freedom, parts=tuple(names))
    effects = np.array([[parts[name] for name in names]])
    return StoredEmissivity(
        heating,
        replace(
            estimate,
            components=(*estimate.components, Component(random, effects)),
            unevaluated=tuple(cause for cause in BUDGET if np.isnan(parts[cause])),
            warnings=tuple(str(row["region_warnings"].values).splitlines()),
        ),
    )


def read_emissivity_map(path: str | os.PathLike[str], reference: float | None = None) -> MapSurface:
    """Read an emissivity map as a surface.

    Parameters
    ----------
    path : path-like
        A file of `write_emissivity`.
    reference : float, optional
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
        index = (
            0 if reference is None else int(np.abs(data["reference"].values - reference).argmin())
        )
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
    head += [f"{cause}_uncertainty" for cause in BUDGET]
    write_table(Path(path), head, map(_line, rows))


def _line(row: RegionEmissivity) -> list[str]:
    numbers = [row.heating.reference, row.heating.reflected]
    numbers += [_value(row, name) for name in _COLUMNS]
    numbers += [float(row.estimate.contribution(cause)) for cause in BUDGET]
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
        "emissivity", "radiance_temperature", "true_temperature", "deviation",
        "standard_uncertainty", "degrees_of_freedom", "coverage_factor", "expanded_uncertainty",
    )  # fmt: skip
    head = ["region", "pixels", "left_out", *numbers]
    head += [f"{cause}_uncertainty" for cause in TEMPERATURE_BUDGET]

    def line(row: TrueTemperature) -> list[Any]:
        found = row.estimate
        values = [row.emissivity, row.radiance_temperature, found.values, row.deviation]
        values += _stated(found).values()
        values += [found.contribution(cause) for cause in TEMPERATURE_BUDGET]
        texts = (f"{np.asarray(value).item():.9g}" for value in values)
        return [row.name, row.pixels, row.left_out, *texts]

    write_table(Path(path), head, map(line, rows))


_COLUMNS: Final = (
    "pixels",
    "under_range",
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
        "under_range": row.flagged[Flag.UNDER_RANGE],
        "saturated": row.flagged[Flag.SATURATED],
        "dead": row.flagged[Flag.DEAD],
        "under_0": row.outside[0],
        "over_1": row.outside[1],
    }
    stated = _stated(row.estimate)
    if name in stated:
        return stated[name]
    return float(special[name] if name in special else getattr(row, name))


def _stated(estimate: Estimate) -> dict[str, float]:
    """What a table says of the uncertainty."""
    return {
        "standard_uncertainty": float(estimate.standard_uncertainty),
        "degrees_of_freedom": float(estimate.degrees_of_freedom),
        "coverage_factor": float(estimate.coverage_factor()),
        "expanded_uncertainty": float(estimate.expanded_uncertainty()),
    }


def _column(rows: Sequence[Sequence[RegionEmissivity]], name: str) -> list[list[float]]:
    return [[_value(row, name) for row in of] for of in rows]


@SURFACES.part
@dataclass(frozen=True)
class EmissivityMapFile(SurfaceChoice):
    """An image that stays where it is."""

    kind: ClassVar[str] = "map"
    example: ClassVar[str] = "{kind: map, file: emissivity.nc}  what chipglow emissivity writes"
    file: Annotated[FileBeside, Parameter("What chipglow emissivity writes.")]

    def surface(self) -> MapSurface:
        """The surface."""
        return read_emissivity_map(self.file)
