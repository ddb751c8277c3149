"""The command ``chipglow temperature``: true temperature of regions of known emissivity."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import Settings, file_option

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.emissivity import (
        AreaEmissivity,
        EmissivityLine,
        KnownEmissivity,
        ReflectedTemperature,
        RegionTemperatures,
    )


def temperature(
    images: Annotated[
        list[Path],
        typer.Argument(metavar="IMAGE...", help="Measurements of the object; repetitions."),
    ],
    regions: Annotated[
        Path, typer.Option(metavar="FILE", help="The regions of the image, a YAML file.")
    ],
    emissivity: Annotated[
        str,
        typer.Option(
            metavar="FILE|NUMBER",
            help="What chipglow emissivity wrote of regions of the same names, NetCDF, of several "
            "true temperatures the line over them; or one emissivity of all, such as 0.42.",
        ),
    ],
    emissivity_uncertainty: Annotated[
        float | None,
        typer.Option(metavar="NUMBER", help="Its standard uncertainty, if it is a number."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="The camera's calibration, YAML: says how far its errors are the same in the "
            "emissivity and here.",
        ),
    ] = None,
    reflected: Annotated[
        str | None,
        typer.Option(
            metavar="TEMPERATURE",
            help="Temperature of the surroundings that the object reflects; by default those in "
            "which the emissivity was determined, with the same error, or 293 K.",
        ),
    ] = None,
    reflected_uncertainty: Annotated[
        str | None,
        typer.Option(metavar="KELVINS", help="Its standard uncertainty, such as '2 K'."),
    ] = None,
    drift: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Relative standard uncertainty of the radiance from one recording to the next, "
            "such as 0.01; by default what several images show.",
        ),
    ] = None,
    table: Annotated[Path | None, file_option("Write the table of regions, CSV.")] = None,
    settings: Settings = None,
) -> None:
    """Determine the true temperature of regions whose emissivity is known."""
    from chipglow.cli.finish import finish
    from chipglow.cli.screen import current
    from chipglow.laboratory.emissivity import load_regions, true_temperatures
    from chipglow.laboratory.measurement import load_calibration, load_measurement
    from chipglow.laboratory.result_file import write_frame

    named = load_regions(regions)
    surroundings = _surroundings(reflected, reflected_uncertainty)
    known = None if calibration is None else load_calibration(calibration)
    measurements = [load_measurement(image, settings or ()) for image in images]
    given = _emissivities(emissivity, emissivity_uncertainty)
    names = list(map(str, images))
    found = true_temperatures(measurements, named, given, surroundings, known, drift, names)
    _print(current(), found)
    notes = sum((one.notes for one in measurements), found.notes)
    finish(notes, (table, partial(write_frame, found.to_frame())))


def _emissivities(
    text: str, uncertainty: float | None
) -> "KnownEmissivity | dict[str, AreaEmissivity] | dict[str, EmissivityLine]":
    """One emissivity, or those of a file."""
    from chipglow.laboratory.emissivity import KnownEmissivity, read_region_emissivity

    try:
        number = float(text)
    except ValueError:
        if uncertainty is not None:
            raise ValueError(
                "--emissivity-uncertainty: the file states it, expected none with a file"
            ) from None
        return read_region_emissivity(Path(text))
    return KnownEmissivity(number, uncertainty or 0.0)


def _surroundings(reflected: str | None, uncertainty: str | None) -> "ReflectedTemperature | None":
    """What the object reflects, if that is said."""
    from chipglow.laboratory.emissivity import ReflectedTemperature
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_DIFFERENCE

    if reflected is None and uncertainty is None:
        return None
    return ReflectedTemperature(
        parse("--reflected", TEMPERATURE, reflected or "293 K"),
        parse("--reflected-uncertainty", TEMPERATURE_DIFFERENCE, uncertainty or "0 K"),
    )


def _print(screen: "Screen", found: "RegionTemperatures") -> None:
    from chipglow.laboratory.emissivity.temperature import TEMPERATURE_BUDGET

    rows = found.to_frame()
    for name in ("radiance_temperature", "true_temperature"):
        rows[f"{name}_degC"] = rows[name] - 273.15
    columns = ["region", "pixels", "radiance_temperature_degC", "emissivity"]
    columns += ["true_temperature_degC ± standard_uncertainty"]
    columns += ["expanded_uncertainty", "coverage_factor"]
    screen.table("regions", rows, columns)
    screen.heading()
    parts = {cause: f"{cause}_uncertainty" for cause in TEMPERATURE_BUDGET}
    screen.table(None, rows, {"parts of u / K": "region"} | parts)
