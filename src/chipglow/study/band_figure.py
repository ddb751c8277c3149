"""Figure of a band: as it is and as a camera shows it, and the contributions of the effects."""

from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.quantities.format import quantity_text

if TYPE_CHECKING:
    from chipglow.study.band import BandReading

_HEIGHT: Final = 3.4
"""Height of the figure in inches."""

_ROOM: Final = 0.5
"""Room for the numbers of the bars on their side, as a part of the largest contribution."""


def draw_band_reading(reading: "BandReading") -> Figure:
    """Draw the band across, and the contributions to the error of its peak temperature."""
    with drawing.style():
        figure = drawing.new_figure(_HEIGHT)
        across, effects = figure.subplots(1, 2, width_ratios=[3, 2])
        _draw_profile(across, reading)
        _draw_effects(effects, reading)
    return figure


def _draw_profile(axes: Axes, reading: "BandReading") -> None:
    x = 1e6 * reading.x
    shown = reading.shown - ZERO_CELSIUS
    low, middle, high = np.quantile(shown, [0.025, 0.5, 0.975], axis=0)
    axes.plot(x, reading.true - ZERO_CELSIUS, color="black", label="true, middle of the exposure")
    axes.plot(x, middle, color=scales.BLUE, label="shown")
    axes.fill_between(
        x, low, high, color=scales.BLUE, alpha=0.25, linewidth=0, label="95 % of single frames"
    )
    axes.set_xlabel("position across the band / µm")
    axes.set_ylabel("temperature / °C")
    axes.set_ylim(top=float(np.max(reading.true) - ZERO_CELSIUS + 0.45 * reading.rise))
    axes.legend(loc="upper left")


def _draw_effects(axes: Axes, reading: "BandReading") -> None:
    frame = reading.effects_frame()
    positions = np.arange(len(frame))
    values = frame.contribution_K.to_numpy()
    largest = float(np.abs(values).max())
    axes.barh(
        positions, values, color=[scales.BLUE if v < 0 else scales.VERMILLION for v in values]
    )
    for position, value in zip(positions.tolist(), values.tolist(), strict=True):
        text, side = quantity_text(value, "", 1), "right" if value < 0 else "left"
        axes.annotate(
            text, (value, position), (-3 if value < 0 else 3, 0), textcoords="offset points",
            ha=side, va="center",
        )  # fmt: skip
    room = _ROOM * largest
    axes.set_xlim(
        min(values.min(), 0.0) - room * (values < 0).any(),
        max(values.max(), 0.0) + room * (values >= 0).any(),
    )
    axes.axvline(0.0, color="black", linewidth=0.8)
    axes.set_yticks(positions, frame.effect)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.set_title("error of the peak")
    axes.set_xlabel("contribution / K")
