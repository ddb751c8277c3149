"""The command ``chipglow compare``: a measurement beside simulations."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli.options import (
    Force,
    ReferenceFrame,
    Settings,
    ToolChoice,
    argument,
    folder_option,
    option,
    picture_option,
)

if TYPE_CHECKING:
    from chipglow.cli.screen import Screen
    from chipglow.laboratory.comparison import Comparison, StatedUncertainties


def compare(
    measured: Annotated[Path, argument("MEASURED", "Measurement file.")],
    simulated: Annotated[
        list[Path],
        argument(
            "SIMULATED...",
            "Simulated measurements, e.g. one per set of emissivities, named by their attribute "
            "'surface' or by file.",
        ),
    ],
    tool: ToolChoice = None,
    curve: Annotated[
        Path | None,
        option(
            "FILE",
            "Curve of the shear band in all files, a CSV file with header x_um,y_um, from the "
            "cutting edge outward. Default: the ridge found in each file.",
        ),
    ] = None,
    reference: ReferenceFrame = None,
    uncertainty: Annotated[
        str | None,
        option(
            "KELVINS",
            "Standard uncertainty of the measured radiance temperatures, e.g. '10 K', if the "
            "measurement does not state it.",
        ),
    ] = None,
    emissivity_uncertainty: Annotated[
        float,
        option("FRACTION", "Relative standard uncertainty of the simulated emissivities."),
    ] = 0.0,
    position: Annotated[
        str | None,
        option(
            "LENGTH",
            "Standard uncertainty of positions in the measured image. Default: that of a found "
            "tool and of a pixel, its side / √12.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        folder_option("Results folder: comparison.csv, summary.json, comparison.png and .svg."),
    ] = None,
    force: Force = False,
    plot: Annotated[Path | None, picture_option("Draw the comparison")] = None,
    settings: Settings = None,
) -> None:
    """Compare a measurement with simulations and report the best fit at each place."""
    from dataclasses import replace

    from chipglow.cli.finish import figure, finish
    from chipglow.cli.screen import current
    from chipglow.cli.times import frame_at
    from chipglow.laboratory.chip import chosen_tool, read_curve
    from chipglow.laboratory.comparison import compare as compare_all, labelled_simulations
    from chipglow.laboratory.comparison.figure import draw_comparison
    from chipglow.laboratory.measurement import load_measurement

    stated = _stated(uncertainty, emissivity_uncertainty, position)
    whole = load_measurement(measured, settings or ())
    chosen = chosen_tool(whole, tool, position)
    result = compare_all(
        whole,
        labelled_simulations(simulated),
        chosen.tool,
        None if curve is None else read_curve(curve),
        replace(stated, tool=chosen.uncertainty),
        None if reference is None else frame_at("--reference", reference, whole.times),
    )
    screen = current()
    _print(screen, result)
    screen.remarks(chosen.notes)
    screen.heading()
    for place in result.places:
        screen.say(place.sentence)
    screen.heading()
    screen.say(result.statement)
    finish(
        whole.notes + chosen.notes + result.notes,
        (out, partial(_write, result, force)),
        (plot, figure(draw_comparison, result)),
    )


def _stated(
    uncertainty: str | None, emissivity: float, position: str | None
) -> "StatedUncertainties":
    from chipglow.laboratory.comparison import StatedUncertainties
    from chipglow.quantities.option import parse
    from chipglow.quantities.units import LENGTH, TEMPERATURE_DIFFERENCE

    if not 0.0 <= emissivity < 1.0:
        raise ValueError(f"--emissivity-uncertainty: {emissivity:g}, expected 0 to under 1")
    kelvins = parse("--uncertainty", TEMPERATURE_DIFFERENCE, uncertainty)
    if kelvins is not None and not kelvins > 0.0:
        raise ValueError(f"--uncertainty: {uncertainty}, expected over 0 K")
    return StatedUncertainties(kelvins or 0.0, emissivity, parse("--position", LENGTH, position))


def _print(screen: "Screen", result: "Comparison") -> None:
    from chipglow.laboratory.comparison.comparison import COVERAGE

    frame = result.fit_frame()
    frame["bias_expanded_K"] = COVERAGE * frame["bias_standard_uncertainty_K"]
    columns = ["place", "simulation", "bias_K ± bias_expanded_K", "rms_K"]
    columns += ["values_with_E_n_up_to_1", "values"]
    title = f"simulated minus measured radiance temperature, ± U (k = {COVERAGE:g})"
    screen.table("fits", frame, columns, title)


def _write(result: "Comparison", force: bool, out: Path) -> None:
    from chipglow.drawing import drawing
    from chipglow.io import atomic_folder
    from chipglow.laboratory.comparison import write_comparison
    from chipglow.laboratory.comparison.figure import draw_comparison

    with atomic_folder(out, force) as folder:
        write_comparison(result, folder)
        drawing.save(draw_comparison(result), folder, "comparison")
