"""The command ``chipglow emissivity``: emissivity from images of heated objects."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import Settings, file_option, picture_option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from chipglow.camera import Measurement
    from chipglow.laboratory.emissivity import (
        EmissivityLine,
        EmissivityMap,
        Heating,
        RegionEmissivity,
    )


def emissivity(
    images: Annotated[
        list[Path],
        typer.Argument(metavar="IMAGE...", help="Measurements of the heated object."),
    ],
    reference: Annotated[
        list[str],
        typer.Option(
            metavar="TEMPERATURE",
            help="True temperature of the object, such as 391degC: once for all images, or once "
            "for each in their order. Images at one temperature are repetitions.",
        ),
    ],
    regions: Annotated[
        Path, typer.Option(metavar="FILE", help="The regions of the image, a YAML file.")
    ],
    reflected: Annotated[
        str,
        typer.Option(
            metavar="TEMPERATURE", help="Temperature of the surroundings that the object reflects."
        ),
    ] = "293 K",
    reference_uncertainty: Annotated[
        str | None,
        typer.Option(metavar="KELVINS", help="Its standard uncertainty, such as '2 K'."),
    ] = None,
    reflected_uncertainty: Annotated[
        str | None,
        typer.Option(metavar="KELVINS", help="Standard uncertainty of the surroundings'."),
    ] = None,
    camera_uncertainty: Annotated[
        str | None,
        typer.Option(
            metavar="KELVINS",
            help="Standard uncertainty of radiance temperatures from the camera's calibration; "
            "by default that which the measurement tells.",
        ),
    ] = None,
    drift: Annotated[
        float | None,
        typer.Option(
            metavar="NUMBER",
            help="Relative standard uncertainty of the radiance from one recording to the next, "
            "such as 0.01; by default what several images at one temperature show.",
        ),
    ] = None,
    out: Annotated[Path | None, file_option("Write maps and regions, NetCDF.")] = None,
    table: Annotated[Path | None, file_option("Write the table of regions, CSV.")] = None,
    plot: Annotated[Path | None, picture_option("Draw image, regions and map")] = None,
    settings: Settings = None,
) -> None:
    """Determine emissivity from images of an object of known temperature."""
    from rich.console import Console

    from chipglow.cli.assumed import say_assumed, say_doubtful, say_of_measurements
    from chipglow.laboratory.emissivity import determine_emissivity, emissivity_line, load_regions
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.scene import areas, shared_pixels

    heatings = _heatings(
        images, reference, reflected, reference_uncertainty, reflected_uncertainty,
        camera_uncertainty, drift,
    )  # fmt: skip
    named = load_regions(regions)
    measurements = [load_measurement(image, settings or ()) for image in images]
    _check_same_pixels(images, measurements)
    groups: dict[Heating, list[Measurement]] = {}
    for measurement, heating in zip(measurements, heatings, strict=True):
        groups.setdefault(heating, []).append(measurement)
    maps = [determine_emissivity(group, heating) for heating, group in groups.items()]
    found = areas(named, maps[0].raster)
    rows = [[one.of(area) for area in found] for one in maps]
    lines = [emissivity_line(of) for of in zip(*rows, strict=True)] if len(maps) > 1 else []
    console = Console(highlight=False, markup=False)
    _print_tables(console, rows, lines)
    console.print()
    say_of_measurements(*measurements)
    say_assumed(_assumptions(maps))
    say_assumed(
        f"{one} and {other} share {count} pixels, which count in both."
        for (one, other), count in shared_pixels(named, maps[0].raster).items()
    )
    say_doubtful(_doubts(rows))
    _print_study(console, rows)
    _write(maps, rows, out, table)
    if plot is not None:
        from chipglow.cli.pictures import write_picture
        from chipglow.laboratory.emissivity.figure import draw_emissivity

        whole = [line for line, area in zip(lines, found, strict=False) if area.whole]
        write_picture(draw_emissivity(maps[0], named, whole), plot)


def _heatings(
    images: list[Path],
    references: list[str],
    reflected: str,
    reference_uncertainty: str | None,
    reflected_uncertainty: str | None,
    camera_uncertainty: str | None,
    drift: float | None,
) -> "list[Heating]":
    """How the object was heated for each image."""
    from chipglow.laboratory.emissivity import Heating
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import TEMPERATURE, TEMPERATURE_DIFFERENCE

    if len(references) not in (1, len(images)):
        raise ValueError(
            f"--reference: {len(references)} temperatures for {len(images)} images, "
            "expected one for all or one for each"
        )

    def spread(option: str, text: str | None) -> float | None:
        return parse(option, TEMPERATURE_DIFFERENCE, text)

    return [
        Heating(
            parse("--reference", TEMPERATURE, text),
            parse("--reflected", TEMPERATURE, reflected),
            spread("--reference-uncertainty", reference_uncertainty) or 0.0,
            spread("--reflected-uncertainty", reflected_uncertainty) or 0.0,
            spread("--camera-uncertainty", camera_uncertainty),
            drift,
        )
        for text in (references if len(references) > 1 else references * len(images))
    ]


def _check_same_pixels(images: list[Path], measurements: "list[Measurement]") -> None:
    for image, measurement in zip(images, measurements, strict=True):
        if measurement.raster != measurements[0].raster:
            raise ValueError(
                f"{image}: has other pixels than {images[0]}, "
                "expected images of one camera that see the same place"
            )


def _print_tables(
    console: "Console", rows: "list[list[RegionEmissivity]]", lines: "list[EmissivityLine]"
) -> None:
    from rich.table import Table

    from chipglow.cli.budget import spread_text
    from chipglow.laboratory.emissivity.emissivity import BUDGET

    for of in rows:
        console.print(f"\nObject at {of[0].heating.reference - 273.15:.6g} °C")
        result = Table("region", "pixels", "mean", "sd of pixels", "u", "U 95 %", "k", box=None)
        budget = Table(
            "parts of u", *BUDGET, box=None,
        )  # fmt: skip
        for column in (*result.columns[1:], *budget.columns[1:]):
            column.justify = "right"
        for row in of:
            found = row.estimate
            spread = found.standard_uncertainty, found.expanded_uncertainty()
            result.add_row(
                row.name,
                str(row.pixels),
                f"{row.mean:.4f}",
                *map(spread_text, (row.deviation, *spread)),
                f"{found.coverage_factor():.2f}",
            )
            budget.add_row(row.name, *(spread_text(found.contribution(cause)) for cause in BUDGET))
        console.print(result)
        console.print()
        console.print(budget)
    if lines:
        console.print("\nOver the temperature, with standard uncertainties")
        table = Table("region", "emissivity", "at", "change in 100 K", "sd about line", box=None)
        for line in lines:
            middle, slope = line.estimate.values
            of_middle, of_slope = line.estimate.standard_uncertainty
            table.add_row(
                line.name,
                f"{middle:.4f} ± {spread_text(of_middle)}",
                f"{line.middle - 273.15:.6g} °C",
                f"{100 * slope:+.4f} ± {spread_text(100 * of_slope)}",
                spread_text(line.residual),
            )
        console.print(table)


def _assumptions(maps: "list[EmissivityMap]") -> "Iterator[str]":
    heating = maps[0].heating
    if not heating.reference_uncertainty:
        yield "the true temperature is exact (--reference-uncertainty)."
    if not heating.reflected_uncertainty:
        yield (
            f"the object reflects just {heating.reflected - 273.15:.4g} degC; reflected apparent "
            f"temperature 100 K higher would make {_of_reflected(maps[0]):+.2g} of the emissivity "
            "(--reflected, --reflected-uncertainty)."
        )
    if heating.drift is None and any(one.recordings == 1 for one in maps):
        yield (
            "the camera does not drift from one recording to the next: there is one image, which "
            "does not show it, and u holds nothing of it (--drift)."
        )
    if any(one.calibration is None for one in maps):
        yield (
            "the camera's calibration is exact, as the measurement tells no uncertainty of it "
            "(--camera-uncertainty)."
        )
    if any(one.observations == 1 for one in maps):
        yield (
            "nothing changes from frame to frame, as there is one only; noise is at most the "
            "spread over the pixels."
        )


def _of_reflected(one: "EmissivityMap") -> float:
    """Change of the mean emissivity if what is reflected is 100 K hotter."""
    from dataclasses import replace

    import numpy as np

    heating = one.heating
    hotter = min(heating.reflected + 100.0, (heating.reflected + heating.reference) / 2)
    other = replace(one, heating=replace(heating, reflected=hotter, reflected_uncertainty=0.0,
                                         reference_uncertainty=0.0))  # fmt: skip
    return float(np.nanmean(other.emissivity) - np.nanmean(one.emissivity))


def _doubts(rows: "list[list[RegionEmissivity]]") -> "Iterator[str]":
    for of in rows:
        at = f" (object at {of[0].heating.reference - 273.15:.6g} °C)" if len(rows) > 1 else ""
        for warning in (warning for row in of for warning in row.estimate.warnings):
            yield f"{warning.removesuffix('.')}{at}."


def _print_study(console: "Console", rows: "list[list[RegionEmissivity]]") -> None:
    from chipglow.laboratory.emissivity import surface_text

    text = surface_text(rows[0])
    if text:
        at = f" at {rows[0][0].heating.reference - 273.15:.6g} °C" if len(rows) > 1 else ""
        console.print(f"\nFor a study{at}:\n\n{text}", soft_wrap=True)


def _write(
    maps: "list[EmissivityMap]",
    rows: "list[list[RegionEmissivity]]",
    out: Path | None,
    table: Path | None,
) -> None:
    from chipglow.laboratory.emissivity import write_emissivity, write_emissivity_table

    if out is not None:
        write_emissivity(maps, rows, out)
        print(out)
    if table is not None:
        write_emissivity_table([row for of in rows for row in of], table)
        print(table)
