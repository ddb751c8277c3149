"""The picture of the wavelengths: all bands and pairs, and the parts of the smallest errors."""

from typing import Final

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from chipglow.analysis.wavelengths import wavelengths_frame
from chipglow.drawing import drawing, scales

_BEST: Final = 3
"""Bands alone, and pairs, of which the parts of the error are drawn."""

_DARKEST: Final = 10
"""Largest error that colours show, in smallest errors: a decade distinguishes the good bands."""

_BAR: Final = 0.8
"""Height of the bars of a band, in the distance between bands: a gap divides them."""

_TICKS: Final = (1, 2, 3, 5, 7, 10, 20, 30, 50, 70, 100, 200, 300, 500)
"""Ticks of the colour bar in K."""

_PARTS: Final = {
    "error_K": ("mean error", scales.VERMILLION),
    "standard_deviation_K": ("scatter over the draws", "#E69F00"),
    "misregistration_K": ("misregistration", scales.GREEN),
    "noise_K": ("noise", "#56B4E9"),
    "emissivity_uncertainty_K": ("emissivity", scales.BLUE),
}


def draw_wavelengths(data: xr.Dataset) -> Figure:
    """Draw a place a column: above all bands and pairs, below the causes of the best."""
    frame = wavelengths_frame(data)
    places = list(frame.place.unique())
    with drawing.style():
        figure = drawing.new_figure(6.4)
        panels = figure.subplots(2, len(places), squeeze=False)
        known = frame.total_K[np.isfinite(frame.total_K)]
        low, high = float(known.min()), float(min(known.max(), _DARKEST * known.min()))
        norm = LogNorm(low, high)
        for column, place in zip(panels.T, places, strict=True):
            rows = frame[frame.place == place]
            picture = _draw_all(column[0], rows, norm)
            _draw_causes(column[1], rows)
            column[0].set_title(f"{place}, {rows.truth_degC.iloc[0]:.0f} °C")
        panels[0, 0].set_ylabel("first band / µm")
        ticks = [one for one in _TICKS if low <= one <= high]
        bar = figure.colorbar(
            picture, ax=panels[0], label="error / K", aspect=drawing.BAR_ASPECT, extend="max"
        )
        bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks], minor=False)
        bar.ax.minorticks_off()
        drawing.legend(figure, 3)
        return figure


def _draw_all(axes: Axes, rows: pd.DataFrame, norm: LogNorm) -> AxesImage:
    """Bands alone on the diagonal, ratios above it."""
    bands = sorted(rows.first_um.unique(), key=lambda name: sum(map(float, name.split("-"))))
    totals = np.full((len(bands), len(bands)), np.nan)
    for first, second, total in zip(rows.first_um, rows.second_um, rows.total_K, strict=True):
        totals[bands.index(first), bands.index(second or first)] = total
    picture = axes.imshow(np.ma.masked_invalid(totals), cmap=f"{scales.PLAIN}_r", norm=norm)
    for (row, column), total in np.ndenumerate(totals):
        if np.isfinite(total):
            colour = "white" if norm(total) > 0.5 else "black"
            text = f"{total:.0f}" if total >= 10 else f"{total:.1f}"
            axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=7)
    axes.set_xticks(range(len(bands)), bands, rotation=45, ha="right", fontsize=7)
    axes.set_yticks(range(len(bands)), bands, fontsize=7)
    axes.set(xlabel="second band / µm")
    axes.text(0.02, 0.03, "diagonal:\none band alone", transform=axes.transAxes, fontsize=8)
    return picture


def _draw_causes(axes: Axes, rows: pd.DataFrame) -> None:
    """Parts of the best bands and pairs, in K; the squares add up to that of all."""
    known = rows[np.isfinite(rows.total_K)].sort_values("total_K")
    alone = known.second_um == ""
    best = pd.concat([known[alone][:_BEST], known[~alone][:_BEST]])
    height = _BAR / len(_PARTS)
    places = np.arange(len(best))
    for number, (name, (label, colour)) in enumerate(_PARTS.items()):
        values = best[name].abs().fillna(0.0)
        axes.barh(places + (number - 2) * height, values, height, color=colour, label=label)
    names = [
        f"{first} over\n{second}" if second else f"{first} alone"
        for first, second in zip(best.first_um, best.second_um, strict=True)
    ]
    axes.set_yticks(places, names, fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="parts of the smallest errors / K")
