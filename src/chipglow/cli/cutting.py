"""The command ``chipglow cut``: the cutting simulation, and optionally a movie of it."""

import sys
from collections.abc import Iterable
from contextlib import nullcontext
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from chipglow.cli import options as opt
from chipglow.cli.screen import current

if TYPE_CHECKING:
    from chipglow.laboratory.chip import Inertia

_INERTIA: Final = {
    "kinetic_fraction": "kinetic energy at most {:.2%} of the work",
    "force_fraction": "momentum flux {:.2%} of the mean cutting force",
}


def cut(
    study: opt.StudyFile,
    out: Annotated[Path, opt.file("Scene to write, NetCDF.")],
    preview: Annotated[
        Path | None,
        opt.file(
            "Movie to write, .mp4 or .gif: temperature, plastic strain and strain rate of the "
            "whole cut; with --resume, of the rest; of a cached cut, of the recorded part.",
            ".mp4",
            ".gif",
        ),
    ] = None,
    resume: opt.Resume = False,
    yes: opt.Yes = False,
) -> None:
    """Run only the cutting simulation of a study."""
    from shutil import copyfile

    from chipglow.cli.progress import confirm_cost, progress_bars
    from chipglow.io import atomic_path, open_scene
    from chipglow.laboratory.chip import inertia, resolution_warnings
    from chipglow.study import cut as compute, load_study, preview_raster

    loaded = load_study(study)
    movie: Any = nullcontext()
    if preview is not None:
        from chipglow.report import cut_movie

        movie = cut_movie(preview, preview_raster(loaded), loaded.cutting.simulation())
    with atomic_path(out) as temporary, movie as on_preview:
        confirm_cost(loaded, resume, yes)
        with progress_bars() as progress:
            copyfile(compute(loaded, progress, resume, on_preview), temporary)
    scene = open_scene(out)
    say_of_cut(inertia(scene), resolution_warnings(scene))
    scene.data.close()
    for path in filter(None, (out, preview)):
        current().file(path)


def say_of_cut(inertia: "Inertia | None", warnings: Iterable[str] = ()) -> None:
    """Print kinetic energy and momentum of the scaled mass, and the warnings of the cut."""
    from chipglow.text import Notes

    fractions = {name: getattr(inertia, name, nan) for name in _INERTIA}
    known = {name: fraction for name, fraction in fractions.items() if isfinite(fraction)}
    if known:
        texts = ", ".join(_INERTIA[name].format(fraction) for name, fraction in known.items())
        current().say(f"Scaled mass after the build-up: {texts}.", known, sys.stderr)
    own = [inertia.warning] if inertia and inertia.warning else []
    current().notes(Notes(warnings=[*own, *warnings]))
