"""Style of figures: sizes, curves, colour bars, legends, files."""

from base64 import b64encode
from collections.abc import Iterable
from io import BytesIO
from itertools import pairwise
from math import ceil, floor
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from numpy.typing import NDArray
from PIL.Image import Image, open as open_image
from PIL.ImageOps import invert

WIDTH: Final = 7.2
"""Width of a figure in inches: a page's text."""

_MARGIN: Final = 3
"""Pixels on the left of a column of panels."""

DPI: Final = 150
"""Pixels per inch of written figures."""

BAR_ASPECT: Final = 25
"""Length of a colour bar over its width."""

# Text and lines in points, for a figure as wide as the text of a page.
_STYLE: Final[Any] = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.labelsize": 9.5,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # otherwise sought above the ticks of each axis in each pass of the layout
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "lines.linewidth": 1.6,
    "legend.frameon": False,
    "image.interpolation": "nearest",
    "svg.hashsalt": "chipglow",
    "savefig.facecolor": "white",
}


def style() -> Any:
    """Return the context in which figures are drawn."""
    return matplotlib.rc_context(_STYLE)


def new_figure(
    height: float, layout: Literal["constrained", "compressed"] = "constrained"
) -> Figure:
    """Return an empty figure of the page's width and a height in inches."""
    figure = Figure(figsize=(WIDTH, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def axes_or_new(
    ax: Axes | None, layout: Literal["constrained", "compressed"] = "constrained"
) -> Axes:
    """Return axes, or those of a new figure that a notebook shows."""
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt  # takes long, and only notebooks need it

    return plt.subplots(layout=layout)[1]


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write a figure as PNG at 150 dots per inch and as SVG; images in it stay images."""
    png, svg = folder / f"{name}.png", folder / f"{name}.svg"
    if layout := figure.get_layout_engine():  # once; `savefig` repeats it for each file
        figure.set_dpi(DPI)
        layout.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(png, dpi=DPI)
    figure.savefig(svg, dpi=DPI, metadata={"Date": None})
    return png, svg


def panels(figure: Figure, png: Path) -> tuple[list[Image], Image | None]:
    """Cut the PNG of a saved figure into its columns of panels and the legend below them."""
    picture = open_image(png)
    width, height = picture.size
    legends = [legend.get_window_extent().extents for legend in figure.legends]
    lefts: dict[int, float] = {}
    specs = {axes: axes.get_subplotspec() for axes in figure.axes}
    first_column = min((spec.colspan.start for spec in specs.values() if spec), default=0)
    for axes, spec in specs.items():
        if spec and (column := spec.colspan.start) > first_column:
            left = axes.get_tightbbox().x0  # type: ignore[union-attr]
            lefts[column] = min(left, lefts.get(column, left))
    cuts = [0, *(floor(lefts[column]) - _MARGIN for column in sorted(lefts)), width]
    below = round(height - max((top for *_, top in legends), default=0.0))
    _, first, _, _ = _content(picture)
    columns = [picture.crop((left, first, right, below)) for left, right in pairwise(cuts)]
    columns = [column.crop((0, 0, column.width, _content(column)[3])) for column in columns]
    if not legends:
        return columns, None
    left, _, right, _ = legends[0]
    return columns, picture.crop((floor(left), below, ceil(right), height))


def _content(picture: Image) -> tuple[int, int, int, int]:
    """Return the left, upper, right and lower end of the part that is not white."""
    return invert(picture.convert("L")).getbbox() or (0, 0, *picture.size)


def label_panels(figure: Figure) -> None:
    """Label the vertical axis of every panel, as each may stand alone on a narrow screen."""
    labels: dict[int, str] = {}
    for axes in figure.axes:
        if spec := axes.get_subplotspec():
            first = labels.setdefault(spec.rowspan.start, axes.get_ylabel())
            axes.tick_params(labelleft=True)
            axes.set_ylabel(axes.get_ylabel() or first)


def png(image: Image) -> bytes:
    """Return an image as a PNG file."""
    file = BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def data_url(png: bytes) -> str:
    """Return a PNG file as a data URL."""
    return f"data:image/png;base64,{b64encode(png).decode('ascii')}"


def time_unit(longest: float) -> tuple[float, str]:
    """Return the unit of times up to the longest: its factor from s, and its name."""
    if longest < 1e-3:
        return 1e6, "µs"
    return (1e3, "ms") if longest < 1.0 else (1.0, "s")


def draw_line(
    axes: Axes, points: NDArray[np.float64], colour: str, label: str = "", factor: float = 1e6
) -> None:
    """Draw a curve in m on axes of another unit, visible on dark and light backgrounds."""
    axes.plot(*(points * factor).T, color="white", linewidth=3.0)
    axes.plot(*(points * factor).T, color=colour, linewidth=1.6, label=label)


def colour_bar(
    figure: FigureBase,
    picture: AxesImage,
    axes: Any,
    label: str,
    location: Literal["right", "bottom"] = "right",
) -> None:
    """Draw a colour bar; arrows show that values exceed its limits."""
    values, low, high = picture.get_array(), picture.norm.vmin, picture.norm.vmax
    assert values is not None and low is not None and high is not None
    under, over = bool(np.any(values < low)), bool(np.any(values > high))
    extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(
        (under, over), "neither"
    )
    figure.colorbar(
        picture, ax=axes, label=label, extend=extend, aspect=BAR_ASPECT, location=location
    )


def legend(
    figure: Figure, columns: int, panels: Iterable[Axes] | None = None, title: str | None = None
) -> None:
    """Add one legend below all panels, or with the labels of some; each label once."""
    handles: dict[str, Any] = {}
    for axes in figure.axes if panels is None else panels:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    look: Any = {"loc": "outside lower center", "ncols": columns, "title": title}
    figure.legend(handles.values(), handles.keys(), **look)


def draw_mean(
    axes: Axes, along: NDArray[np.float64], draws: NDArray[np.float64], colour: str, name: str
) -> None:
    """Draw the mean of draws, one per row, ± a standard deviation, and the first draw dotted."""
    mean, deviation = draws.mean(axis=0), draws.std(axis=0)
    axes.plot(along, mean, color=colour, label=name)
    shade(axes, along, mean, deviation, colour, opacity=0.2)
    axes.plot(along, draws[0], color=colour, linewidth=0.9, linestyle=":")


def shade(
    axes: Axes,
    along: NDArray[np.float64],
    middle: NDArray[np.float64],
    half: NDArray[np.float64],
    colour: Any,
    opacity: float = 0.15,
    label: str = "",
) -> None:
    """Shade a half width on either side of a curve, such as its uncertainty."""
    axes.fill_between(
        along, middle - half, middle + half, color=colour, alpha=opacity, linewidth=0, label=label
    )
