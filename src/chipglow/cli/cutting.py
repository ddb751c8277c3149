"""The command ``chipglow cut``: the cutting simulation, and optionally a movie of it."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import copyfile

from rich.console import Console

from chipglow.cli.inertia import say_of_cut
from chipglow.cli.progress import progress_bars, say_where_it_starts
from chipglow.io import atomic_path, open_scene
from chipglow.laboratory.chip import inertia, resolution_warnings
from chipglow.scene import Frame
from chipglow.study import Study, cut, is_cut, kept_progress, preview_raster


def cut_study(study: Study, out: Path, preview: Path | None, resume: bool, agreed: bool) -> None:
    """Run the cut, or take it from the cache, and write the scene."""
    with atomic_path(out) as temporary, _movie(study, preview) as on_preview:
        say_where_it_starts(study, resume, agreed)
        if on_preview:
            _announce_preview(study, resume)
        with progress_bars() as progress:
            copyfile(cut(study, progress, resume, on_preview), temporary)
    scene = open_scene(out)
    say_of_cut(inertia(scene), resolution_warnings(scene))
    scene.data.close()


@contextmanager
def _movie(study: Study, path: Path | None) -> Iterator[Callable[[Frame], None] | None]:
    if path is None:
        yield None
        return
    from chipglow.io import check_movie_path

    try:
        check_movie_path(path)
    except ValueError as error:
        raise ValueError(f"--preview: {error}") from None
    from chipglow.report import cut_movie

    with cut_movie(path, preview_raster(study), study.cutting.simulation()) as on_preview:
        yield on_preview


def _announce_preview(study: Study, resume: bool) -> None:
    console, window = Console(stderr=True), study.cutting.window
    if is_cut(study):
        console.print(
            f"The preview shows the cached scene: {window.start * 1e3:g} mm to "
            f"{window.end * 1e3:g} mm of the cut."
        )
    elif resume and kept_progress(study):
        console.print("The preview shows the rest of the cut.")
