"""Figure of an emissivity determination: image, regions, map and lines."""

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.patheffects import withStroke

from chipglow.drawing import drawing, scales
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene import Raster, Region, Tool
from chipglow.scene.figures import ImagePanel

if TYPE_CHECKING:
    from chipglow.laboratory.emissivity.emissivity import EmissivityLine, EmissivityMap
    from chipglow.laboratory.emissivity.region_emissivities import RegionEmissivities
    from chipglow.laboratory.emissivity.temperature import RegionTemperatures

_PANEL_WIDTH: Final = 2.7
"""Width of an image in inches."""

_IMAGE_HEIGHTS: Final = (1.0, 5.0)
"""Smallest and largest height of an image in inches."""

_LABEL_HEIGHT: Final = 0.75
"""Height in inches of title and labels of an image."""

_LINES_HEIGHT: Final = 2.6
"""Height in inches of the panel of lines."""

_LINE_POINTS: Final = 50
"""Points of a line over the temperature with its band of uncertainty, which is curved."""

_SLENDERNESS: Final = 3.0
"""Height over width of a region from which its name is written upright."""

_BESIDE: Final = 0.2
"""Margin beside the first and the last region, in widths of the axes."""
_BACKGROUND: Final = 0.1
"""Emissivity up to which a pixel is taken for background: hardly a surface has less."""
_DARKER: Final = 10.0
"""Range in K below the object's pixels, so that all of them differ from the background."""


def draw_emissivity(
    found: "EmissivityMap", regions: Sequence[Region], lines: "Sequence[EmissivityLine]" = ()
) -> Figure:
    """Draw the radiance temperature with the regions, and the emissivity."""
    raster = found.raster
    least, most = _IMAGE_HEIGHTS
    height = min(max(_PANEL_WIDTH * raster.rows / raster.columns, least), most) + _LABEL_HEIGHT
    with drawing.style():
        figure = drawing.new_figure(height + (_LINES_HEIGHT if lines else 0.0))
        parts: Any = (
            figure.subfigures(2, 1, height_ratios=(height, _LINES_HEIGHT)) if lines else (figure,)
        )
        left, right = parts[0].subplots(1, 2, sharey=True)
        draw_heated(parts[0], left, found, regions, "heated object", named=True)
        _emissivity_panel(found).draw(parts[0], right, raster)
        _draw_regions(right, regions, raster, named=False)
        right.label_outer()
        if lines:
            colours = _colours(regions)
            _draw_lines(parts[1].subplots(), lines, [colours[line.feature] for line in lines])
    return figure


def draw_heated(
    figure: FigureBase,
    axes: Axes,
    found: "EmissivityMap",
    regions: Sequence[Region],
    title: str,
    tool: Tool | None = None,
    named: bool = False,
) -> None:
    """Draw the radiance temperature of a heated object, with the regions that are read.

    A region has its name beside it, or its feature as the label of a legend.
    """
    temperature = found.radiance_temperature - ZERO_CELSIUS
    low, high = scales.ends(temperature[found.emissivity > _BACKGROUND], 1.0, 99.9)
    limits = (low - _DARKER, high)
    label = "radiance temperature / °C"
    panel = ImagePanel(title, label, temperature, limits, scales.HEAT)
    panel.draw(figure, axes, found.raster, tool)
    _draw_regions(axes, regions, found.raster, named)


def plot_emissivity_map(found: "EmissivityMap", ax: Axes | None) -> Axes:
    """Draw the emissivity of every pixel."""
    with drawing.style():
        axes = drawing.axes_or_new(ax, "compressed")
        _emissivity_panel(found).draw(axes.figure, axes, found.raster)
    return axes


def plot_region_emissivities(found: "RegionEmissivities", ax: Axes | None) -> Axes:
    """Draw the emissivity of each region, over the temperature if there are several."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        if found.lines:
            _draw_lines(axes, found.lines, scales.COLOURS)
            return axes
        (rows,) = found.rows
        names, means = [row.name for row in rows], np.array([row.mean for row in rows])
        expanded = np.array([2 * float(row.estimate.standard_uncertainty) for row in rows])
        axes.errorbar(names, means, expanded, fmt="o", markersize=4, capsize=3, color=scales.BLUE)
        axes.margins(x=_BESIDE)
        celsius = found.maps[0].heating.reference - ZERO_CELSIUS
        axes.set_title(f"object at {celsius:.4g} °C; bars: 2 standard uncertainties")
        axes.set(xlabel="region", ylabel="emissivity")
    return axes


def plot_region_temperatures(found: "RegionTemperatures", ax: Axes | None) -> Axes:
    """Draw the true temperature of each region with its interval, and what the camera shows."""
    rows = found.rows
    names = [row.name for row in rows]
    true = np.array([float(row.estimate.values) for row in rows])
    low, high = (
        np.array([float(getattr(row.distribution, end)) for row in rows]) for end in ("low", "high")
    )
    measured = np.array([row.radiance_temperature for row in rows])
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        middle, half = (high + low) / 2 - ZERO_CELSIUS, (high - low) / 2
        axes.errorbar(names, middle, half, fmt="none", capsize=3, color=scales.VERMILLION)
        for kelvins, label, marker, colour in (
            (true, "true temperature, 95 % interval", "o", scales.VERMILLION),
            (measured, "radiance temperature", "s", scales.GREY),
        ):
            axes.plot(
                names, kelvins - ZERO_CELSIUS, marker, markersize=5, color=colour, label=label
            )
        axes.margins(x=_BESIDE)
        axes.set(xlabel="region", ylabel="temperature / °C")
        axes.legend()
    return axes


def _emissivity_panel(found: "EmissivityMap") -> ImagePanel:
    title = f"emissivity, object at {found.heating.reference - ZERO_CELSIUS:.4g} °C"
    limits = scales.ends(found.emissivity, 0.5, 99.5)
    return ImagePanel(title, "emissivity", found.emissivity, limits)


def _draw_regions(axes: Axes, regions: Sequence[Region], raster: Raster, named: bool) -> None:
    colours = _colours(regions)
    for region in regions:
        outline = region.outline(raster)
        colour = colours[region.feature]
        drawing.draw_line(axes, np.concatenate([outline, outline[:1]]), colour, region.feature)
        if named:
            # At its centre, upright where the region is slender.
            width, height = np.ptp(outline, axis=0)
            x, y = (outline.min(axis=0) + outline.max(axis=0)) / 2 * 1e6
            turn = 90 if height > _SLENDERNESS * width else 0
            axes.text(
                x, y, region.name, rotation=turn, ha="center", va="center", fontsize=8,
                color=colour, path_effects=[withStroke(linewidth=2.5, foreground="white")],
            )  # fmt: skip


def _colours(regions: Sequence[Region]) -> dict[str, str]:
    """Return a colour for each feature."""
    features = dict.fromkeys(region.feature for region in regions)
    return dict(zip(features, cycle(scales.COLOURS), strict=False))


def _draw_lines(axes: Axes, lines: "Sequence[EmissivityLine]", colours: Sequence[str]) -> None:
    for line, colour in zip(lines, cycle(colours), strict=False):
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
        along = np.linspace(celsius.min(), celsius.max(), _LINE_POINTS)
        found = line.at(along + ZERO_CELSIUS)
        axes.plot(along, found.values, color=colour)
        drawing.shade(axes, along, found.values, 2 * found.standard_uncertainty, colour)
    axes.set_xlabel("true temperature / °C")
    axes.set_ylabel("emissivity")
    axes.set_title("means over the pixels; bars and bands: 2 standard uncertainties")
    axes.legend()
