"""Previews of a study's cut: coarse frames of the scene's view."""

from collections.abc import Callable
from dataclasses import replace
from math import ceil
from typing import Any, Final

import numpy as np

from chipglow.cutting import Preview
from chipglow.scene import Frame, Raster, Scene
from chipglow.study.schema import Study

PREVIEW_FRAMES: Final = 120
"""About how many frames a preview has."""

_MOST_SAMPLES: Final = 360
"""Samples along the longer side of a preview."""


def preview_raster(study: Study) -> Raster:
    """Return the samples of a preview: those of the study's scene, or several together."""
    raster = study.cutting.field_of_view.build()
    step = _step(raster)
    rows, columns = (count // step for count in raster.shape)
    return replace(raster, spacing=raster.spacing * step, rows=rows, columns=columns)


def preview_of(study: Study, on_frame: Callable[[Frame], None]) -> Preview:
    """Return a preview of a study's cut."""
    return Preview(preview_raster(study), PREVIEW_FRAMES, on_frame)


def show_scene(scene: Scene, preview: Preview, on_progress: Callable[[float], None]) -> None:
    """Hand the frames of a scene to a preview of its study, as if it were being cut."""
    step, (rows, columns) = _step(scene.raster), preview.raster.shape
    last = len(scene.times)
    for number in range(1, last + 1):
        if preview.shows(number, last):
            preview.on_frame(_thinned(scene.frame(number - 1), step, rows, columns))
            on_progress(number / last)


def _step(raster: Raster) -> int:
    """Return how many samples of a scene are one of its preview, in either direction."""
    return min(ceil(max(raster.shape) / _MOST_SAMPLES), *raster.shape)


def _thinned(frame: Frame, step: int, rows: int, columns: int) -> Frame:
    middles = slice(step // 2, None, step)
    fields: dict[str, Any] = {
        name: values[middles, middles][:rows, :columns]
        for name, values in vars(frame).items()
        if isinstance(values, np.ndarray)
    }
    return Frame(time=frame.time, **fields)
