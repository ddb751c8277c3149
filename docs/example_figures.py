"""How the gallery takes an example's figures, and in which order it shows the examples."""

from pathlib import Path
from typing import Any, Final

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

DOTS_PER_INCH: Final = 130
ORDER: Final = (
    *("radiance", "texture", "oxide_direction", "reflections", "steps", "psf", "optics"),
    *("detector", "shutter", "error", "tool_edges"),
    *("camera_files", "calibration", "emissivity", "temperature", "knife_edge", "registration"),
    *("rake_face", "shear_band", "correction", "compare"),
    *("programs", "meshes", "grids", "points", "movies", "any_scene"),
)


def take(block: tuple[Any, ...], variables: dict[str, Any], settings: dict[str, Any]) -> str:
    """Save the new figures of a block, each once, and return the text that shows them.

    The first figure of an example is not shown again: the page begins with it.
    """
    names = variables["example_globals"]
    known = names.setdefault("_taken", set())
    shown = []
    for figure in list(names.values()):
        if isinstance(figure, Figure) and id(figure) not in known:
            path = next(variables["image_path_iterator"])
            figure.savefig(path, dpi=DOTS_PER_INCH)
            if known:
                shown.append(path)
            known.add(id(figure))
    return str(figure_rst(shown, settings["src_dir"]))


class Order:
    """Sorts the examples of a folder; one that is not in the list is an error."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, name: str) -> int:
        """Place of a file."""
        return ORDER.index(Path(name).stem)
