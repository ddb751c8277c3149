"""Determined emissivities in NetCDF-4 files, and as surfaces and sections of a study."""

import os
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

import numpy as np
import xarray as xr
import yaml

from chipglow.camera import Measurement
from chipglow.io import write_dataset
from chipglow.io.measurement_file import Made, read_dataset
from chipglow.laboratory.emissivity.emissivity import (
    BUDGET,
    COMMON,
    EmissivityLine,
    Heating,
    emissivity_covariance,
    emissivity_line,
)
from chipglow.laboratory.emissivity.observations import ALL_IMAGES, RANDOM, UNIFORMITY, with_drift
from chipglow.laboratory.emissivity.region_emissivities import RegionEmissivities
from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.units import WAVELENGTHS
from chipglow.scene import Raster
from chipglow.scene.scene import raster_coordinates
from chipglow.surface import SURFACES, EmissivityTrend, MapSurface, Origin, Surface, TrendSurface
from chipglow.text import Notes
from chipglow.uncertainty import Cause, Component, Estimate
from chipglow.uncertainty.dataset import correlation_forms

_KIND: Final = "emissivity map"
_FIELDS: Final[Mapping[str, str]] = {
    "chip": "body",
    "chip body": "body",
    "body": "body",
    "shear band": "shear_band",
    "shear_band": "shear_band",
    "workpiece": "workpiece",
    "tool": "tool",
}
_CHIP: Final = "measured chip"

_DIGITS: Final = 4
"""Decimals of an emissivity in a study, beyond what any is known to."""

_GREATEST_DEVIATION: Final = 0.5
"""Largest standard deviation of an emissivity that a study accepts."""

_HEATING: Final = ("reflected", "reference_uncertainty", "reflected_uncertainty")


def write_emissivity(found: RegionEmissivities, path: str | os.PathLike[str]) -> None:
    """Write emissivity maps and their regions to a NetCDF-4 file."""
    maps, rows = found.maps, [row for of in found.rows for row in of]
    estimates = [row.estimate for row in rows]
    frame = found.to_frame().loc[:, "pixels":"expanded_uncertainty"].astype(float)
    columns: dict[str, Any] = {name: frame[name].to_numpy() for name in frame}
    for cause in BUDGET:
        effect = Estimate.effect if cause in COMMON else Estimate.contribution
        columns[f"{cause}_uncertainty"] = np.array([float(effect(e, cause)) for e in estimates])
    for name in (RANDOM, UNIFORMITY):
        columns[f"{name}_degrees_of_freedom"] = np.array(
            [float(one.only(name).degrees_of_freedom) for one in estimates]
        )
    columns["warnings"] = np.array(["\n".join(one.warnings) for one in estimates], object)
    image, table = ("reference", "y", "x"), ("reference", "region")
    shape, kelvins = (len(maps), -1), {"units": "K"}
    names = np.array([row.name for row in found.rows[0]], dtype=object)
    covariances = [emissivity_covariance(of) for of in found.rows]
    data = xr.Dataset(
        {
            "emissivity": (image, [one.emissivity for one in maps]),
            "standard_uncertainty": (image, [one.estimate.standard_uncertainty for one in maps]),
            "flags": (image, [one.flags for one in maps]),
            **{f"region_{name}": (table, of.reshape(shape)) for name, of in columns.items()},
            "region_covariance": ((*table, "other_region"), covariances),
            **{
                name: ("reference", [getattr(one.heating, name) for one in maps], kelvins)
                for name in _HEATING
            },
            "observations": ("reference", np.array([one.identity for one in maps], dtype=object)),
            "feature": ("region", np.array([row.feature for row in found.rows[0]], dtype=object)),
        },
        coords={
            **raster_coordinates(maps[0].raster, np.zeros(1)),
            "reference": ("reference", [one.heating.reference for one in maps], kelvins),
            "other_region": ("other_region", names),
            "region": ("region", names),
        },
        attrs={
            "kind": _KIND,
            "pitch": maps[0].raster.spacing,
            "band_lower": maps[0].band.lower,
            "band_upper": maps[0].band.upper,
            "metal": found.metal,
        },
    ).drop_vars("time")
    parts = {cause: data[f"region_{cause}_uncertainty"] for cause in _FORMS}
    for cause, part in parts.items():
        forms = correlation_forms(dict(zip(table, _FORMS[cause], strict=True)))
        part.attrs |= {"pdf_shape": "gaussian", **forms}
    data["region_mean"].attrs["unc_comps"] = [
        part.name for part in parts.values() if np.isfinite(part.values).all()
    ]
    for variable in data.data_vars.values():
        variable.attrs.setdefault("units", "1")
    write_dataset(data, path)


