"""The command ``chipglow correct``: the true temperature of every pixel."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from chipglow.cli import options as opt
from chipglow.cli.chip import chosen_frames
from chipglow.cli.emissivity import doubts, emissivities_of, origin_of
from chipglow.cli.screen import current, figure, finish

_LARGEST_MISFIT: Final = 4.0
"""Misfit above which the residuals are more than twice the noise: not by chance."""

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.camera import Camera, Measurement
    from chipglow.correction import Correction
    from chipglow.laboratory.emissivity import PlacesDescription
    from chipglow.text import Notes


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
            "(NetCDF), or one emissivity for all, e.g. 0.42. Default: as the file of the regions "
            "states.",
        ),
    ] = None,
    emissivity_map: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Emissivity of every pixel, instead of --emissivity: output of chipglow emissivity for "
            "images of the same camera at the same place (NetCDF).",
            "--map",
        ),
    ] = None,
    regions: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Regions of the image with their own emissivity, YAML; with --study only places.",
        ),
    ] = None,
    elsewhere: Annotated[
        str | None,
        opt.value("NAME", "Emissivity outside the regions. Default: not determined there."),
    ] = None,
    tool: opt.ToolChoice = None,
    emissivity_uncertainty: Annotated[
        float | None, opt.value("NUMBER", "Standard uncertainty of an emissivity that states none.")
    ] = None,
    psf_uncertainty: Annotated[
        float,
        opt.value(
            "NUMBER",
            "Relative standard uncertainty of the width of the point spread function, e.g. 0.03.",
        ),
    ] = 0.0,
    outline_uncertainty: Annotated[
        float | None,
        opt.length(
            "Standard uncertainty of the position of the outlines, e.g. '3 um'. If given, the "
            "position is estimated from the image. Default: that of a found tool, otherwise none."
        ),
    ] = None,
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
    frame: Annotated[str, opt.value("N|all", "Index of the frame, or all.")] = "all",
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
    from chipglow.laboratory.emissivity import load_places
    from chipglow.laboratory.recordings import load_measurement

    known = {
        "--emissivity": emissivity,
        "--map": emissivity_map,
        "--elsewhere": elsewhere,
        "--tool": tool,
        "--reflected": reflected,
        "--reflected-uncertainty": reflected_uncertainty,
    }
    described = None if regions is None else load_places(regions)
    _check_options(study, psf, known, described)
    measurement = _frames(load_measurement(image, settings or ()), frame)
    named = () if described is None else described.places()
    with progress_bars() as progress:
        progress("correction", 0.0)
        if study is not None:
            from chipglow.study import correct_study, load_study

            result = correct_study(
                load_study(study),
                measurement,
                emissivity_uncertainty=emissivity_uncertainty or 0.0,
                psf_uncertainty=psf_uncertainty,
                outline_uncertainty=outline_uncertainty or 0.0,
                noise=noise,
                progress=progress,
            )
        else:
            measurement, notes, found = _with_tool(measurement, tool)
            camera, stated = _camera(measurement, Path(str(psf)))
            result = _corrected(
                measurement,
                camera,
                described,
                known,
                emissivity_uncertainty,
                psf_uncertainty=psf_uncertainty,
                outline_uncertainty=found if outline_uncertainty is None else outline_uncertainty,
                noise=noise,
                progress=partial(progress, "correction"),
            ).with_notes(notes + stated)
    table_of_places = place_frame(result, places_of(result, measurement, named))
    _print(result, table_of_places)
    finish(
        measurement.notes + result.notes + _doubts(result),
        (out, partial(write_correction, result)),
        (table, partial(write_frame, table_of_places)),
        (plot, figure(draw_correction, result, measurement)),
    )


def _check_options(
    study: Path | None,
    psf: Path | None,
    known: "dict[str, Any]",
    described: "PlacesDescription | None",
) -> None:
    """Raise a ValueError if options lack each other or exclude each other."""
    if study is None and psf is None:
        raise ValueError("--psf: is missing; give --psf with --emissivity, or --study")
    given = [name for name, value in known.items() if value is not None]
    if study is not None:
        for name in ["--psf"] if psf is not None else given:
            raise ValueError(
                f"--study: cannot be combined with {name}, as the study states camera and surface"
            )
        return
    stated = described is not None and described.emissivities
    if known["--emissivity"] is None and known["--map"] is None and not stated:
        raise ValueError("--emissivity: give a file of chipglow emissivity, or a number; or --map")
    if known["--map"] is not None:
        for name in [one for one in ("--emissivity", "--elsewhere") if one in given]:
            raise ValueError(f"--map: cannot be combined with {name}, as it states each pixel's")


def _frames(measurement: "Measurement", frame: str) -> "Measurement":
    from chipglow.camera import Measurement

    frames = chosen_frames(measurement, frame, None)
    return measurement if frames is None else Measurement(measurement.data.isel(time=frames))


def _with_tool(measurement: "Measurement", tool: str | None) -> "tuple[Measurement, Notes, float]":
    """Return the measurement with the chosen tool, and its standard uncertainty in m if found."""
    from chipglow.cli.tool_choice import chosen_tool
    from chipglow.text import Notes

    if tool is None:
        return measurement, Notes(), 0.0
    chosen, known, notes = chosen_tool(measurement, tool)
    return measurement.with_tool(chosen), notes, 0.0 if known is None else known.across


def _camera(measurement: "Measurement", psf: Path) -> "tuple[Camera, Notes]":
    """Return a camera with the measurement's band and pixels, and a function from a file."""
    from chipglow.camera import Camera, MeasuredPSFFile
    from chipglow.text import Notes

    choice, band, notes = MeasuredPSFFile(str(psf)), measurement.band, Notes()
    if choice.psf.band is None:
        notes = Notes([f"{psf} states no band: it was measured in that of the image."])
    camera = Camera(
        band=band,
        pitch=measurement.raster.spacing,
        fill_factor=float(measurement.data.attrs.get("fill_factor", 1.0)),
        psf=choice.for_camera(band, None),
    )
    return camera, notes


