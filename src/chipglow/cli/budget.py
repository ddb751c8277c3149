"""The command that states the uncertainty of a study's errors."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from chipglow.study import StudyBudget

_LARGEST: Final = 6
"""Inputs of each reading that the table on the screen shows."""


def budget(
    study: opt.StudyFile,
    at: Annotated[
        list[str] | None,
        opt.value("PLACE", "Place or reading, e.g. 'rake face' or band. Repeatable. Default: all."),
    ] = None,
    trials: Annotated[
        int,
        opt.value("NUMBER", "Most trials of the Monte Carlo; it ends when the interval is stable."),
    ] = 3000,
    samples: Annotated[
        int, opt.value("NUMBER", "Base samples of the parts of the variance, a power of 2.")
    ] = 256,
    scenes: Annotated[
        int, opt.value("NUMBER", "Scenes to cut, if settings of the cut are uncertain.")
    ] = 16,
    out: Annotated[
        Path | None, opt.file("Budget to write, .csv: a row per reading and input.", ".csv")
    ] = None,
    plot: Annotated[Path | None, opt.picture("Draw the contributions")] = None,
) -> None:
    """State the uncertainty of the error of a single reading, and what it comes from."""
    from chipglow.cli.progress import progress_bars
    from chipglow.io.result_file import write_frame
    from chipglow.study import load_study, study_budget
    from chipglow.text import Notes

    loaded = load_study(study)
    current().notes(Notes(loaded.uncertainty.build(loaded).truncated))
    with progress_bars() as progress:
        result = study_budget(loaded, tuple(at or ()), trials, samples, scenes, progress)
    _print(result)
    finish(
        result.notes,
        (out, lambda path: write_frame(result.to_frame(), path)),
        (plot, figure(result.plot)),
    )


def _print(result: "StudyBudget") -> None:
    import pandas as pd

    from chipglow.uncertainty.budget import VALIDATED

    screen, budget, summary = current(), result.to_frame(), result.summary()
    screen.table(
        "summary",
        summary,
        {
            "reading": "reading",
            "error / K": "error_K",
            "u / K": "standard_uncertainty_K",
            "k": "coverage_factor",
            "U 95 % / K": "expanded_uncertainty_K",
            "Monte Carlo 95 %, from / K": "low_K",
            "to / K": "high_K",
            "GUM validated": "validated",
        },
    )
    screen.heading()
    parts = (part for _, part in budget.groupby("reading", sort=False))
    largest = pd.concat([part.nlargest(_LARGEST, "contribution_K") for part in parts])
    columns = ["reading", "input", "group", "distribution", "contribution_K", "variance_percent"]
    screen.table("contributions", largest, columns)
    screen.heading()
    screen.table(
        "groups",
        result.groups(),
        {
            "reading": "reading",
            "group": "group",
            "variance, alone / %": "first_order_percent",
            "with interactions / %": "total_order_percent",
        },
    )
    trials = result.budget.monte_carlo
    how, remedy = (
        ("stable", "") if trials.is_stable.all() else ("not stable", "; use more --trials")
    )
    screen.say(
        f"{trials.trials} trials: mean, u and the ends of the interval are {how} within "
        f"{trials.tolerance:.0%} of u with 95 % confidence{remedy}.",
        {"trials": trials.trials},
    )
    screen.say(
        f"GUM validated: both ends of its interval, error ± U, are within {VALIDATED:.0%} of u of "
        "Monte Carlo's."
    )
    for reading, one in result.surrogates.items():
        screen.say(
            f"{reading}: the settings of the scene act as a {one.form}; scenes left out of the fit "
            f"are predicted within {one.error:.2g} K."
        )
