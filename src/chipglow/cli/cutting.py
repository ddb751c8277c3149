"""The command ``chipglow cut``: the cutting simulation, and optionally a movie of it."""

import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from math import isfinite, nan
from pathlib import Path
from shutil import copyfile
from typing import Final

from rich.console import Console

from chipglow.cli.progress import confirm_cost, progress_bars
from chipglow.cli.screen import current
from chipglow.io import atomic_path, open_scene
from chipglow.laboratory.chip import Inertia, inertia, resolution_warnings
from chipglow.scene import Frame
from chipglow.study import Study, cut, is_cut, kept_progress, preview_raster
from chipglow.text import Notes

_INERTIA: Final = {
    "kinetic_fraction": "kinetic energy at most {:.2%} of the work",
    "force_fraction": "momentum flux {:.2%} of the mean cutting force",
}


def cut_study(study: Study, out: Path, preview: Path | None, resume: bool, agreed: bool) -> None:
    """Run the cut, or take it from the cache, and write the scene."""
    movie: AbstractContextManager[Callable[[Frame], None] | None] = nullcontext()
    if preview is not None:
        from chipglow.report import cut_movie

        movie = cut_movie(preview, preview_raster(study), study.cutting.simulation())
    with atomic_path(out) as temporary, movie as on_preview:
        confirm_cost(study, resume, agreed)
        if on_preview:
            _announce_preview(study, resume)
        with progress_bars() as progress:
            copyfile(cut(study, progress, resume, on_preview), temporary)
    scene = open_scene(out)
    say_of_cut(inertia(scene), resolution_warnings(scene))
    scene.data.close()
    current().file(out)
    if preview is not None:
        current().file(preview)


def say_of_cut(inertia: Inertia | None, warnings: Iterable[str] = ()) -> None:
    """Print kinetic energy and momentum of the scaled mass, and the warnings of the cut."""
    fractions = {name: getattr(inertia, name, nan) for name in _INERTIA}
    known = {name: fraction for name, fraction in fractions.items() if isfinite(fraction)}
    if known:
        texts = ", ".join(_INERTIA[name].format(fraction) for name, fraction in known.items())
        current().say(f"Scaled mass after the build-up: {texts}.", known, sys.stderr)
    own = [inertia.warning] if inertia and inertia.warning else []
    current().notes(Notes(warnings=[*own, *warnings]))


def _announce_preview(study: Study, resume: bool) -> None:
    console, window = Console(stderr=True), study.cutting.window
    if is_cut(study):
        console.print(
            f"The preview shows the cached scene: {window.start * 1e3:g} mm to "
            f"{window.end * 1e3:g} mm of the cut."
        )
    elif resume and kept_progress(study):
        console.print("The preview shows the rest of the cut.")
