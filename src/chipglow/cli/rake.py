"""The command ``chipglow rake``: the analysis grid on the rake face."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from chipglow.cli.options import MeasurementFile, Settings, ToolChoice, picture_option, table_option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.table import Table

    from chipglow.camera import Measurement
    from chipglow.laboratory.chip import RakeGrid


def rake(
    measurement: MeasurementFile,
    tool: ToolChoice = None,
    frame: Annotated[
        str, typer.Option(metavar="N|all", help="Number of the frame, from 0, or all.")
    ] = "all",
    at: Annotated[
        str | None,
        typer.Option(metavar="TIME", help="Only the frame nearest to this time, such as '2 ms'."),
    ] = None,
    pixels: Annotated[
        float, typer.Option(metavar="NUMBER", help="Side of a square in pixels.")
    ] = 3.0,
    depth: Annotated[
        str, typer.Option(metavar="LENGTH", help="How far into the chip the grid reaches.")
    ] = "90 um",
    position: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help="Standard uncertainty of the tool's position, along and across its face; by "
            "default that of a tool that is found, else none.",
        ),
    ] = None,
    out: Annotated[Path | None, table_option("Write the squares of every frame")] = None,
    plot: Annotated[
        Path | None, picture_option("Draw the grid on the image and its profiles")
    ] = None,
    settings: Settings = None,
) -> None:
    """Average radiance temperature in squares along the rake face, as the paper's Figure 7."""
    from rich.console import Console

    from chipglow.cli.assumed import say_assumed, say_doubtful, say_of_measurements
    from chipglow.cli.budget import budget_table
    from chipglow.cli.pictures import write_picture
    from chipglow.laboratory.chip import (
        ToolUncertainty,
        chosen_tool,
        rake_grid,
        write_rake_grid,
    )
    from chipglow.laboratory.chip.rake_grid_figure import draw_rake_grid
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import LENGTH

    reach = parse("--depth", LENGTH, depth)
    stated = parse("--position", LENGTH, position)
    given = None if stated is None else ToolUncertainty(stated, stated)
    measured = load_measurement(measurement, settings or ())
    frames = _frames(measured, frame, at)
    console = Console(highlight=False, markup=False)
    chosen = chosen_tool(measured, tool, position)
    grid = rake_grid(measured, chosen.tool, pixels, reach, frames, given or chosen.uncertainty)
    console.print(_table(grid))
    console.print("\nStandard uncertainty of the squares' means")
    console.print(budget_table(grid.frame_estimate))
    console.print()
    for sentence in (*chosen.found, *_common(grid), *_left_out(grid)):
        console.print(sentence)
    say_of_measurements(measured)
    say_assumed(chosen.assumptions)
    say_doubtful((*chosen.warnings, *_doubts(grid)))
    if out is not None:
        write_rake_grid(grid, out)
        print(out)
    if plot is not None:
        write_picture(draw_rake_grid(measured, grid), plot)


def _frames(measurement: "Measurement", frame: str, at: str | None) -> list[int] | None:
    """Numbers of the chosen frames; None for all."""
    from chipglow.cli.times import frame_at

    times = measurement.times
    if at is not None:
        if frame != "all":
            raise ValueError(f"--frame: {frame!r} beside --at, expected one or the other")
        return [frame_at("--at", at, times)]
    if frame == "all":
        return None
    if not (frame.isdecimal() and int(frame) < times.size):
        raise ValueError(f"--frame: {frame!r}, expected 0 to {times.size - 1}, or all")
    return [int(frame)]


def _table(grid: "RakeGrid") -> "Table":
    from rich.table import Table

    several = grid.times.size > 1
    mean = grid.frame_mean - 273.15
    deviation = grid.frame_deviation if several else grid.deviation[0]
    over = f"between {grid.times.size} frames" if several else "over a square's pixels"
    table = Table(
        "along / µm",
        *(f"{1e6 * depth:.4g} µm deep" for depth in grid.depth),
        box=None,
        title=f"radiance temperature / °C ± standard deviation {over}",
        title_justify="left",
    )
    for column in table.columns:
        column.justify = "right"
        column.no_wrap = True
    for n, along in enumerate(grid.along):
        values = zip(mean[:, n], deviation[:, n], strict=True)
        table.add_row(f"{1e6 * along:.4g}", *(_cell(*value) for value in values))
    return table


def _cell(mean: float, deviation: float) -> str:
    from math import isnan

    if isnan(mean):
        return "–"
    return f"{mean:.1f}" if isnan(deviation) else f"{mean:.1f} ± {deviation:.1f}"


def _common(grid: "RakeGrid") -> "Iterator[str]":
    """What the deviations do not hold."""
    causes = [one.cause.name for one in grid.estimate.components]
    if causes:
        yield (
            f"Errors of {' and '.join(causes)} move all squares together and are not in the "
            "deviations."
        )


def _left_out(grid: "RakeGrid") -> "Iterator[str]":
    """What is not in the table."""
    seen = grid.frame_count
    if (seen == 0).any():
        yield (
            f"{int((seen == 0).sum())} of {seen.size} squares are left out (–): a pixel of theirs "
            "is under the camera's lower range limit, saturated or dead, or outside the image."
        )


def _doubts(grid: "RakeGrid") -> "Iterator[str]":
    seen, frames = grid.frame_count, grid.times.size
    partly = int(((seen > 0) & (seen < frames)).sum())
    if partly:
        yield (
            f"{partly} squares are usable in some of the {frames} frames only; their means are of "
            "those frames, which are the hotter ones where the lower range limit is the reason."
        )
