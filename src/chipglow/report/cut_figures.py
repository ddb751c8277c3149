"""Figures of a cut: heated chips and tool, rake face, dual spectrum, shear band, forces, chip."""

from typing import Any, Final

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.analysis import Analysis
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.laboratory.chip import RakeGrid, rake_grid
from chipglow.laboratory.chip.figure import draw_rake_profiles
from chipglow.laboratory.emissivity.figure import draw_heated
from chipglow.quantities import ZERO_CELSIUS
from chipglow.report.facts import Facts
from chipglow.scene import Frame, Material, Raster
from chipglow.scene.figures import draw_chip, image_figure, show_image
from chipglow.scene.tool import DRAWN_FACE
from chipglow.surface import Emissivity, Texture

_GRAIN, _SEED, _STEEL = 9e-6, 8, Emissivity(0.62, 0.07)
"""Texture of the visible picture: grain in m, seed, mean grey and its standard deviation."""

_VOID, _SHEARED, _DARKEST = 0.28, (1.5, 5.0), 0.45
"""Grey beyond the material, plastic strains of first and full darkening, and darkness of bands."""

_BRIGHTEST: Final = 0.88
"""Fraction of the colour map that is used: its end is too bright for a line on white."""

_LARGEST_STRAIN: Final = 4.0
"""Plastic strain of the last colour."""

_NARROWEST: Final = 50.0
"""Smallest range of a scale of temperatures in K."""

_DARK_START: Final = 100.0
"""Temperature in °C at which a scale begins if the camera states no lower limit."""


def heated_chips(facts: Facts) -> Figure | None:
    """Draw the radiance temperature of isothermal chips, with the regions that are read."""
    chips = [heated for heated in facts.cut.heated if heated.regions]
    if not chips:
        return None
    figure = drawing.new_figure(2.6)
    panels = figure.subplots(1, len(chips), squeeze=False)[0]
    for letter, axes, heated in zip("abcdefgh", panels, chips, strict=False):
        truth = heated.map.heating.reference - ZERO_CELSIUS
        title = f"{letter}) {heated.name}, at {truth:.0f} °C"
        draw_heated(figure, axes, heated.map, heated.regions, title)
    drawing.legend(figure, 2)
    return figure


def heated_tool(facts: Facts) -> Figure | None:
    """Draw the radiance temperature of an isothermal tool, and its emissivity."""
    tools = [heated for heated in facts.cut.heated if not heated.regions]
    if not tools:
        return None
    found, raster, tool = tools[0], tools[0].map.raster, facts.cut.segments[0].tool
    figure = drawing.new_figure(2.9)
    left, right = figure.subplots(1, 2)
    title = f"a) tool, at {found.map.heating.reference - ZERO_CELSIUS:.0f} °C"
    draw_heated(figure, left, found.map, (), title, tool)
    # Three pixels from the faces, blur from outside the tool is small.
    inside = tool.signed_distance(*np.meshgrid(raster.x, raster.y)) < -3 * raster.spacing
    right.hist(found.map.emissivity[inside], bins=40, color=BLUE, density=True)
    row = found.rows[0]
    right.axvline(row.found.mean, color="black", linestyle="-", label="found")
    right.axvline(row.true.mean, color="black", linestyle="--", label="input")
    right.set(xlabel="emissivity", ylabel="pixels, density", title="b) emissivity of its pixels")
    right.legend()
    return figure


def rake_profiles(facts: Facts) -> Figure | None:
    """Draw the temperature along the rake face by depth in the chip."""
    grids = rake_grids(facts.analysis)
    if not grids:
        return None
    figure = drawing.new_figure(3.6)
    panels = figure.subplots(1, len(grids), sharex=True, sharey=True, squeeze=False)[0]
    for axes, (name, grid) in zip(panels, grids.items(), strict=True):
        draw_rake_profiles(axes, grid)
        axes.set_title(name)
        axes.label_outer()
    drawing.legend(figure, 5, panels[:1], "depth into the chip")
    return figure


