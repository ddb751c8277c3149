"""The report of a scene's measurement error: page, figures, numbers and arrays."""

from collections.abc import Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr

from chipglow.analysis import Distribution, SceneErrors
from chipglow.analysis.distribution import TOGETHER
from chipglow.drawing.scales import KELVIN
from chipglow.report.camera_rows import camera_rows
from chipglow.report.error_player import scene_player
from chipglow.report.evidence import answer_note, definition_of, error_text
from chipglow.report.page import (
    Line,
    Section,
    Statement,
    Term,
    answer_part,
    document,
    figure_part,
    repeat_section,
    table_part,
    titled_part,
    write_files,
)
from chipglow.report.scene_error_figures import draw_scene_errors
from chipglow.report.summary import scene_summary_file
from chipglow.report.terms import INTERVAL, PSF


class PlaceRow(NamedTuple):
    """A reading as printed: where, what a camera without error would say, error, interval, PSF."""

    place: str
    reference: str
    error: str
    interval: str
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
            where = f"{one.place}, {one.reading}"
            rows.append(
                PlaceRow(
                    f"{where} ({name})" if len(result.surfaces) > 1 else where,
                    f"{_mean_text(one.reference, -KELVIN)} °C",
                    f"{_mean_text(one.error)} °C",
                    _interval_text(one.error),
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
        ``report.html``; beside it are ``figures/``, ``summary.json`` and its schema,
        ``results.nc`` and ``study.yaml``.

    Raises
    ------
    OSError
        If something can't be written.
    """
    pictures = folder / "figures"
    pictures.mkdir()
    figures = "\n".join(map(figure_part, draw_scene_errors(result, pictures)))
    camera = camera_rows(result.camera, result.raster)
    missing = "".join(f"<p>{escape(sentence)}</p>\n" for sentence in result.missing)
    lines = (Line((row.quantity, row.here_text), row.unit, row.term.key) for row in camera)
    tables = (
        ("places", "The error at each place", _places(result)),
        ("camera", "The camera", table_part("", ("Quantity", "Here"), lines) if camera else ""),
        ("missing", "What is not here", missing),
    )
    sections = [
        Section(
            "answer",
            "The answer",
            answer_part(
                list(_answer(result))[:_SENTENCES],
                _note(result),
                remarks,
                scene_player(result).html,
            ),
        ),
        Section("causes", "What causes it", f"{_causes(result)}\n{figures}"),
        Section("tables", "Tables", "\n".join(titled_part(*one) for one in tables if one[2])),
        repeat_section(
            "chipglow error scene.nc --study study.yaml --out results",
            study_text,
            provenance,
            [*_terms(result), *(row.term for row in camera)],
            "",
        ),
    ]
    return write_files(
        folder,
        document(title, sections),
        _dataset(result, provenance),
        scene_summary_file(result, camera, provenance),
        study_text,
    )


_SENTENCES: Final = 3
"""How many places the answer speaks of; the table has all."""

_MEAN: Final = Term(
    "mean",
    "Mean and standard deviation",
    "Over the draws of exposure, texture (the random pattern of the emissivity) and pixel phase "
    "(where the pixels lie on the scene).",
)
_REFERENCE: Final = Term(
    "reference", "Reference", "What a camera without error would read: mean over the draws."
)
_SCATTER: Final = Term(
    "causes-of-scatter",
    "Causes of scatter",
    "Each cause in the mean over the others: standard deviation of these means, and its part of "
    "the sum of squares. Causes together: what none of them makes by itself.",
)


def _note(result: SceneErrors) -> str:
    readings = [one for surface in result.surfaces.values() for one in surface.readings]
    return answer_note(readings[0].error if readings else None)


def _terms(result: SceneErrors) -> Iterator[Term]:
    yield _error(result)
    yield from (_REFERENCE, _MEAN, INTERVAL, PSF, _SCATTER)


def _error(result: SceneErrors) -> Term:
    return Term("error", "Error", definition_of(result.plan.reference))


def _answer(result: SceneErrors) -> Iterator[Statement]:
    """The first reading of every place with every surface, as sentences."""
    for name, surface in result.surfaces.items():
        said: set[str] = set()
        for one in surface.readings:
            if one.place in said:
                continue
            said.add(one.place)
            of_surface = f" ({name})" if len(result.surfaces) > 1 else ""
            sense = -1.0 if one.error.mean < 0 else 1.0
            portion = Distribution(sense * one.psf_portion.values, one.psf_portion.causes)
            yield Statement(
                f"{one.place.capitalize()}, {one.reading}{of_surface}: the camera reads "
                f"{error_text(one.error)}; the point spread function makes "
                f"{_mean_text(portion)} °C of it.",
                "causes",
            )


def _places(result: SceneErrors) -> str:
    heads = ("Place", _REFERENCE, _error(result), INTERVAL, PSF)
    text = f"{definition_of(result.plan.reference)} Mean ± standard deviation over the draws."
    return table_part(text, heads, (Line(row, "°C", "mean") for row in place_rows(result)))


def _causes(result: SceneErrors) -> str:
    readings = [
        (f"{one.place}, {one.reading}" + (f" ({name})" if len(result.surfaces) > 1 else ""), one)
        for name, surface in result.surfaces.items()
        for one in surface.readings
        if one.error.draws > 1
    ]
    if not readings:
        return "<p>One draw only: it says nothing of the scatter.</p>"
    causes = (*readings[0][1].error.causes, TOGETHER)
    heads: tuple[str | Term, ...] = (
        "Error",
        *(_SCATTER._replace(name=cause) for cause in causes),
    )
    text = (
        "How far each cause alone makes the error scatter, as a standard deviation, and in "
        "brackets its part of the sum of squares."
    )
    lines = (
        Line((name, *(_cause_text(part) for part in one.error.parts.values())), "°C", "error")
        for name, one in readings
    )
    return table_part(text, heads, lines)


def _cause_text(part: Any) -> str:
    if part.draws < 2 or not np.isfinite(part.standard_deviation):
        return "–"
    return f"{part.standard_deviation:.1f} °C ({100 * part.fraction:.0f} %)"


def _interval_text(draws: Distribution) -> str:
    low, high = draws.interval
    return f"{_rounded(low)} to {_rounded(high)} °C" if np.isfinite(low) else "–"


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
        "radiance_temperature": (
            ("surface", "exposure", "pixel_y", "pixel_x"),
            np.stack([one.measurement.radiance_temperature() for one in surfaces]),
            kelvin,
        ),
        "reference_temperature": (
            ("surface", "exposure", "pixel_y", "pixel_x"),
            np.stack([one.references for one in surfaces]),
            kelvin,
        ),
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
