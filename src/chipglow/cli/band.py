"""The command ``chipglow band``: what a camera shows of a hot band."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.study import BandReading


def band(
    width: Annotated[float, opt.length("Full width of the band at half of its rise, e.g. 20um.")],
    rise: Annotated[float, opt.kelvins("Largest temperature minus that beside it, e.g. 300K.")],
    speed: Annotated[
        float, opt.speed("Speed of the band across itself, e.g. 4m/s. Default: it stands still.")
    ] = 0.0,
    base: Annotated[
        float | None, opt.temperature("Temperature beside the band. Default: 500 degC.")
    ] = None,
    camera: Annotated[
        Path | None,
        opt.value(
            "STUDY",
            "Study file with the camera, the emissivity and their uncertainties. Default: the "
            "paper's camera.",
        ),
    ] = None,
    emissivity: Annotated[
        float | None,
        opt.value("NUMBER", "Emissivity. Default: that of the study if it is uniform, else 1."),
    ] = None,
    draws: Annotated[int, opt.value("NUMBER", "Single frames from which the interval is.")] = 200,
    out: Annotated[
        Path | None, opt.file("Values to write, .csv: a row per quantity and effect.", ".csv")
    ] = None,
    plot: Annotated[
        Path | None, opt.picture("Draw the band as it is and as it is shown, and the effects")
    ] = None,
    scene: Annotated[
        Path | None,
        opt.file("Scene to write, NetCDF, for other commands such as error and app.", ".nc"),
    ] = None,
) -> None:
    """Compute what a camera shows of a hot band that moves, how wrong it is, and why."""
    from chipglow.cli.progress import progress_bars
    from chipglow.io import write_scene
    from chipglow.io.result_file import write_frame
    from chipglow.quantities import changed
    from chipglow.scene.scenes import HOT_CHIP
    from chipglow.study import Study, band_reading, load_study
    from chipglow.surface import UniformSurface

    study = Study() if camera is None else load_study(camera)
    if emissivity is not None:
        study = changed(study, {"surface": UniformSurface(emissivity)})
    beside = HOT_CHIP if base is None else base
    with progress_bars() as progress:
        reading = band_reading(
            study, width, rise, speed, base=beside, draws=draws, progress=progress
        )
    _print(reading)
    finish(
        reading.notes,
        (out, partial(write_frame, reading.to_frame())),
        (plot, figure(reading.plot)),
        (scene, partial(write_scene, reading.scene)),
    )


def _print(reading: "BandReading") -> None:
    screen, frame = current(), reading.quantities_frame()
    shown = frame.assign(
        unit=frame.unit.replace({"degC": "°C", "um": "µm"}),
        interval=list(zip(frame.low, frame.high, strict=True)),
    )
    columns = ["quantity", "unit", "true", "shown", "error"]
    named = {name: name for name in columns} | {"95 % of single frames": "interval"}
    screen.table("reading", shown, named)
    screen.heading()
    screen.table("effects", reading.effects_frame(), title="Error of the peak temperature")
    screen.heading()
    screen.say(f"Single frames differ in: {', '.join(reading.causes)}.")
