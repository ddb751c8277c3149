"""The command ``chipglow correct``: the true temperature of every pixel."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.camera import Measurement
    from chipglow.correction import Correction, Zone


def correct(
    image: Annotated[Path, opt.argument("IMAGE", "Measurement or camera file.")],
    study: Annotated[
        Path | None,
        opt.value(
            "STUDY",
            "Study that states camera and surface, and whose scene is the object. For images of a "
            "real object, give --psf and --emissivity instead.",
        ),
    ] = None,
    psf: Annotated[
        Path | None, opt.value("FILE", "Point spread function, output of chipglow psf (NetCDF).")
    ] = None,
    emissivity: Annotated[
        str | None,
        opt.value(
            "FILE|NUMBER",
            "Output of chipglow emissivity with the names of the regions, and 'tool' for a tool "
            "(NetCDF), or one emissivity for all, e.g. 0.42.",
        ),
    ] = None,
    regions: Annotated[
        Path | None, opt.value("FILE", "Regions of the image with their own emissivity, YAML.")
    ] = None,
    elsewhere: Annotated[
        str | None,
        opt.value("NAME", "Emissivity outside the regions. Default: not determined there."),
    ] = None,
    tool: opt.ToolChoice = None,
    emissivity_uncertainty: Annotated[
        float, opt.value("NUMBER", "Standard uncertainty of an emissivity that states none.")
    ] = 0.0,
    psf_uncertainty: Annotated[
        float,
        opt.value(
            "NUMBER",
            "Relative standard uncertainty of the width of the point spread function, e.g. 0.03.",
        ),
    ] = 0.0,
    outline_uncertainty: Annotated[
        float,
        opt.length(
            "Standard uncertainty of the position of the outlines, e.g. '3 um'. If given, the "
            "position is estimated from the image."
        ),
    ] = 0.0,
    reflected: Annotated[
        float | None, opt.temperature("Temperature of the reflected surroundings. Default: 293 K.")
    ] = None,
    reflected_uncertainty: opt.ReflectedUncertainty = None,
    noise: Annotated[
        float | None,
        opt.kelvins(
            "Standard deviation of the noise at 600 K, e.g. '0.5 K'. Default: as the measurement "
            "states, or estimated from the image."
        ),
    ] = None,
    out: Annotated[
        Path | None, opt.file("Write temperatures and intervals, NetCDF.", ".nc")
    ] = None,
    table: Annotated[Path | None, opt.file("Write the table of places, CSV.")] = None,
    plot: Annotated[Path | None, opt.picture("Draw measured and corrected temperature")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine the true temperature of every pixel, with its uncertainty."""
    from chipglow.cli.progress import progress_bars
    from chipglow.correction import place_frame, places_of, write_correction
    from chipglow.correction.figure import draw_correction
    from chipglow.io.result_file import write_frame
    from chipglow.laboratory.emissivity import load_regions, reflected_temperature
    from chipglow.laboratory.recordings import load_measurement

    if study is None and psf is None:
        raise ValueError("--psf: is missing; give --psf with --emissivity, or --study")
    if study is not None and psf is not None:
        raise ValueError("--study: cannot be combined with --psf, as the study states the camera")
    measurement = load_measurement(image, settings or ())
    with progress_bars() as progress:
        progress("correction", 0.0)
        if study is not None:
            from chipglow.study import correct_study, load_study

            result = correct_study(
                load_study(study),
                measurement,
                emissivity_uncertainty=emissivity_uncertainty,
                psf_uncertainty=psf_uncertainty,
                outline_uncertainty=outline_uncertainty,
                noise=noise,
                progress=progress,
            )
        else:
            result = _corrected(
                measurement,
                Path(str(psf)),
                _zones(measurement, emissivity, emissivity_uncertainty, regions, elsewhere, tool),
                psf_uncertainty=psf_uncertainty,
                outline_uncertainty=outline_uncertainty,
                surroundings=reflected_temperature(
                    293.0 if reflected is None else reflected, reflected_uncertainty or 0.0
                ),
                noise=noise,
                progress=partial(progress, "correction"),
            )
    named = () if regions is None else load_regions(regions)
    frame = place_frame(result, places_of(result, measurement, named))
    _print(result, frame)
    finish(
        measurement.notes + result.notes,
        (out, partial(write_correction, result)),
        (table, partial(write_frame, frame)),
        (plot, figure(draw_correction, result, measurement)),
    )


def _zones(
    measurement: "Measurement",
    emissivity: str | None,
    uncertainty: float,
    regions: Path | None,
    elsewhere: str | None,
    tool: str | None,
) -> "tuple[Zone, ...]":
    """Return the zones that the options describe."""
    from chipglow.cli.tool_choice import chosen_tool
    from chipglow.correction import known_zones
    from chipglow.laboratory import emissivity as lab

    if emissivity is None:
        raise ValueError("--emissivity: give a file of chipglow emissivity, or a number")
    lines: Any
    if emissivity.replace(".", "", 1).isdigit():
        lines = lab.EmissivityLine.constant(float(emissivity), uncertainty)
    else:
        lines = lab.read_emissivity_lines(Path(emissivity))
    named = () if regions is None else lab.load_regions(regions)
    cutter = measurement.tool if tool is None else chosen_tool(measurement, tool)[0]
    return known_zones(lines, named, cutter, elsewhere)


def _corrected(
    measurement: "Measurement", psf: Path, zones: "tuple[Zone, ...]", **settings: Any
) -> "Correction":
    """Correct a measurement with a point spread function from a file."""
    from chipglow.camera import Camera, MeasuredPSFFile
    from chipglow.correction import correct as correct_measurement

    band = measurement.band
    camera = Camera(
        band=band,
        pitch=measurement.raster.spacing,
        psf=MeasuredPSFFile(str(psf)).for_camera(band, None),
    )
    return correct_measurement(measurement, camera, zones, **settings)


def _print(result: "Correction", frame: "pd.DataFrame") -> None:
    from chipglow.quantities import ZERO_CELSIUS

    screen = current()
    columns = {
        "place": "place",
        "pixels": "pixels",
        "measured / °C": "measured_degC",
        "true temperature ± u / °C": "true_temperature_degC ± standard_uncertainty_K",
        "U 95 % / K": "expanded_uncertainty_K",
        "largest contributions to u / K": "contributions",
    }
    shown = frame.assign(
        measured_degC=frame.measured_K - ZERO_CELSIUS,
        true_temperature_degC=frame.true_temperature_K - ZERO_CELSIUS,
    )
    screen.table("places", shown, columns)
    screen.say(f"Misfit: {float(result.data['misfit'].mean()):.2g} (expected 1 or less).")
