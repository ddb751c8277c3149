"""What is there, what the camera measures and its error, through time."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import SceneErrors, StudyResult
from chipglow.analysis.cut_error import SurfaceResult
from chipglow.analysis.scene_error import SurfaceErrors
from chipglow.camera import Camera
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import KELVIN
from chipglow.report.evidence import definition_of
from chipglow.report.player import Mark, Player, View
from chipglow.scene import Tool

_Surfaces = Mapping[str, SurfaceResult | SurfaceErrors]

_TITLE: Final = "What is there, what the camera measures, and its error"
_GREY: Final = (
    "Grey: what the camera marks as unusable, such as under the lower limit of its range."
)
_SLIDER: Final = "The slider chooses the exposure; arrow keys move it."


def cut_player(result: StudyResult) -> Player:
    """The exposures of a cut's longest part, with the lines of the answer on the developed one.

    Parameters
    ----------
    result : StudyResult
        The study.
    """
    count, still = len(result.one_segment), result.developed
    names = dict.fromkeys((result.plan.rake_surface, result.plan.band_surface))
    ridges = [
        Mark(instant.band.ridge.points, "ridge", i)
        for i, instant in enumerate(result.one_segment)
        if instant.band is not None
    ]
    marks = (
        *ridges,
        Mark(result.rake.line.points, "line", still),
        Mark(result.band_errors.line.points, "line", still),
    )
    caption = (
        f"{definition_of(result.plan.reference)} On the left what they are compared with, in every "
        "pixel. Shown first is the exposure with the fully developed shear band. Green: the lines "
        "across rake face and shear band along which the errors of the answer are read; dashed: "
        f"the band's ridge. {_GREY}{_scrubbed(count)} Each image is one draw."
    )
    surfaces = {name: result.surfaces[name] for name in names}
    return _player(surfaces, count, still, result.camera, result.tool, marks, caption)


def scene_player(result: SceneErrors) -> Player:
    """The exposures of any scene, with the places of the errors.

    Parameters
    ----------
    result : SceneErrors
        What was found.
    """
    outlines = [outline for place in result.places if (outline := place.outline()) is not None]
    marks = [
        Mark(points, "line") if len(points) > 1 else Mark(points.repeat(2, axis=0), "spot")
        for points in outlines
    ]
    count = len(result.starts)
    caption = (
        f"{definition_of(result.plan.reference)} On the left what they are compared with, in every "
        "pixel. Shown first is the exposure in the middle of which the scene is hottest. Green: "
        f"the places. {_GREY}{_scrubbed(count)} Each image is one draw."
    )
    return _player(result.surfaces, count, result.shown, result.camera, result.tool, marks, caption)


def _player(
    surfaces: _Surfaces,
    count: int,
    still: int,
    camera: Camera,
    tool: Tool | None,
    marks: Sequence[Mark],
    caption: str,
) -> Player:
    measurement = next(iter(surfaces.values())).measurement
    return Player(
        name="player",
        title=_TITLE,
        caption=caption,
        views=list(_views(surfaces, count, camera.lower_limit)),
        columns=3,
        times=list(_times(measurement.times[:count], camera.integration_time)),
        still=still,
        raster=measurement.raster,
        tool=tool,
        marks=marks,
    )


def _views(surfaces: _Surfaces, count: int, lower_limit: float | None) -> Iterator[View]:
    """A row for each surface; the same colours mean the same in all rows."""
    references = {name: one.references[:count] - KELVIN for name, one in surfaces.items()}
    measured = {
        name: one.measurement.radiance_temperature()[:count] - KELVIN
        for name, one in surfaces.items()
    }
    heat = _heat_limits(np.stack(list(references.values())), lower_limit)
    errors = {name: measured[name] - references[name] for name in surfaces}
    largest = scales.round_limit(np.stack(list(errors.values())), 99.0, 10.0)
    for name in surfaces:
        of = f", {name}" if len(surfaces) > 1 else ""
        yield View(
            f"Reference{of}",
            references[name],
            "°C",
            heat,
            scales.HEAT,
            f"Image of the radiance temperature that is there{of}: sharp and mottled.",
        )
        yield View(
            f"Measured{of}",
            measured[name],
            "°C",
            heat,
            scales.HEAT,
            f"Image of the radiance temperature that the camera measures{of}: the same, blurred.",
        )
        yield View(
            f"Error{of}",
            errors[name],
            "°C",
            (-largest, largest),
            scales.SIGNED,
            f"Image of measured less reference{of}: blue where the camera reads too little.",
        )


def _heat_limits(references: NDArray[np.float64], lower_limit: float | None) -> tuple[float, float]:
    low, high = scales.ends(references, 0.5, 99.9, 1.0)
    if lower_limit is not None:
        low = max(lower_limit - KELVIN - 50.0, low)
    return low, max(high, low + 1.0)


def _times(starts: NDArray[np.float64], duration: float) -> Iterator[str]:
    factor, unit = drawing.time_unit(float(starts[-1]))
    length, of_length = drawing.time_unit(duration)
    for i, start in enumerate(starts):
        yield (
            f"Exposure {i + 1} of {len(starts)}: begins at {start * factor:.1f} {unit}, lasts "
            f"{duration * length:.3g} {of_length}."
        )


def _scrubbed(count: int) -> str:
    return f" {_SLIDER}" if count > 1 else ""
