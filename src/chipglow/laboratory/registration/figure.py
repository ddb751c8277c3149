"""Infrared image and visible picture, on each other and in turns."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import HEAT, VERMILLION
from chipglow.laboratory.registration.registration import Registration
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene import Raster, Tool

_FACE: Final = 3e-3
_OPACITY: Final = 0.55
_BLINK_WIDTH: Final = 6.4
_LABEL: Final = "radiance temperature / °C"


def draw_registration(
    registration: Registration,
    temperature: NDArray[np.floating],
    raster: Raster,
    visible: NDArray[Any],
    tool: Tool | None = None,
    points: tuple[Array, Array] | None = None,
) -> Figure:
    """Draw the infrared image, and the visible picture with the infrared one laid over it."""
    celsius = np.asarray(temperature) - ZERO_CELSIUS
    limits = scales.ends(celsius, 0.5, 99.8, 1.0)
    with drawing.style():
        figure = drawing.new_figure(3.0)
        left, right = figure.subplots(1, 2)
        picture = drawing.show_image(left, celsius, raster, tool, HEAT, limits)
        left.set_title("infrared")
        _draw_visible(right, visible)
        warped = registration.warp(celsius, raster, (visible.shape[0], visible.shape[1]))
        _draw_warped(right, warped, limits, _OPACITY)
        right.set_title("visible, infrared over it")
        _draw_tool(right, registration, tool, visible.shape)
        if points is not None:
            left.plot(*(1e6 * points[0]).T, "+", color=VERMILLION)
            right.plot(*points[1].T, "+", color=VERMILLION)
            right.plot(*registration.pixels(points[0]).T, "o", color="white", fillstyle="none")
        drawing.colour_bar(figure, picture, [left, right], _LABEL)
    return figure


def blink_pictures(
    registration: Registration,
    temperature: NDArray[np.floating],
    raster: Raster,
    visible: NDArray[Any],
    tool: Tool | None = None,
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return the visible picture, and the infrared image as the visible camera would have it.

    Parameters are those of `draw_registration`.
    """
    shape = (visible.shape[0], visible.shape[1])
    celsius = registration.warp(np.asarray(temperature) - ZERO_CELSIUS, raster, shape)
    limits = scales.ends(celsius, 0.5, 99.8, 1.0)
    plain = _rendered(registration, visible, tool)
    hot = _rendered(registration, visible, tool, celsius, limits)
    return plain, hot


def _rendered(
    registration: Registration,
    visible: NDArray[Any],
    tool: Tool | None,
    celsius: Array | None = None,
    limits: tuple[float, float] = (0.0, 1.0),
) -> NDArray[np.uint8]:
    height = _BLINK_WIDTH * visible.shape[0] / visible.shape[1]
    figure = Figure(figsize=(_BLINK_WIDTH, height), dpi=100)
    canvas: Any = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    if celsius is None:
        _draw_visible(axes, visible)
    else:
        _draw_warped(axes, celsius, limits)
        axes.set_facecolor(scales.VOID)
    axes.set_axis_on()
    axes.set_xticks([])
    axes.set_yticks([])
    _draw_tool(axes, registration, tool, visible.shape)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba(), np.uint8)[..., :3].copy()


def _draw_visible(axes: Axes, visible: NDArray[Any]) -> None:
    low, high = np.percentile(visible, (0.5, 99.5))
    axes.imshow(visible, cmap="gray", vmin=low, vmax=max(high, low + 1e-9))
    axes.set_xlabel("column")
    axes.set_ylabel("row")


def _draw_warped(
    axes: Axes, celsius: Array, limits: tuple[float, float], opacity: float = 1.0
) -> None:
    shown: Any = np.ma.masked_invalid(celsius)
    axes.imshow(shown, cmap=HEAT, vmin=limits[0], vmax=limits[1], alpha=opacity)


def _draw_tool(
    axes: Axes, registration: Registration, tool: Tool | None, shape: tuple[int, ...]
) -> None:
    if tool is not None:
        drawing.draw_line(axes, registration.pixels(tool.outline(_FACE)), "black", factor=1.0)
    axes.set_xlim(-0.5, shape[1] - 0.5)
    axes.set_ylim(shape[0] - 0.5, -0.5)
