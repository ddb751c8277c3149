"""The picture of the wavelengths: all bands and pairs, and what makes the error of the best."""

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from chipglow.analysis import WavelengthError, WavelengthErrors
from chipglow.analysis.wavelengths import band_name
from chipglow.drawing import drawing, scales

_BEST: Final = 3
"""Bands alone, and pairs, of which the parts of the error are drawn."""

_TICKS: Final = (1, 2, 3, 5, 7, 10, 20, 30, 50, 70, 100, 200, 300, 500)

_PARTS: Final = {
    "mean error": scales.VERMILLION,
    "scatter over the draws": "#E69F00",
    "misregistration": scales.GREEN,
    "noise": "#56B4E9",
    "emissivity": scales.BLUE,
}


def draw_wavelengths(found: WavelengthErrors) -> Figure:
    """Draw a place a column: above all bands and pairs, below the causes of the best.

    Parameters
    ----------
    found : WavelengthErrors
        What was compared.
    """
    with drawing.style():
        figure = drawing.new_figure(6.4)
        panels = figure.subplots(2, len(found.places), squeeze=False)
        low, high = _limits(found)
        norm = LogNorm(low, high)
        for column, place in zip(panels.T, found.places, strict=True):
            errors = [one for one in found.errors if one.place == place]
            picture = _draw_all(column[0], found, errors, norm)
            _draw_causes(column[1], errors)
            truth = float(errors[0].truth.mean()) - scales.KELVIN
            column[0].set_title(f"{place}, {truth:.0f} °C")
        panels[0, 0].set_ylabel("first band / µm")
        ticks = [one for one in _TICKS if low <= one <= high]
        bar = figure.colorbar(picture, ax=panels[0], label="error / K", aspect=25, extend="max")
        bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks], minor=False)
        bar.ax.minorticks_off()
        handles, labels = panels[1, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        return figure


def _limits(found: WavelengthErrors) -> tuple[float, float]:
    totals = np.array([one.total for one in found.errors])
    known = totals[np.isfinite(totals)]
    return float(known.min()), float(min(known.max(), 10 * known.min()))


def _draw_all(
    axes: Axes, found: WavelengthErrors, errors: list[WavelengthError], norm: LogNorm
) -> AxesImage:
    """Bands alone on the diagonal, ratios above it."""
    bands = sorted(found.plan.bands, key=lambda band: band.lower + band.upper)
    totals = np.full((len(bands), len(bands)), np.nan)
    for one in errors:
        totals[bands.index(one.first), bands.index(one.second or one.first)] = one.total
    picture = axes.imshow(np.ma.masked_invalid(totals), cmap=f"{scales.PLAIN}_r", norm=norm)
    for (row, column), total in np.ndenumerate(totals):
        if np.isfinite(total):
            colour = "white" if norm(total) > 0.5 else "black"
            text = f"{total:.0f}" if total >= 10 else f"{total:.1f}"
            axes.text(column, row, text, ha="center", va="center", color=colour, fontsize=7)
    names = [band_name(band) for band in bands]
    axes.set_xticks(range(len(bands)), names, rotation=45, ha="right", fontsize=7)
    axes.set_yticks(range(len(bands)), names, fontsize=7)
    axes.set(xlabel="second band / µm")
    axes.text(0.02, 0.03, "diagonal:\none band alone", transform=axes.transAxes, fontsize=8)
    return picture


def _draw_causes(axes: Axes, errors: list[WavelengthError]) -> None:
    """Parts of the best bands and pairs, in K; the squares add up to that of all."""
    known = [one for one in errors if np.isfinite(one.total)]
    known.sort(key=lambda one: one.total)
    alone, ratios = ([one for one in known if bool(one.second) is two] for two in (False, True))
    best = [*alone[:_BEST], *ratios[:_BEST]]
    height = 0.8 / len(_PARTS)
    for number, (name, colour) in enumerate(_PARTS.items()):
        values = [_parts(one)[name] for one in best]
        places = np.arange(len(best)) + (number - 2) * height
        axes.barh(places, values, height, color=colour, label=name)
    axes.set_yticks(range(len(best)), [_name(one) for one in best], fontsize=7)
    axes.invert_yaxis()
    axes.set(xlabel="parts of the least errors / K")


def _parts(one: WavelengthError) -> dict[str, float]:
    values = [abs(float(one.error.mean())), float(one.error.std()), one.shift_error]
    return dict(zip(_PARTS, [*values, one.noise, one.emissivity], strict=True))


def _name(one: WavelengthError) -> str:
    if one.second is None:
        return f"{band_name(one.first)} alone"
    return f"{band_name(one.first)} over\n{band_name(one.second)}"
