"""Figure of a scene at one time: its fields and the distribution of their values."""

from math import ceil
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREY, VERMILLION, VOID, shown_frame
from chipglow.scene.figures import SPEED, ImagePanel, field_panels, leave_out, show_image, veil
from chipglow.scene.frame import FILLED, Frame, Material
from chipglow.scene.raster import Raster
from chipglow.scene.scene import Scene
from chipglow.scene.tool import Tool

_COLOURS: Final = {Material.VOID: VOID, Material.WORKPIECE: BLUE, Material.TOOL: GREY}

_PANEL_WIDTH: Final = 2.6
"""Width of a panel in inches."""

_PANEL_HEIGHTS: Final = (1.0, 3.4)
"""Smallest and largest height of a panel in inches."""

_LABEL_HEIGHT: Final = 0.46
"""Height in inches of title and labels of a panel."""

_HISTOGRAM_HEIGHT: Final = 1.8
"""Height of a histogram in inches."""

_BINS: Final = 60
"""Bins of a histogram."""

_ARROWS: Final = 14
"""Arrows along the longer side of a panel."""


def draw_scene(scene: Scene, time: float | None = None) -> Figure:
    """Draw the fields of the frame nearest to a time in s, and histograms over the workpiece."""
    frame = scene.frame(shown_frame(scene.times, time, "scene"))
    raster, tool, panels = scene.raster, scene.tool, field_panels(frame)
    has_quality = frame.quality is not None and bool(
        frame.quality[frame.material != Material.VOID].any()
    )
    has_kinds = tool is not None or bool((frame.material != Material.WORKPIECE).any())
    rows = ceil((len(panels) + has_kinds + has_quality) / 2)
    histogram_rows = ceil(len(panels) / 2)
    with drawing.style():
        images = rows * (_panel_height(raster) + _LABEL_HEIGHT) + _LABEL_HEIGHT
        histograms = histogram_rows * _HISTOGRAM_HEIGHT
        figure = drawing.new_figure(images + histograms)
        figure.suptitle(f"{frame.time * 1e6:.6g} µs")
        # The layout of subfigures leaves too little room for labels on their left.
        engine: Any = figure.get_layout_engine()
        engine.set(rect=(0.02, 0.0, 0.98, 1.0))
        parts: Any = figure.subfigures(2, 1, height_ratios=(images, histograms))
        top, bottom = parts
        grid = top.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
        places = iter(grid.flat)
        for panel in panels:
            axes = next(places)
            panel.draw(top, axes, raster, tool)
            axes.label_outer()
            if panel.title == SPEED:
                _draw_arrows(axes, frame, raster)
        if has_kinds:
            _draw_material(top, next(places), frame, raster, tool)
        if has_quality and frame.quality is not None:
            _draw_quality(top, next(places), frame, frame.quality, raster, tool)
        for empty in places:
            leave_out(empty, grid[-2, 1] if rows > 1 else None, raster)
        solid = frame.material == Material.WORKPIECE
        below = bottom.subplots(histogram_rows, 2, squeeze=False)
        for axes, panel in zip(below.flat, panels, strict=False):
            _draw_histogram(axes, panel, panel.image[solid])
        for axes in below.flat[len(panels) :]:
            axes.remove()
        whose = " of the workpiece's samples" if histogram_rows > 1 else ""
        bottom.supylabel(f"fraction{whose} / %", fontsize=9.5)
    return figure


def _panel_height(raster: Raster) -> float:
    least, most = _PANEL_HEIGHTS
    return min(max(_PANEL_WIDTH * raster.rows / raster.columns, least), most)


def _draw_arrows(axes: Axes, frame: Frame, raster: Raster) -> None:
    """Draw velocities on a coarse grid; the largest is as long as the grid spacing."""
    step = max(ceil(max(raster.shape) / _ARROWS), 1)
    coarse = np.s_[step // 2 :: step, step // 2 :: step]
    solid = frame.material[coarse] == Material.WORKPIECE
    x, y = np.meshgrid(raster.x[coarse[1]] * 1e6, raster.y[coarse[0]] * 1e6)
    u = frame.needed("velocity_x")[coarse][solid]
    v = frame.needed("velocity_y")[coarse][solid]
    fastest = float(np.hypot(u, v).max(initial=0.0))
    if fastest > 0.0:
        scale = fastest / (step * raster.spacing * 1e6)
        style: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": scale}
        edge: dict[str, Any] = {"color": "white", "edgecolor": "black", "linewidth": 0.4}
        axes.quiver(x[solid], y[solid], u, v, width=0.007, pivot="mid", **style, **edge)


def _draw_material(
    figure: Any, axes: Axes, frame: Frame, raster: Raster, tool: Tool | None
) -> None:
    colours = ListedColormap([_COLOURS[kind] for kind in Material])
    ends = (-0.5, len(Material) - 0.5)
    picture = show_image(axes, frame.material, raster, tool, colours, ends)
    bar = figure.colorbar(picture, ax=axes, aspect=drawing.BAR_ASPECT, ticks=list(Material))
    bar.ax.set_yticklabels([kind.name.lower() for kind in Material], rotation=90, va="center")
    axes.set_title("material")
    axes.label_outer()


def _draw_quality(
    figure: Any,
    axes: Axes,
    frame: Frame,
    flags: NDArray[np.uint8],
    raster: Raster,
    tool: Tool | None,
) -> None:
    there = frame.material != Material.VOID
    filled = there & (flags == FILLED)
    distance = np.where(there & ~filled, flags, np.nan)
    ends = (0.0, scales.ends(distance, 0.0, 99.0)[1])
    title = f"quality; red: filled, {100 * filled.sum() / there.sum():.2g} %"
    ImagePanel(title, "colour distance / ΔE", distance, ends).draw(figure, axes, raster, tool)
    axes.label_outer()
    veil(axes, filled, raster, VERMILLION, 1.0)


def _draw_histogram(axes: Axes, panel: ImagePanel, values: NDArray[Any]) -> None:
    axes.set_xlabel(panel.label)
    if values.size == 0:
        axes.set_title("no workpiece")
        return
    low, high = scales.ends(values, 0.0, 100.0)
    bins = np.geomspace(low, high, _BINS) if panel.log else np.linspace(low, high, _BINS)
    axes.hist(values, bins.tolist(), weights=np.full(values.size, 100.0 / values.size), color=BLUE)
    axes.set_yscale("log")
    if panel.log:
        axes.set_xscale("log")
        axes.set_title("slower ones in the first bar")
