"""Where a run starts and how far it is, on the terminal."""

from collections.abc import Iterator
from contextlib import contextmanager

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

from chipglow.study import Progress as Report
from chipglow.study import Study, is_cut, kept_progress


def say_where_it_starts(study: Study, resume: bool) -> None:
    """Say on stderr what earlier runs of the same cut left, and whether it is used."""
    console = Console(stderr=True)
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
    with Progress(*columns, console=Console(stderr=True)) as bars:
        tasks: dict[str, TaskID] = {}

        def report(step: str, fraction: float) -> None:
            if step not in tasks:
                tasks[step] = bars.add_task(step, total=1.0)
            bars.update(tasks[step], completed=fraction)

        yield report
