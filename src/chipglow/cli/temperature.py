"""The command ``chipglow temperature``: true temperature of regions of known emissivity."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, finish

if TYPE_CHECKING:
    from chipglow.laboratory import emissivity as lab


def temperature(
    images: Annotated[
        list[Path], opt.argument("IMAGE...", "Measurements of the object, taken as repetitions.")
    ],
    regions: opt.RegionsFile,
    emissivity: Annotated[
        str,
        opt.value(
            "FILE|NUMBER",
            "Output of chipglow emissivity for regions of the same names (NetCDF), or one "
            "emissivity for all, e.g. 0.42.",
        ),
    ],
    emissivity_uncertainty: Annotated[
        float | None, opt.value("NUMBER", "Standard uncertainty of an emissivity given as number.")
    ] = None,
    calibration: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Calibration of the camera, YAML. It states how its errors in the emissivity and in "
            "these images are correlated.",
        ),
    ] = None,
    reflected: Annotated[
        float | None,
        opt.temperature(
            "Temperature of the surroundings that the object reflects. Default: as in the "
            "determination of the emissivity, with the same error, or 293 K.",
        ),
    ] = None,
    reflected_uncertainty: opt.ReflectedUncertainty = None,
    drift: opt.Drift = None,
    table: Annotated[Path | None, opt.file("Write the table of regions, CSV.")] = None,
    settings: opt.Settings = None,
) -> None:
    """Determine the true temperature of regions of known emissivity."""
    from chipglow.laboratory import emissivity as lab
    from chipglow.laboratory.measurement import load_calibration, load_measurement
    from chipglow.laboratory.result_file import write_frame

    named = lab.load_regions(regions)
    surroundings = None
    if reflected is not None or reflected_uncertainty is not None:
        surroundings = lab.reflected_temperature(reflected or 293.0, reflected_uncertainty or 0.0)
    fitted = None if calibration is None else load_calibration(calibration)
    measurements = [load_measurement(image, settings or ()) for image in images]
    lines = _emissivities(emissivity, emissivity_uncertainty)
    names = list(map(str, images))
    result = lab.true_temperatures(measurements, named, lines, surroundings, fitted, drift, names)
    _print(result)
    notes = sum((one.notes for one in measurements), result.notes)
    finish(notes, (table, partial(write_frame, result.to_frame())))


def _emissivities(
    text: str, uncertainty: float | None
) -> "lab.EmissivityLine | dict[str, lab.EmissivityLine]":
    from chipglow.laboratory import emissivity as lab

    try:
        number = float(text)
    except ValueError:
        if uncertainty is not None:
            raise ValueError(
                "--emissivity-uncertainty: the file states it, expected none with a file"
            ) from None
        return lab.read_emissivity_lines(Path(text))
    return lab.EmissivityLine.constant(number, uncertainty or 0.0)


def _print(result: "lab.RegionTemperatures") -> None:
    from chipglow.laboratory.emissivity.temperature import TEMPERATURE_BUDGET

    screen, rows = current(), result.to_frame()
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
