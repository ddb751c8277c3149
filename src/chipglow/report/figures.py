"""Figures of any analysis: scene, measurement, errors as images, along lines and over time."""

from collections.abc import Callable
from itertools import cycle
from typing import Any, Final, TypeAlias

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.analysis import (
    Distribution,
    image_error,
    image_psf_portion,
    line_error,
    line_psf_portion,
    sensitivity_error,
    sensitivity_psf_fraction,
)
from chipglow.analysis.figure import draw_error, draw_marks, error_limit
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.quantities import ZERO_CELSIUS
from chipglow.report.facts import Facts
from chipglow.report.paper import PAPER
from chipglow.report.rows import MAIN, main_readings
from chipglow.scene import Material
from chipglow.scene.figures import (
    SPEED,
    ImagePanel,
    field_panels,
    image_figure,
    image_panels,
    length_unit,
    show_image,
)

Array = NDArray[Any]

_ORDERS: Final = {
    "detector": (BLUE, "Gaussian, on the pixel image"),
    "optics": (VERMILLION, "Gaussian, before the pixels"),
}
_Series: TypeAlias = Callable[[xr.Dataset, str, str], Array]

_MAX_CURVES: Final = 6
"""Curves of a figure, beyond which they cannot be distinguished."""

_LINE_TITLES: Final = {
    "rake": "across the rake face",
    "contact": "along the contact",
    "band": "across the shear band",
}
_LINE_LABELS: Final = {
    "rake": "distance from the rake face / µm\n← tool      chip →",
    "band": "distance from the ridge / µm\n← workpiece      chip →",
}


_PSF_SAMPLES: Final = 12
"""Samples over the width of a point spread function in its figure."""

_PSF_REACH: Final = 15e-6
"""Distance in m from its centre up to which a point spread function is shown."""


def point_spread(facts: Facts) -> Figure | None:
    """Draw the point spread function of the camera and its cross-section."""
    camera = facts.analysis.camera
    psf = camera.psf
    if psf is None:
        return None
    spacing = min(facts.analysis.raster.spacing, psf.fwhm / _PSF_SAMPLES)
    kernel = psf.kernel(spacing)
    middle = kernel.shape[0] // 2
    half = min(middle, round(_PSF_REACH / spacing))
    near = slice(middle - half, middle + half + 1)
    density = kernel[near, near] / kernel.max()
    reach, side = (half + 0.5) * spacing * 1e6, camera.pitch * 1e6 / 2
    figure = drawing.new_figure(3.2)
    left, right = figure.subplots(1, 2)
    logarithm = np.log10(np.maximum(density, 1e-6))  # below the darkest colour
    extent = (-reach, reach, -reach, reach)
    picture = left.imshow(logarithm, extent=extent, cmap=scales.PLAIN, vmin=-4.0, vmax=0.0)
    square = [-side, side, side, -side, -side], [-side, -side, side, side, -side]
    left.plot(*square, color="white")
    left.set(xlabel="x / µm", ylabel="y / µm", title="a) kernel")
    drawing.colour_bar(figure, picture, left, "log₁₀ of the fraction of the maximum")
    at = spacing * 1e6 * np.arange(-half, half + 1)
    width = psf.fwhm * 1e6
    right.plot(at, density[half], color=BLUE)
    right.plot([-width / 2, width / 2], [0.5, 0.5], color=VERMILLION, marker="|", markersize=10)
    place: Any = {"xytext": (6, 0), "textcoords": "offset points", "va": "center"}
    right.annotate(f"{width:.2f} µm", (width / 2, 0.5), **place)
    right.set_ylim(0.0)
    right.set(xlabel="x / µm", ylabel="fraction of the maximum", title="b) cross-section")
    return figure


def scene(facts: Facts) -> Figure:
    """Draw the fields of the scene in the shown exposure, and the emissivity of every surface."""
    frame, tool = facts.analysis.frame, facts.analysis.tool
    there = frame.material != Material.VOID
    panels = [panel for panel in field_panels(frame) if panel.title != SPEED]
    for name in facts.read_surfaces:
        image = np.where(there, facts.data.emissivity.sel(surface=name), np.nan)
        panels.append(
            ImagePanel(of_surface(facts, "emissivity", name), "emissivity", image, (0.0, 1.0))
        )
    return image_panels(panels, facts.analysis.raster, tool)


