"""Other people's fields to a scene's file, with what was found and what had to be assumed."""

from pathlib import Path

import pandas as pd
from rich.console import Console

from chipglow.cli.progress import progress_bars
from chipglow.cli.screen import current
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
    current().file(out)


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
    screen, survey, raster = current(), looked.survey, looked.raster
    times = survey.times * 1e6
    screen.say(
        f"{survey.kind}: {times.size} frames, {times[0]:g} us to {times[-1]:g} us",
        {"kind": survey.kind, "frames": times.size, "from_us": times[0], "to_us": times[-1]},
    )
    fields = pd.DataFrame(survey.found.items(), columns=["field", "from"])
    screen.table("fields", fields)
    if survey.unused:
        screen.say(f"Not used: {', '.join(survey.unused)}", {"unused": list(survey.unused)})
    left, right, bottom, top = (round(edge * 1e6, 6) + 0.0 for edge in raster.extent)
    screen.say(
        f"Sampled every {raster.spacing * 1e6:.4g} um: {raster.columns} x {raster.rows} samples, "
        f"x {left:.4g} um to {right:.4g} um, y {bottom:.4g} um to {top:.4g} um",
        {
            "spacing_um": raster.spacing * 1e6,
            "columns": raster.columns,
            "rows": raster.rows,
            "extent_um": [left, right, bottom, top],
        },
    )
    screen.remarks(looked.notes)
    screen.notes(looked.notes)
