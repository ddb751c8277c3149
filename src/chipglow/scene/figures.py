"""Images of a raster in figures: axes in µm or mm, the tool's outline, colour bars."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LogNorm, Normalize, to_rgba
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from chipglow.drawing import drawing
from chipglow.drawing.scales import GREEN, HEAT, PLAIN, VOID, round_limit
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.frame import Material
from chipglow.scene.raster import Raster
from chipglow.scene.tool import Tool

if TYPE_CHECKING:
    from chipglow.scene.scene import Scene

_LARGEST_IN_MICRONS: Final = 5e-3


def image_figure(raster: Raster, panel_width: float, rows: int) -> Figure:
    """Return an empty figure of the page's width for rows of images of a width in inches."""
    panel = panel_width * raster.rows / raster.columns
    return drawing.new_figure(rows * (panel + 0.35) + 0.45, "compressed")


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
        drawing.colour_bar(figure, picture, axes, self.label, bar)
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


def draw_chip(overview: "Scene", view: Raster, tool: Tool | None) -> Figure:
    """Return a figure of the whole chip with the border of a view."""
    frame, raster = overview.frame(0), overview.raster
    void, solid = frame.material == Material.VOID, frame.material == Material.WORKPIECE
    celsius = np.where(void, np.nan, frame.temperature - ZERO_CELSIUS)
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
        drawing.draw_line(axes, view.border, GREEN, factor=factor)
        axes.label_outer()
    return figure


def leave_out(axes: Axes, above: Axes | None, raster: Raster) -> None:
    """Remove an image and label the one above it, now the lowest of its column."""
    axes.remove()
    if above is not None:
        above.set_xlabel(f"x / {length_unit(raster)[1]}")
        above.tick_params(labelbottom=True)


def crop(axes: Axes, points: NDArray[np.float64], raster: Raster, around: float) -> None:
    """Limit micrometre axes to points in m and a margin around them."""
    left, right, bottom, top = (1e6 * edge for edge in raster.extent)
    known = 1e6 * points[np.isfinite(points).all(axis=-1)]
    (x_least, y_least), (x_most, y_most) = known.min(axis=0), known.max(axis=0)
    axes.set_xlim(max(left, x_least - 1e6 * around), min(right, x_most + 1e6 * around))
    axes.set_ylim(max(bottom, y_least - 1e6 * around), min(top, y_most + 1e6 * around))


def plot_image(
    celsius: NDArray[Any],
    raster: Raster,
    tool: Tool | None,
    label: str,
    time: float,
    ax: Axes | None,
) -> Axes:
    """Draw temperatures in °C with the tool's outline and a colour bar."""
    axes = drawing.axes_or_new(ax, "compressed")
    limits = (np.nanmin(celsius), np.nanmax(celsius)) if np.isfinite(celsius).any() else (0.0, 1.0)
    picture = show_image(axes, celsius, raster, tool, "inferno", limits)
    axes.set_title(f"{1e6 * time:.6g} µs", loc="left")
    axes.figure.colorbar(picture, ax=axes, label=label)
    return axes
