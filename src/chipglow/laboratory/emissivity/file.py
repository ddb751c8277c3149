"""Determined emissivities in files: maps and regions as NetCDF-4, the table of regions as CSV."""

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

import numpy as np
import xarray as xr

from chipglow.io import write_dataset
from chipglow.io.measurement_file import Made, read_dataset
from chipglow.laboratory.emissivity.emissivity import (
    BUDGET,
    COMMON,
    Heating,
    emissivity_covariance,
)
from chipglow.laboratory.emissivity.observations import RANDOM
from chipglow.laboratory.emissivity.region_emissivities import RegionEmissivities
from chipglow.quantities import FileBeside, Parameter
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.surface import SURFACES, MapSurface, SurfaceChoice
from chipglow.uncertainty import Cause, Component, Estimate

_KIND: Final = "emissivity map"
_HEATING: Final = ("reflected", "reference_uncertainty", "reflected_uncertainty")


def write_emissivity(found: RegionEmissivities, path: str | os.PathLike[str]) -> None:
    """Write emissivity maps and their regions to a NetCDF-4 file.

    Parameters
    ----------
    found : RegionEmissivities
        Of one object, at one true temperature or several.
    path : path-like
        The file to write; one that is there is replaced at the end.
    """
    maps, rows = found.maps, found.rows
    raster = maps[0].raster
    images: dict[str, Any] = {
        "emissivity": np.stack([one.emissivity for one in maps]),
        "standard_uncertainty": np.stack([one.estimate.standard_uncertainty for one in maps]),
        "flags": np.stack([one.flags for one in maps]),
    }
    table = found.to_frame().loc[:, "pixels":"expanded_uncertainty"].astype(float)
    tables: dict[str, Any] = {
        f"region_{name}": table[name].to_numpy().reshape(len(maps), -1) for name in table
    }
    for cause in BUDGET:
        effect = Estimate.effect if cause in COMMON else Estimate.contribution
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
"""How errors of the regions correlate along reference and region, as obsarray names it."""


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
