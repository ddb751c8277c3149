"""Where a run starts and how far it is, on the terminal."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    TaskID,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from chipglow.study import (
    Progress as Report,
    Study,
    expected_cost,
    is_cut,
    is_damaged,
    kept_progress,
)

_ROOM: Final = 4

MUCH_TIME: Final = 300.0
"""Seconds from which on a cut is begun only if the user says so."""

MUCH_DISK: Final = 2e9
"""The same in bytes of the cache."""


def say_where_it_starts(study: Study, resume: bool, agreed: bool) -> None:
    """Say on stderr what earlier runs of the same cut left, what it will cost, and ask if much.

    Parameters
    ----------
    study : Study
        A study that cuts.
    resume : bool
        Whether to go on from what an earlier run left.
    agreed : bool
        Whether the user agreed beforehand to any cost. Without a terminal nobody is asked.

    Raises
    ------
    typer.Exit
        If the user does not agree.
    """
    console = Console(stderr=True)
    _say_of_earlier_runs(console, study, resume)
    if is_cut(study):
        return
    cost = expected_cost(study)
    left = 1 - kept_progress(study) if resume else 1.0
    seconds = left * cost.seconds
    time = f"{seconds / 60:.0f} min" if seconds > 90 else f"{seconds:.0f} s"
    console.print(
        f"Expected: about {time}, {cost.disk / 1e9:.2g} GB of the cache, {cost.memory / 1e9:.2g} "
        "GB of memory."
    )
    much = seconds > MUCH_TIME or cost.disk > MUCH_DISK
    if much and not agreed and sys.stdin.isatty() and console.is_terminal:
        typer.confirm("Go on?", default=True, abort=True, err=True)


def _say_of_earlier_runs(console: Console, study: Study, resume: bool) -> None:
    if is_damaged(study):
        console.print("The scene of this cut in the cache is damaged: it is computed again.")
    if is_cut(study):
        console.print("The cut was computed before: its scene comes from the cache.")
    elif kept := kept_progress(study):
        console.print(
            f"The cut goes on at {kept:.0%}, where an earlier run was ended."
            if resume
            else f"An earlier run was ended at {kept:.0%} of this cut. This one starts anew; "
            "--resume goes on from there."
        )
    elif resume:
        console.print("No earlier run left a state of this cut: it starts anew.")


@contextmanager
def progress_bars() -> Iterator[Report]:
    """A bar on stderr for each step that is reported: what, how far, time left."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    # Where Ctrl-C shows as ^C behind a bar that fills its line, the next bar would be one too low.
    console.width = max(console.width - _ROOM, _ROOM)
    with Progress(*columns, console=console) as bars:
        tasks: dict[str, TaskID] = {}

        def report(step: str, fraction: float) -> None:
            if step not in tasks:
                tasks[step] = bars.add_task(step, total=1.0)
            bars.update(tasks[step], completed=fraction)

        yield report
