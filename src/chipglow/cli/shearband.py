"""The command ``chipglow shearband``: the temperature along the shear band."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import MeasurementFile, Settings, ToolChoice, picture_option, table_option

if TYPE_CHECKING:
    from rich.table import Table

    from chipglow.laboratory.chip import BandProfile


def shearband(
    measurement: MeasurementFile,
    curve: Annotated[
        str,
        typer.Option(
            metavar="FILE|found",
            help="Where to read: a CSV file whose first line is x_um,y_um, from the cutting edge "
            "outward; or 'found', the ridge of the radiance temperature in each frame.",
        ),
    ] = "found",
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="TIME",
            help="The frame nearest to this time, such as '400 us'; may be repeated; by default "
            "all frames.",
        ),
    ] = None,
    tool: ToolChoice = None,
    reference: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help="The frame whose band is fully developed; by default the given curve is its "
            "place, or the hottest and longest found band that begins near the cutting edge.",
        ),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH", help="Width across the curve of the mean; by default a pixel."
        ),
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Standard uncertainty of the curve's position; by default that of a pixel, its "
            "side over the root of 12, and that of the edge, where the tool is found.",
        ),
    ] = None,
    out: Annotated[Path | None, table_option("Write the temperatures along the band")] = None,
    plot: Annotated[
        Path | None, picture_option("Draw the curves on the image and the profiles")
    ] = None,
    settings: Settings = None,
) -> None:
    """Read the radiance temperature along the shear band, as the paper's Figure 9."""
    from rich.console import Console

    from chipglow.cli.assumed import say_assumed, say_doubtful, say_of_measurements
    from chipglow.cli.budget import budget_table
    from chipglow.cli.pictures import write_picture
    from chipglow.cli.times import frame_at
    from chipglow.laboratory.chip import (
        band_profile,
        chosen_tool,
        read_curve,
        write_band_profile,
    )
    from chipglow.laboratory.chip.band_figure import draw_band_profile
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import LENGTH

    measured = load_measurement(measurement, settings or ())
    times = measured.times
    chosen = chosen_tool(measured, tool, position)
    profile = band_profile(
        measured,
        chosen.tool,
        frames=sorted({frame_at("--at", text, times) for text in at}) if at else None,
        curve=None if curve == "found" else read_curve(curve),
        reference=None if reference is None else frame_at("--reference", reference, times),
        width=parse("--width", LENGTH, width),
        position=parse("--position", LENGTH, position),
        uncertainty=chosen.uncertainty,
    )
    console = Console(highlight=False, markup=False)
    console.print(_table(profile))
    console.print("\nStandard uncertainty of the points along the band")
    console.print(budget_table(profile.estimate))
    console.print()
    for sentence in chosen.found:
        console.print(sentence)
    say_of_measurements(measured)
    say_assumed((*chosen.assumptions, *profile.assumptions))
    say_doubtful((*chosen.warnings, *profile.warnings))
    if measured.calibration_errors is None:
        say_doubtful(
            [
                "the measurement does not tell the uncertainty of its calibration, which is not in "
                "the uncertainty here."
            ]
        )
    if out is not None:
        write_band_profile(profile, out)
        print(out)
    if plot is not None:
        write_picture(draw_band_profile(measured, chosen.tool, profile), plot)


def _table(profile: "BandProfile") -> "Table":
    import numpy as np
    from rich.table import Table

    table = Table(
        "at / µs",
        "stage",
        "offset / µm",
        "from / µm",
        "to / µm",
        "mean / °C",
        "most / °C",
        "u / K",
        box=None,
        title=f"radiance temperature along the band, over a width of {1e6 * profile.width:.4g} µm",
        title_justify="left",
    )
    table.columns[1].no_wrap = True
    uncertainty = profile.estimate.standard_uncertainty
    for frame, time in enumerate(profile.times):
        values = profile.temperature[frame]
        known = np.isfinite(values)
        row = [f"{1e6 * time:.7g}", str(profile.stage[frame])]
        offset = profile.offset[frame]
        row.append(f"{1e6 * offset:+.1f}" if np.isfinite(offset) else "–")
        if known.any():
            ends = profile.distance[known][[0, -1]] * 1e6
            row += [
                f"{ends[0]:.0f}",
                f"{ends[1]:.0f}",
                f"{values[known].mean() - 273.15:.1f}",
                f"{values[known].max() - 273.15:.1f}",
                f"{np.sqrt((uncertainty[frame, known] ** 2).mean()):.1f}",
            ]
        else:
            row += ["–"] * 5
        table.add_row(*row)
    return table
