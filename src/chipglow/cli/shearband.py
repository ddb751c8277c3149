"""The command ``chipglow shearband``: the temperature along the shear band."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import (
    MeasurementFile,
    ReferenceFrame,
    Settings,
    ToolChoice,
    option,
    picture_option,
    table_option,
)

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.chip import BandProfile


def shearband(
    measurement: MeasurementFile,
    curve: Annotated[
        str,
        option(
            "FILE|found",
            "Curve to read along: a CSV file with header x_um,y_um, from the cutting edge outward; "
            "or 'found', the ridge of the radiance temperature in each frame.",
        ),
    ] = "found",
    at: Annotated[
        list[str] | None,
        option("TIME", "Frame nearest to this time, e.g. '400 us'. Repeatable. Default: all."),
    ] = None,
    tool: ToolChoice = None,
    reference: ReferenceFrame = None,
    width: Annotated[
        str | None, option("LENGTH", "Averaging width across the curve. Default: one pixel.")
    ] = None,
    position: Annotated[
        str | None,
        option(
            "LENGTH",
            "Standard uncertainty of the curve's position. Default: that of a pixel, its side / "
            "√12, and that of the edge of a found tool.",
        ),
    ] = None,
    out: Annotated[Path | None, table_option("Write the temperatures along the band")] = None,
    plot: Annotated[
        Path | None, picture_option("Draw the curves on the image and the profiles")
    ] = None,
    settings: Settings = None,
) -> None:
    """Read the radiance temperature along the shear band (the paper's Figure 9)."""
    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.cli.times import frame_at
    from chipglow.laboratory.chip import band_profile, chosen_tool, read_curve
    from chipglow.laboratory.chip.figures import draw_band_profile
    from chipglow.laboratory.measurement import load_measurement
    from chipglow.laboratory.result_file import write_result
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
    screen = current()
    _print(screen, profile)
    screen.budget("budget", profile.estimate, "Standard uncertainty of the points along the band")
    screen.remarks(chosen.notes)
    finish(
        measured.notes + chosen.notes + profile.notes,
        (out, partial(write_result, profile)),
        (plot, figure(draw_band_profile, measured, chosen.tool, profile)),
    )


def _print(screen: "Screen", profile: "BandProfile") -> None:
    screen.table(
        "stages",
        profile.stage_frame(),
        title=f"radiance temperature along the band, over a width of {1e6 * profile.width:.4g} µm",
        unbroken=("stage",),
    )
