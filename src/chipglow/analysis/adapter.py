"""The one result made from today's two: until the engine makes it itself."""

# mypy: ignore-errors

from typing import Any

import numpy as np

from chipglow.analysis.cut_error import StudyResult
from chipglow.analysis.dataset import (
    assembled,
    history_variables,
    image_variables,
    ridge_variables,
    scene_variables,
)
from chipglow.analysis.places import BandPlace, RakePlace
from chipglow.analysis.result import Analysis, Cut
from chipglow.analysis.scene_error import SceneErrors
from chipglow.scene.tool_attributes import tool_attributes

EFFECTS = ["all", "without psf"]


def analysis_of(result):
    """Either result as an `Analysis`."""
    if isinstance(result, Analysis):
        return result
    return _of_cut(result) if isinstance(result, StudyResult) else _of_scene(result)


def _common(result, starts, shown, extra, attrs):
    surfaces = list(result.surfaces.values())
    cases = [[s.errors.reference + c for c in (s.errors.case_1, s.errors.case_2)] for s in surfaces]
    variables = {
        "surface": ("surface", list(result.surfaces)),
        "effects": ("effects", EFFECTS),
        **scene_variables(
            result.frame,
            result.raster,
            [s.emissivity for s in surfaces],
            [s.scene_temperature for s in surfaces],
        ),
        **image_variables(
            [s.measurement for s in surfaces],
            [s.references for s in surfaces],
            np.array(cases),
            np.array([s.errors.flagged for s in surfaces]),
        ),
        **extra,
    }
    tool = {} if result.tool is None else tool_attributes(result.tool)
    attributes = {"shown_instant": shown, "error_reference": result.plan.reference, **tool, **attrs}
    return assembled(variables, attributes)


def _warnings(result):
    return tuple(
        f"Image of {name}. {warning}"
        for name, surface in result.surfaces.items()
        for warning in surface.warnings
    )


def _draw_coordinates(starts, title, textures, phases) -> dict[str, Any]:
    return {
        "exposure": ("exposure", np.asarray(starts), {"units": "s", "title": title}),
        "texture": ("texture", np.arange(textures)),
        "pixel_phase": ("pixel_phase", np.arange(phases)),
    }


def _of_cut(result: StudyResult) -> Analysis:
    plan, draws = result.plan, result.draws
    names = list(draws.headlines)
    shape = draws.rake_line.case_1.shape[:3]
    error = np.array([draws.headlines[n].error.values for n in names])
    portion = np.array([draws.headlines[n].psf_portion.values for n in names])
    of = {n: plan.rake_surface if n.startswith("rake") else plan.band_surface for n in names}
    titles = {
        "rake": ("rake face", "mid-contact"),
        "rake_extremum": ("rake face", "most negative within two pixels"),
        "rake_mean": ("rake face", "mean along the contact"),
        "band": ("shear band", "ridge of strain rate"),
        "band_measured": ("shear band", "ridge of measured temperature"),
        "band_worst": ("shear band", "most negative beside it"),
    }
    rows = ("reading", "exposure", "texture", "pixel_phase")
    contact = result.rake
    lines = {
        "rake": (draws.rake_line, contact.line, plan.rake_surface),
        "band": (draws.band_line, result.band_errors.line, plan.band_surface),
    }
    points = max(
        *(one.distance.size for one, _, _ in lines.values()), contact.contact.distance.size
    )
    place = np.full((3, 3, shape[0], points), np.nan)
    measured = np.full((3, *shape, 2, points), np.nan)
    scene = np.full((3, *shape[:2], points), np.nan)
    motion = np.full((3, *shape[:2]), np.nan)
    for i, (one, line, _) in enumerate(lines.values()):
        n = one.distance.size
        place[0, i, :, :n] = one.distance
        place[1, i, 0, :n], place[2, i, 0, :n] = line.points.T
        measured[i, ..., 0, :n] = one.case_1
        measured[i, ..., 1, :n] = one.case_1 - one.psf_portion
        scene[i, ..., :n], motion[i] = one.scene, one.motion
    n = contact.contact.distance.size
    place[0, 2, 0, :n] = contact.contact.distance
    place[1, 2, 0, :n], place[2, 2, 0, :n] = contact.contact.points.T
    measured[2, 0, 0, 0, 0, :n] = contact.contact_case_1
    measured[2, 0, 0, 0, 1, :n] = contact.contact_case_1 - contact.contact_psf_portion
    over = ("line", "exposure", "texture", "pixel_phase")
    found = result.sensitivity
    varied = np.array([[s.errors[n] for n in names] for s in found])  # order, reading, width, draw
    varied_p = np.array([[s.psf_portions[n] for n in names] for s in found])
    varied, varied_p = (
        np.moveaxis(v, 1, 2).reshape(2, -1, len(names), shape[0], shape[2])
        for v in (varied, varied_p)
    )
    dims = ("psf_order", "psf_width", "reading", "exposure", "pixel_phase")
    extra = {
        **_draw_coordinates([s.start for s in result.segments], "segment", shape[1], shape[2]),
        "reading": ("reading", names),
        "place": (
            "reading",
            ["rake face" if n.startswith("rake") else "shear band" for n in names],
        ),
        "quantity": ("reading", [titles[n][1] for n in names]),
        "seen_surface": ("reading", [of[n] for n in names]),
        "textures": ("reading", [shape[1]] * len(names)),
        "reference": (rows, np.zeros(error.shape), {"units": "K"}),
        "measured": (
            (*rows, "effects"),
            np.stack([error, error - portion], axis=-1),
            {"units": "K"},
        ),
        "line": ("line", ["rake", "band", "contact"]),
        "line_surface": ("line", [plan.rake_surface, plan.band_surface, plan.rake_surface]),
        "line_textures": ("line", [shape[1]] * 3),
        **{
            f"line_{name}": (("line", "exposure", "point"), values, {"units": "m"})
            for name, values in zip(("distance", "x", "y"), place, strict=True)
        },
        "line_reference": ((*over, "point"), np.zeros((3, *shape, points)), {"units": "K"}),
        "line_measured": ((*over, "effects", "point"), measured, {"units": "K"}),
        "line_scene": ((*over[:3], "point"), scene, {"units": "K"}),
        "line_motion": (over[:3], motion, {"units": "K"}),
        "psf_order": ("psf_order", [s.psf_order for s in found]),
        "psf_width": ("psf_width", np.asarray(plan.psf_widths), {"units": "m"}),
        "varied_reference": (dims, np.zeros(varied.shape), {"units": "K"}),
        "varied_measured": (
            (*dims, "effects"),
            np.stack([varied, varied - varied_p], axis=-1),
            {"units": "K"},
        ),
        **ridge_variables(
            result.instants, {name: s.measurement for name, s in result.surfaces.items()}
        ),
        **history_variables(result.forces, result.chip),
    }
    first = result.segment
    attrs = {"rake_surface": plan.rake_surface, "band_surface": plan.band_surface}
    starts = [instant.start for instant in result.instants]
    return Analysis(
        data=_common(result, starts, result.developed, extra, attrs),
        plan=plan,
        camera=result.camera,
        raster=result.raster,
        frame=result.frame,
        tool=result.tool,
        places=(
            RakePlace(
                "rake face", result.tool, first.contact_length, plan.line_reach, plan.line_step
            ),
            BandPlace("shear band", result.band, plan.line_reach, plan.line_step),
        ),
        measurements={name: s.measurement for name, s in result.surfaces.items()},
        cut=Cut(
            result.instants,
            result.other_parts,
            result.developed,
            result.segments,
            result.moments,
            result.chip,
            result.forces,
            result.heated,
        ),
        warnings=(*result.warnings, *_warnings(result)),
        missing=(),
        failed={},
    )


