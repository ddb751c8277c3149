"""The command that runs a study at many settings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, cast

from chipglow.cli import options as opt
from chipglow.cli.screen import current, figure, finish

if TYPE_CHECKING:
    import pandas as pd

    from chipglow.quantities import Quantity

_MAX_ROWS: Final = 40
_MAX_FAILURES: Final = 5


def sweep(
    study: opt.StudyFile,
    vary: Annotated[
        list[str],
        opt.value(
            "PATH=VALUES",
            "Setting to vary with its values, e.g. camera.integration_time=2us,5us,10us, or first, "
            "last and number: camera.psf.fwhm=6um:20um:8. Repeatable.",
        ),
    ],
    out: Annotated[
        Path, opt.value("DIR", "Folder of the results; an interrupted sweep is continued.")
    ],
    at: Annotated[
        list[str] | None,
        opt.value("READING", "Reading to keep, e.g. rake or band. Repeatable. Default: all."),
    ] = None,
    method: Annotated[
        str,
        opt.value(
            "METHOD",
            "grid: all combinations; latin-hypercube or sobol: samples between first and last.",
        ),
    ] = "grid",
    samples: Annotated[int, opt.value("NUMBER", "Number of samples, if not a grid.")] = 64,
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
    from chipglow.laboratory.result_file import write_frame
    from chipglow.quantities import setting_at
    from chipglow.report.sweep_figure import draw_sweep
    from chipglow.study import Method, load_study, sweep as compute
    from chipglow.study.workers import connected
    from chipglow.text import Notes

    loaded, client = load_study(study), connected(scheduler) if scheduler else None
    axes = dict(_axis(text) for text in vary)
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
    quantities = {path: setting_at(loaded, path).parameter.quantity for path in axes}
    if len(frame) <= _MAX_ROWS:
        numbers = ["error_K ± uncertainty_K", "psf_portion_K", "true_error_K"]
        screen.table("points", _with_units(frame, quantities), [*axes, "reading", *numbers])
    count, failed = len(result.keys), result.failed
    screen.say(f"{count} points: {count - len(failed)} computed, {len(failed)} failed.")
    reasons = [f"point {index}: {reason}" for index, reason in failed.items()]
    data = result.to_xarray()
    finish(
        Notes(warnings=reasons[:_MAX_FAILURES]),
        (out / "sweep.csv", lambda path: write_frame(frame, path)),
        (out / "sweep.nc", lambda path: write_dataset(data, path)),
        (out / "sweep.png" if len(frame) else None, figure(draw_sweep, data, quantities)),
    )


def _with_units(frame: "pd.DataFrame", quantities: "dict[str, Quantity | None]") -> "pd.DataFrame":
    """Return the frame with the settings as text in their units."""
    texts = {
        path: [
            quantity.text(value) if quantity and not isinstance(value, str) else str(value)
            for value in frame[path]
        ]
        for path, quantity in quantities.items()
    }
    return frame.assign(**texts)


def _axis(text: str) -> tuple[str, str]:
    path, equals, values = text.partition("=")
    if not (path and equals and values):
        raise ValueError(f"--vary: {text!r}, expected a setting and its values, PATH=VALUES")
    return path.strip(), values
