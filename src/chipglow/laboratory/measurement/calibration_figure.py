"""Calibrations as a picture: the fit, and what it leaves at every point."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.camera import CalibrationFit, FittedCalibration
from chipglow.drawing import drawing
from chipglow.drawing.scales import BLUE, GREEN, GREY, KELVIN, VERMILLION

_COLOURS: Final = (BLUE, VERMILLION, GREEN)
_MARKS: Final = ("o", "s", "^")
_SAMPLES: Final = 300


def draw_calibrations(fits: Mapping[str, CalibrationFit[FittedCalibration]]) -> Figure:
    """Draw counts over temperature with the fits, and the residuals in K with uncertainties."""
    with drawing.style():
        figure = drawing.new_figure(5.2)
        upper, lower = figure.subplots(2, 1, sharex=True)
        first = next(iter(fits.values()))
        upper.plot(first.temperatures - KELVIN, first.counts, "o", color=GREY, label="blackbody")
        for (name, fit), colour, mark in zip(fits.items(), _COLOURS, _MARKS, strict=False):
            _draw(upper, lower, name, fit, colour, mark)
        upper.set_ylabel("counts")
        upper.legend()
        lower.axhline(0.0, color=GREY, linewidth=0.6)
        lower.set_ylabel("residual / K")
        lower.set_xlabel("temperature of the blackbody / °C")
    return figure


def _draw(
    upper: Axes,
    lower: Axes,
    name: str,
    fit: CalibrationFit[FittedCalibration],
    colour: str,
    mark: str,
) -> None:
    calibration = fit.calibration
    kelvins = np.linspace(calibration.lowest, calibration.highest, _SAMPLES)
    counts = calibration.counts(kelvins)
    upper.plot(kelvins - KELVIN, counts, color=colour, linewidth=1.0, label=name)
    uncertainty = calibration.uncertainty(counts) / calibration.band.slope(kelvins)
    lower.fill_between(kelvins - KELVIN, -uncertainty, uncertainty, color=colour, alpha=0.2)
    bars = fit.standard_uncertainties / calibration.slope(fit.temperatures)
    lower.errorbar(
        fit.temperatures - KELVIN, fit.residuals_temperature, bars,
        fmt=mark, color=colour, markersize=4, linewidth=0.8, label=name,
    )  # fmt: skip
