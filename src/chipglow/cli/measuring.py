"""The command ``chipglow measure``: a scene to a measurement."""

from functools import partial
from math import floor
from pathlib import Path
from typing import Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import finish


def measure(
    scene: opt.SceneFile,
    study: Annotated[Path, opt.value("STUDY", "Study file defining surface and camera.")],
    out: Annotated[Path, opt.file("Measurement to write, NetCDF.")],
    start: Annotated[
        float | None,
        opt.time("Start of the first exposure, e.g. '400 us'. Default: that of the scene."),
    ] = None,
    chip: Annotated[
        str | None, opt.value("NAME", "One of the study's chips. Default: the first.")
    ] = None,
) -> None:
    """Measure a scene with a study's camera."""
    from chipglow.camera import Measurement
    from chipglow.cli.progress import progress_bars
    from chipglow.io import open_scene, write_measurement
    from chipglow.study import fit, load_study

    loaded = load_study(study)
    fitted = fit(loaded, open_scene(scene))
    seen, surfaces = fitted.scene, fitted.surfaces
    camera = loaded.camera.on(seen.raster, loaded.seed)
    name = next(iter(surfaces)) if chip is None else chip
    if name not in surfaces:
        raise ValueError(f"--chip: {name!r} is unknown, expected one of {', '.join(surfaces)}")
    first = float(seen.times[0]) if start is None else start
    left = float(seen.times[-1]) + seen.frame_spacing - first - camera.frame_duration(seen.raster)
    starts = camera.frame_times(first, max(floor(left * camera.frame_rate) + 1, 1))
    with progress_bars() as progress:
        progress("measurement", 0.0)
        try:
            measured = camera.measure(seen, surfaces[name], starts).data.assign_attrs(surface=name)
        except ValueError as error:
            raise ValueError(f"{scene}: {error}") from None
        progress("measurement", 1.0)
    measurement = Measurement(measured)
    finish(fitted.notes + measurement.notes, (out, partial(write_measurement, measurement)))
