"""The figures of the report: the paper's, in its order, and what goes beyond it."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.analysis import LineDraws, Sensitivity, StudyResult
from chipglow.analysis.cut_error import SurfaceResult
from chipglow.camera import PointSpreadFunction
from chipglow.drawing import drawing, scales
from chipglow.drawing.drawing import Drawing, FigureFile, ImagePanel
from chipglow.drawing.scales import BLUE, GREEN, GREY, KELVIN, VERMILLION
from chipglow.report.evidence import beside, error_definition
from chipglow.report.laboratory_figures import (
    dual_spectrum,
    heated_chips,
    heated_tool,
    rake_profiles,
)
from chipglow.report.paper import PAPER, stands_beside
from chipglow.scene import Material

_ORDER_STYLE: Final = {
    "detector": (BLUE, "Gaussian, pixel to pixel"),
    "optics": (VERMILLION, "Gaussian, before the pixels"),
}


def draw_figures(result: StudyResult, folder: Path) -> Iterator[FigureFile]:
    """Draw every figure of the study into a folder, one after the other.

    Parameters
    ----------
    result : StudyResult
        The study.
    folder : Path
        An existing folder; ``<name>.png`` and ``<name>.svg`` are written.
    """
    for one in _DRAWINGS:
        if not stands_beside(result):
            name = one.name.removeprefix(f"{one.paper.lower().replace(' ', '-')}-")
            one = replace(one, name=name, paper="")
        if (figure := one.write(result, folder)) is not None:
            yield figure


def fields(result: StudyResult) -> Figure:
    """Temperature, strain, strain rate and emissivity at one moment (the paper's Figure 5)."""
    frame, surface = result.frame, result.surfaces[result.plan.band_surface]
    solid = frame.material == Material.WORKPIECE
    there = frame.material != Material.VOID
    rate = np.where(solid, frame.needed("plastic_strain_rate"), np.nan) * 1e-3
    temperature = _celsius(frame.temperature, there)
    strain = np.where(solid, frame.needed("plastic_strain"), np.nan)
    emissivity = np.where(there, surface.emissivity, np.nan)
    hottest = scales.round_limit(temperature, 99.9, 50.0)
    name = result.plan.band_surface
    panels = (
        ImagePanel("a) temperature", "temperature / °C", temperature, (0.0, hottest), scales.HEAT),
        ImagePanel("b) plastic strain", "plastic strain", strain, (0.0, 4.0)),
        ImagePanel("c) plastic strain rate", "strain rate / (10³ 1/s)", rate, (0.0, 60.0)),
        ImagePanel(f"d) emissivity, {name}", "emissivity", emissivity, (0.0, 1.0)),
    )
    figure = drawing.image_figure(result.raster, 2.5, rows=2)
    grid = figure.subplots(2, 2, sharex=True, sharey=True)
    for axes, panel in zip(grid.flat, panels, strict=True):
        panel.draw(figure, axes, result.raster, result.tool)
    return figure


def measurement(result: StudyResult) -> Figure:
    """One moment as it is and as the camera measures it (the paper's Figure 6)."""
    name = result.plan.band_surface
    surface = result.surfaces[name]
    measured = surface.measurement.radiance_temperature()[result.developed] - KELVIN
    truth = surface.scene_temperature - KELVIN
    lower_limit = (result.camera.lower_limit or KELVIN) - KELVIN
    top = scales.round_limit(np.asarray(truth, np.float64), 99.9, 50.0)
    figure = drawing.image_figure(result.raster, 2.8, rows=1)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    shown = (max(lower_limit - 50.0, 0.0), max(top, lower_limit + 50.0))
    drawing.show_image(left, truth, result.raster, result.tool, scales.HEAT, shown)
    picture = drawing.show_image(
        right, measured, surface.measurement.raster, result.tool, scales.HEAT, shown
    )
    left.set_title(f"a) scene, {name}, one moment")
    right.set_title(f"b) as measured ({result.camera.integration_time * 1e6:.3g} µs)")
    right.label_outer()
    drawing.colour_bar(figure, picture, [left, right], "radiance temperature / °C")
    return figure


def band_curves(result: StudyResult) -> Figure:
    """Measured temperature along the shear band as it grows (the paper's Figure 9)."""
    figure = drawing.new_figure(3.7)
    panels = figure.subplots(1, len(result.surfaces), sharex=True, sharey=True, squeeze=False)[0]
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, len(result.one_segment)))
    first = result.instants[0].start
    for axes, (name, surface) in zip(panels, result.surfaces.items(), strict=True):
        curves = surface.curves[: len(result.one_segment)]
        for i, (instant, curve) in enumerate(zip(result.one_segment, curves, strict=True)):
            if instant.band is None:
                continue
            axes.plot(
                instant.band.ridge.distance * 1e6,
                curve - KELVIN,
                color=shades[i],
                linewidth=2.6 if i == result.developed else 1.2,
                label=_instant_label(result, i, first),
            )
        _draw_floor(axes, result)
        axes.set_title(name)
    panels[0].set_ylabel("radiance temperature / °C")
    figure.supxlabel("distance from the cutting edge along the band / µm", fontsize=9.5)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right center", title="time")
    return figure


