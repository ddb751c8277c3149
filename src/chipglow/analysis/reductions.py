"""Errors, portions, means and scatter: reductions of an analysis' Dataset over its axes."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np
import pandas as pd
import xarray as xr

from chipglow.analysis.distribution import PIXEL_PHASE, Distribution
from chipglow.analysis.images import ALL, WITHOUT_PSF
from chipglow.quantities import ZERO_CELSIUS, Array, Brief

_DRAWS = ("exposure", "texture", "pixel_phase")

Value = TypeVar("Value")
"""Errors over all draws, or of a single frame."""


@dataclass(frozen=True, eq=False, repr=False)
class ReadingErrors(Brief, Generic[Value]):
    """Errors of one reading in K of radiance temperature."""

    error: Value
    psf_portion: Value
    true_error: Value
    """Radiance temperature minus the largest true temperature in the pixel."""
    corrected_error: Value
    """The same, with the emissivity set in the camera."""


@dataclass(frozen=True, eq=False, repr=False)
class Headline(ReadingErrors[Distribution]):
    """One reading over all draws, in K of radiance temperature."""

    place: str
    quantity: str
    surface: str
    reference: Distribution

    @property
    def psf_fraction(self) -> Distribution | None:
        """The PSF's portion over the error, draw by draw; None if the error changes its sign."""
        low, high = self.error.range
        if low <= 0 <= high:
            return None
        part = self.error.having(self.psf_portion.values / self.error.values)
        return replace(part, limits=(0.0, 1.0))


def error(data: xr.Dataset, kind: str = "", effects: str = ALL) -> xr.DataArray:
    """Return the error of readings (or of `kind` line_ or varied_), by default with all effects."""
    return data[f"{kind}measured"].sel(effects=effects, drop=True) - data[f"{kind}reference"]


def psf_portion(data: xr.Dataset, kind: str = "") -> xr.DataArray:
    """Return what the point spread function adds to the error; see `error`."""
    measured = data[f"{kind}measured"]
    with_psf, without = (measured.sel(effects=name, drop=True) for name in (ALL, WITHOUT_PSF))
    return with_psf - without


def headline(data: xr.Dataset, reading: str) -> Headline | None:
    """Return one reading over all draws; None unless it is finite in each of them."""
    if reading not in data.reading.values:
        return None
    one = data[["reference", "measured", "true", "corrected"]].sel(reading=reading)
    one = one.isel(texture=slice(int(one.textures)))
    values = [array.transpose(*_DRAWS).values for array in (*_errors(one), one.reference)]
    if not np.isfinite(values).all():
        return None
    causes = (str(data.exposure.attrs["title"]), "texture", PIXEL_PHASE)
    place, quantity, surface, undrawn = (
        str(one[name].item()) for name in ("place", "quantity", "seen_surface", "undrawn")
    )
    missing = tuple(filter(None, undrawn.split(", ")))
    wrong, portion, truly, corrected, reference = (
        Distribution(array, causes, missing) for array in values
    )
    return Headline(wrong, portion, truly, corrected, place, quantity, surface, reference)


def _errors(one: xr.Dataset) -> tuple[xr.DataArray, ...]:
    """Return error, the PSF's portion, true error and corrected error of readings."""
    measured = one.measured.sel(effects=ALL, drop=True)
    return error(one), psf_portion(one), measured - one.true, one.corrected - one.true


def headlines(data: xr.Dataset) -> dict[str, Headline]:
    """Return all readings that are finite in every draw."""
    every = {str(name): headline(data, str(name)) for name in data.reading.values}
    return {name: one for name, one in every.items() if one is not None}


def one_draw(data: xr.Dataset, reading: str) -> ReadingErrors[float]:
    """Return a reading of the first exposure, texture and pixel phase; NaN where unknown."""
    one = data.sel(reading=reading).isel(dict.fromkeys(_DRAWS, 0))
    return ReadingErrors(*map(float, _errors(one)))


def line_error(data: xr.Dataset, line: str) -> xr.DataArray:
    """Return the error along a line over exposure, texture, pixel phase and point."""
    return error(_line(data, line), "line_")


