"""Pictures that a command draws to a file of the user's choice."""

from pathlib import Path
from typing import TYPE_CHECKING

from chipglow.cli.screen import current

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def write_picture(figure: "Figure", path: Path) -> None:
    """Write a figure as the kind of picture that the file's name says, and print that name."""
    from chipglow.io import atomic_path

    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=path.suffix[1:].lower(), dpi=150)
    current().file(path)