def _of_scene(result: SceneErrors) -> Analysis:
    several = len(result.surfaces) > 1
    rows = [(name, one) for name, s in result.surfaces.items() for one in s.readings]
    lines = [(name, one) for name, s in result.surfaces.items() for one in s.profiles]
    textures = max([one.error.values.shape[1] for _, one in rows], default=1)
    phases = result.plan.phases**2
    exposures = len(result.starts)
    reference = np.full((len(rows), exposures, textures, phases), np.nan)
    measured = np.full((*reference.shape, 2), np.nan)
    for i, (_, one) in enumerate(rows):
        n = one.error.values.shape[1]
        reference[i, :, :n] = one.reference.values
        measured[i, :, :n, :, 0] = one.reference.values + one.error.values
        measured[i, :, :n, :, 1] = measured[i, :, :n, :, 0] - one.psf_portion.values
    dims = ("reading", "exposure", "texture", "pixel_phase")
    extra = {
        **_draw_coordinates(result.starts, "exposure", textures, phases),
        "reading": (
            "reading",
            [f"{r.place}, {r.reading}" + (f" ({name})" if several else "") for name, r in rows],
        ),
        "place": ("reading", [r.place for _, r in rows]),
        "quantity": ("reading", [r.reading for _, r in rows]),
        "seen_surface": ("reading", [name for name, _ in rows]),
        "textures": ("reading", [r.error.values.shape[1] for _, r in rows]),
        "reference": (dims, reference, {"units": "K"}),
        "measured": ((*dims, "effects"), measured, {"units": "K"}),
    }
    if lines:
        points = max(one.line.distance.size for _, one in lines)
        shape = (len(lines), exposures)
        place = np.full((3, *shape, points), np.nan)
        of_lines = np.full((3, *shape, textures, phases, points), np.nan)
        for i, (_, one) in enumerate(lines):
            n = one.line.distance.size
            place[0, i, :, :n] = one.line.distance
            place[1, i, :, :n], place[2, i, :, :n] = one.line.points.T[:, None]
            drawn = one.reference.shape[0] // phases
            values = (one.reference, one.reference + one.error)
            values = (*values, values[1] - one.psf_portion)
            for target, rows_ in zip(of_lines, values, strict=True):
                target[i, result.shown, :drawn, :, :n] = rows_.reshape(drawn, phases, n)
        over = ("line", "exposure", "texture", "pixel_phase")
        extra |= {
            "line": (
                "line",
                [one.name + (f" ({name})" if several else "") for name, one in lines],
            ),
            "line_surface": ("line", [name for name, _ in lines]),
            "line_textures": ("line", [one.reference.shape[0] // phases for _, one in lines]),
            **{
                f"line_{name}": (("line", "exposure", "point"), values, {"units": "m"})
                for name, values in zip(("distance", "x", "y"), place, strict=True)
            },
            "line_reference": ((*over, "point"), of_lines[0], {"units": "K"}),
            "line_measured": (
                (*over, "effects", "point"),
                np.stack(list(of_lines[1:]), axis=-2),
                {"units": "K"},
            ),
        }
    return Analysis(
        data=_common(result, result.starts, result.shown, extra, {}),
        plan=result.plan,
        camera=result.camera,
        raster=result.raster,
        frame=result.frame,
        tool=result.tool,
        places=result.places,
        measurements={name: s.measurement for name, s in result.surfaces.items()},
        cut=None,
        warnings=_warnings(result),
        missing=result.missing,
        failed={},
    )