def error_images(result: StudyResult) -> Figure:
    """Error images with all effects, and the PSF's portion (the paper's Figure 10)."""
    names = list(result.surfaces)
    errors = [result.surfaces[name].errors for name in names]
    figure = drawing.image_figure(result.raster, 2.8, rows=2)
    rows = figure.subplots(2, len(names), sharex=True, sharey=True, squeeze=False)
    letters = iter("abcdefgh")
    flagged = np.stack([error.flagged for error in errors])
    seen = np.ones_like(flagged) if flagged.all() else ~flagged
    for axes_row, images, what, unit_label in (
        (rows[0], [e.case_1 for e in errors], "error", "error / °C"),
        (rows[1], [e.psf_portion for e in errors], "PSF's portion", "PSF's portion / °C"),
    ):
        limit = scales.round_limit(np.stack(images)[seen], 99.0, 10.0)
        for axes, name, error, image in zip(axes_row, names, errors, images, strict=True):
            picture = drawing.show_image(
                axes, image, error.raster, result.tool, scales.SIGNED, (-limit, limit)
            )
            drawing.veil(axes, error.flagged, error.raster)
            drawing.draw_tool(axes, result.tool)
            _draw_analysis_lines(axes, result)
            axes.set_title(f"{next(letters)}) {what}, {name}")
            axes.label_outer()
        drawing.colour_bar(figure, picture, list(axes_row), unit_label)
    return figure