def rake_grids(analysis: Analysis) -> dict[str, RakeGrid]:
    """Return the squares along the rake face of each surface that has usable ones."""
    assert analysis.tool is not None
    grids = {}
    for name, measurement in analysis.measurements.items():
        try:
            grids[name] = rake_grid(measurement, analysis.tool)
        except ValueError:
            continue
    return grids


def dual_spectrum(facts: Facts) -> Figure:
    """Draw a grey picture and the infrared image of the same moments."""
    analysis, cut = facts.analysis, facts.cut
    name, tool, rows = analysis.data.attrs["band_surface"], cut.segments[0].tool, len(cut.moments)
    images = analysis.data.radiance_temperature.sel(surface=name).values - ZERO_CELSIUS
    starts = analysis.data.instant.values[: facts.starts]
    figure = image_figure(analysis.raster, 2.3, rows=rows)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    low = (analysis.camera.lower_limit or ZERO_CELSIUS + _DARK_START) - ZERO_CELSIUS
    heat = (low, max(scales.round_limit(images[np.isfinite(images)], 99.9, 50.0), low + _NARROWEST))
    pixels = analysis.measurements[name].raster
    for (left, right), frame in zip(grid, cut.moments, strict=True):
        grey = _visible_picture(frame, analysis.raster)
        show_image(left, grey, analysis.raster, None, "gray", (0.0, 1.0))
        number = max(int(np.searchsorted(starts, frame.time)) - 1, 0)
        picture = show_image(right, images[number], pixels, None, scales.HEAT, heat)
        left.set_title(f"visible, {frame.time * 1e6:.0f} µs")
        right.set_title(f"infrared, {name}")
        for axes in (left, right):
            axes.fill(*(1e6 * tool.outline(DRAWN_FACE)).T, color="black")
            axes.set_facecolor(GREY)
            axes.label_outer()
    drawing.colour_bar(figure, picture, list(grid[:, 1]), "radiance temperature / °C")
    return figure


def band_curves(facts: Facts) -> Figure:
    """Draw the measured temperature along the shear band as it develops."""
    data, shown = facts.data, int(facts.data.attrs["shown_instant"])
    figure = drawing.new_figure(3.7)
    panels = figure.subplots(1, data.sizes["surface"], sharex=True, sharey=True, squeeze=False)[0]
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, _BRIGHTEST, facts.starts))
    after = (data.instant.values - data.instant.values[0]) * 1e6
    for axes, name in zip(panels, data.surface.values, strict=True):
        curves = data.ridge_radiance_temperature.sel(surface=name).values - ZERO_CELSIUS
        for i in range(facts.starts):
            axes.plot(
                data.ridge_distance.values[i] * 1e6,
                curves[i],
                color=shades[i],
                linewidth=2.6 if i == shown else 1.2,
                label=f"{after[i]:.0f} µs" + (" (full)" if i == shown else ""),
            )
        if facts.analysis.camera.lower_limit is not None:
            limit = facts.analysis.camera.lower_limit - ZERO_CELSIUS
            axes.axhline(limit, color=GREY, linestyle="--", linewidth=1.0)
        axes.set(title=name, xlabel="distance along the band / µm")
    panels[0].set_ylabel("radiance temperature / °C")
    drawing.legend(figure, 6, panels[:1], "time")
    return figure


def chip(facts: Facts) -> Figure | None:
    """Draw the whole chip at the end of the cut, with the view of the scene."""
    overview, tool = facts.cut.overview, facts.analysis.tool
    return None if overview is None else draw_chip(overview, facts.analysis.raster, tool)


