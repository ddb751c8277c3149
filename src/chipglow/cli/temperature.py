"""The command ``chipglow temperature``: true temperature of regions of known emissivity."""

from collections.abc import Iterator, Mapping, Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from chipglow.cli.options import Settings, file_option

if TYPE_CHECKING:
    from rich.console import Console

    from chipglow.laboratory.emissivity import (
        KnownEmissivity,
        ReflectedTemperature,
        TrueTemperature,
    )
    from chipglow.laboratory.emissivity.temperature import DeterminedEmissivity

    Emissivities = Mapping[str, DeterminedEmissivity | KnownEmissivity]


FAR: Final = 50.0
"""Difference of temperature in K from which on an emissivity may well be another."""


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
            help="What chipglow emissivity wrote of regions of the same names, NetCDF; or one "
            "emissivity of all regions, such as 0.42.",
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
            help="The camera's calibration, YAML: tells how far its errors are the same in the "
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
    from rich.console import Console

    from chipglow.cli.assumed import say_assumed, say_doubtful, say_of_measurements
    from chipglow.laboratory.emissivity import (
        load_regions,
        true_temperature,
        write_temperature_table,
    )
    from chipglow.laboratory.measurement import load_calibration, load_measurement
    from chipglow.scene import areas

    named = load_regions(regions)
    room = _room(reflected, reflected_uncertainty)
    known = None if calibration is None else load_calibration(calibration)
    measurements = [load_measurement(image, settings or ()) for image in images]
    found = areas(named, measurements[0].raster)
    names = [area.name for area in found]
    emissivities = _emissivities(emissivity, emissivity_uncertainty, names)
    rows = [
        true_temperature(measurements, area, emissivities[area.name], room, known, drift)
        for area in found
        if area.name in emissivities
    ]
    _print(Console(highlight=False, markup=False), rows)
    say_of_measurements(*measurements)
    say_assumed(_assumptions(rows, emissivities, room, drift is None and len(images) == 1))
    say_doubtful(warning for row in rows for warning in row.estimate.warnings)
    say_doubtful(_far_from_the_heating(rows, emissivities))
    if table is not None:
        write_temperature_table(rows, table)
        print(table)


def _emissivities(text: str, spread: float | None, names: Sequence[str]) -> "Emissivities":
    """Emissivities by the names of regions."""
    from chipglow.laboratory.emissivity import KnownEmissivity, read_region_emissivity

    try:
        number = float(text)
    except ValueError:
        if spread is not None:
            raise ValueError(
                "--emissivity-uncertainty: the file tells it, expected none with a file"
            ) from None
        stored = read_region_emissivity(Path(text))
        if not stored.keys() & set(names):
            raise ValueError(
                f"{text}: tells of {', '.join(stored)}, expected one of the regions "
                f"{', '.join(names)}"
            ) from None
        return stored
    return dict.fromkeys(names, KnownEmissivity(number, spread or 0.0))


def _room(reflected: str | None, spread: str | None) -> "ReflectedTemperature | None":
    """What the object reflects, if that is said."""
    from chipglow.laboratory.emissivity import ReflectedTemperature
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_DIFFERENCE

    if reflected is None and spread is None:
        return None
    return ReflectedTemperature(
        parse("--reflected", TEMPERATURE, reflected or "293 K"),
        parse("--reflected-uncertainty", TEMPERATURE_DIFFERENCE, spread or "0 K"),
    )


def _far_from_the_heating(
    rows: "list[TrueTemperature]", emissivities: "Emissivities"
) -> Iterator[str]:
    """Regions whose temperature is another than that at which their emissivity was determined."""
    from chipglow.laboratory.emissivity import KnownEmissivity

    for row in rows:
        known = emissivities[row.name]
        if isinstance(known, KnownEmissivity):
            continue
        difference = abs(float(row.estimate.values) - known.heating.reference)
        if difference > FAR:
            yield (
                f"{row.name}: is {difference:.0f} K from the "
                f"{known.heating.reference - 273.15:.0f} °C "
                "at which its emissivity was determined; what the temperature changes in the "
                "emissivity is not in u."
            )


def _print(console: "Console", rows: "list[TrueTemperature]") -> None:
    from rich.table import Table

    from chipglow.cli.budget import spread_text
    from chipglow.laboratory.emissivity.temperature import TEMPERATURE_BUDGET

    result = Table(
        "region", "pixels", "radiance temperature", "emissivity", "true temperature", "u", "U 95 %",
        "k", box=None,
    )  # fmt: skip
    budget = Table("parts of u / K", *TEMPERATURE_BUDGET, box=None)
    for column in (*result.columns[1:], *budget.columns[1:]):
        column.justify = "right"
    for row in rows:
        found = row.estimate
        result.add_row(
            row.name,
            str(row.pixels),
            f"{row.radiance_temperature - 273.15:.2f} °C",
            f"{row.emissivity:.4f}",
            f"{found.values - 273.15:.2f} °C",
            f"{spread_text(found.standard_uncertainty)} K",
            f"{spread_text(found.expanded_uncertainty())} K",
            f"{found.coverage_factor():.2f}",
        )
        parts = (spread_text(found.contribution(cause)) for cause in TEMPERATURE_BUDGET)
        budget.add_row(row.name, *parts)
    console.print(result)
    console.print()
    console.print(budget)


def _assumptions(
    rows: "list[TrueTemperature]",
    emissivities: "Emissivities",
    room: "ReflectedTemperature | None",
    drift_missing: bool,
) -> Iterator[str]:
    from chipglow.laboratory.emissivity import KnownEmissivity

    known = any(isinstance(one, KnownEmissivity) for one in emissivities.values())
    yield "every region is of uniform temperature and emissivity."
    if not known:
        yield "the emissivity is the same at all temperatures."
    if known and not any(row.estimate.contribution("emissivity") for row in rows):
        yield "the emissivity is exact (--emissivity-uncertainty)."
    if known and room is None:
        yield "the object reflects 293 K exactly (--reflected, --reflected-uncertainty)."
    if not known and room is None:
        yield "the object reflects what it did when its emissivity was determined."
    if not any(row.estimate.contribution("calibration") for row in rows):
        yield "the camera's calibration is exact, as the measurement tells no uncertainty of it."
    elif not known and rows[0].correlation is None:
        yield (
            "the calibration's errors in the emissivity and here are independent, which makes u "
            "too large rather than too small (--calibration)."
        )
    if drift_missing or any(
        isnan(one.estimate.contribution("drift")) for one in emissivities.values()
    ):
        yield (
            "the camera does not drift from one recording to the next: there is one image here or "
            "of the emissivity, which does not show it, and u holds nothing of it (--drift)."
        )
    if any(isnan(row.estimate.contribution("repeatability")) for row in rows):
        yield "nothing changes from frame to frame, as there is one only."