def error_lines(result: StudyResult) -> Figure:
    """Errors across the rake face and the shear band (the paper's Figure 11)."""
    figure = drawing.new_figure(3.9)
    left, right = figure.subplots(1, 2)
    rake, band = result.rake, result.band_errors
    _draw_error_line(left, result.draws.rake_line, rake.case_1, rake.psf_portion)
    left.set_title(f"a) across the rake face, {result.plan.rake_surface}")
    left.set_xlabel("distance from the rake face / µm\n← tool      chip →")
    _draw_error_line(right, result.draws.band_line, band.case_1, band.psf_portion)
    if stands_beside(result):
        _draw_papers_points(left, right)
    right.set_title(f"b) across the shear band, {result.plan.band_surface}")
    right.set_xlabel("distance from the ridge / µm\n← workpiece      chip →")
    for axes in (left, right):
        axes.set_ylabel("error / °C")
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.axvline(0.0, color=GREY, linewidth=0.6)
    handles = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    handles |= dict(zip(*reversed(right.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=3)
    return figure


def _draw_papers_points(left: Axes, right: Axes) -> None:
    """The figures that the paper states, on the lines of its Figure 11."""
    for axes, error, fraction in (
        (left, PAPER.rake_error.value, PAPER.rake_psf_fraction.value),
        (right, PAPER.band_error.value, PAPER.band_psf_fraction.value),
    ):
        _draw_point(axes, 0.0, error, BLUE, "the paper's error")
        _draw_point(axes, 0.0, error * fraction, VERMILLION, "the paper's PSF portion")
    worst = PAPER.band_worst.value
    right.axhline(worst, color=BLUE, linestyle="--", linewidth=1.0, label="the paper, beside")
    # The line is no axis: it needs room below.
    right.set_ylim(bottom=min(right.get_ylim()[0], 1.1 * worst))


def point_spread(result: StudyResult) -> Figure | None:
    """The camera's PSF and its cross-section (the paper's Figure 2)."""
    psf = result.camera.psf
    if psf is None:
        return None
    spacing = min(result.raster.spacing, psf.fwhm / 12)
    kernel = psf.kernel(spacing)
    density = kernel / kernel.max()
    half = min(kernel.shape[0] // 2, round(15e-6 / spacing))
    middle = kernel.shape[0] // 2
    near = slice(middle - half, middle + half + 1)
    reach = (half + 0.5) * spacing * 1e6
    figure = drawing.new_figure(3.2)
    left, right = figure.subplots(1, 2)
    picture = left.imshow(
        np.log10(np.maximum(density[near, near], 1e-6)),
        extent=(-reach, reach, -reach, reach),
        cmap=scales.PLAIN,
        vmin=-4.0,
        vmax=0.0,
    )
    _draw_pixel(left, result.camera.pitch)
    left.set_xlabel("x / µm")
    left.set_ylabel("y / µm")
    left.set_title("a) kernel")
    drawing.colour_bar(figure, picture, left, "log₁₀ of the fraction of the greatest")
    _draw_section(right, psf, density[middle, near], spacing)
    return figure


def forces(result: StudyResult) -> Figure | None:
    """Force history with its segments."""
    history = result.forces
    if history is None:
        return None
    segments, time = history.segmentation, history.time * 1e6
    figure = drawing.new_figure(3.3)
    axes = figure.subplots()
    axes.plot(time, history.cutting * 1e-3, color=BLUE, label="cutting force", linewidth=1.2)
    axes.plot(time, history.thrust * 1e-3, color=VERMILLION, label="thrust force", linewidth=1.2)
    for i, peak in enumerate(segments.peaks * 1e6):
        axes.axvline(peak, color=GREY, linewidth=0.8, linestyle=":", label="" if i else "segments")
    axes.axvspan(time[0], segments.start * 1e6, color=scales.VOID, label="first build-up")
    duration = result.camera.integration_time
    for i, instant in enumerate(result.instants):
        seen = (instant.start * 1e6, (instant.start + duration) * 1e6)
        axes.axvspan(*seen, ymax=0.03, color=GREEN, label="" if i else "exposures")
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(0.0)
    axes.set_xlabel("time / µs")
    axes.set_ylabel("force per width / (N/mm)")
    axes.set_title(
        f"period {segments.period * 1e6:.0f} µs" if np.isfinite(segments.period) else "no period"
    )
    figure.legend(loc="outside lower center", ncols=3)
    return figure


def chip(result: StudyResult) -> Figure | None:
    """Where the chip is measured, and its thickness as it passes there."""
    found, scan = result.chip, result.chip.scan
    if not np.isfinite(scan.height):
        return None
    figure = drawing.new_figure(3.6)
    left, right = figure.subplots(1, 2)
    frame = result.frame
    strain = np.where(frame.material == Material.WORKPIECE, frame.needed("plastic_strain"), np.nan)
    picture = drawing.show_image(left, strain, result.raster, result.tool, scales.PLAIN, (0.0, 4.0))
    drawing.colour_bar(figure, picture, left, "plastic strain")
    thickness = float(np.interp(frame.time, scan.time, scan.thickness))
    foot, normal = result.tool.rake_point(scan.height), np.array(result.tool.rake_normal)
    across = np.stack([foot, foot + thickness * normal])
    drawing.draw_line(left, across, VERMILLION, "thickness")
    drawing.draw_line(left, result.segment.moment.ridge.points, BLUE, "band")
    figure.legend(loc="outside lower center", ncols=2)
    left.set_title(f"a) at {frame.time * 1e6:.0f} µs")
    right.plot(scan.time * 1e6, scan.thickness * 1e6, color=VERMILLION)
    for value, label in (
        (found.peak, "peak"),
        (found.thickness, "mean"),
        (found.valley, "valley"),
    ):
        if not np.isfinite(value):
            continue
        right.axhline(value * 1e6, color=GREY, linewidth=0.8, linestyle=":")
        right.annotate(
            f"{label} {value * 1e6:.0f}",
            (1.02, value * 1e6),
            xycoords=("axes fraction", "data"),
            va="center",
        )
    right.set_xlabel("time / µs")
    right.set_ylabel("thickness / µm")
    right.set_title("b) the chip passing the line")
    return figure


def psf_sensitivity(result: StudyResult) -> Figure:
    """Headline errors and the PSF's fractions against its width, for both orders."""
    figure = drawing.new_figure(5.2)
    grid = figure.subplots(2, 2, sharex=True)
    for axes, panel in zip(grid.flat, _sensitivity_panels(result), strict=True):
        for series in result.sensitivity:
            colour, label = _ORDER_STYLE[series.psf_order]
            axes.plot(
                series.widths * 1e6,
                panel.scale * panel.values(series),
                color=colour,
                marker="o",
                markersize=3.0,
                label=label,
            )
        if stands_beside(result):
            level, style = panel.scale * panel.paper, "--"
            axes.axhline(level, color="black", linestyle=style, linewidth=1.0, label="paper")
        if result.camera.psf is not None and panel.own is not None:
            width, own = result.camera.psf.fwhm * 1e6, panel.scale * panel.own
            colour = _ORDER_STYLE[result.camera.psf_order][0]
            _draw_point(axes, width, own, colour, "this camera's PSF")
        axes.set_title(panel.title)
        axes.set_ylabel("%" if panel.scale == 100 else "°C")
    for axes in grid[1]:
        axes.set_xlabel("PSF, full width at half maximum / µm")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


@dataclass(frozen=True)
class _SensitivityPanel:
    """One quantity of the sensitivity: its values, the study's mean and the paper's figure."""

    title: str
    values: Callable[[Sensitivity], NDArray[np.float64]]
    scale: float
    own: float | None
    paper: float


def _sensitivity_panels(result: StudyResult) -> tuple[_SensitivityPanel, ...]:
    own = {}
    for name in ("rake", "band"):
        headline = result.draws.headlines.get(name)
        fraction = headline.psf_fraction if headline else None
        own[name] = (headline.error.mean if headline else None, fraction.mean if fraction else None)
    return (
        _SensitivityPanel(
            "a) error at the rake face",
            lambda series: series.error("rake"),
            1,
            own["rake"][0],
            PAPER.rake_error.value,
        ),
        _SensitivityPanel(
            "b) error at the band's centre",
            lambda series: series.error("band"),
            1,
            own["band"][0],
            PAPER.band_error.value,
        ),
        _SensitivityPanel(
            "c) PSF's portion, rake face",
            lambda series: series.psf_fraction("rake"),
            100,
            own["rake"][1],
            PAPER.rake_psf_fraction.value,
        ),
        _SensitivityPanel(
            "d) PSF's portion, band's centre",
            lambda series: series.psf_fraction("band"),
            100,
            own["band"][1],
            PAPER.band_psf_fraction.value,
        ),
    )


def _celsius(temperature: NDArray[np.floating], where: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(where, temperature.astype(np.float64) - KELVIN, np.nan)


def _instant_label(result: StudyResult, index: int, first: float) -> str:
    after = (result.instants[index].start - first) * 1e6
    return f"{after:.0f} µs" + (" (full)" if index == result.developed else "")


def _draw_floor(axes: Axes, result: StudyResult) -> None:
    if result.camera.lower_limit is not None:
        axes.axhline(result.camera.lower_limit - KELVIN, color=GREY, linestyle="--", linewidth=1.0)


def _draw_analysis_lines(axes: Axes, result: StudyResult) -> None:
    drawing.draw_line(axes, result.rake.line.points, GREEN)
    drawing.draw_line(axes, result.band_errors.line.points, GREEN)
    axes.plot(*(result.band.ridge.points * 1e6).T, color="black", linestyle="--", linewidth=0.8)


def _draw_error_line(
    axes: Axes,
    draws: LineDraws,
    case_1: NDArray[np.float64],
    portion: NDArray[np.float64],
) -> None:
    """Mean over the draws with a standard deviation to either side, and one draw."""
    for values, one, colour, name in (
        (draws.case_1, case_1, BLUE, "error"),
        (draws.psf_portion, portion, VERMILLION, "PSF's portion"),
    ):
        lines = values.reshape(-1, draws.distance.size)
        mean, deviation = lines.mean(axis=0), lines.std(axis=0)
        at = draws.distance * 1e6
        axes.plot(at, mean, color=colour, label=f"{name}, mean")
        drawing.shade(axes, at, mean, deviation, colour, 0.2, f"{name}, ± 1 sd")
        axes.plot(at, one, color=colour, linewidth=0.9, linestyle=":", label=f"{name}, one draw")


def _draw_point(axes: Axes, at: float, value: float, colour: str, label: str) -> None:
    axes.plot(
        at,
        value,
        marker="D",
        markersize=6,
        color=colour,
        markeredgecolor="black",
        linestyle="none",
        label=label,
    )


def _draw_pixel(axes: Axes, pitch: float) -> None:
    side = pitch * 1e6 / 2
    axes.plot([-side, side, side, -side, -side], [-side, -side, side, side, -side], color="white")


def _draw_section(
    axes: Axes, psf: PointSpreadFunction, section: NDArray[np.float64], spacing: float
) -> None:
    at = spacing * 1e6 * (np.arange(section.size) - section.size // 2)
    half = psf.fwhm * 1e6 / 2
    axes.plot(at, section, color=BLUE)
    axes.plot([-half, half], [0.5, 0.5], color=VERMILLION, marker="|", markersize=10)
    axes.annotate(
        f"{psf.fwhm * 1e6:.2f} µm",
        (half, 0.5),
        xytext=(6, 0),
        textcoords="offset points",
        va="center",
    )
    axes.set_ylim(0.0)
    axes.set_xlabel("x / µm")
    axes.set_ylabel("fraction of the greatest")
    axes.set_title("b) cross-section")


def _surface(result: StudyResult) -> SurfaceResult:
    return result.surfaces[result.plan.band_surface]


def _fields_caption(result: StudyResult) -> str:
    return beside(
        result,
        f"The scene {result.frame.time * 1e6:.1f} µs into the cut, when its shear band is fully "
        "developed. Grey: no material, or not of this field.",
        "Same as the paper: the fields, and how strain and strain rate choose the emissivity. "
        "Different: strain follows the material without remeshing, so that formed bands stay "
        "sharp, and textures follow every point.",
    )


def _measurement_caption(result: StudyResult) -> str:
    lower_limit = ""
    if result.camera.lower_limit is not None:
        fraction = float(np.mean(_surface(result).errors.flagged))
        lower_limit = (
            " Grey on the right: under the lower limit of the camera's range, "
            f"{result.camera.lower_limit - KELVIN:.0f} °C, {100 * fraction:.0f} % of the pixels."
        )
    return beside(
        result,
        "What the simulated camera makes of the scene: radiance temperature of the scene's samples "
        f"at one moment, and of the pixels over the exposure.{lower_limit}",
        "The paper's figure is the scheme of this calculation; here is its result.",
    )


def _heated_caption(result: StudyResult) -> str:
    return beside(
        result,
        "Radiance temperature of evenly heated chips, and the regions whose mean is taken: a "
        "virtual strip with straight shear bands as wide and as far apart as those of the cut, of "
        "known emissivity, so that what the procedure finds can be held against the truth. The "
        "camera's lower limit is left out.",
        "Table 1 has the numbers. Same as the paper: temperatures, reflected laboratory of 20 °C, "
        "Equation 2. Different: the strip is not a chip; at the limit of 300 °C emissivities under "
        "0.46 of chip 1 would be hidden.",
    )


def _heated_tool_caption(result: StudyResult) -> str:
    return beside(
        result,
        "Radiance temperature of an evenly heated tool, and the emissivity of its pixels.",
        "Same as the paper: temperature, mean and standard deviation put in. Different: the "
        "texture is random; the paper's insert has an uneven oxide with a gradient.",
    )


def _profiles_caption(result: StudyResult) -> str:
    grid = next(s.rake_grid for s in result.surfaces.values() if s.rake_grid is not None)
    return beside(
        result,
        "Mean radiance temperature in squares of 3 × 3 pixels along the rake face, by their depth "
        f"in the chip; bars: standard deviation over {grid.times.size} exposures of "
        f"{len(result.segments)} segments. A square counts where all its pixels are over the lower "
        "limit of the range.",
        f"Same as the paper: grid, limit, both chips. Different: squares of "
        f"{grid.size * 1e6:.0f} µm (the paper's first middle of 7.5 µm means 15 µm), and our "
        "contact reaches the border of the view. The paper's panel a is its measurement, of which "
        "we have no data.",
    )


def _dual_caption(result: StudyResult) -> str:
    return beside(
        result,
        "The same moments in visible light and in the infrared: the band develops, is developed, "
        "has moved on. On the left is a drawing from the strain (darker where sheared), not a "
        "photograph.",
        "Same as the paper: pairs of one moment, tool blacked out. Different: infrared images are "
        "as close in time as we like; the paper's camera takes 600 a second.",
    )


def _curves_caption(result: StudyResult) -> str:
    return beside(
        result,
        "Measured radiance temperature along the ridge of the shear band, by time after the first "
        "exposure. A curve begins where the band does, and its distance counts straight from the "
        "cutting edge to there. The thick curve is the fully developed band, the first within 5 % "
        "of its greatest rise; the dashed line is the lower limit of the camera's range.",
        "Same as the paper: panels b and c. Different: bands of the paper's simulation are of "
        "another length; its panel a is a measurement, of which we have no data.",
    )


def _images_caption(result: StudyResult) -> str:
    return beside(
        result,
        f"{error_definition(result)} With the band fully developed, in one draw; below, the part "
        "that the PSF makes. Green: the lines along which the error is read. Dashed: the band's "
        "ridge. Paler: under the lower limit of the camera's range; the scale is that of the "
        "others.",
        "Same as the paper: definition, cases and panels. Different: our PSF, which the paper "
        "gives as a picture only.",
    )


def _lines_caption(result: StudyResult) -> str:
    return beside(
        result,
        "Errors along the green lines of the error images: through mid-contact along the normal of "
        "the rake face, and through the middle of the shear band; mean and standard deviation (sd) "
        "over all draws of segment, texture and pixel phase, and one draw dotted.",
        "The paper's stated figures are drawn as diamonds and as a dashed line. Different: the "
        "paper shows one draw.",
    )


def _psf_caption(result: StudyResult) -> str:
    return beside(
        result,
        f"The camera's point spread function on the scene's plane: {result.camera.psf}. White "
        "square: one pixel.",
        "Different: the paper measured its own with a knife edge and gives it as a picture without "
        "numbers; ours is calculated.",
    )


def _forces_caption(result: StudyResult) -> str:
    return beside(
        result,
        "Force history of the cut. Each peak is a segment.",
        "The paper does not show forces.",
    )


def _sensitivity_caption(result: StudyResult) -> str:
    return beside(
        result,
        "The headline errors, in the mean over segments and pixel phases, with Gaussian PSFs of "
        "several widths, applied from pixel to pixel, or to the light before the pixels integrate "
        "it. Diamond: this camera's PSF, which is not a Gaussian, at its own width, in the mean "
        "over all draws.",
        "Dashed: the paper's figures, whose PSF's width is not stated.",
    )


def _chip_caption(result: StudyResult) -> str:
    return (
        f"Distance from the rake face to the chip's free surface at right angles to the face, "
        f"{result.chip.scan.height * 1e6:.0f} µm up from the edge: the lowest line on which "
        "the surface is in the view and over 1.2 times the feed all the time. Peak, mean and "
        "valley are those of whole segments at the end of the scene."
    )


def _fields_alt(result: StudyResult) -> str:
    frame = result.frame
    hottest = float(frame.temperature[frame.material == Material.WORKPIECE].max()) - KELVIN
    return (
        "Four images of chip, workpiece and tool: temperature, which reaches "
        f"{hottest:.0f} °C along the rake face; plastic strain; plastic strain rate, "
        "a narrow band from the edge to the free surface; emissivity, mottled."
    )


def _measurement_alt(result: StudyResult) -> str:
    measured = result.surfaces[result.plan.band_surface].measurement
    temperature = measured.radiance_temperature()[result.developed] - KELVIN
    return (
        "Two images of radiance temperature side by side: the scene, sharp and mottled, and the "
        "same as measured, blurred into pixels, with a highest value of "
        f"{np.nanmax(temperature):.0f} °C."
    )


def _curves_alt(result: StudyResult) -> str:
    return (
        "Curves of measured radiance temperature over the distance from the cutting edge along the "
        f"shear band, one for each of {len(result.instants)} exposures, one panel for each of "
        f"{', '.join(result.surfaces)}. They rise with time until the band is developed."
    )


def _images_alt(result: StudyResult) -> str:
    worst = ", ".join(
        f"{np.nanmin(np.where(surface.errors.flagged, np.nan, surface.errors.case_1)):.0f} °C "
        f"with {name}"
        for name, surface in result.surfaces.items()
    )
    return (
        "Images of the error, blue where too little is measured: strongest along the rake face and "
        f"on both sides of the shear band, at most {worst}. Below, the part that the PSF makes."
    )


def _lines_alt(result: StudyResult) -> str:
    return (
        "Two panels of the error over the distance from the rake face and from the ridge of the "
        "shear band, as mean and standard deviation over the draws. At the face: "
        f"{result.draws.rake_line.case_1.mean(axis=(0, 1, 2)).min():.0f} °C at most; beside the "
        f"band: {result.draws.band_line.case_1.mean(axis=(0, 1, 2)).min():.0f} °C."
    )


def _sensitivity_alt(result: StudyResult) -> str:
    return (
        "Four panels over the width of the PSF: the errors at rake face and band grow with it, and "
        "so does the PSF's portion of them, from near 0 for the narrowest."
    )


def _psf_alt(result: StudyResult) -> str:
    assert result.camera.psf is not None
    return (
        "The point spread function as an image and as a cross-section, with a full width at half "
        f"maximum of {result.camera.psf.fwhm * 1e6:.2f} µm."
    )


def _forces_alt(result: StudyResult) -> str:
    assert result.forces is not None
    segments = result.forces.segmentation
    return (
        f"Cutting and thrust force over time: saw-teeth, {segments.segments} of them, about "
        f"{segments.cutting_mean * 1e-3:.0f} and {segments.thrust_mean * 1e-3:.0f} N/mm."
    )


def _chip_alt(result: StudyResult) -> str:
    return (
        "The chip with the line on which its thickness is read, and that thickness over time: "
        "between its valleys and peaks."
    )


def _heated_alt(result: StudyResult) -> str:
    return (
        "Images of heated strips of chip: bodies of the segments darker, shear bands across them "
        "brighter, each with a frame around the pixels of one region."
    )


def _heated_tool_alt(result: StudyResult) -> str:
    tool = next(heated for heated in result.heated if not heated.regions)
    return (
        "Image of a heated tool, mottled, and a histogram of the emissivity of its pixels about "
        f"{tool.rows[0].found.mean:.2f}."
    )


def _profiles_alt(result: StudyResult) -> str:
    hottest = ", ".join(
        f"{np.nanmax(surface.rake_grid.frame_mean) - KELVIN:.0f} °C with {name}"
        for name, surface in result.surfaces.items()
        if surface.rake_grid is not None
    )
    return (
        "Curves of radiance temperature over the distance along the rake face, one for each depth "
        f"in the chip, hottest beside the face: {hottest} at most."
    )


def _dual_alt(result: StudyResult) -> str:
    return (
        f"{len(result.moments)} pairs of pictures: a grey drawing of the chip with dark shear "
        "bands and a black tool, and beside it the infrared image of the same moment."
    )


_DRAWINGS: Final[tuple[Drawing[StudyResult], ...]] = (
    Drawing(
        "figure-2-psf",
        "The camera's point spread function",
        "Figure 2",
        _psf_caption,
        _psf_alt,
        point_spread,
    ),
    Drawing(
        "figure-3-heated-chips",
        "Heated chips",
        "Figure 3",
        _heated_caption,
        _heated_alt,
        heated_chips,
    ),
    Drawing(
        "figure-4-heated-tool",
        "Heated tool",
        "Figure 4",
        _heated_tool_caption,
        _heated_tool_alt,
        heated_tool,
    ),
    Drawing("figure-5-scene", "The scene", "Figure 5", _fields_caption, _fields_alt, fields),
    Drawing(
        "figure-6-measurement",
        "The measurement",
        "Figure 6",
        _measurement_caption,
        _measurement_alt,
        measurement,
    ),
    Drawing(
        "figure-7-rake-profiles",
        "The chip beside the rake face",
        "Figure 7",
        _profiles_caption,
        _profiles_alt,
        rake_profiles,
    ),
    Drawing(
        "figure-8-dual-spectrum",
        "Visible and infrared",
        "Figure 8",
        _dual_caption,
        _dual_alt,
        dual_spectrum,
    ),
    Drawing(
        "figure-9-band-curves",
        "The shear band as it develops",
        "Figure 9",
        _curves_caption,
        _curves_alt,
        band_curves,
    ),
    Drawing(
        "figure-10-error-images",
        "The measurement error",
        "Figure 10",
        _images_caption,
        _images_alt,
        error_images,
    ),
    Drawing(
        "figure-11-error-lines",
        "Across the rake face and the shear band",
        "Figure 11",
        _lines_caption,
        _lines_alt,
        error_lines,
    ),
    Drawing(
        "psf-sensitivity",
        "How much the PSF's width decides",
        "",
        _sensitivity_caption,
        _sensitivity_alt,
        psf_sensitivity,
    ),
    Drawing("forces", "The forces", "", _forces_caption, _forces_alt, forces),
    Drawing("chip-thickness", "The chip's thickness", "", _chip_caption, _chip_alt, chip),
)