def measurement(facts: Facts) -> Figure:
    """Draw the scene at one moment and as the camera measures it."""
    analysis, names = facts.analysis, facts.read_surfaces
    figure = image_figure(analysis.raster, 2.8, rows=len(names))
    rows = figure.subplots(len(names), 2, sharex=True, sharey=True, squeeze=False)
    shown = facts.data.isel(instant=facts.data.attrs["shown_instant"])
    for axes, name in zip(rows, names, strict=True):
        truth = shown.scene_radiance_temperature.sel(surface=name).values - ZERO_CELSIUS
        measured = shown.radiance_temperature.sel(surface=name).values - ZERO_CELSIUS
        limits = facts.heat_limits(truth)
        pixels = analysis.measurements[name].raster
        show_image(axes[0], truth, analysis.raster, analysis.tool, scales.HEAT, limits)
        picture = show_image(axes[1], measured, pixels, analysis.tool, scales.HEAT, limits)
        axes[0].set_title(of_surface(facts, "scene, one moment", name))
        axes[1].set_title("as measured")
        for one in axes:
            one.label_outer()
        drawing.colour_bar(figure, picture, list(axes), "radiance temperature / °C")
    return figure


def exposure(facts: Facts) -> Figure:
    """Draw reference, measurement and error of the shown exposure, and where errors are read."""
    analysis, names = facts.analysis, facts.read_surfaces
    shown = facts.data.isel(instant=facts.data.attrs["shown_instant"]).sel(surface=names)
    reference = shown.reference_temperature - ZERO_CELSIUS
    measured = shown.radiance_temperature - ZERO_CELSIUS
    error = measured - reference
    heat = facts.heat_limits(reference.values)
    largest = scales.round_limit(error.values, 99.0, 10.0)
    figure = image_figure(analysis.raster, 2.2, rows=len(names))
    rows = figure.subplots(len(names), 3, sharex=True, sharey=True, squeeze=False)
    for row, name in zip(rows, names, strict=True):
        panels = (
            ("reference", reference, "temperature / °C", heat, scales.HEAT),
            ("measured", measured, "temperature / °C", heat, scales.HEAT),
            ("error", error, "error / K", (-largest, largest), scales.SIGNED),
        )
        for axes, (title, images, label, limits, colours) in zip(row, panels, strict=True):
            image = images.sel(surface=name).values.astype(np.float64)
            panel = ImagePanel(of_surface(facts, title, name), label, image, limits, colours)
            panel.draw(figure, axes, analysis.measurements[name].raster, analysis.tool, "bottom")
            draw_marks(axes, analysis)
            axes.label_outer()
    return figure


def error_images(facts: Facts) -> Figure:
    """Draw the error and the contribution of the PSF to it, with the places of the readings."""
    analysis, names = facts.analysis, facts.read_surfaces
    flagged = facts.data.flagged.sel(surface=names)
    figure = image_figure(analysis.raster, 2.5, rows=len(names))
    rows = figure.subplots(len(names), 2, sharex=True, sharey=True, squeeze=False)
    for column, (title, images) in enumerate(
        (("error", image_error(facts.data)), ("PSF contribution", image_psf_portion(facts.data)))
    ):
        images = images.sel(surface=names)
        limit = error_limit(images, flagged)
        for axes, name in zip(rows[:, column], names, strict=True):
            panel = ImagePanel(
                of_surface(facts, title, name),
                f"{title} / K",
                images.sel(surface=name).values,
                (-limit, limit),
                scales.SIGNED,
            )
            draw_error(figure, axes, analysis, name, panel)
            axes.label_outer()
    return figure


def error_lines(facts: Facts) -> Figure | None:
    """Draw temperatures and errors along the lines: of all segments or the shown exposure."""
    names = [] if "line" not in facts.data else list(facts.data.line.values)
    names = [name for name in names if name != "contact"]
    if not names:
        return None
    number = int(facts.data.attrs["shown_instant"])
    shown = slice(None) if facts.analysis.cut else slice(number, number + 1)
    factor, unit = length_unit(facts.analysis.raster)
    figure = drawing.new_figure(2.7 * len(names) + 0.8)
    rows = figure.subplots(len(names), 2, squeeze=False)
    for (left, right), name in zip(rows, names, strict=True):
        error, portion = line_error(facts.data, name), line_psf_portion(facts.data, name)
        known = {dim: slice(error.sizes[dim]) for dim in ("texture", "point")}
        reference = facts.data.line_reference.sel(line=name).isel(known) - ZERO_CELSIUS
        at = error.distance.values * factor
        for axes, values, colour, label in (
            (left, reference, GREY, "reference"),
            (left, reference + error, BLUE, "measured"),
            (right, error, GREEN, "error"),
            (right, portion, VERMILLION, "PSF contribution"),
        ):
            drawing.draw_mean(axes, at, _draws(values[shown].values), colour, label)
        if facts.is_compared:
            _draw_published(right, str(name))
        left.set(title=line_title(facts, str(name)), ylabel="radiance temperature / °C")
        right.set_ylabel("error / K")
        right.axhline(0.0, color=GREY, linewidth=0.6)
        for axes in (left, right):
            axes.set_xlabel(_LINE_LABELS.get(name, f"distance / {unit}"))
    drawing.legend(figure, 3, rows.T.flat)
    return figure