def _corrected(
    measurement: "Measurement",
    camera: "Camera",
    described: "PlacesDescription | None",
    known: "dict[str, Any]",
    emissivity_uncertainty: float | None,
    **settings: Any,
) -> "Correction":
    """Correct a measurement with emissivities of the laboratory."""
    from chipglow.correction import correct_known, correct_mapped, known_parts
    from chipglow.laboratory import emissivity as lab

    tool, file = measurement.tool, known["--map"] or known["--emissivity"]
    places = () if described is None else described.places()
    regions = tuple(place for place in places if place.has_area)
    if described is not None:
        settings["surroundings"] = described.surroundings()
    if known["--reflected"] is not None or known["--reflected-uncertainty"] is not None:
        settings["surroundings"] = lab.reflected_temperature(
            known["--reflected"] or lab.LABORATORY, known["--reflected-uncertainty"] or 0.0
        )
    if known["--map"] is not None:
        shapes: tuple[Any, ...] = regions if tool is None else (*regions, tool)
        result = correct_mapped(
            measurement, camera, lab.read_emissivity_map(file), shapes, **settings
        )
        return result.with_notes(doubts(lab.read_origin(file), [measurement]))
    lines = emissivities_of(file, emissivity_uncertainty, described)
    parts = known_parts(lines, regions, tool, known["--elsewhere"])
    result = correct_known(measurement, camera, parts, **settings)
    return result.with_notes(doubts(origin_of(file), [measurement]))


def _doubts(result: "Correction") -> "Notes":
    """Warn of frames that the zones and the point spread function do not explain."""
    from chipglow.text import Notes

    worst = float(result.data["misfit"].max())
    if worst <= _LARGEST_MISFIT:
        return Notes()
    return Notes(
        warnings=[
            f"The corrected image differs from the measured one by {worst**0.5:.2g} times the "
            "noise: an outline, an emissivity or the point spread function is wrong, or the noise "
            "is larger than assumed. The intervals do not contain this."
        ]
    )


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
    if result.data.sizes["time"] > 1:
        columns = {"time / s": "time_s", **columns}
    shown = frame.assign(
        measured_degC=frame.measured_K - ZERO_CELSIUS,
        true_temperature_degC=frame.true_temperature_K - ZERO_CELSIUS,
    )
    screen.table("places", shown, columns)
    screen.say(f"Misfit: {float(result.data['misfit'].mean()):.2g} (expected 1 or less).")
