"""The report of a scene's measurement error: page, figures, numbers and arrays."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from chipglow.drawing.drawing import KELVIN
from chipglow.errors import Distribution, SceneErrors
from chipglow.errors.distribution import TOGETHER
from chipglow.errors.scene_error import PlaceErrors
from chipglow.report.camera_rows import camera_rows, camera_table
from chipglow.report.comparison import Row
from chipglow.report.evidence import definition_of
from chipglow.report.page import (
    Line,
    answer_part,
    closing_sections,
    document,
    figure_part,
    table_part,
    write_files,
)
from chipglow.report.results import scatter
from chipglow.report.scene_error_figures import draw_scene_errors

_HEADS: Final = ("Place", "Reference", "Error", "Range", "PSF's portion")


class PlaceRow(NamedTuple):
    """A reading as printed: where, what a camera without error would say, error, range, PSF."""

    place: str
    reference: str
    error: str
    range: str
    psf_portion: str


def place_rows(result: SceneErrors) -> list[PlaceRow]:
    """Every reading with its scatter, in °C.

    Parameters
    ----------
    result : SceneErrors
        What was found.
    """
    rows = []
    for name, surface in result.surfaces.items():
        for one in surface.readings:
            low, high = one.error.range
            where = f"{one.place}, {one.reading}"
            rows.append(
                PlaceRow(
                    f"{where} ({name})" if len(result.surfaces) > 1 else where,
                    f"{_mean_text(one.reference, -KELVIN)} °C",
                    f"{_mean_text(one.error)} °C",
                    f"{_rounded(low)} to {_rounded(high)}" if one.error.draws > 1 else "–",
                    f"{_mean_text(one.psf_portion)} °C",
                )
            )
    return rows


def write_scene_report(
    result: SceneErrors,
    folder: Path,
    title: str,
    study_text: str,
    provenance: Mapping[str, str],
    remarks: Sequence[str] = (),
) -> Path:
    """Write everything that is known of a scene's measurement error into a folder.

    Parameters
    ----------
    result : SceneErrors
        What was found.
    folder : Path
        An existing folder, such as a temporary one that is moved into place at the end.
    title : str
        Heads the page.
    study_text : str
        The study's YAML, written as ``study.yaml`` and shown in the report.
    provenance : mapping
        What, when, version, seed and the like, in the order in which it is shown.
    remarks : sequence of str
        What a reader must know before quoting a number: sentences under the answer.

    Returns
    -------
    Path
        ``report.html``; beside it are ``figures/``, ``summary.json``, ``results.nc`` and
        ``study.yaml``.

    Raises
    ------
    OSError
        If something can't be written.
    """
    pictures = folder / "figures"
    pictures.mkdir()
    figures = [figure_part(figure) for figure in draw_scene_errors(result, pictures)]
    camera = camera_rows(result.camera, result.raster)
    missing = "".join(f"<p>{escape(sentence)}</p>\n" for sentence in result.missing)
    sections = [
        ("answer", "The answer", answer_part(list(_answer(result)), remarks)),
        ("places", "The error at each place", _places(result)),
        ("scatter", "What makes the scatter", _causes(result)),
        ("figures", "Figures", "\n".join(figures)),
        *([("camera", "The camera", camera_table(camera))] if camera else []),
        *([("missing", "What is not here", missing)] if missing else []),
        *closing_sections(study_text, provenance),
    ]
    return write_files(
        folder,
        document(title, sections),
        _dataset(result, provenance),
        _summary(result, provenance, camera),
        study_text,
    )


def _answer(result: SceneErrors) -> Iterator[str]:
    """The first reading of every place with every surface, as sentences."""
    for name, surface in result.surfaces.items():
        said: set[str] = set()
        for one in surface.readings:
            if one.place in said:
                continue
            said.add(one.place)
            of_surface = f" ({name})" if len(result.surfaces) > 1 else ""
            yield f"{one.place.capitalize()}, {one.reading}{of_surface}: {_sentence(one)}"


def _sentence(one: PlaceErrors) -> str:
    mean = one.error.mean
    way = "little" if mean < 0 else "much"
    scale = -1.0 if mean < 0 else 1.0
    scaled = Distribution(scale * one.error.values, one.error.causes)
    text = f"the camera reads {_mean_text(scaled)} °C too {way} radiance temperature"
    if one.error.draws > 1:
        low, high = one.error.range
        text += (
            f" (error of {_rounded(low)} to {_rounded(high)} °C in {one.error.draws} draws of "
            "exposure, texture and pixel phase)"
        )
    return f"{text}; the point spread function makes {_mean_text(one.psf_portion)} °C of the error."


def _places(result: SceneErrors) -> str:
    text = (
        f"{definition_of(result.plan.reference)} PSF: point spread function. Mean ± standard "
        f"deviation over the draws of {len(result.starts)} exposures, of textures and pixel phases."
    )
    return table_part(text, _HEADS, map(Line, place_rows(result)))


def _causes(result: SceneErrors) -> str:
    readings = [
        (f"{one.place}, {one.reading}" + (f" ({name})" if len(result.surfaces) > 1 else ""), one)
        for name, surface in result.surfaces.items()
        for one in surface.readings
        if one.error.draws > 1
    ]
    if not readings:
        return "<p>One draw only: it says nothing of the scatter.</p>"
    heads = ("Error", *readings[0][1].error.causes, TOGETHER)
    text = (
        "Each cause in the mean over the others: standard deviation, and its part of the sum of "
        "squares. Causes together: what none of them makes by itself."
    )
    lines = (
        Line((name, *(_cause_text(part) for part in one.error.parts.values())))
        for name, one in readings
    )
    return table_part(text, heads, lines)


def _cause_text(part: Any) -> str:
    if part.draws < 2 or not np.isfinite(part.standard_deviation):
        return "–"
    return f"{part.standard_deviation:.1f} °C ({100 * part.fraction:.0f} %)"


def _mean_text(draws: Distribution, offset: float = 0.0) -> str:
    """Mean and standard deviation, of as many decimals; the mean alone of a single draw."""
    mean = draws.mean + offset
    if draws.draws < 2:
        return _rounded(mean)
    digits = 0 if max(abs(mean), draws.standard_deviation) >= 9.95 else 1
    return f"{_rounded(mean, digits)} ± {draws.standard_deviation:.{digits}f}"


def _rounded(value: float, digits: int | None = None) -> str:
    """Without decimals from 10 on, with the sign of minus that is read."""
    text = f"{value:.{(0 if abs(value) >= 9.95 else 1) if digits is None else digits}f}"
    return (text.removeprefix("-") if float(text) == 0 else text).replace("-", "−")


def _summary(
    result: SceneErrors, provenance: Mapping[str, str], camera: Sequence[Row]
) -> dict[str, Any]:
    surfaces: dict[str, Any] = {}
    for name, surface in result.surfaces.items():
        of_place = surfaces.setdefault(name, {})
        for one in surface.readings:
            of_place.setdefault(one.place, {})[one.reading] = {
                "reference_degC": one.reference.mean - KELVIN,
                "error_degC": scatter(one.error),
                "psf_portion_degC": scatter(one.psf_portion),
            }
    return {
        "provenance": dict(provenance),
        **({"camera": {row.key: row.here for row in camera}} if camera else {}),
        "results": surfaces,
        "missing": list(result.missing),
    }


def _dataset(result: SceneErrors, provenance: Mapping[str, str]) -> xr.Dataset:
    """Arrays behind the figures, in SI units, each with a ``units`` attribute."""
    surfaces = list(result.surfaces.values())
    grid, kelvin = surfaces[0].errors.raster, {"units": "K"}
    pixels = ("surface", "pixel_y", "pixel_x")
    variables: dict[str, Any] = {
        "temperature": (("y", "x"), result.frame.temperature, kelvin),
        "emissivity": (
            ("surface", "y", "x"),
            np.stack([one.emissivity for one in surfaces]),
            {"units": "1"},
        ),
        "scene_temperature": (
            ("surface", "y", "x"),
            np.stack([one.scene_temperature for one in surfaces]),
            kelvin,
        ),
        "measured": (pixels, np.stack([one.errors.measured for one in surfaces]), kelvin),
        "error": (pixels, np.stack([one.errors.case_1 for one in surfaces]), kelvin),
        "psf_portion": (pixels, np.stack([one.errors.psf_portion for one in surfaces]), kelvin),
        "flagged": (
            pixels,
            np.stack([one.errors.flagged for one in surfaces]).astype(np.int8),
            {"units": "1"},
        ),
    }
    for name, surface in result.surfaces.items():
        for one in surface.readings:
            key = "_".join((*one.place.split(), *one.reading.split(), "error", *name.split()))
            draws = ("exposure", f"texture_{_key(name)}", "pixel_phase")
            variables[_key(key)] = (draws, one.error.values, kelvin)
        for profile in surface.profiles:
            key, along = _key(f"{profile.name} {name}"), _key(f"{profile.name} distance")
            variables[f"profile_{key}"] = ((f"draw_{_key(name)}", along), profile.error, kelvin)
            variables[along] = ((along,), profile.line.distance, {"units": "m"})
    coordinates = {
        "surface": list(result.surfaces),
        "exposure": ("exposure", result.starts, {"units": "s"}),
        "y": ("y", result.raster.y, {"units": "m"}),
        "x": ("x", result.raster.x, {"units": "m"}),
        "pixel_y": ("pixel_y", grid.y, {"units": "m"}),
        "pixel_x": ("pixel_x", grid.x, {"units": "m"}),
    }
    attributes: dict[str, Any] = {
        "error_reference": result.plan.reference,
        **{f"provenance_{name.replace(' ', '_')}": text for name, text in provenance.items()},
    }
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def _key(name: str) -> str:
    """A name that readers of NetCDF take."""
    return "_".join("".join(c if c.isalnum() else " " for c in name).split())
