"""How the gallery takes an example's figures, and in which order it shows the examples."""

import shutil
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox
from sphinx_gallery.scrapers import figure_rst

DOTS_PER_INCH: Final = 130
PANELS: Final = "panels"
THUMBNAIL: Final = (480, 336)
"""Largest width and height in pixels: twice those in which a page shows them."""
MARGIN: Final = 0.04
"""Width of a panel in inches."""
WIDEST: Final = 4.0
"""Width of a panel in inches above which its words would be too small: it is drawn narrower."""
SHOWN_PANEL: Final = {
    **{"detector": 1, "optics": 5, "psf": 3, "reflections": 1, "shutter": 1, "steps": 3},
    **{"tool_edges": 1, "camera_files": 1, "correction": 1, "registration": 1},
    **{"movies": 1, "points": 2},
}
"""Index of the axes that stand for an example in the gallery; of others the first."""
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
            else:
                save_panel(figure, Path(path))
            known.add(id(figure))
    return str(figure_rst(shown, settings["src_dir"]))


def save_panel(figure: Figure, path: Path) -> None:
    """Save one panel of an example's first figure, as its thumbnail, in the folder `PANELS`."""
    name = path.name.replace("_001.", "_thumb.")
    axes = figure.axes[SHOWN_PANEL.get(name.removeprefix("sphx_glr_").split("_thumb")[0], 0)]
    size, legends = figure.get_size_inches(), list(figure.legends)
    if (width := _extent(figure, axes).width) > WIDEST:
        figure.set_size_inches(size[0] * WIDEST / width, size[1])
        legends += [legend] if (legend := axes.get_legend()) else []
    for legend in legends:  # of all panels, or too wide
        legend.set(visible=False, in_layout=False)
    figure.draw_without_rendering()
    bounds = _extent(figure, axes)
    folder = path.parent / PANELS
    folder.mkdir(exist_ok=True)
    dots = min(THUMBNAIL[0] / bounds.width, THUMBNAIL[1] / bounds.height)
    figure.savefig(folder / name, dpi=dots, bbox_inches=bounds)
    for legend in legends:
        legend.set(visible=True, in_layout=True)
    figure.set_size_inches(size)


def _extent(figure: Figure, axes: Axes) -> Bbox:
    """Return the extent in inches of axes with their labels, after the figure was drawn."""
    bounds = axes.get_tightbbox()
    assert bounds is not None, "the panel is invisible"
    return Bbox(bounds.transformed(figure.dpi_scale_trans.inverted())).padded(MARGIN)


def use_panels(app: Any) -> None:
    """Show the panels as thumbnails: whole figures cannot be read as small as that."""
    for panel in Path(app.srcdir, "gallery").glob(f"*/images/{PANELS}/*.png"):
        shutil.copy(panel, panel.parents[1] / "thumb" / panel.name)


class Order:
    """Sorts the examples of a folder; one that is not in the list is an error."""

    def __init__(self, folder: str) -> None:
        self.folder = folder

    def __call__(self, name: str) -> int:
        """Place of a file."""
        return ORDER.index(Path(name).stem)
