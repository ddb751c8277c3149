"""The command ``chipglow correct``: the true temperature of every pixel."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from chipglow.cli import options as opt
from chipglow.cli.chip import chosen_frames
from chipglow.cli.emissivity import emissivities_of, origin_of
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.camera import Measurement, PSFChoice
    from chipglow.correction import Correction
    from chipglow.laboratory.emissivity import PlacesDescription
    from chipglow.surface import Origin


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
        str | None,
        opt.value(
            "FILE|CAMERA",
            "Point spread function, output of chipglow psf (NetCDF), or that of a camera by its "
            "name (chipglow cameras), from its aperture. Default: as the file of the regions "
            "states.",
        ),
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
        float | None,
        opt.value(
            "NUMBER",
            "Relative standard uncertainty of the width of the point spread function, e.g. 0.03. "
            "Default: as the file of the regions states, otherwise none.",
        ),
    ] = None,
    outline_uncertainty: Annotated[
        float | None,
        opt.length(
            "Standard uncertainty of the position of the outlines, e.g. '3 um'. If given, the "
            "position is estimated from the image. Default: as the file of the regions states, "
            "that of a found tool, otherwise none."
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
    from chipglow.laboratory.chip.tool_choice import with_chosen_tool
    from chipglow.laboratory.emissivity import load_places
    from chipglow.laboratory.recordings import load_measurement
    from chipglow.study.measured_corrections import misfit_notes

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
                psf_uncertainty=psf_uncertainty or 0.0,
                outline_uncertainty=outline_uncertainty or 0.0,
                noise=noise,
                progress=progress,
            )
        else:
            chosen = tool or _stated(described, "tool")
            measurement, notes, found = with_chosen_tool(measurement, chosen)
            stated = _stated(described, "outline_uncertainty")
            outlines = (one for one in (outline_uncertainty, stated, found) if one is not None)
            if psf_uncertainty is None:
                psf_uncertainty = _stated(described, "psf_uncertainty")
            result = _corrected(
                measurement,
                _psf(psf, described, measurement),
                described,
                known,
                emissivity_uncertainty,
                psf_uncertainty=psf_uncertainty or 0.0,
                outline_uncertainty=next(outlines),
                noise=noise,
                progress=partial(progress, "correction"),
            ).with_notes(notes)
    table_of_places = place_frame(result, places_of(result, measurement, named))
    _print(result, table_of_places)
    finish(
        measurement.notes + result.notes + misfit_notes(result),
        (out, partial(write_correction, result)),
        (table, partial(write_frame, table_of_places)),
        (plot, figure(draw_correction, result, measurement)),
    )


def _check_options(
    study: Path | None,
    psf: str | None,
    known: "dict[str, Any]",
    described: "PlacesDescription | None",
) -> None:
    """Raise a ValueError if options lack each other or exclude each other."""
    if study is None and psf is None and _stated(described, "psf") is None:
        raise ValueError("--psf: is missing; give --psf with --emissivity, or --study")
    given = [name for name, value in known.items() if value is not None]
    if study is not None:
        for name in ["--psf"] if psf is not None else given:
            raise ValueError(
                f"--study: cannot be combined with {name}, as the study states camera and surface"
            )
        return
    stated = described is not None and described.states_emissivity
    if known["--emissivity"] is None and known["--map"] is None and not stated:
        raise ValueError("--emissivity: give a file of chipglow emissivity, or a number; or --map")
    if known["--map"] is not None:
        for name in [one for one in ("--emissivity", "--elsewhere") if one in given]:
            raise ValueError(f"--map: cannot be combined with {name}, as it states each pixel's")


def _frames(measurement: "Measurement", frame: str) -> "Measurement":
    from chipglow.camera import Measurement

    frames = chosen_frames(measurement, frame, None)
    return measurement if frames is None else Measurement(measurement.data.isel(time=frames))


def _stated(described: "PlacesDescription | None", name: str) -> Any:
    """Return what the file of the regions states; None without one."""
    return None if described is None else getattr(described, name)


def _psf(
    name: str | None, described: "PlacesDescription | None", measurement: "Measurement"
) -> "PSFChoice":
    """Return the point spread function of the option, or else of the file of the regions."""
    from chipglow.study.measured_corrections import psf_choice

    if name is not None:
        return psf_choice(name, measurement.raster.spacing)
    psf: PSFChoice = _stated(described, "psf")
    return psf


def _corrected(
    measurement: "Measurement",
    psf: "PSFChoice",
    described: "PlacesDescription | None",
    known: "dict[str, Any]",
    emissivity_uncertainty: float | None,
    **settings: Any,
) -> "Correction":
    """Correct a measurement with emissivities of the laboratory."""
    from chipglow.laboratory import emissivity as lab
    from chipglow.study.measured_corrections import correct_measured

    file, elsewhere = known["--map"] or known["--emissivity"], known["--elsewhere"]
    places = () if described is None else described.places()
    regions = tuple(place for place in places if place.has_area)
    if described is not None:
        settings["surroundings"] = described.surroundings()
    if known["--reflected"] is not None or known["--reflected-uncertainty"] is not None:
        settings["surroundings"] = lab.reflected_temperature(
            known["--reflected"] or lab.LABORATORY, known["--reflected-uncertainty"] or 0.0
        )
    if known["--map"] is not None:
        emissivities: Any = lab.read_emissivity_map(file)
        origin: Origin | None = lab.read_origin(file)
    else:
        emissivities = emissivities_of(file, emissivity_uncertainty, described)
        origin = origin_of(file, described)
    if file is None and described is not None:
        regions, elsewhere = described.zones(), elsewhere or described.elsewhere
    result = correct_measured(
        measurement, psf, emissivities, regions, measurement.tool, elsewhere=elsewhere, **settings
    )
    return result.with_notes(lab.doubts(origin, [measurement]))


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
