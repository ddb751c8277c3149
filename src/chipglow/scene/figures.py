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
from chipglow.drawing.scales import GREEN, HEAT, PLAIN, RATE, VOID, ends
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.frame import Frame, Material
from chipglow.scene.raster import Raster
from chipglow.scene.tool import DRAWN_FACE, Tool

if TYPE_CHECKING:
    from chipglow.scene.scene import Scene

SPEED: Final = "speed"
"""Title of the panel of the speed."""

_LARGEST_IN_MICRONS: Final = 5e-3
"""Length in m from which axes are in millimetres."""

_SLOWEST: Final = 1e-30
"""Strain rate in 1/s of which the logarithm is taken where nothing is strained."""

_DECADES: Final = 3
"""Decades of a scale of strain rates."""


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
    outline = tool.outline(DRAWN_FACE) * factor
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


def field_panels(frame: Frame) -> list[ImagePanel]:
    """Return panels of temperature and, if available, strain, strain rate and speed."""
    there, solid = frame.material != Material.VOID, frame.material == Material.WORKPIECE
    temperature = np.where(there, frame.temperature.astype(np.float64) - ZERO_CELSIUS, np.nan)
    heat = ends(temperature, 0.1, 99.9)
    panels = [ImagePanel("temperature", "temperature / °C", temperature, heat, HEAT)]
    if frame.plastic_strain is not None:
        strain = np.where(solid, frame.plastic_strain, np.nan)
        limits = (0.0, ends(strain, 0.0, 98.0)[1])
        panels.append(ImagePanel("plastic strain", "plastic strain", strain, limits))
    if frame.plastic_strain_rate is not None:
        rate = np.where(solid, frame.plastic_strain_rate, np.nan)
        decades = _decades(rate)
        panels.append(
            ImagePanel(
                "plastic strain rate",
                "strain rate / (1/s)",
                np.maximum(rate, decades[0]),
                decades,
                RATE,
                log=True,
            )
        )
    if frame.velocity_x is not None and frame.velocity_y is not None:
        speed = np.where(solid, np.hypot(frame.velocity_x, frame.velocity_y), np.nan)
        panels.append(ImagePanel(SPEED, "speed / (m/s)", speed, (0.0, ends(speed, 0.0, 99.9)[1])))
    return panels


def _decades(rate: NDArray[Any]) -> tuple[float, float]:
    fastest = ends(rate, 0.0, 99.9)[1]
    # A power of ten is its own top, whatever the rounding of the logarithm.
    top = float(np.ceil(np.log10(max(fastest, _SLOWEST)) - 1e-9))
    return 10.0 ** (top - _DECADES), 10.0**top


def draw_chip(overview: "Scene", view: Raster, tool: Tool | None) -> Figure:
    """Return a figure of the whole chip with the border of a view."""
    raster = overview.raster
    panels = field_panels(overview.frame(0))[:3]
    figure = image_figure(raster, 2.2, rows=1)
    factor, _ = length_unit(raster)
    grid = figure.subplots(1, len(panels), sharey=True)
    for axes, panel in zip(grid, panels, strict=True):
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
