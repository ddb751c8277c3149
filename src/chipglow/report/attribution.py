"""Attribution in the report: a sentence for each main error, maps, and stacked profiles."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.drawing import drawing, scales
from chipglow.quantities import Array
from chipglow.quantities.format import quantity_text
from chipglow.report.facts import Facts
from chipglow.report.figures import line_title, of_surface
from chipglow.report.rows import MAIN
from chipglow.scene.figures import ImagePanel, image_panels, length_unit

_LEAST: Final = 0.5
"""Contribution in K below which a sentence and the maps leave an effect out."""

_MAX_SENTENCES: Final = 3
"""Sentences of an answer; the tables hold all errors."""


def attribution_sentence(data: xr.Dataset, x: float, y: float) -> str:
    """Return a sentence on the error of one pixel and its causes.

    Parameters
    ----------
    data : xarray.Dataset
        An attribution, of `chipglow.attribute`.
    x, y : float
        Position in m; the pixel with the nearest centre is described.
    """
    one = data.sel(x=x, y=y, method="nearest")
    contributions = dict(zip(data.effect.values, one.contribution.values, strict=True))
    error = float(one.measured - one.reference)
    subject, gain = "The measured temperature", float(one.gain_half_exposure)
    return _sentence(subject, error, contributions, gain, data.attrs["reference_kind"])


def sentences(facts: Facts) -> Iterator[str]:
    """Yield a sentence for each main reading of the shown exposure."""
    data = facts.data
    if "effect" not in data.dims:
        return
    names = [name for name in data.reading.values if name in MAIN or facts.analysis.cut is None]
    for name in names[:_MAX_SENTENCES]:
        one = data.sel(reading=name)
        values = one.attribution_reading.values
        if np.isfinite(values).all():
            contributions = dict(zip(data.effect.values, values, strict=True))
            place, gain = str(one.place.item()), float(one.attribution_reading_gain)
            where = f"{place[0].upper()}{place[1:]}, {one.quantity.item()}"
            subject = f"{where} ({one.seen_surface.item()}), in the shown exposure"
            subject += ": the measured temperature"
            kind = facts.context["attribution_reference"]
            yield _sentence(subject, float(values.sum()), contributions, gain, kind)


def contributions(facts: Facts) -> dict[str, dict[str, float]]:
    """Return the contribution of each effect to each reading in K, where it is known."""
    data = facts.data
    if "effect" not in data.dims:
        return {}
    table = data.attribution_reading.to_pandas().dropna()
    return {str(name): dict(row) for name, row in table.iterrows()}


def maps(facts: Facts) -> Figure | None:
    """Draw the contribution of each effect to the error of every usable pixel."""
    data, names = facts.data, facts.read_surfaces
    if "effect" not in data.dims:
        return None
    every = data.attribution_contribution.where(data.attribution_lost == 0).sel(surface=names)
    # Effects that contribute to few pixels only are not shown.
    size = np.abs(every).quantile(0.95, [dim for dim in every.dims if dim != "effect"])
    shown = every.sel(effect=size > _LEAST)
    if shown.size == 0:
        return None
    limits = {
        effect: scales.round_limit(shown.sel(effect=effect).values, 99.0, 5.0)
        for effect in shown.effect.values
    }
    panels = [
        ImagePanel(
            of_surface(facts, _label(effect), name),
            "contribution / K",
            shown.sel(surface=name, effect=effect).values,
            (-limits[effect], limits[effect]),
            scales.SIGNED,
        )
        for effect in shown.effect.values
        for name in names
    ]
    raster = facts.analysis.measurements[names[0]].raster
    return image_panels(panels, raster, facts.analysis.tool)


def profiles(facts: Facts) -> Figure | None:
    """Draw the contributions along the lines of the shown exposure, stacked to the error."""
    data = facts.data
    if "effect" not in data.dims or "line" not in data.dims:
        return None
    data = data.sel(exposure=data.instant.values[data.attrs["shown_instant"]], method="nearest")
    factor, unit = length_unit(facts.analysis.raster)
    figure = drawing.new_figure(2.9 * ((data.sizes["line"] + 1) // 2) + 0.6)
    grid = figure.subplots((data.sizes["line"] + 1) // 2, 2, squeeze=False).flat
    for name, axes in zip(data.line.values, grid, strict=False):
        one = data.sel(line=name)
        along = factor * one.line_distance.values
        _stack(axes, along, one.attribution_line.values, [*map(_label, data.effect.values)])
        axes.set(title=line_title(facts, str(name)))
        axes.set_xlabel(f"distance / {unit}")
        axes.set_ylabel("contribution / K")
    for axes in list(grid):
        axes.remove()
    drawing.legend(figure, 4, figure.axes[:1])
    return figure


def _label(effect: str) -> str:
    return effect.replace("psf", "PSF")


def _stack(axes: Axes, along: Array, values: Array, effects: list[str]) -> None:
    """Draw positive values upwards and negative ones downwards, and their sum."""
    colours = [*scales.COLOURS, scales.GREY, "#000000"]
    known = np.isfinite(values).all(axis=0) & np.isfinite(along)
    along, values = along[known], values[:, known]
    for part in (np.maximum(values, 0.0), np.minimum(values, 0.0)):
        ends = np.vstack([np.zeros(along.size), np.cumsum(part, axis=0)])
        for effect, colour, low, high in zip(effects, colours, ends, ends[1:], strict=False):
            label = effect if part.min() < 0 else ""
            axes.fill_between(along, low, high, color=colour, linewidth=0, label=label)
    axes.plot(along, values.sum(axis=0), color="black", label="error")
    axes.axhline(0.0, color=scales.GREY, linewidth=0.6)


def _sentence(
    subject: str, error: float, contributions: dict[str, float], gain: float, reference: str
) -> str:
    if not np.isfinite(error):
        return f"{subject} is not known: nothing radiates there."
    ordered = sorted(contributions.items(), key=lambda item: -abs(item[1]))
    parts = [
        f"{_label(name)} {quantity_text(value, 'K', 0, '+')}"
        for name, value in ordered
        if abs(value) >= _LEAST
    ]
    way = "below" if error < 0 else "above"
    truth = "true temperature" if reference == "true-maximum" else "largest radiance temperature"
    text = f"{subject} is {quantity_text(abs(error), 'K', 0)} {way} the {truth}"
    text += f": {', '.join(parts)}" if parts else ""
    if np.isfinite(gain) and abs(gain) >= _LEAST:
        change = "reduce" if gain > 0 else "increase"
        amount = quantity_text(abs(gain), "K", 0)
        text += f"; halving the exposure would {change} the error by {amount}"
    return f"{text}."
