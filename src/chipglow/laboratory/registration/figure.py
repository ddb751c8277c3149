"""Infrared image and visible picture, on each other and in turns."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import HEAT, VERMILLION, VOID
from chipglow.laboratory.registration.registration import Registration
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene import Raster, Tool
from chipglow.scene.figures import show_image
from chipglow.scene.tool import DRAWN_FACE

_OPACITY: Final = 0.55
"""Opacity of the infrared image over the visible picture."""

_BLINK_WIDTH: Final = 6.4
"""Width in inches of the pictures that are shown in turn."""

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
        picture = show_image(left, celsius, raster, tool, HEAT, limits)
        left.set_title("infrared")
        warped = registration.warp(celsius, raster, (visible.shape[0], visible.shape[1]))
        _show(right, visible, "gray", scales.ends(visible, 0.5, 99.5))
        _show(right, warped, HEAT, limits, _OPACITY)
        _draw_tool(right, registration, tool, visible.shape)
        right.set(title="visible, infrared over it", xlabel="column", ylabel="row")
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
    """Return the visible picture, and the infrared image as the visible camera would have it."""
    shape = (visible.shape[0], visible.shape[1])
    celsius = registration.warp(np.asarray(temperature) - ZERO_CELSIUS, raster, shape)

    def rendered(image: NDArray[Any], colours: str, limits: tuple[float, float]) -> Any:
        height = _BLINK_WIDTH * shape[0] / shape[1]
        figure = Figure(figsize=(_BLINK_WIDTH, height), dpi=100)
        canvas: Any = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), facecolor=VOID)
        _show(axes, image, colours, limits)
        axes.set(xticks=[], yticks=[])
        _draw_tool(axes, registration, tool, shape)
        canvas.draw()
        return np.asarray(canvas.buffer_rgba(), np.uint8)[..., :3].copy()

    plain = rendered(visible, "gray", scales.ends(visible, 0.5, 99.5))
    return plain, rendered(celsius, HEAT, scales.ends(celsius, 0.5, 99.8, 1.0))


def _show(
    axes: Axes, image: NDArray[Any], colours: Any, limits: tuple[float, float], opacity: float = 1.0
) -> None:
    shown: Any = np.ma.masked_invalid(image)
    axes.imshow(shown, cmap=colours, vmin=limits[0], vmax=limits[1], alpha=opacity)


def _draw_tool(
    axes: Axes, registration: Registration, tool: Tool | None, shape: tuple[int, ...]
) -> None:
    if tool is not None:
        drawing.draw_line(axes, registration.pixels(tool.outline(DRAWN_FACE)), "black", factor=1.0)
    axes.set_xlim(-0.5, shape[1] - 0.5)
    axes.set_ylim(shape[0] - 0.5, -0.5)
