"""The command ``chipglow compare``: a measurement and simulations."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.laboratory import comparison as lab


def compare(
    measured: Annotated[Path, opt.argument("MEASURED", "Measurement file.")],
    simulated: Annotated[
        list[Path],
        opt.argument(
            "SIMULATED...",
            "Simulated measurements, e.g. one per set of emissivities, named by their attribute "
            "'surface' or by file.",
        ),
    ],
    tool: opt.ToolChoice = None,
    curve: Annotated[
        Path | None,
        opt.value(
            "FILE",
            "Curve of the shear band in all files, a CSV file with header x_um,y_um, from the "
            "cutting edge outward. Default: the ridge found in each file.",
        ),
    ] = None,
    reference: opt.ReferenceFrame = None,
    uncertainty: Annotated[
        float | None,
        opt.kelvins(
            "Standard uncertainty of the measured radiance temperatures, e.g. '10 K', if the "
            "measurement does not state it."
        ),
    ] = None,
    emissivity_uncertainty: Annotated[
        float, opt.value("FRACTION", "Relative standard uncertainty of the simulated emissivities.")
    ] = 0.0,
    position: Annotated[
        float | None,
        opt.length(
            "Standard uncertainty of positions in the measured image. Default: that of a found "
            "tool and of a pixel, its side / √12."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        opt.folder("Results folder: comparison.csv, summary.json, comparison.png and .svg."),
    ] = None,
    force: opt.Force = False,
    plot: Annotated[Path | None, opt.picture("Draw the comparison")] = None,
    settings: opt.Settings = None,
) -> None:
    """Compare a measurement with simulations and report the best fit at each place."""
    from chipglow.drawing.scales import shown_frame
    from chipglow.io import read_curve
    from chipglow.laboratory import comparison as lab
    from chipglow.laboratory.chip.tool_choice import chosen_tool
    from chipglow.laboratory.comparison.coverage import COVERAGE
    from chipglow.laboratory.recordings import load_measurement

    if not 0.0 <= emissivity_uncertainty < 1.0:
        raise ValueError(f"--emissivity-uncertainty: {emissivity_uncertainty:g}, expected 0 to < 1")
    if uncertainty is not None and not uncertainty > 0.0:
        raise ValueError(f"--uncertainty: {uncertainty:g} K, must be positive")
    whole = load_measurement(measured, settings or ())
    chosen, known, notes = chosen_tool(whole, tool, position)
    result = lab.compare(
        whole,
        lab.labelled_simulations(simulated),
        chosen,
        None if curve is None else read_curve(curve),
        lab.StatedUncertainties(uncertainty or 0.0, emissivity_uncertainty, position, known),
        None if reference is None else shown_frame(whole.times, reference, option="--reference: "),
    )
    screen, fits = current(), result.fits.copy()
    fits["bias_expanded_K"] = COVERAGE * fits["bias_standard_uncertainty_K"]
    columns = ["place", "simulation", "bias_K ± bias_expanded_K", "rms_K"]
    columns += ["values_with_E_n_up_to_1", "values"]
    title = f"simulated minus measured radiance temperature, ± U (k = {COVERAGE:g})"
    screen.table("fits", fits, columns, title)
    screen.remarks(notes)
    screen.heading()
    for sentence in result.sentences:
        screen.say(sentence)
    screen.heading()
    screen.say(result.statement)
    finish(
        whole.notes + notes + result.notes,
        (out, partial(_write, result, force)),
        (plot, figure(result.plot)),
    )


def _write(result: "lab.Comparison", force: bool, out: Path) -> None:
    from chipglow.drawing import drawing
    from chipglow.io import atomic_folder
    from chipglow.laboratory import comparison as lab

    with atomic_folder(out, force) as folder:
        lab.write_comparison(result, folder)
        drawing.save(result.plot(), folder, "comparison")
