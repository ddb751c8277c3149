"""The camera alone, from a scene's file to a measurement's."""

from dataclasses import replace
from math import floor
from pathlib import Path

from rich.console import Console

from chipglow.camera import Measurement
from chipglow.cli.progress import progress_bars
from chipglow.cli.times import parse_instant
from chipglow.io import open_scene, write_measurement
from chipglow.study import Study


def measure_scene(path: Path, study: Study, out: Path, start: str | None, chip: str | None) -> None:
    """Look at a scene with a study's camera and write the measurement.

    Parameters
    ----------
    path : Path
        The scene's file.
    study : Study
        Says surface and camera.
    out : Path
        The measurement's file.
    start : str, optional
        When the first exposure starts, in the scene's time, with its unit; frames follow at the
        camera's rate to the end of the scene.
    chip : str, optional
        Name of one of the study's chips; the first by default.

    A scene without material coordinates, as imports often are, is looked at with textures that move
    by the mean velocities, as the paper's did; that is said.

    Raises
    ------
    ValueError
        If there is no such chip, or no exposure fits into the scene.
    """
    surfaces = study.surface.build(study.seed)
    name = next(iter(surfaces)) if chip is None else chip
    if name not in surfaces:
        raise ValueError(f"--chip: {name!r} is unknown, expected one of {', '.join(surfaces)}")
    scene, camera = open_scene(path), study.camera.build()
    first = float(scene.times[0]) if start is None else parse_instant("--start", start)
    left = float(scene.times[-1]) + scene.frame_spacing - first - camera.integration_time
    count = max(floor(left * camera.frame_rate) + 1, 1)
    surface = surfaces[name]
    if surface.follow == "material" and not scene.has_material_coordinates:
        Console(stderr=True).print(
            "The scene does not say where each point was before the cut: textures move with the "
            "mean velocity of their feature (surface.follow: mean)."
        )
        surface = replace(surface, follow="mean")
    with progress_bars() as progress:
        progress("measurement", 0.0)
        starts = camera.frame_times(first, count)
        try:
            measured = camera.measure(scene, surface, starts).data.assign_attrs(surface=name)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
        progress("measurement", 1.0)
    write_measurement(Measurement(measured), out)
