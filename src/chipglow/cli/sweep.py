"""The commands that run a study at many settings and choose among them."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, TypeAlias, cast

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import pandas as pd

    from chipglow.quantities import Quantity

_MAX_ROWS: Final = 40
"""Rows of a table that is shown on the screen."""

_MAX_FAILURES: Final = 5
"""Reasons of failed points that are shown."""

_Vary: TypeAlias = Annotated[
    list[str],
    opt.value(
        "PATH=VALUES",
        "Setting to vary with its values, e.g. camera.integration_time=2us,5us,10us, or first, "
        "last and number: camera.psf.fwhm=6um:20um:8. Repeatable.",
    ),
]
_MethodName: TypeAlias = Annotated[
    str,
    opt.value(
        "METHOD",
        "grid: all combinations; latin-hypercube or sobol: samples between first and last.",
    ),
]
_Samples: TypeAlias = Annotated[int, opt.value("NUMBER", "Number of samples, if not a grid.")]


def sweep(
    study: opt.StudyFile,
    vary: _Vary,
    out: Annotated[
        Path, opt.value("DIR", "Folder of the results; an interrupted sweep is continued.")
    ],
    at: Annotated[
        list[str] | None,
        opt.value("READING", "Reading to keep, e.g. rake or band. Repeatable. Default: all."),
    ] = None,
    method: _MethodName = "grid",
    samples: _Samples = 64,
    workers: Annotated[
        int | None,
        opt.value("NUMBER", "Processes on this machine. Default: one per core. 0: this process."),
    ] = None,
    scheduler: Annotated[
        str | None, opt.value("ADDRESS", "Scheduler of a Dask cluster, e.g. tcp://node1:8786.")
    ] = None,
) -> None:
    """Run a study at many settings and tabulate the errors."""
    from chipglow.cli.progress import progress_bars
    from chipglow.io import write_dataset
    from chipglow.io.result_file import write_frame
    from chipglow.study import Method, load_study, sweep as compute
    from chipglow.study.workers import connected
    from chipglow.text import Notes

    loaded, client = load_study(study), connected(scheduler) if scheduler else None
    axes = dict(map(_axis, vary))
    with progress_bars() as progress:
        result = compute(
            loaded,
            axes,
            out,
            tuple(at or ()),
            cast(Method, method),
            samples,
            client=client,
            workers=workers,
            progress=progress,
        )
    frame, screen = result.to_frame(), current()
    if len(frame) <= _MAX_ROWS:
        numbers = ["error_K ± uncertainty_K", "psf_portion_K", "true_error_K"]
        screen.table("points", _with_units(frame, result.quantities), [*axes, "reading", *numbers])
    count, failed = len(result.keys), result.failed
    screen.say(f"{count} points: {count - len(failed)} computed, {len(failed)} failed.")
    reasons = [f"point {index}: {reason}" for index, reason in failed.items()]
    data = result.to_xarray()
    finish(
        Notes(warnings=[*reasons[:_MAX_FAILURES], *_range_warnings(frame)]),
        (out / "sweep.csv", lambda path: write_frame(frame, path)),
        (out / "sweep.nc", lambda path: write_dataset(data, path)),
        (out / "sweep.png" if len(frame) else None, figure(result.plot)),
    )


def design(
    study: opt.StudyFile,
    vary: _Vary,
    at: Annotated[
        list[str] | None,
        opt.value("PLACE", "Place or reading that counts, e.g. 'rake face'. Repeatable."),
    ] = None,
    method: _MethodName = "grid",
    samples: _Samples = 64,
    draws: Annotated[int, opt.value("NUMBER", "Draws of the inputs for the last settings.")] = 1024,
    below: Annotated[
        float, opt.value("FRACTION", "Most of a place below the lower range limit.")
    ] = 0.05,
    saturated: Annotated[float, opt.value("FRACTION", "Most of a place saturated.")] = 0.05,
    out: Annotated[Path | None, opt.file("Settings to write, .csv.", ".csv")] = None,
    plot: Annotated[Path | None, opt.picture("Draw bias and uncertainty")] = None,
) -> None:
    """Find the settings of camera and surface with the smallest bias and uncertainty."""
    from chipglow.cli.progress import progress_bars
    from chipglow.io.result_file import write_frame
    from chipglow.study import Method, design as search, load_study
    from chipglow.study.design_figure import draw_design
    from chipglow.text import Notes

    loaded, axes, screen = load_study(study), dict(map(_axis, vary)), current()
    with progress_bars() as progress:
        result = search(
            loaded,
            axes,
            tuple(at or ()),
            cast(Method, method),
            samples,
            draws,
            below,
            saturated,
            progress,
        )
    frame = result.to_frame()
    columns = {
        "|bias| / K": "bias_K",
        "U (k = 2) / K": "expanded_uncertainty_K",
        "regret / K": "regret_K",
        "draws": "draws",
        "Pareto": "pareto",
        "own": "own",
        "excluded": "is_excluded",
    }
    best = _with_units(frame[frame.regret_K.notna()].head(_MAX_ROWS), result.quantities)
    best = best.assign(is_excluded=best.excluded != "")
    screen.table("settings", best, {path: path for path in axes} | columns)
    count, total = len(result.settings), int(result.draws.sum())
    screen.say(
        f"{count} settings, {len(result.reasons)} excluded; {total} draws, "
        f"{100 * total / (count * draws):.0f} % of {draws} for each setting.",
        {"best": dict(result.settings[result.best]) if result.best is not None else None},
    )
    reasons = list(dict.fromkeys(result.reasons.values()))
    notes = result.notes + Notes(warnings=[f"excluded: {one}" for one in reasons[:_MAX_FAILURES]])
    finish(notes, (out, lambda path: write_frame(frame, path)), (plot, figure(draw_design, result)))


def _with_units(
    frame: "pd.DataFrame", quantities: "Mapping[str, Quantity | None]"
) -> "pd.DataFrame":
    """Return the frame with the settings as text in their units."""
    from chipglow.quantities import value_text

    return frame.assign(
        **{
            path: [value_text(value, quantity) for value in frame[path]]
            for path, quantity in quantities.items()
        }
    )


def _range_warnings(frame: "pd.DataFrame") -> "Iterator[str]":
    """Yield a sentence for each reading whose place is outside the camera's range at some point."""
    from chipglow.analysis import outside_warnings

    largest = frame.groupby("reading", sort=False)[["below_range", "saturated"]].max()
    for reading, below, saturated in largest.itertuples():
        yield from outside_warnings(f"{reading}, at the worst point", below, saturated)


def _axis(text: str) -> tuple[str, str]:
    path, equals, values = text.partition("=")
    if not (path and equals and values):
        raise ValueError(f"--vary: {text!r}, expected a setting and its values, PATH=VALUES")
    return path.strip(), values
