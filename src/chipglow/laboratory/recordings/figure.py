"""A frame of a measurement and calibrations as figures."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from chipglow.camera import FittedCalibration, Flag, Measurement
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, COLOURS, GREEN, GREY, VERMILLION, VOID, shown_frame
from chipglow.laboratory.recordings.calibration_fit import CalibrationFit
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene.figures import ImagePanel, veil

_FLAGS: Final = {
    Flag.UNDER_RANGE: ("below the lower range limit", VOID),
    Flag.SATURATED: ("saturated", VERMILLION),
    Flag.DEAD: ("dead", "black"),
    Flag.REPLACED: ("replaced", GREEN),
}

_IMAGE_HEIGHTS: Final = (2.0, 6.0)
"""Smallest and largest height of an image in inches."""

_IMAGE_WIDTH: Final = 5.6
"""Width of an image in inches."""

_HISTOGRAM_HEIGHT: Final = 2.2
"""Height of the histogram in inches."""

_BINS: Final = 80
"""Bins of the histogram."""

_MARKS: Final = ("o", "s", "^")

_CURVE_POINTS: Final = 300
"""Temperatures of a calibration's curve."""


def draw_measurement(measurement: Measurement, time: float | None = None) -> Figure:
    """Draw the radiance temperature of a frame, its flags, and how the temperatures are spread."""
    index = shown_frame(measurement.times, time, "measurement")
    celsius = measurement.radiance_temperature()[index] - ZERO_CELSIUS
    flags, raster = measurement.flags[index], measurement.raster
    height = float(np.clip(_IMAGE_WIDTH * raster.rows / raster.columns, *_IMAGE_HEIGHTS))
    with drawing.style():
        figure = drawing.new_figure(height + _HISTOGRAM_HEIGHT + 0.9)
        upper, lower = figure.subplots(2, 1, height_ratios=(height, _HISTOGRAM_HEIGHT))
        title, limits = f"{measurement.times[index] * 1e6:.6g} µs", scales.ends(celsius)
        panel = ImagePanel(title, "radiance temperature / °C", celsius, limits, scales.HEAT)
        panel.draw(figure, upper, raster, measurement.tool)
        _draw_flags(upper, flags, measurement)
        _draw_histogram(lower, celsius)
    return figure


def _draw_flags(axes: Axes, flags: NDArray[np.uint8], measurement: Measurement) -> None:
    shown: list[Any] = []
    for flag, (name, colour) in _FLAGS.items():
        where = flags & flag != 0
        if where.any():
            veil(axes, where, measurement.raster, colour, 1.0)
            label = f"{name}, {100 * np.mean(where):.2g} %"
            shown.append(Patch(facecolor=colour, edgecolor=GREY, label=label))
    if shown:
        axes.legend(
            handles=shown, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(shown),
            handlelength=1.0, columnspacing=1.2,
        )  # fmt: skip


def _draw_histogram(axes: Axes, celsius: Array) -> None:
    known = celsius[np.isfinite(celsius)]
    axes.set(xlabel="radiance temperature / °C", ylabel="pixels")
    if known.size:
        low, high = scales.ends(known)
        axes.hist(known, np.linspace(low, high, _BINS).tolist(), color=BLUE)


def draw_calibrations(fits: Mapping[str, CalibrationFit[FittedCalibration]]) -> Figure:
    """Draw counts over temperature with the fits, and the residuals in K with uncertainties."""
    with drawing.style():
        figure = drawing.new_figure(5.2)
        upper, lower = figure.subplots(2, 1, sharex=True)
        first = next(iter(fits.values()))
        upper.plot(
            first.temperatures - ZERO_CELSIUS, first.counts, "o", color=GREY, label="blackbody"
        )
        for (name, fit), colour, mark in zip(fits.items(), COLOURS, _MARKS, strict=False):
            _draw_fit(upper, lower, name, fit, colour, mark)
        upper.set_ylabel("counts")
        upper.legend()
        lower.axhline(0.0, color=GREY, linewidth=0.6)
        lower.set(ylabel="residual / K", xlabel="temperature of the blackbody / °C")
    return figure


def _draw_fit(
    upper: Axes,
    lower: Axes,
    name: str,
    fit: CalibrationFit[FittedCalibration],
    colour: str,
    mark: str,
) -> None:
    calibration = fit.calibration
    kelvins = np.linspace(calibration.lowest, calibration.highest, _CURVE_POINTS)
    counts = calibration.counts(kelvins)
    upper.plot(kelvins - ZERO_CELSIUS, counts, color=colour, linewidth=1.0, label=name)
    uncertainty = calibration.uncertainty(counts) / calibration.band.slope(kelvins)
    lower.fill_between(kelvins - ZERO_CELSIUS, -uncertainty, uncertainty, color=colour, alpha=0.2)
    bars = fit.standard_uncertainties / calibration.slope(fit.temperatures)
    lower.errorbar(
        fit.temperatures - ZERO_CELSIUS, fit.residuals_temperature, bars,
        fmt=mark, color=colour, markersize=4, linewidth=0.8, label=name,
    )  # fmt: skip
