"""The command ``chipglow import``: fields of other programs to a scene."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from chipglow.cli import options as opt
from chipglow.cli.screen import current

if TYPE_CHECKING:
    from chipglow.io.importing import Prospect


def import_source(
    source: Annotated[
        Path,
        opt.argument(
            "SOURCE", "Mesh, grid, point cloud or movie, or YAML file describing an import."
        ),
    ],
    out: Annotated[
        Path | None, opt.file("Scene to write, NetCDF. Omit it to only inspect the source.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        opt.value(
            "FIELD=VALUE", "Set a field of the import (units.length=mm). Repeatable.", "--set"
        ),
    ] = None,
    resume: Annotated[bool, opt.flag("--resume", "Resume an interrupted import.")] = False,
) -> None:
    """Import meshes, grids, points or movies as a scene."""
    from chipglow.cli.progress import progress_bars, say_checkpoint
    from chipglow.io import import_scene, load_import, prospect
    from chipglow.io.importing import kept_import

    wanted = load_import(source, settings or ()).build()
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


def _say(looked: "Prospect") -> None:
    import pandas as pd

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