def line_psf_portion(data: xr.Dataset, line: str) -> xr.DataArray:
    """Return the PSF's portion along a line."""
    return psf_portion(_line(data, line), "line_")


def line_change(data: xr.Dataset, line: str, near: float, far: float) -> float:
    """Return the mean change of the scene's temperature in K between two distances in m."""
    ends = [np.interp([near, far], at, values) for at, values in _scene_lines(data, line)]
    return float(np.mean([last - first for first, last in ends]))


def line_steepest(data: xr.Dataset, line: str, length: float) -> float:
    """Return the mean of the largest change of the scene's temperature in K over a length in m."""
    changes = [
        np.nanmax(np.abs(np.interp(at + length, at, values) - values))
        for at, values in _scene_lines(data, line)
    ]
    return float(np.mean(changes))


def image_error(data: xr.Dataset, effects: str = ALL) -> xr.DataArray:
    """Return the error of every pixel in the shown exposure."""
    reference = data["reference_temperature"].isel(instant=data.attrs["shown_instant"], drop=True)
    return data["image_measured"].sel(effects=effects, drop=True) - reference


def image_psf_portion(data: xr.Dataset) -> xr.DataArray:
    """Return the PSF's portion of the error of every pixel in the shown exposure."""
    return psf_portion(data, "image_")


def sensitivity_error(data: xr.Dataset, order: str, reading: str) -> Array:
    """Return the mean error by the width of the PSF."""
    return _by_width(error(data.sel(psf_order=order, reading=reading), "varied_"))


def sensitivity_psf_fraction(data: xr.Dataset, order: str, reading: str) -> Array:
    """Return the mean PSF portion over the error, by the width of the PSF."""
    one = data.sel(psf_order=order, reading=reading)
    return _by_width(psf_portion(one, "varied_") / error(one, "varied_"))


def with_errors(data: xr.Dataset) -> xr.Dataset:
    """Return the Dataset with the errors of images and readings as variables."""
    errors = {
        "error_case_1": image_error(data),
        "error_case_2": image_error(data, WITHOUT_PSF),
        "error_psf_portion": image_psf_portion(data),
    }
    for part, array in (("error", error(data)), ("psf_portion", psf_portion(data))):
        for name in map(str, data.reading.values):
            key = "_".join("".join(c if c.isalnum() else " " for c in name).split())
            one = array.sel(reading=name, drop=True)
            errors[f"draws_{key}_{part}"] = one.reset_coords(drop=True)
    if "line" in data.dims:
        errors["line_error"] = error(data, "line_")
        errors["line_psf_portion"] = psf_portion(data, "line_")
    return data.assign({name: array.assign_attrs(units="K") for name, array in errors.items()})


def readings_frame(data: xr.Dataset) -> pd.DataFrame:
    """Return a table of every reading: reference, error, its scatter, and the PSF's portion."""
    return pd.DataFrame(
        {
            "surface": one.surface,
            "place": one.place,
            "reading": one.quantity,
            "draws": one.error.draws,
            "reference_degC": one.reference.mean - ZERO_CELSIUS,
            "error_K": one.error.mean,
            "standard_deviation_K": one.error.standard_deviation,
            "least_K": one.error.range[0],
            "greatest_K": one.error.range[1],
            "psf_portion_K": one.psf_portion.mean,
        }
        for one in headlines(data).values()
    )


def _line(data: xr.Dataset, line: str) -> xr.Dataset:
    """Return the variables of a line without the points beyond its end."""
    names = [name for name in data.data_vars if str(name).startswith("line_")]
    one = data[names].sel(line=line)
    distance = one.line_distance.isel(exposure=0, drop=True)
    one = one.isel(texture=slice(int(one.line_textures)))
    return one.assign_coords(distance=distance).isel(point=np.isfinite(distance.values))


def _scene_lines(data: xr.Dataset, line: str) -> Iterator[tuple[Array, Array]]:
    one = _line(data, line)
    scene = one.line_scene.transpose("exposure", "texture", "point").values
    for values in scene.reshape(-1, scene.shape[-1]):
        yield one.distance.values, values


def _by_width(values: xr.DataArray) -> Array:
    return np.asarray(values.mean(("exposure", "varied_phase"), skipna=False).values)
