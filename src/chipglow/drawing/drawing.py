"""Style of figures: sizes, colours, images on micrometre axes."""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from math import ceil, floor
from pathlib import Path
from typing import Any, Final, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap, LogNorm, Normalize, to_rgba
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from numpy.typing import NDArray
from PIL.Image import Image, open as open_image
from PIL.ImageOps import invert

from chipglow.drawing.scales import GREEN, HEAT, KELVIN, PLAIN, VOID, round_limit
from chipglow.scene import Material, Raster, Scene, Tool

WIDTH: Final = 7.2
"""Width of a figure in inches: a page's text."""

_MARGIN: Final = 3
"""Pixels on the left of a column of panels."""

_LARGEST_IN_MICRONS: Final = 5e-3

_STYLE: Final[Any] = {
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.labelsize": 9.5,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "legend.fontsize": 9,
    "axes.titlelocation": "left",
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


def image_figure(raster: Raster, panel_width: float, rows: int) -> Figure:
    """Return an empty figure of the page's width for rows of images of a width in inches."""
    panel = panel_width * raster.rows / raster.columns
    return new_figure(rows * (panel + 0.35) + 0.45, "compressed")


def save(figure: Figure, folder: Path, name: str) -> tuple[Path, Path]:
    """Write a figure as PNG at 150 dots per inch and as SVG; images in it stay images."""
    png, svg = folder / f"{name}.png", folder / f"{name}.svg"
    if layout := figure.get_layout_engine():  # once; `savefig` repeats it for each file
        figure.set_dpi(150)
        layout.execute(figure)
        figure.set_layout_engine(None)
    figure.savefig(png, dpi=150)
    figure.savefig(svg, dpi=150, metadata={"Date": None})
    return png, svg


def panels(figure: Figure, png: Path) -> tuple[list[Image], Image | None]:
    """Cut the PNG of a saved figure into its columns of panels and the legend below them."""
    picture = open_image(png)
    width, height = picture.size
    legends = [legend.get_window_extent().extents for legend in figure.legends]
    lefts: dict[int, float] = {}
    for axes in figure.axes:
        if spec := axes.get_subplotspec():
            left, column = axes.get_tightbbox().x0, spec.colspan.start  # type: ignore[union-attr]
            lefts[column] = min(left, lefts.get(column, left))
    cuts = [0, *(floor(lefts[column]) - _MARGIN for column in sorted(lefts)[1:]), width]
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


def show_image(
    axes: Axes,
    image: NDArray[Any],
    raster: Raster,
    tool: Tool | None,
    colours: str | Colormap,
    limits: tuple[float, float],
    *,
    log: bool = False,
) -> AxesImage:
    """Draw an image with the tool's outline; undefined values are grey. See `length_unit`."""
    factor, unit = length_unit(raster)
    extent = np.array(raster.extent) * factor
    shown = matplotlib.colormaps.get_cmap(colours).with_extremes(bad=VOID)
    picture = axes.imshow(
        np.ma.masked_invalid(image),
        extent=tuple(extent),
        cmap=shown,
        norm=LogNorm(*limits) if log else Normalize(*limits),
    )
    if tool is not None:
        draw_tool(axes, tool, factor)
    axes.set_xlim(extent[0], extent[1])
    axes.set_ylim(extent[2], extent[3])
    axes.set_xlabel(f"x / {unit}")
    axes.set_ylabel(f"y / {unit}")
    return picture


def length_unit(raster: Raster) -> tuple[float, str]:
    """Return the unit of an image's axes, µm or mm: its factor from m, and its name."""
    longest = raster.spacing * max(raster.rows, raster.columns)
    return (1e6, "µm") if longest < _LARGEST_IN_MICRONS else (1e3, "mm")


def time_unit(longest: float) -> tuple[float, str]:
    """Return the unit of times up to the longest: its factor from s, and its name."""
    if longest < 1e-3:
        return 1e6, "µs"
    return (1e3, "ms") if longest < 1.0 else (1.0, "s")


def veil(
    axes: Axes,
    where: NDArray[np.bool_],
    raster: Raster,
    colour: str = "white",
    opacity: float = 0.5,
) -> None:
    """Cover part of an image with a translucent colour."""
    layer = np.broadcast_to(to_rgba(colour), (*where.shape, 4)).copy()
    layer[..., 3] = np.where(where, opacity, 0.0)
    axes.imshow(layer, extent=tuple(np.array(raster.extent) * length_unit(raster)[0]))


def draw_tool(axes: Axes, tool: Tool, factor: float = 1e6) -> None:
    """Draw the tool's outline, visible on dark and light backgrounds."""
    outline = tool.outline(3e-3) * factor
    axes.plot(*outline.T, color="white", linewidth=2.2)
    axes.plot(*outline.T, color="black", linewidth=1.0)


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
    figure.colorbar(picture, ax=axes, label=label, extend=extend, aspect=25, location=location)


@dataclass(frozen=True)
class ImagePanel:
    """An image with its title and a colour bar with a label between limits; NaN is void."""

    title: str
    label: str
    image: NDArray[Any]
    limits: tuple[float, float]
    colours: str = PLAIN
    log: bool = False

    def draw(
        self,
        figure: FigureBase,
        axes: Axes,
        raster: Raster,
        tool: Tool | None = None,
        bar: Literal["right", "bottom"] = "right",
    ) -> None:
        """Draw the image with the tool's outline and a colour bar on a side."""
        picture = show_image(
            axes, self.image, raster, tool, self.colours, self.limits, log=self.log
        )
        colour_bar(figure, picture, axes, self.label, bar)
        axes.set_title(self.title)


def image_panels(panels: Sequence[ImagePanel], raster: Raster, tool: Tool | None) -> Figure:
    """Return a figure of images on the same raster, two in a row."""
    rows = (len(panels) + 1) // 2
    figure = image_figure(raster, 2.5, rows)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        panel.draw(figure, axes, raster, tool)
        axes.label_outer()
    for axes in grid.flat[len(panels) :]:
        leave_out(axes, grid[-2, 1] if rows > 1 else None, raster)
    return figure


def draw_chip(overview: Scene, view: Raster, tool: Tool | None) -> Figure:
    """Return a figure of the whole chip with the border of a view."""
    frame, raster = overview.frame(0), overview.raster
    void, solid = frame.material == Material.VOID, frame.material == Material.WORKPIECE
    celsius = np.where(void, np.nan, frame.temperature - KELVIN)
    strain = np.where(solid, frame.needed("plastic_strain"), np.nan)
    rate = np.where(solid, 1e-3 * frame.needed("plastic_strain_rate"), np.nan)
    heat = (0.0, round_limit(celsius, 99.9, 50.0))
    panels = (
        ImagePanel("temperature", "temperature / °C", celsius, heat, HEAT),
        ImagePanel("plastic strain", "plastic strain", strain, (0.0, 4.0)),
        ImagePanel("strain rate", "strain rate / (10³ 1/s)", rate, (0.0, 60.0)),
    )
    figure = image_figure(raster, 2.2, rows=1)
    factor, _ = length_unit(raster)
    for axes, panel in zip(figure.subplots(1, 3, sharey=True), panels, strict=True):
        panel.draw(figure, axes, raster, tool, "bottom")
        draw_line(axes, view.border, GREEN, factor=factor)
        axes.label_outer()
    return figure


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


def leave_out(axes: Axes, above: Axes | None, raster: Raster) -> None:
    """Remove an image and label the one above it, now the lowest of its column."""
    axes.remove()
    if above is not None:
        above.set_xlabel(f"x / {length_unit(raster)[1]}")
        above.tick_params(labelbottom=True)


def draw_mean(
    axes: Axes, along: NDArray[np.float64], draws: NDArray[np.float64], colour: str, name: str
) -> None:
    """Draw the mean of draws, one per row, ± a standard deviation, and the first draw dotted."""
    mean, deviation = draws.mean(axis=0), draws.std(axis=0)
    axes.plot(along, mean, color=colour, label=name)
    shade(axes, along, mean, deviation, colour, 0.2)
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


def crop(axes: Axes, points: NDArray[np.float64], raster: Raster, around: float) -> None:
    """Limit micrometre axes to points in m and a margin around them."""
    left, right, bottom, top = (1e6 * edge for edge in raster.extent)
    known = 1e6 * points[np.isfinite(points).all(axis=-1)]
    (x_least, y_least), (x_most, y_most) = known.min(axis=0), known.max(axis=0)
    axes.set_xlim(max(left, x_least - 1e6 * around), min(right, x_most + 1e6 * around))
    axes.set_ylim(max(bottom, y_least - 1e6 * around), min(top, y_most + 1e6 * around))
