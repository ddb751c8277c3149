"""Takes the figures of an example: those that a block leaves in variables, each once."""

from typing import Any, Final

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

DOTS_PER_INCH: Final = 130


def take(block: tuple[Any, ...], variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Save the new figures of a block and return the text that shows them."""
    known = variables["example_globals"].setdefault("_taken", set())
    saved = []
    for figure in list(variables["example_globals"].values()):
        if isinstance(figure, Figure) and id(figure) not in known:
            known.add(id(figure))
            path = next(variables["image_path_iterator"])
            figure.savefig(path, dpi=DOTS_PER_INCH)
            saved.append(path)
    return str(figure_rst(saved, settings["src_dir"]))
