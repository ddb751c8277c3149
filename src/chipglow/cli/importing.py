"""The command ``chipglow import``: fields of other programs to a scene."""

from pathlib import Path

import pandas as pd

from chipglow.cli.progress import progress_bars, say_checkpoint
from chipglow.cli.screen import current
from chipglow.io import ImportDescription, import_scene, prospect
from chipglow.io.importing import Prospect, kept_import


def import_fields(description: ImportDescription, out: Path | None, resume: bool) -> None:
    """Print the contents of a source and, if a file is named, write its scene."""
    wanted = description.build()
    looked = prospect(wanted)
    _say(looked)
    if out is None:
        return
    kept = kept_import(wanted, looked, out)
    say_checkpoint("import", kept.progress if kept else 0.0, resume)
    with progress_bars() as progress:
        import_scene(
            wanted,
            out,
            lambda fraction: progress("import", fraction),
            looked=looked,
            resume=kept if resume else None,
        )
    current().file(out)


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
