"""Figure of an emissivity determination: image, regions, map and lines."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from chipglow.drawing import drawing, scales
from chipglow.drawing.drawing import ImagePanel
from chipglow.laboratory.emissivity.emissivity import EmissivityLine, EmissivityMap
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Raster, Region

_PANEL_WIDTH: Final = 2.7
_AROUND: Final = 0.75
_LINES: Final = 2.6
_SLENDER: Final = 3.0


def draw_emissivity(
    found: EmissivityMap, regions: Sequence[Region], lines: Sequence[EmissivityLine] = ()
) -> Figure:
    """Draw the radiance temperature with the regions, and the emissivity."""
    raster = found.raster
    temperature = found.radiance_temperature - ZERO_CELSIUS
    heat, values = (scales.ends(one, 0.5, 99.5) for one in (temperature, found.emissivity))
    title = f"emissivity, object at {found.heating.reference - ZERO_CELSIUS:.4g} °C"
    panels = (
        ImagePanel("radiance temperature", "°C", temperature, heat, scales.HEAT),
        ImagePanel(title, "emissivity", found.emissivity, values),
    )
    height = min(max(_PANEL_WIDTH * raster.rows / raster.columns, 1.0), 5.0) + _AROUND
    with drawing.style():
        figure = drawing.new_figure(height + (_LINES if lines else 0.0))
        parts: Any = figure.subfigures(2, 1, height_ratios=(height, _LINES)) if lines else (figure,)
        for axes, panel in zip(parts[0].subplots(1, 2, sharey=True), panels, strict=True):
            panel.draw(parts[0], axes, raster)
            axes.label_outer()
            _draw_regions(axes, regions, raster, named=panel is panels[0])
        if lines:
            _draw_lines(parts[1].subplots(), lines, _colours(regions))
    return figure


def _draw_regions(axes: Axes, regions: Sequence[Region], raster: Raster, named: bool) -> None:
    colours = _colours(regions)
    for region in regions:
        outline = region.outline(raster)
        colour = colours[region.feature]
        drawing.draw_line(axes, np.concatenate([outline, outline[:1]]), colour)
        if named:
            # At its centre, upright where the region is slender.
            width, height = np.ptp(outline, axis=0)
            x, y = (outline.min(axis=0) + outline.max(axis=0)) / 2 * 1e6
            turn = 90 if height > _SLENDER * width else 0
            axes.text(
                x, y, region.name, rotation=turn, ha="center", va="center", fontsize=8,
                color=colour, path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )  # fmt: skip


def _colours(regions: Sequence[Region]) -> dict[str, str]:
    """Return a colour for each feature."""
    features = dict.fromkeys(region.feature for region in regions)
    return dict(zip(features, cycle(scales.COLOURS), strict=False))


def _draw_lines(axes: Axes, lines: Sequence[EmissivityLine], colours: Mapping[str, str]) -> None:
    for line in lines:
        colour = colours[line.feature]
        celsius = np.array(line.temperatures) - ZERO_CELSIUS
        axes.errorbar(
            celsius,
            line.means,
            yerr=2 * np.array(line.uncertainties),
            fmt="o",
            markersize=4,
            capsize=3,
            color=colour,
            label=line.name,
        )
        along = np.linspace(celsius.min(), celsius.max(), 50)
        found = line.at(along + ZERO_CELSIUS)
        axes.plot(along, found.values, color=colour)
        drawing.shade(axes, along, found.values, 2 * found.standard_uncertainty, colour)
    axes.set_xlabel("true temperature / °C")
    axes.set_ylabel("emissivity")
    axes.set_title("means over the pixels; bars and bands: 2 standard uncertainties")
    axes.legend()
