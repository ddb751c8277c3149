"""A frame of a measurement as a picture, and how its temperatures are spread."""

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement
from chipglow.drawing import drawing, scales
from chipglow.drawing.drawing import ImagePanel
from chipglow.drawing.frames import shown_frame
from chipglow.drawing.scales import BLUE, GREEN, GREY, KELVIN, VERMILLION, VOID
from chipglow.quantities import Array

_FLAGS: Final = {
    Flag.UNDER_RANGE: ("below the lower range limit", VOID),
    Flag.SATURATED: ("saturated", VERMILLION),
    Flag.DEAD: ("dead", "black"),
    Flag.REPLACED: ("replaced", GREEN),
}
_IMAGE_HEIGHTS: Final = (2.0, 6.0)
_HISTOGRAM: Final = 2.2
_BINS: Final = 80


def draw_measurement(measurement: Measurement, time: float | None = None) -> Figure:
    """Draw the radiance temperature of a frame, its flags, and how the temperatures are spread."""
    index = shown_frame(measurement.times, time, "measurement")
    celsius = measurement.radiance_temperature()[index] - KELVIN
    flags, raster = measurement.flags[index], measurement.raster
    least, most = _IMAGE_HEIGHTS
    height = min(max(5.6 * raster.rows / raster.columns, least), most)
    with drawing.style():
        figure = drawing.new_figure(height + _HISTOGRAM + 0.9)
        upper, lower = figure.subplots(2, 1, height_ratios=(height, _HISTOGRAM))
        title = f"{measurement.times[index] * 1e6:.6g} µs"
        panel = ImagePanel(
            title, "radiance temperature / °C", celsius, scales.ends(celsius), scales.HEAT
        )
        panel.draw(figure, upper, raster, measurement.tool)
        upper.set_xlabel("x / µm")
        upper.tick_params(labelbottom=True)
        _draw_flags(upper, flags, measurement)
        _draw_histogram(lower, celsius)
    return figure


def _draw_flags(axes: Axes, flags: NDArray[np.uint8], measurement: Measurement) -> None:
    shown: list[Any] = []
    for flag, (name, colour) in _FLAGS.items():
        where = flags & flag != 0
        if where.any():
            drawing.veil(axes, where, measurement.raster, colour, 1.0)
            label = f"{name}, {100 * np.mean(where):.2g} %"
            shown.append(Patch(facecolor=colour, edgecolor=GREY, label=label))
    if shown:
        axes.legend(
            handles=shown, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(shown),
            handlelength=1.0, columnspacing=1.2,
        )  # fmt: skip


def _draw_histogram(axes: Axes, celsius: Array) -> None:
    known = celsius[np.isfinite(celsius)]
    axes.set_xlabel("radiance temperature / °C")
    axes.set_ylabel("pixels")
    if known.size:
        low, high = scales.ends(known)
        axes.hist(known, np.linspace(low, high, _BINS).tolist(), color=BLUE)