def over_time(facts: Facts) -> Figure | None:
    """Draw the error at the first reading of every place over the exposures."""
    starts = facts.data.exposure.values
    readings = [facts.headlines[name] for name in main_readings(facts)]
    if len(starts) < 2 or not readings:
        return None
    surfaces = sorted({found.surface for found in readings})
    coloured = list(zip(readings, cycle(scales.COLOURS)))
    figure = drawing.new_figure(3.4)
    panels = figure.subplots(1, len(surfaces), sharex=True, sharey=True, squeeze=False)[0]
    factor, unit = drawing.time_unit(float(starts[-1]))
    for axes, surface in zip(panels, surfaces, strict=True):
        curves = [(found, colour) for found, colour in coloured if found.surface == surface]
        for found, colour in curves[:_MAX_CURVES]:
            values = found.error.values.reshape(len(starts), -1)
            bars: Any = {"marker": "o", "markersize": 3, "capsize": 2, "color": colour}
            bars["label"] = f"{found.place}: {found.quantity}"
            axes.errorbar(starts * factor, values.mean(axis=1), values.std(axis=1), **bars)
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.set(
            title=of_surface(facts, "error", surface), xlabel=f"start of the exposure / {unit}"
        )
    panels[0].set_ylabel("error / K")
    drawing.legend(figure, 2)
    return figure


def psf_sensitivity(facts: Facts) -> Figure | None:
    """Draw errors and contributions of the PSF over its width, for both orders."""
    data, psf = facts.data, facts.analysis.camera.psf
    if "psf_width" not in data:
        return None
    found = facts.headlines
    names = [name for name in MAIN[:2] if name in data.reading]
    figure = drawing.new_figure(5.2)
    grid = figure.subplots(2, len(names), sharex=True, squeeze=False)
    widths, order = data.psf_width.values * 1e6, facts.analysis.camera.psf_order
    for column, name in enumerate(names):
        own = found.get(name)
        fraction = own.psf_fraction if own else None
        panels: tuple[tuple[str, _Series, int, Distribution | None, str], ...] = (
            ("error", sensitivity_error, 1, own.error if own else None, "error_degC"),
            ("PSF contribution", sensitivity_psf_fraction, 100, fraction, "psf_fraction_percent"),
        )
        for axes, (title, values, scale, draws, key) in zip(grid[:, column], panels, strict=True):
            for one, (colour, label) in _ORDERS.items():
                line: Any = {"color": colour, "marker": "o", "markersize": 3.0, "label": label}
                axes.plot(widths, scale * values(data, one, name), **line)
            if facts.is_compared:
                paper = PAPER[f"{name}_{key}"]
                low, high = paper.value - paper.rounding, paper.value + paper.rounding
                axes.axhspan(low, high, color=GREY, alpha=0.3, linewidth=0)
                axes.axhline(paper.value, color="black", linestyle="--", label="paper")
            if psf is not None and draws is not None:
                own_width, colour = psf.fwhm * 1e6, _ORDERS[order][0]
                _draw_point(axes, own_width, scale * draws.mean, colour, "PSF of this camera")
            place = data.place.sel(reading=name).item()
            axes.set(title=place, ylabel=f"{title} / {'%' if scale == 100 else 'K'}")
    for axes in grid[-1]:
        axes.set_xlabel("PSF, full width at half maximum / µm")
    drawing.legend(figure, 2)
    return figure


def of_surface(facts: Facts, title: str, surface: str) -> str:
    """Return the title of a panel, with the surface if there are several."""
    return f"{title}, {surface}" if len(facts.read_surfaces) > 1 else title


def line_title(facts: Facts, line: str) -> str:
    """Return the title of a line's panel."""
    title = _LINE_TITLES.get(line, line)
    return of_surface(facts, title, str(facts.data.line_surface.sel(line=line).item()))


def _draws(values: Array) -> Array:
    """Return one row per draw, without those of textures that a surface does not have."""
    rows = values.reshape(-1, values.shape[-1])
    return np.asarray(rows[np.isfinite(rows).any(axis=1)])


def _draw_published(axes: Axes, line: str) -> None:
    error, fraction = PAPER[f"{line}_error_degC"], PAPER[f"{line}_psf_fraction_percent"]
    _draw_point(axes, 0.0, error.value, GREEN, "the paper's error")
    portion = error.value * fraction.value / 100
    _draw_point(axes, 0.0, portion, VERMILLION, "the paper's PSF contribution")
    worst = PAPER.get(f"{line}_worst_error_degC")
    if worst is not None:
        label = "the paper, beside the band"
        axes.axhline(worst.value, color=GREEN, linestyle="--", linewidth=1.0, label=label)
        axes.set_ylim(bottom=min(axes.get_ylim()[0], 1.1 * worst.value))


def _draw_point(axes: Axes, at: float, value: float, colour: str, label: str) -> None:
    look: Any = {"marker": "D", "markersize": 6, "markeredgecolor": "black", "linestyle": "none"}
    axes.plot(at, value, color=colour, label=label, **look)
