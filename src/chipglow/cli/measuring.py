"""The command ``chipglow measure``: a scene to a measurement."""

from functools import partial
from math import floor
from pathlib import Path

from chipglow.camera import Measurement
from chipglow.cli.progress import progress_bars
from chipglow.cli.screen import finish
from chipglow.io import open_scene, write_measurement
from chipglow.study import Study, fit


def measure_scene(
    path: Path, study: Study, out: Path, start: float | None, chip: str | None
) -> None:
    """Measure a scene with a study's camera and write the measurement."""
    fitted = fit(study, open_scene(path))
    camera = study.camera.on(fitted.scene.raster, study.seed)
    scene, surfaces = fitted.scene, fitted.surfaces
    name = next(iter(surfaces)) if chip is None else chip
    if name not in surfaces:
        raise ValueError(f"--chip: {name!r} is unknown, expected one of {', '.join(surfaces)}")
    first = float(scene.times[0]) if start is None else start
    duration = camera.frame_duration(scene.raster)
    left = float(scene.times[-1]) + scene.frame_spacing - first - duration
    count = max(floor(left * camera.frame_rate) + 1, 1)
    with progress_bars() as progress:
        progress("measurement", 0.0)
        starts = camera.frame_times(first, count)
        try:
            measured = camera.measure(scene, surfaces[name], starts).data.assign_attrs(surface=name)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        progress("measurement", 1.0)
    measurement = Measurement(measured)
    finish(fitted.notes + measurement.notes, (out, partial(write_measurement, measurement)))
