"""Figure of measured and simulated temperatures and their difference (the paper's 7 and 9)."""

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.drawing import drawing
from chipglow.drawing.scales import COLOURS, GREY
from chipglow.laboratory.comparison.coverage import COVERAGE
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.uncertainty import Estimate

if TYPE_CHECKING:
    from chipglow.laboratory.comparison.comparison import Comparison

_HEIGHT: Final = 5.2
"""Height of the figure in inches."""

_BAR_DISTANCE: Final = 0.2
"""Distance of the bars of two simulations, in steps of the axis."""


def draw_comparison(comparison: "Comparison") -> Figure:
    """Draw what was measured and simulated, and the differences with expanded uncertainties."""
    columns = []
    grid = comparison.grid
    if grid is not None and grid.depth is not None:
        title = f"at the rake face, {1e6 * grid.depth[0]:.3g} µm deep"
        readings = [item[0] for item in (grid.measured, *grid.simulated)]
        columns.append((title, "along the rake face / µm", grid.distance, readings))
    if comparison.band is not None:
        band = comparison.band
        label = "distance from the cutting edge / µm"
        readings = [band.measured, *band.simulated]
        columns.append(("along the shear band", label, band.distance, readings))
    with drawing.style():
        figure = drawing.new_figure(_HEIGHT)
        panels = figure.subplots(
            2, len(columns), squeeze=False, sharex="col", sharey="row", height_ratios=(1.4, 1)
        )
        for (above, below), column in zip(panels.T, columns, strict=True):
            title, label, place, readings = column
            above.set_title(title)
            below.set_xlabel(label)
            _draw_values(above, place, readings, comparison.labels)
            _draw_differences(below, place, readings)
        panels[0, 0].set_ylabel("radiance temperature / °C")
        panels[1, 0].set_ylabel("simulated − measured / K")
        handles, labels = panels[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _draw_values(
    axes: Axes, place: Array, readings: Sequence[Estimate], labels: Sequence[str]
) -> None:
    measured, *simulated = readings
    x, values = 1e6 * place, measured.values - ZERO_CELSIUS
    axes.plot(x, values, "k.", markersize=4, label="measured")
    expanded = COVERAGE * measured.standard_uncertainty
    label = "expanded uncertainty, k = 2"
    drawing.shade(axes, x, values, expanded, GREY, opacity=0.3, label=label)
    for reading, label, colour in zip(simulated, labels, cycle(COLOURS), strict=False):
        values = reading.values - ZERO_CELSIUS
        axes.plot(x, values, color=colour, label=label)
        drawing.shade(axes, x, values, COVERAGE * reading.standard_uncertainty, colour)


def _draw_differences(axes: Axes, place: Array, readings: Sequence[Estimate]) -> None:
    measured, *simulated = readings
    axes.axhline(0.0, color="black", linewidth=0.8)
    step = float(np.median(np.diff(1e6 * place))) if place.size > 1 else 0.0
    for i, reading in enumerate(simulated):
        # Beside one another, so that no bar hides another.
        aside = _BAR_DISTANCE * step * (i - (len(simulated) - 1) / 2)
        axes.errorbar(
            1e6 * place + aside,
            reading.values - measured.values,
            COVERAGE * (reading - measured).standard_uncertainty,
            color=COLOURS[i % len(COLOURS)],
            marker=".",
            markersize=4,
            linewidth=0.8,
            elinewidth=0.5,
        )