def forces(facts: Facts) -> Figure | None:
    """Draw the force history with its segments."""
    known = facts.cut.forces
    if known is None:
        return None
    history, time = known.history, known.history.time * 1e6
    figure = drawing.new_figure(3.3)
    axes = figure.subplots()
    axes.plot(time, history.cutting * 1e-3, color=BLUE, label="cutting force", linewidth=1.2)
    axes.plot(time, history.thrust * 1e-3, color=VERMILLION, label="thrust force", linewidth=1.2)
    for i, peak in enumerate(history.segmentation.peaks * 1e6):
        axes.axvline(
            peak, color=GREY, linewidth=0.8, linestyle=":", label="" if i else "peaks of the chip"
        )
    axes.axvspan(time[0], history.start * 1e6, color=scales.VOID, label="first build-up")
    duration = facts.analysis.camera.integration_time
    for i, start in enumerate(facts.data.instant.values):
        ends = (start * 1e6, (start + duration) * 1e6)
        axes.axvspan(*ends, ymax=0.03, color=GREEN, label="" if i else "exposures")
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(0.0)
    period = history.segmentation.period * 1e6
    axes.set_title(f"period {period:.0f} µs" if np.isfinite(period) else "no period")
    axes.set(xlabel="time / µs", ylabel="force per width / (N/mm)")
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def chip_thickness(facts: Facts) -> Figure | None:
    """Draw where the thickness of the chip is read, and its course over time."""
    cut, raster, frame = facts.cut, facts.analysis.raster, facts.analysis.frame
    if cut.chip is None or not np.isfinite(cut.chip.scan.height):
        return None
    scan, tool = cut.chip.scan, cut.segments[0].tool
    figure = drawing.new_figure(3.6)
    left, right = figure.subplots(1, 2)
    strain = np.where(frame.material == Material.WORKPIECE, frame.needed("plastic_strain"), np.nan)
    picture = show_image(left, strain, raster, tool, scales.PLAIN, (0.0, _LARGEST_STRAIN))
    drawing.colour_bar(figure, picture, left, "plastic strain")
    thickness = float(np.interp(frame.time, scan.time, scan.thickness))
    foot, normal = tool.rake_point(scan.height), np.array(tool.rake_normal)
    drawing.draw_line(left, np.stack([foot, foot + thickness * normal]), VERMILLION, "thickness")
    drawing.draw_line(left, cut.segments[0].moment.ridge.points, BLUE, "band")
    figure.legend(loc="outside lower center", ncols=2)
    left.set_title(f"a) at {frame.time * 1e6:.0f} µs")
    time, passed = scan.time, scan.thickness
    if cut.forces is not None:
        history = cut.forces.history
        later = history.time >= history.start
        time, passed = history.time[later], history.thickness[later]
    right.plot(time * 1e6, passed * 1e6, color=VERMILLION)
    place: Any = {"xycoords": ("axes fraction", "data"), "va": "center"}
    levels = {"peak": cut.chip.peak, "mean": cut.chip.thickness, "valley": cut.chip.valley}
    for label, level in levels.items():
        if np.isfinite(level):
            right.axhline(level * 1e6, color=GREY, linewidth=0.8, linestyle=":")
            # Beside the axes.
            right.annotate(f"{label} {level * 1e6:.0f}", (1.02, level * 1e6), **place)
    right.set(xlabel="time / µs", ylabel="thickness / µm", title="b) the chip passing the line")
    return figure


def _visible_picture(frame: Frame, raster: Raster) -> NDArray[np.float64]:
    """Return grey values from 0 to 1, shape (y, x), for orientation only."""
    x, y = frame.material_x, frame.material_y
    if x is None or y is None:
        x, y = (grid.astype(np.float32) for grid in np.meshgrid(raster.x, raster.y))
    generator = np.random.default_rng(_SEED)
    steel = Texture.random(_STEEL, _GRAIN, generator, restore_standard_deviation=True).at(x, y)
    low, high = _SHEARED
    sheared = np.clip((frame.needed("plastic_strain") - low) / (high - low), 0.0, 1.0)
    grey = steel * (1.0 - _DARKEST * sheared)
    grey = np.where(frame.material == Material.WORKPIECE, grey, _VOID)
    return np.asarray(np.where(frame.material == Material.TOOL, 0.0, grey), np.float64)
