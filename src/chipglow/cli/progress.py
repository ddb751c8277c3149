"""Where a run starts, its cost, its progress and the cut that it made, on the terminal."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from math import isfinite, nan
from typing import Final

import typer
from rich.console import Console
from rich.progress import Progress, ProgressColumn, TaskID, TimeElapsedColumn

from chipglow.chip import Inertia
from chipglow.cli.screen import current
from chipglow.study import (
    Progress as Report,
    Study,
    check_cost,
    expected_cost,
    is_cut,
    is_damaged,
    kept_progress,
)
from chipglow.text import Notes

_LONG: Final = 90.0
"""Seconds above which a time is stated in minutes."""

_MARGIN: Final = 4
"""Columns that a bar leaves free."""

MUCH_TIME: Final = 300.0
"""Expected time of a cut in s above which the user is asked first."""

MUCH_DISK: Final = 2e9
"""Expected size of the cached scene in bytes above which the user is asked first."""

_INERTIA: Final = {
    "kinetic_fraction": "kinetic energy at most {:.2%} of the work",
    "force_fraction": "momentum flux {:.2%} of the mean cutting force",
}


def confirm_cost(study: Study, resume: bool, agreed: bool) -> None:
    """Print the state of earlier runs and the expected cost; ask before a large one."""
    console = Console(stderr=True)
    if is_cut(study):
        console.print("The scene of this cut comes from the cache.")
        return
    if is_damaged(study):
        console.print("The cached scene of this cut is damaged; it is computed again.")
    check_cost(study)
    kept = kept_progress(study)
    say_checkpoint("cut", kept, resume)
    cost = expected_cost(study)
    seconds = (1 - kept if resume else 1.0) * cost.seconds
    time = f"{seconds / 60:.0f} min" if seconds > _LONG else f"{seconds:.0f} s"
    console.print(
        f"Expected: about {time}, {cost.disk / 1e9:.2g} GB in the cache, {cost.memory / 1e9:.2g} "
        "GB of memory."
    )
    much = seconds > MUCH_TIME or cost.disk > MUCH_DISK
    if much and not agreed and sys.stdin.isatty() and console.is_terminal:
        typer.confirm("Continue?", default=True, abort=True, err=True)


def say_checkpoint(what: str, progress: float, resume: bool) -> None:
    """Print whether an earlier run left a checkpoint, and whether it is used."""
    if resume and progress:
        text = f"Resuming the {what} at {progress:.0%}."
    elif progress:
        text = (
            f"Starting from the beginning; an earlier run of this {what} was interrupted at "
            f"{progress:.0%} (--resume continues it)."
        )
    elif resume:
        text = f"No checkpoint of this {what} found; starting from the beginning."
    else:
        return
    Console(stderr=True).print(text)


@contextmanager
def progress_bars() -> Iterator[Report]:
    """Show a progress bar on stderr for each step that is reported."""
    console = Console(stderr=True)
    # Where Ctrl-C shows as ^C behind a bar that fills its line, the next bar would be one too low.
    console.width = max(console.width - _MARGIN, _MARGIN)
    elapsed: tuple[str | ProgressColumn, ...] = "left,", TimeElapsedColumn(), "elapsed"
    columns = *Progress.get_default_columns(), *elapsed
    # Without a terminal only the end is shown: no thread is needed that refreshes the bars.
    with Progress(*columns, console=console, auto_refresh=console.is_terminal) as bars:
        tasks: dict[str, TaskID] = {}

        def report(step: str, fraction: float) -> None:
            if step not in tasks:
                tasks[step] = bars.add_task(step, total=1.0)
            bars.update(tasks[step], completed=fraction)

        yield report


def say_of_cut(inertia: Inertia | None, warnings: Iterable[str] = ()) -> None:
    """Print kinetic energy and momentum of the scaled mass, and the warnings of the cut."""
    fractions = {name: getattr(inertia, name, nan) for name in _INERTIA}
    known = {name: fraction for name, fraction in fractions.items() if isfinite(fraction)}
    if known:
        texts = ", ".join(_INERTIA[name].format(fraction) for name, fraction in known.items())
        current().say(f"Scaled mass after the build-up: {texts}.", known, sys.stderr)
    own = [inertia.warning] if inertia and inertia.warning else []
    current().notes(Notes(warnings=[*own, *warnings]))
