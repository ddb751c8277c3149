"""The study's arrays as data: results.nc."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis import StudyResult
from chipglow.scene import FIELD_UNITS
from chipglow.scene.tool_attributes import tool_attributes


def results_dataset(result: StudyResult, provenance: Mapping[str, str]) -> xr.Dataset:
    """Arrays behind the figures, in SI units, each with a ``units`` attribute.

    Parameters
    ----------
    result : StudyResult
        The study.
    provenance : mapping
        Goes into the attributes.

    Returns
    -------
    xarray.Dataset
        Dimensions: ``y``, ``x`` the scene's samples; ``pixel_y``, ``pixel_x`` the pixels;
        ``instant`` the exposures; ``surface`` the surfaces; ``ridge_point`` along the shear band,
        NaN beyond its end; ``rake_distance`` and ``band_distance`` along the analysis lines;
        ``contact_distance`` up the rake face; ``segment``, ``texture`` and ``pixel_phase`` the
        draws; ``psf_order``, ``psf_width`` and ``sensitivity_draw`` the sensitivity;
        ``force_time`` the force history; ``chip_time`` the chip as it passes one rake-normal line.
    """
    variables = {
        **_scene(result),
        **_pixels(result),
        **_ridges(result),
        **_lines(result),
        **_draws(result),
        **_sensitivity(result),
        **_forces(result),
        **_chip(result),
    }
    coordinates = {
        "surface": list(result.surfaces),
        "instant": ("instant", [i.start for i in result.instants], {"units": "s"}),
        "y": ("y", result.raster.y, {"units": "m"}),
        "x": ("x", result.raster.x, {"units": "m"}),
        "psf_order": [series.psf_order for series in result.sensitivity],
        "psf_width": ("psf_width", np.asarray(result.plan.psf_widths), {"units": "m"}),
    }
    attributes: dict[str, Any] = {
        "developed_instant": result.developed,
        "rake_surface": result.plan.rake_surface,
        "band_surface": result.plan.band_surface,
        "error_reference": result.plan.reference,
        **tool_attributes(result.tool),
        **{f"provenance_{name.replace(' ', '_')}": text for name, text in provenance.items()},
    }
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def _scene(result: StudyResult) -> dict[str, Any]:
    place, surfaces = ("y", "x"), result.surfaces.values()
    names = ("temperature", "plastic_strain", "plastic_strain_rate", "material")
    fields = {
        name: (place, getattr(result.frame, name), {"units": FIELD_UNITS[name]}) for name in names
    }
    emissivity = np.stack([surface.emissivity for surface in surfaces])
    temperature = np.stack([surface.scene_temperature for surface in surfaces])
    return {
        **fields,
        "emissivity": (("surface", *place), emissivity, {"units": "1"}),
        "scene_radiance_temperature": (
            ("surface", *place),
            temperature.astype(np.float32),
            {"units": "K"},
        ),
    }


def _pixels(result: StudyResult) -> dict[str, Any]:
    place, surfaces = ("pixel_y", "pixel_x"), result.surfaces.values()
    raster = next(iter(surfaces)).errors.raster
    measured = np.stack([s.measurement.radiance_temperature() for s in surfaces])
    references = np.stack([s.references for s in surfaces])
    flags = np.stack([s.measurement.flags for s in surfaces])
    errors = {
        "error_case_1": [s.errors.case_1 for s in surfaces],
        "error_case_2": [s.errors.case_2 for s in surfaces],
        "error_psf_portion": [s.errors.psf_portion for s in surfaces],
    }
    return {
        "pixel_y": ("pixel_y", raster.y, {"units": "m"}),
        "pixel_x": ("pixel_x", raster.x, {"units": "m"}),
        "radiance_temperature": (("surface", "instant", *place), measured, {"units": "K"}),
        "reference_temperature": (("surface", "instant", *place), references, {"units": "K"}),
        "flags": (("surface", "instant", *place), flags, {"units": "1"}),
        **{
            name: (("surface", *place), np.stack(images), {"units": "K"})
            for name, images in errors.items()
        },
    }


def _ridges(result: StudyResult) -> dict[str, Any]:
    bands = [instant.band for instant in result.instants]
    length = max(band.ridge.distance.size for band in bands if band is not None)
    place = ("instant", "ridge_point")
    of_band: dict[str, tuple[Sequence[NDArray[np.float64] | None], str]] = {
        "ridge_distance": ([b.ridge.distance if b else None for b in bands], "m"),
        "ridge_x": ([b.ridge.points[:, 0] if b else None for b in bands], "m"),
        "ridge_y": ([b.ridge.points[:, 1] if b else None for b in bands], "m"),
        "ridge_strain_rate": ([b.rate if b else None for b in bands], "1/s"),
        "ridge_width": ([b.widths if b else None for b in bands], "m"),
        "ridge_temperature": ([i.temperatures for i in result.instants], "K"),
    }
    curves = [_padded(surface.curves, length) for surface in result.surfaces.values()]
    return {
        **{
            name: (place, _padded(values, length), {"units": unit})
            for name, (values, unit) in of_band.items()
        },
        "ridge_radiance_temperature": (("surface", *place), np.stack(curves), {"units": "K"}),
    }


def _padded(rows: Sequence[NDArray[np.float64] | None], length: int) -> NDArray[np.float64]:
    padded = np.full((len(rows), length), np.nan)
    for i, row in enumerate(rows):
        if row is not None:
            padded[i, : row.size] = row
    return padded


def _lines(result: StudyResult) -> dict[str, Any]:
    rakes = [surface.rake for surface in result.surfaces.values()]
    bands = [surface.band for surface in result.surfaces.values()]
    lines = {
        "rake_distance": rakes[0].line.distance,
        "contact_distance": rakes[0].contact.distance,
        "band_distance": bands[0].line.distance,
    }
    errors = {
        "rake_error": ("rake_distance", [r.case_1 for r in rakes]),
        "rake_psf_portion": ("rake_distance", [r.psf_portion for r in rakes]),
        "contact_error": ("contact_distance", [r.contact_case_1 for r in rakes]),
        "contact_psf_portion": ("contact_distance", [r.contact_psf_portion for r in rakes]),
        "band_error": ("band_distance", [b.case_1 for b in bands]),
        "band_psf_portion": ("band_distance", [b.psf_portion for b in bands]),
    }
    return {
        **{name: (name, values, {"units": "m"}) for name, values in lines.items()},
        **{
            name: (("surface", along), np.stack(values), {"units": "K"})
            for name, (along, values) in errors.items()
        },
    }


def _draws(result: StudyResult) -> dict[str, Any]:
    draws, axes = result.draws, ("segment", "texture", "pixel_phase")
    headlines = {
        f"draws_{name}_{part}": (axes, getattr(headline, part).values, {"units": "K"})
        for name, headline in draws.headlines.items()
        for part in ("error", "psf_portion")
    }
    lines = {
        f"draws_{place}_line_{part}": (
            (*axes, f"{place}_distance"),
            getattr(line, part),
            {"units": "K"},
        )
        for place, line in (("rake", draws.rake_line), ("band", draws.band_line))
        for part in ("case_1", "psf_portion")
    }
    starts = [segment.start for segment in result.segments]
    return {**headlines, **lines, "segment": ("segment", starts, {"units": "s"})}


def _sensitivity(result: StudyResult) -> dict[str, Any]:
    place = ("psf_order", "psf_width", "sensitivity_draw")
    return {
        f"sensitivity_{name}_{part}": (
            place,
            np.stack([getattr(series, f"{part}s")[name] for series in result.sensitivity]),
            {"units": "K"},
        )
        for name in result.sensitivity[0].errors
        for part in ("error", "psf_portion")
    }


def _chip(result: StudyResult) -> dict[str, Any]:
    scan = result.chip.scan
    return {
        "chip_time": ("chip_time", scan.time, {"units": "s"}),
        "chip_thickness": ("chip_time", scan.thickness, {"units": "m", "height": scan.height}),
    }


def _forces(result: StudyResult) -> dict[str, Any]:
    if result.forces is None:
        return {}
    history = result.forces
    return {
        "force_time": ("force_time", history.time, {"units": "s"}),
        "cutting_force": ("force_time", history.cutting, {"units": "N/m"}),
        "thrust_force": ("force_time", history.thrust, {"units": "N/m"}),
    }
