"""The command ``chipglow emissivity``: emissivity from images of heated objects."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import Settings, argument, file_option, option, picture_option

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.emissivity import Heating, RegionEmissivities


def emissivity(
    images: Annotated[list[Path], argument("IMAGE...", "Measurements of the heated object.")],
    reference: Annotated[
        list[str],
        option(
            "TEMPERATURE",
            "True temperature of the object, e.g. 391degC: once for all images, or once per image. "
            "Images at one temperature are repetitions.",
        ),
    ],
    regions: Annotated[Path, option("FILE", "Regions of the image, a YAML file.")],
    reflected: Annotated[
        str, option("TEMPERATURE", "Temperature of the surroundings that the object reflects.")
    ] = "293 K",
    reference_uncertainty: Annotated[
        str | None, option("KELVINS", "Standard uncertainty of the true temperature, e.g. '2 K'.")
    ] = None,
    reflected_uncertainty: Annotated[
        str | None, option("KELVINS", "Standard uncertainty of the reflected temperature.")
    ] = None,
    camera_uncertainty: Annotated[
        str | None,
        option(
            "KELVINS",
            "Standard uncertainty of the radiance temperatures by the calibration. Default: as "
            "the measurement states.",
        ),
    ] = None,
    drift: Annotated[
        float | None,
        option(
            "NUMBER",
            "Relative standard uncertainty of the radiance between recordings, e.g. 0.01. "
            "Default: from several images at one temperature.",
        ),
    ] = None,
    out: Annotated[Path | None, file_option("Write maps and regions, NetCDF.")] = None,
    table: Annotated[Path | None, file_option("Write the table of regions, CSV.")] = None,
    plot: Annotated[Path | None, picture_option("Draw image, regions and map")] = None,
    settings: Settings = None,
) -> None:
    """Determine emissivity from images of an object of known temperature."""
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.laboratory.emissivity import (
        determine_emissivities,
        load_regions,
        write_emissivity,
    )
    from chipglow.laboratory.emissivity.figure import draw_emissivity
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.result_file import write_frame

    heatings = _heatings(
        images, reference, reflected, reference_uncertainty, reflected_uncertainty,
        camera_uncertainty, drift,
    )  # fmt: skip
    named = load_regions(regions)
    measurements = [load_measurement(image, settings or ()) for image in images]
    found = determine_emissivities(measurements, heatings, named, list(map(str, images)))
    screen = current()
    _print_tables(screen, found)
    screen.heading()
    _print_study(screen, found, out)
    whole = {row.name for row in found.rows[0] if row.whole}
    lines = [line for line in found.lines if line.name in whole]
    finish(
        sum((one.notes for one in measurements), found.notes),
        (out, partial(write_emissivity, found)),
        (table, partial(write_frame, found.to_frame())),
        (plot, figure(draw_emissivity, found.maps[0], named, lines)),
    )


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

    def kelvins(option: str, text: str | None) -> float | None:
        return parse(option, TEMPERATURE_DIFFERENCE, text)

    return [
        Heating(
            parse("--reference", TEMPERATURE, text),
            parse("--reflected", TEMPERATURE, reflected),
            kelvins("--reference-uncertainty", reference_uncertainty) or 0.0,
            kelvins("--reflected-uncertainty", reflected_uncertainty) or 0.0,
            kelvins("--camera-uncertainty", camera_uncertainty),
            drift,
        )
        for text in (references if len(references) > 1 else references * len(images))
    ]


def _print_tables(screen: "Screen", found: "RegionEmissivities") -> None:
    from chipglow.laboratory.emissivity.emissivity import BUDGET

    columns = ["region", "pixels", "mean", "standard_deviation", "standard_uncertainty"]
    columns += ["expanded_uncertainty", "coverage_factor"]
    parts = {"parts of u": "region"} | {cause: f"{cause}_uncertainty" for cause in BUDGET}
    for kelvins, rows in found.to_frame().groupby("reference_K", sort=False):
        screen.heading(f"\nObject at {kelvins - 273.15:.6g} °C")
        screen.table("regions", rows, columns)
        screen.heading()
        screen.table(None, rows, parts)
    if found.lines:
        screen.heading("\nOver the temperature, with standard uncertainties")
        over_temperature = {
            "region": "region",
            "emissivity": "emissivity ± emissivity_uncertainty",
            "at / °C": "temperature_degC",
            "change in 100 K": "change_in_100_K ± change_in_100_K_uncertainty",
            "sd about line": "residual",
        }
        screen.table("lines", found.line_frame(), over_temperature)


def _print_study(screen: "Screen", found: "RegionEmissivities", out: Path | None) -> None:
    from chipglow.laboratory.emissivity import measured_text, surface_text

    text = surface_text(found.rows[0])
    several, kelvins = len(found.maps) > 1, found.maps[0].heating.reference
    if text and several and out is not None and "chips" in text:
        _print_yaml(screen, "For a study", measured_text(out))
    elif text:
        at = f" at {kelvins - 273.15:.6g} °C" if several else ""
        _print_yaml(screen, f"For a study{at}", text)


def _print_yaml(screen: "Screen", head: str, text: str) -> None:
    screen.heading(f"\n{head}:\n\n{text}")
    screen.values({"study": text})
