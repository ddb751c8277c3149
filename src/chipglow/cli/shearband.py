"""The command ``chipglow shearband``: the temperature along the shear band."""

from functools import partial
from pathlib import Path
from typing import Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish


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
            "√12, and that of the edge of a found tool.",
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
    from chipglow.laboratory.chip import band_profile, chosen_tool, read_curve
    from chipglow.laboratory.chip.figures import draw_band_profile
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.result_file import write_result

    measured = load_measurement(measurement, settings or ())
    times = measured.times
    chosen = chosen_tool(measured, tool, position)
    profile = band_profile(
        measured,
        chosen.tool,
        frames=sorted({shown_frame(times, time, option="--at: ") for time in at}) if at else None,
        curve=None if curve == "found" else read_curve(curve),
        reference=None
        if reference is None
        else shown_frame(times, reference, option="--reference: "),
        width=width,
        position=position,
        uncertainty=chosen.uncertainty,
    )
    screen = current()
    title = f"radiance temperature along the band, over a width of {1e6 * profile.width:.4g} µm"
    screen.table("stages", profile.stage_frame(), title=title, unbroken=("stage",))
    screen.budget("budget", profile.estimate, "Standard uncertainty of the points along the band")
    screen.remarks(chosen.notes)
    finish(
        measured.notes + chosen.notes + profile.notes,
        (out, partial(write_result, profile)),
        (plot, figure(draw_band_profile, measured, chosen.tool, profile)),
    )
