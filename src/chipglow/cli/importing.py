"""Other people's fields to a scene's file, with what was found and what had to be assumed."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from chipglow.cli.assumed import say_assumed
from chipglow.cli.progress import progress_bars
from chipglow.io import ImportDescription, import_scene, prospect
from chipglow.io.importing import Prospect, kept_import


def import_fields(description: ImportDescription, out: Path | None, resume: bool) -> None:
    """Say what a source holds and, if a file is named, write its scene.

    Parameters
    ----------
    description : ImportDescription
        What to read, and what it means.
    out : Path, optional
        The scene's file.
    resume : bool
        Whether to go on where an earlier import of the same was ended.
    """
    wanted = description.build()
    looked = prospect(wanted)
    _say(looked)
    if out is None:
        return
    kept = kept_import(wanted, looked, out)
    _say_where_it_starts(kept.progress if kept else 0.0, resume)
    with progress_bars() as progress:
        import_scene(
            wanted,
            out,
            lambda fraction: progress("import", fraction),
            looked=looked,
            resume=kept if resume else None,
        )
    print(out)


def _say_where_it_starts(kept: float, resume: bool) -> None:
    console = Console(stderr=True)
    if kept and resume:
        console.print(f"The import goes on at {kept:.0%}, where an earlier one was ended.")
    elif kept:
        console.print(
            f"An earlier import was ended at {kept:.0%}. This one starts anew; --resume goes on "
            "from there."
        )
    elif resume:
        console.print("No earlier run left a state of this import: it starts anew.")


def _say(looked: Prospect) -> None:
    console, survey, raster = Console(stderr=True), looked.survey, looked.raster
    table = Table("field", "from")
    for ours, theirs in survey.found.items():
        table.add_row(ours, theirs)
    times = survey.times * 1e6
    console.print(f"{survey.kind}: {times.size} frames, {times[0]:g} us to {times[-1]:g} us")
    console.print(table)
    if survey.unused:
        console.print(f"Not used: {', '.join(survey.unused)}")
    left, right, bottom, top = (round(edge * 1e6, 6) + 0.0 for edge in raster.extent)
    console.print(
        f"Sampled every {raster.spacing * 1e6:.4g} um: {raster.columns} x {raster.rows} samples, "
        f"x {left:.4g} um to {right:.4g} um, y {bottom:.4g} um to {top:.4g} um"
    )
    for sentence in survey.from_file:
        console.print(f"From the file: {sentence}")
    say_assumed(looked.assumed)
