"""The corrected temperatures in the report: a sentence for each place, images and curves."""

from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.analysis import CorrectedPlace, CorrectedWindow
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.report.facts import Facts
from chipglow.report.page import texts
from chipglow.report.rows import Row, slug
from chipglow.scene.figures import ImagePanel, image_figure

_LARGEST: Final = 98.0
"""Percentile of the half-widths at which their scale ends: those near the range limit are wider."""


def sentences(facts: Facts, rows: Mapping[str, Row]) -> Iterator[str]:
    """Yield a sentence for each corrected place and for each corrected part of the image."""
    windows = facts.analysis.cut.corrected if facts.analysis.cut else ()
    words = texts()["correction"]
    for window in windows:
        for place in window.places:
            reach = float(place.estimate.expanded_uncertainty())
            yield facts.text(
                words["place"],
                place=place.name,
                surface=place.surface,
                pixels=int(place.pixels.sum()),
                is_held=abs(float(place.estimate.values) - place.true) <= reach,
                low=_number(rows, place.name, "corrected_low_degC"),
                high=_number(rows, place.name, "corrected_high_degC"),
                measured=_number(rows, place.name, "measured_degC"),
                corrected=_number(rows, place.name, "corrected_degC"),
                truth=_number(rows, place.name, "true_degC"),
            )
    for window in windows:
        yield facts.text(
            words["window"],
            surface=window.surface,
            held=_number(rows, window.surface, "held_percent"),
            uncertainty=window.emissivity_uncertainty,
            measured=_number(rows, window.surface, "measured_rms_K"),
            corrected=_number(rows, window.surface, "corrected_rms_K"),
        )


def _number(rows: Mapping[str, Row], name: str, key: str) -> str:
    """Return the text of a number of a place or of the part with a surface."""
    return rows[f"{slug(name)}_{key}"].cells["mean"]


def images(facts: Facts) -> Figure | None:
    """Draw the corrected part of the image as measured, corrected and true, and the half-width."""
    windows = facts.cut.corrected
    if not windows:
        return None
    figure = image_figure(windows[0].correction.raster, 1.6, rows=len(windows))
    grid = figure.subplots(len(windows), 4, sharex=True, sharey=True, squeeze=False)
    for row, window in zip(grid, windows, strict=True):
        for axes, panel in zip(row, _panels(window), strict=True):
            panel.draw(figure, axes, window.correction.raster, facts.analysis.tool, "bottom")
            _mark(axes, window)
            axes.label_outer()
    return figure


def _panels(window: CorrectedWindow) -> Iterator[ImagePanel]:
    data = window.correction.data.isel(time=0)
    corrected = data["temperature"].values - ZERO_CELSIUS
    measured = window.measurement.celsius(0)
    true = np.where(np.isnan(corrected), np.nan, window.true - ZERO_CELSIUS)
    half = window.correction.half_width()
    heat = scales.ends(np.concatenate([measured, corrected, true]), 0.5, 99.5)
    known = half[np.isfinite(half)]
    widths = 0.0, float(np.percentile(known, _LARGEST)) if known.size else 1.0
    for title, image in (("measured", measured), ("corrected", corrected), ("true", true)):
        yield ImagePanel(f"{title}, {window.surface}", "°C", image, heat, scales.HEAT)
    yield ImagePanel("half-width (95 %)", "K", half, widths)


def _mark(axes: Axes, window: CorrectedWindow) -> None:
    """Draw the centres of the pixels of the places."""
    x, y = np.meshgrid(window.correction.raster.x, window.correction.raster.y)
    for place in window.places:
        at = 1e6 * x[place.pixels], 1e6 * y[place.pixels]
        axes.plot(*at, ".", color=GREEN, markersize=2)


def curves(facts: Facts) -> Figure | None:
    """Draw measured, corrected and true temperature of the pixels along each place."""
    every = [(window, place) for window in facts.cut.corrected for place in window.places]
    if not every:
        return None
    figure = drawing.new_figure(3.2)
    panels = figure.subplots(1, len(every), squeeze=False)[0]
    for axes, (window, place) in zip(panels, every, strict=True):
        data = window.correction.data.isel(time=0)
        at, measured = 1e6 * place.distance, window.measurement.celsius(0)
        corrected, lower, upper = (
            data[name].values - ZERO_CELSIUS for name in ("temperature", "lower", "upper")
        )
        axes.fill_between(at, _along(place, lower), _along(place, upper), color=BLUE, alpha=0.2)
        axes.plot(at, _along(place, window.true - ZERO_CELSIUS), color=GREY, label="true")
        axes.plot(at, _along(place, corrected), color=BLUE, label="corrected, 95 % interval")
        axes.plot(at, _along(place, measured), color=VERMILLION, label="measured")
        axes.set(title=f"{place.name}, {place.surface}", xlabel="distance / µm")
    panels[0].set_ylabel("temperature / °C")
    drawing.legend(figure, 3, panels[:1])
    return figure


def _along(place: CorrectedPlace, image: Array) -> Array:
    return np.asarray(image[place.pixels][place.order])
