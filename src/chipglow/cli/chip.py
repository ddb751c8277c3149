"""The commands ``chipglow rake`` and ``shearband``: the chip of a measurement."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.camera import Measurement
    from chipglow.laboratory.chip import RakeGrid


def rake(
    measurement: opt.MeasurementFile,
    tool: opt.ToolChoice = None,
    frame: Annotated[str, opt.value("N|all", "Index of the frame, or all.")] = "all",
    at: Annotated[
        float | None, opt.time("Use only the frame nearest to this time, e.g. '2 ms'.")
    ] = None,
    pixels: Annotated[float, opt.value("NUMBER", "Side of a square in pixels.")] = 3.0,
    depth: Annotated[float, opt.length("Depth of the grid into the chip. Default: 90 um.")] = 90e-6,
    position: Annotated[
        float | None,
        opt.length(
            "Standard uncertainty of the tool's position along and across its face. Default: that "
            "of a found tool, otherwise none."
        ),
    ] = None,
    out: Annotated[Path | None, opt.table("Write the squares of every frame")] = None,
    plot: Annotated[Path | None, opt.picture("Draw the grid on the image and its profiles")] = None,
    settings: opt.Settings = None,
) -> None:
    """Average the radiance temperature in squares along the rake face (the paper's Figure 7)."""
    from chipglow.io.result_file import write_result
    from chipglow.laboratory.chip import ToolUncertainty, rake_grid
    from chipglow.laboratory.chip.figure import draw_rake_grid
    from chipglow.laboratory.chip.tool_choice import chosen_tool
    from chipglow.laboratory.recordings import load_measurement

    measured = load_measurement(measurement, settings or ())
    frames = chosen_frames(measured, frame, at)
    chosen, known, notes = chosen_tool(measured, tool, position)
    given = known if position is None else ToolUncertainty(position, position)
    grid = rake_grid(measured, chosen, pixels, depth, frames, given)
    _print_squares(grid)
    screen = current()
    screen.budget("budget", grid.frame_estimate, "Standard uncertainty of the squares' means")
    screen.remarks(notes + grid.notes)
    finish(
        measured.notes + notes + grid.notes,
        (out, partial(write_result, grid)),
        (plot, figure(draw_rake_grid, measured, grid)),
    )


def chosen_frames(measurement: "Measurement", frame: str, at: float | None) -> list[int] | None:
    """Return the frames of the options --frame and --at; None for all."""
    from chipglow.drawing.scales import shown_frame

    times = measurement.times
    if at is not None:
        if frame != "all":
            raise ValueError("--frame and --at cannot be combined")
        return [shown_frame(times, at, option="--at: ")]
    if frame == "all":
        return None
    if not (frame.isdecimal() and int(frame) < times.size):
        raise ValueError(f"--frame: {frame!r}, expected 0 to {times.size - 1}, or all")
    return [int(frame)]


def _print_squares(grid: "RakeGrid") -> None:
    import pandas as pd

    from chipglow.quantities import ZERO_CELSIUS

    several = grid.times.size > 1
    over = f"between {grid.times.size} frames" if several else "over a square's pixels"
    squares, columns = {"along_um": 1e6 * grid.along}, {"along / µm": "along_um"}
    for n, depth in enumerate(1e6 * grid.depth):
        squares[f"mean_degC_{n}"] = grid.frame_mean[n] - ZERO_CELSIUS
        squares[f"standard_deviation_K_{n}"] = grid.bars[n]
        squares[f"frames_{n}"] = grid.frame_count[n]
        columns[f"{depth:.4g} µm deep"] = f"mean_degC_{n} ± standard_deviation_K_{n}"
    title = f"radiance temperature / °C ± standard deviation {over}"
    current().table("squares", pd.DataFrame(squares), columns, title, columns.values())


def shearband(
    measurement: opt.MeasurementFile,
    curve: Annotated[
        str,
        opt.value(
            "FILE|found",
            "Curve to read along: a CSV file with header x_um,y_um, from the cutting edge outward; "
            "or 'found', the ridge of the radiance temperature in each frame.",
        ),
    ] = "found",
    at: Annotated[
        list[float] | None,
        opt.time("Frame nearest to this time, e.g. '400 us'. Repeatable. Default: all."),
    ] = None,
    tool: opt.ToolChoice = None,
    reference: opt.ReferenceFrame = None,
    width: Annotated[
        float | None, opt.length("Averaging width across the curve. Default: one pixel.")
    ] = None,
    position: Annotated[
        float | None,
        opt.length(
            "Standard uncertainty of the curve's position. Default: that of a pixel, its side / "
            "√12, and that of the edge of a found tool."
        ),
    ] = None,
    out: Annotated[Path | None, opt.table("Write the temperatures along the band")] = None,
    plot: Annotated[
        Path | None, opt.picture("Draw the curves on the image and the profiles")
    ] = None,
    settings: opt.Settings = None,
) -> None:
    """Read the radiance temperature along the shear band (the paper's Figure 9)."""
    from chipglow.drawing.scales import shown_frame
    from chipglow.io import read_curve
    from chipglow.io.result_file import write_result
    from chipglow.laboratory.chip import band_profile
    from chipglow.laboratory.chip.figure import draw_band_profile
    from chipglow.laboratory.chip.tool_choice import chosen_tool
    from chipglow.laboratory.recordings import load_measurement

    measured = load_measurement(measurement, settings or ())
    times = measured.times
    chosen, known, notes = chosen_tool(measured, tool, position)
    profile = band_profile(
        measured,
        chosen,
        frames=sorted({shown_frame(times, time, option="--at: ") for time in at}) if at else None,
        curve=None if curve == "found" else read_curve(curve),
        reference=None
        if reference is None
        else shown_frame(times, reference, option="--reference: "),
        width=width,
        position=position,
        uncertainty=known,
    )
    screen = current()
    title = f"radiance temperature along the band, over a width of {1e6 * profile.width:.4g} µm"
    screen.table("stages", profile.stage_frame(), title=title, unbroken=("stage",))
    screen.budget("budget", profile.estimate, "Standard uncertainty of the points along the band")
    screen.remarks(notes)
    finish(
        measured.notes + notes + profile.notes,
        (out, partial(write_result, profile)),
        (plot, figure(draw_band_profile, measured, chosen, profile)),
    )