_FORMS: Final = {
    **dict.fromkeys(COMMON, ("systematic", "systematic")),
    "drift": ("random", "systematic"),
    UNIFORMITY: ("random", "random"),
    "repeatability": ("random", "random"),
    "noise": ("random", "random"),
}
"""Correlation of the regions' errors along reference and region, as obsarray names it."""


def read_emissivity_lines(path: str | os.PathLike[str]) -> dict[str, EmissivityLine]:
    """Read the emissivity of areas as lines over the temperature, by their names."""
    return _read(Path(path), _lines)


def _lines(data: xr.Dataset) -> dict[str, EmissivityLine]:
    if not {"observations", f"region_{UNIFORMITY}_uncertainty"} <= set(data):
        raise ValueError("it was written by an earlier version; write it again")
    maps = [data.isel(reference=index) for index in range(data.sizes["reference"])]
    lines = [
        emissivity_line([_constant(one.isel(region=index)) for one in maps])
        for index in range(data.sizes["region"])
    ]
    return {line.name: line for line in lines}


def _constant(row: xr.Dataset) -> EmissivityLine:
    """Return the emissivity of an area at one true temperature."""
    reflected, *spreads = (float(row[name]) for name in _HEATING)
    parts = {cause: float(row[f"region_{cause}_uncertainty"]) for cause in BUDGET}
    name, observations = str(row["region"].values), str(row["observations"].values)
    estimate = Estimate(np.array(float(row["region_mean"])))
    for cause in COMMON:
        estimate = estimate.with_component(cause, parts[cause], identity=ALL_IMAGES)
    if np.isfinite(parts["drift"]):
        estimate = with_drift(estimate, parts["drift"], observations)
    estimate = estimate.with_component(
        UNIFORMITY,
        parts[UNIFORMITY],
        identity=f"{observations} {name} {UNIFORMITY}",
        degrees_of_freedom=float(row[f"region_{UNIFORMITY}_degrees_of_freedom"]),
    )
    names = [cause for cause in ("repeatability", "noise") if np.isfinite(parts[cause])]
    freedom = float(row["region_random_degrees_of_freedom"])
    random = Cause(RANDOM, f"{observations} {name}", len(names), freedom, parts=tuple(names))
    effects = np.array([[parts[name] for name in names]])
    estimate = replace(
        estimate,
        components=(*estimate.components, Component(random, effects)),
        unevaluated=tuple(cause for cause in BUDGET if np.isnan(parts[cause])),
        warnings=tuple(str(row["region_warnings"].values).splitlines()),
    )
    heating = Heating(float(row["reference"]), reflected, *spreads)
    spread = float(row["region_standard_deviation"])
    return EmissivityLine.measured(name, str(row["feature"].values), heating, estimate, spread)


def read_emissivity_map(path: str | os.PathLike[str]) -> MapSurface:
    """Read the emissivity map of a file of `write_emissivity` as a surface.

    Every pixel of several maps has a straight line over the temperature. Emissivities are limited
    to 0 to 1; their uncertainty is the mean of the maps'.
    """

    def surface(data: xr.Dataset) -> MapSurface:
        kelvins, values = data["reference"].values, data["emissivity"].values.astype(np.float64)
        spread = data["standard_uncertainty"].values.astype(np.float64).mean(axis=0)
        x, y, pitch = data["x"].values, data["y"].values, float(data.attrs["pitch"])
        raster = Raster(float(x[0]) - pitch / 2, float(y[0]) + pitch / 2, pitch, len(y), len(x))
        middle = float(kelvins.mean())
        away = kelvins - middle
        scatter = float((away**2).sum())
        slopes = np.tensordot(away, values, axes=1) / scatter if scatter else None
        mean = np.clip(values.mean(axis=0), 0.0, 1.0)
        return MapSurface(mean, raster, 0.0, slopes, middle, spread, origin=_origin(data))

    return _read(Path(path), surface)


@dataclass(frozen=True, eq=False)
class StoredEmissivities:
    """Emissivities of a file by the names of their areas, and what they were measured on."""

    lines: Mapping[str, EmissivityLine]
    origin: Origin

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> "StoredEmissivities":
        """Read a file of `write_emissivity`."""
        return _read(Path(path), lambda data: cls(_lines(data), _origin(data)))


def doubts(origin: Origin | None, measurements: Iterable[Measurement]) -> Notes:
    """Warn if emissivities are of another band or metal than the measurements."""
    if origin is None:
        return Notes()
    doubts = [
        text
        for one in measurements
        for text in origin.warnings(one.band, str(one.data.attrs.get("metal", "")))
    ]
    return Notes(warnings=list(dict.fromkeys(doubts)))


def read_origin(path: str | os.PathLike[str]) -> Origin:
    """Read the band and the metal of the measurement of a file of `write_emissivity`."""
    return _read(Path(path), _origin)


def _origin(data: xr.Dataset) -> Origin:
    attrs, band = data.attrs, None
    if {"band_lower", "band_upper"} <= set(attrs):
        band = float(attrs["band_lower"]), float(attrs["band_upper"])
    return Origin(band, str(attrs.get("metal", "")))


