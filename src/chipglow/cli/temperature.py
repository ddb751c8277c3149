"""The command ``chipglow temperature``: true temperature of regions of known emissivity."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import Settings, argument, file_option, option

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.emissivity import (
        EmissivityLine,
        ReflectedTemperature,
        RegionTemperatures,
    )


def temperature(
    images: Annotated[
        list[Path], argument("IMAGE...", "Measurements of the object, taken as repetitions.")
    ],
    regions: Annotated[Path, option("FILE", "Regions of the image, a YAML file.")],
    emissivity: Annotated[
        str,
        option(
            "FILE|NUMBER",
            "Output of chipglow emissivity for regions of the same names (NetCDF), or one "
            "emissivity for all, e.g. 0.42.",
        ),
    ],
    emissivity_uncertainty: Annotated[
        float | None, option("NUMBER", "Standard uncertainty of an emissivity given as number.")
    ] = None,
    calibration: Annotated[
        Path | None,
        option(
            "FILE",
            "Calibration of the camera, YAML. It states how its errors in the emissivity and in "
            "these images are correlated.",
        ),
    ] = None,
    reflected: Annotated[
        str | None,
        option(
            "TEMPERATURE",
            "Temperature of the surroundings that the object reflects. Default: as in the "
            "determination of the emissivity, with the same error, or 293 K.",
        ),
    ] = None,
    reflected_uncertainty: Annotated[
        str | None,
        option("KELVINS", "Standard uncertainty of the reflected temperature, e.g. '2 K'."),
    ] = None,
    drift: Annotated[
        float | None,
        option(
            "NUMBER",
            "Relative standard uncertainty of the radiance between recordings, e.g. 0.01. "
            "Default: from several images.",
        ),
    ] = None,
    table: Annotated[Path | None, file_option("Write the table of regions, CSV.")] = None,
    settings: Settings = None,
) -> None:
    """Determine the true temperature of regions of known emissivity."""
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
) -> "EmissivityLine | dict[str, EmissivityLine]":
    """One emissivity, or those of a file."""
    from chipglow.laboratory.emissivity import EmissivityLine, read_emissivity_lines

    try:
        number = float(text)
    except ValueError:
        if uncertainty is not None:
            raise ValueError(
                "--emissivity-uncertainty: the file states it, expected none with a file"
            ) from None
        return read_emissivity_lines(Path(text))
    return EmissivityLine.constant(number, uncertainty or 0.0)


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
    columns = {
        "region": "region",
        "pixels": "pixels",
        "radiance temperature / °C": "radiance_temperature_degC",
        "emissivity": "emissivity",
        "true temperature ± u / °C": "true_temperature_degC ± standard_uncertainty",
        "U 95 % / K": "expanded_uncertainty",
        "k": "coverage_factor",
    }
    screen.table("regions", rows, columns)
    screen.heading()
    parts = {cause: f"{cause}_uncertainty" for cause in TEMPERATURE_BUDGET}
    screen.table(None, rows, {"parts of u / K": "region"} | parts)
