"""The paper's Figures 3, 4, 7 and 8 of a study: heated chips and tool, rake face, dual spectrum."""

from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.analysis import StudyResult
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREY, KELVIN, VERMILLION
from chipglow.laboratory.chip import RakeGrid
from chipglow.laboratory.emissivity import HeatedObject
from chipglow.report.visible import visible_picture

_COLOURS: Final = (BLUE, VERMILLION)


def heated_chips(result: StudyResult) -> Figure | None:
    """Radiance temperature of evenly heated chips, with the regions (the paper's Figure 3)."""
    chips = [heated for heated in result.heated if heated.regions]
    if not chips:
        return None
    figure = drawing.new_figure(2.6)
    panels = figure.subplots(1, len(chips), squeeze=False)[0]
    for letter, axes, heated in zip("abcdefgh", panels, chips, strict=False):
        _draw_heated(figure, axes, heated)
        truth = heated.map.heating.reference - KELVIN
        axes.set_title(f"{letter}) {heated.name}, at {truth:.0f} °C")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(_COLOURS)
    )
    return figure


def heated_tool(result: StudyResult) -> Figure | None:
    """Radiance temperature of an evenly heated tool, with its faces (the paper's Figure 4)."""
    tools = [heated for heated in result.heated if not heated.regions]
    if not tools:
        return None
    tool = tools[0]
    figure = drawing.new_figure(2.9)
    left, right = figure.subplots(1, 2)
    _draw_heated(figure, left, tool)
    raster = tool.map.raster
    drawing.draw_tool(left, result.tool)
    left.set_xlim(raster.extent[0] * 1e6, raster.extent[1] * 1e6)
    left.set_ylim(raster.extent[2] * 1e6, raster.extent[3] * 1e6)
    left.set_title(f"a) tool, at {tool.map.heating.reference - KELVIN:.0f} °C")
    inside = result.tool.signed_distance(*np.meshgrid(raster.x, raster.y)) < -3 * raster.spacing
    row = tool.rows[0]
    right.hist(tool.map.emissivity[inside], bins=40, color=BLUE, density=True)
    for value, style, label in (
        (row.found.mean, "-", "found"),
        (row.true.mean, "--", "put in"),
    ):
        right.axvline(value, color="black", linestyle=style, label=label)
    right.set_xlabel("emissivity")
    right.set_ylabel("pixels, density")
    right.set_title("b) emissivity of its pixels")
    right.legend()
    return figure


def _draw_heated(figure: Figure, axes: Axes, heated: HeatedObject) -> None:
    temperature = heated.map.radiance_temperature - KELVIN
    seen = temperature[heated.map.emissivity > 0.1]
    low, high = (float(end) for end in np.percentile(seen, (1.0, 99.9)))
    picture = drawing.show_image(
        axes, temperature, heated.map.raster, None, scales.HEAT, (low - 10.0, high)
    )
    drawing.colour_bar(figure, picture, axes, "radiance temperature / °C")
    for colour, region in zip(_COLOURS, heated.regions, strict=False):
        outline = region.outline(heated.map.raster)
        drawing.draw_line(axes, np.concatenate([outline, outline[:1]]), colour, region.feature)


def rake_profiles(result: StudyResult) -> Figure | None:
    """Temperature along the rake face by depth into the chip (the paper's Figure 7 b and c)."""
    grids = {name: s.rake_grid for name, s in result.surfaces.items() if s.rake_grid is not None}
    if not grids:
        return None
    figure = drawing.new_figure(3.6)
    panels = figure.subplots(1, len(grids), sharex=True, sharey=True, squeeze=False)[0]
    for letter, axes, (name, grid) in zip("bcdefgh", panels, grids.items(), strict=False):
        _draw_profiles(axes, grid)
        axes.set_title(f"{letter}) {name}")
    panels[0].set_ylabel("radiance temperature / °C")
    figure.supxlabel("distance from the edge along the rake face / µm", fontsize=9.5)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", title="depth")
    return figure


def _draw_profiles(axes: Axes, grid: RakeGrid) -> None:
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, grid.depth.size))
    for row, colour in zip(range(grid.depth.size), colours, strict=True):
        axes.errorbar(
            grid.along * 1e6,
            grid.frame_mean[row] - KELVIN,
            yerr=grid.frame_standard_deviation[row],
            color=colour,
            linewidth=1.4,
            elinewidth=0.8,
            capsize=1.5,
            marker=".",
            label=f"{grid.depth[row] * 1e6:.0f} µm",
        )


def dual_spectrum(result: StudyResult) -> Figure:
    """Grey picture and infrared image of the same moments (the paper's Figure 8)."""
    surface = result.surfaces[result.plan.band_surface]
    images = surface.measurement.radiance_temperature() - KELVIN
    starts = np.array([instant.start for instant in result.instants])
    rows = len(result.moments)
    figure = drawing.image_figure(result.raster, 2.3, rows=rows)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    low = (result.camera.lower_limit or KELVIN + 100.0) - KELVIN
    top = max(scales.round_limit(images[np.isfinite(images)], 99.9, 50.0), low + 50.0)
    letters = iter("abcdefgh")
    picture = None
    for (left, right), frame in zip(grid, result.moments, strict=True):
        grey = visible_picture(frame, result.raster)
        drawing.show_image(left, grey, result.raster, None, "gray", (0.0, 1.0))
        number = int(np.searchsorted(starts[: len(result.one_segment)], frame.time)) - 1
        picture = drawing.show_image(
            right,
            images[max(number, 0)],
            surface.measurement.raster,
            None,
            scales.HEAT,
            (low, top),
        )
        drawing.black_tool(right, result.tool)
        drawing.black_tool(left, result.tool)
        left.set_title(f"{next(letters)}) visible, {frame.time * 1e6:.0f} µs")
        right.set_title(f"{next(letters)}) infrared, {result.plan.band_surface}")
        left.label_outer()
        right.label_outer()
    assert picture is not None
    drawing.colour_bar(figure, picture, list(grid[:, 1]), "radiance temperature / °C")
    for axes in grid.flat:
        axes.set_facecolor(GREY)
    return figure
