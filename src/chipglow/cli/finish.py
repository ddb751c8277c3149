"""How every command with a result ends: notes, then the files that were asked for."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from chipglow.cli.screen import current

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from chipglow.text import Notes

Writer: TypeAlias = Callable[[Path], object]


def finish(notes: "Notes", *files: tuple[Path | None, Writer]) -> None:
    """Print assumptions and warnings, then write each file that has a path."""
    screen = current()
    screen.notes(notes)
    for path, write in files:
        if path is not None:
            write(path)
            screen.file(path)


def figure(draw: "Callable[..., Figure]", *arguments: Any) -> Writer:
    """Return a function that draws a figure and writes it in the format of the file's name."""

    def write(path: Path) -> None:
        from chipglow.io import atomic_path

        drawn = draw(*arguments)
        with atomic_path(path) as temporary:
            drawn.savefig(temporary, format=path.suffix[1:].lower(), dpi=150)

    return write