def emissivity_trend(line: EmissivityLine) -> EmissivityTrend:
    """Return a line as surfaces take it: the errors that its areas share, and its own."""
    shared = (*COMMON, "drift")
    effects = {one.cause.name: one.effects.T.tolist() for one in line.estimate.components}
    emissivity, slope = line.estimate.values.tolist()
    return EmissivityTrend(
        middle=line.middle,
        emissivity=emissivity,
        slope=slope,
        common=tuple(tuple(effects.get(name, [[0.0, 0.0]])[0]) for name in shared),
        own=tuple(tuple(own) for name in effects if name not in shared for own in effects[name]),
        measured=(min(line.temperatures), max(line.temperatures)),
    )


def _read(path: Path, made_of: Callable[[xr.Dataset], Made]) -> Made:
    def checked(data: xr.Dataset) -> Made:
        if data.attrs.get("kind") != _KIND:
            raise ValueError("it is not marked as an emissivity map")
        return made_of(data)

    return read_dataset(path, checked, "an emissivity map", "a file of chipglow emissivity")


class SurfaceFile(Part, ABC):
    """A file with the only surface of a study."""

    @abstractmethod
    def surface(self) -> Surface:
        """Read the surface; a ValueError or OSError if that is not possible."""


@SURFACES.part
@dataclass(frozen=True)
class EmissivityMapFile(SurfaceFile):
    """An image that stays where it is."""

    kind: ClassVar[str] = "map"
    example: ClassVar[str] = "{kind: map, file: emissivity.nc}  what chipglow emissivity writes"
    file: Annotated[FileBeside, Parameter("Output file of chipglow emissivity.")]

    def surface(self) -> MapSurface:
        return read_emissivity_map(self.file)


@SURFACES.part
@dataclass(frozen=True)
class MeasuredEmissivity(SurfaceFile):
    """A measured region's emissivity, everywhere: its line over the temperature."""

    kind: ClassVar[str] = "measured"
    example: ClassVar[str] = "{kind: measured, file: emissivity.nc, region: chip body}"
    file: Annotated[FileBeside, Parameter("Output file of chipglow emissivity.")]
    region: Annotated[str, Parameter("Name of a region in it.")]

    def surface(self) -> TrendSurface:
        areas = read_emissivity_lines(self.file)
        if self.region not in areas:
            raise ValueError(
                f"region: {self.region!r} is not in {self.file}, expected one of {', '.join(areas)}"
            )
        return TrendSurface(emissivity_trend(areas[self.region]), origin=read_origin(self.file))


def surface_text(result: RegionEmissivities) -> str:
    """Return sections of a study with the emissivities of its features, as YAML."""
    found = {
        _FIELDS[row.feature.lower()]: {
            "mean": round(row.mean, _DIGITS),
            "standard_deviation": round(row.standard_deviation, _DIGITS),
        }
        for row in result.rows[0]
        if row.whole and row.feature.lower() in _FIELDS
        if 0 <= row.mean <= 1 and row.standard_deviation <= _GREATEST_DEVIATION
    }
    surface: dict[str, Any] = {}
    sections: dict[str, Any] = {"surface": surface}
    if {"body", "shear_band"} <= set(found):
        surface["chips"] = {_CHIP: {name: found[name] for name in ("body", "shear_band")}}
        sections["analysis"] = {"rake_chip": _CHIP, "band_chip": _CHIP}
    surface |= {name: found[name] for name in ("workpiece", "tool") if name in found}
    if not surface:
        return ""
    if result.origin.band is not None:
        surface["measured_in"] = WAVELENGTHS.range_text(result.origin.band)
    if result.metal:
        surface["measured_on"] = result.metal
    return yaml.safe_dump(sections, sort_keys=False, allow_unicode=True)


def measured_text(file: str | os.PathLike[str]) -> str:
    """Return sections of a study with the chip of a file of `write_emissivity`, as YAML."""
    sections = {
        "surface": {"measured": {_CHIP: os.fspath(file)}},
        "analysis": {"rake_chip": _CHIP, "band_chip": _CHIP},
    }
    return yaml.safe_dump(sections, sort_keys=False, allow_unicode=True)


def measured_features(areas: Mapping[str, EmissivityLine]) -> dict[str, EmissivityLine]:
    """Return areas by the features of a study; of several the one with the feature's name."""
    number = Counter(area.feature for area in areas.values())
    found = {
        _FIELDS[area.feature.lower()]: area
        for area in areas.values()
        if area.feature.lower() in _FIELDS
        and (number[area.feature] == 1 or area.name == area.feature)
    }
    if not {"body", "shear_band"} <= set(found):
        raise ValueError(
            f"is of the features {', '.join(number)}, expected chip body and shear band among them"
        )
    return found
