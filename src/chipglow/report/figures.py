"""The figures of the report: the paper's 5, 6, 9, 10 and 11, and what stands behind them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.analysis.paper import PAPER, StudyResult, SurfaceResult
from chipglow.camera import PointSpreadFunction
from chipglow.report import drawing
from chipglow.report.drawing import BLUE, GREEN, GREY, KELVIN, VERMILLION, ImagePanel
from chipglow.report.evidence import error_definition
from chipglow.scene import Material

_ORDER_STYLE: Final = {
    "sensor": (BLUE, "Gaussian, sensor to sensor"),
    "optics": (VERMILLION, "Gaussian, before the sensors"),
}


@dataclass(frozen=True)
class FigureFile:
    """A figure as written.

    Parameters
    ----------
    name : str
        Name of the files without ending.
    title : str
        Heading.
    caption : str
        What it shows, and which figure of the paper it stands beside.
    png, svg : Path
        The files.
    """

    name: str
    title: str
    caption: str
    png: Path
    svg: Path


@dataclass(frozen=True)
class _Drawing:
    """How one figure is drawn; `draw` gives None where the study has nothing for it."""

    name: str
    title: str
    caption: Callable[[StudyResult], str]
    draw: Callable[[StudyResult], Figure | None]


def draw_figures(result: StudyResult, folder: Path) -> Iterator[FigureFile]:
    """Draw every figure of the study into a folder, one after the other.

    Parameters
    ----------
    result : StudyResult
        The study.
    folder : Path
        An existing folder; ``<name>.png`` and ``<name>.svg`` are written.
    """
    for drawing_ in _DRAWINGS:
        with drawing.style():
            figure = drawing_.draw(result)
            if figure is None:
                continue
            png, svg = drawing.save(figure, folder, drawing_.name)
        yield FigureFile(drawing_.name, drawing_.title, drawing_.caption(result), png, svg)


def fields(result: StudyResult) -> Figure:
    """Temperature, strain, strain rate and emissivity at one moment (the paper's Figure 5)."""
    frame, surface = result.frame, result.surfaces[result.plan.band_surface]
    solid = frame.material == Material.WORKPIECE
    there = frame.material != Material.VOID
    rate = np.where(solid, frame.plastic_strain_rate, np.nan) * 1e-3
    temperature = _celsius(frame.temperature, there)
    strain = np.where(solid, frame.plastic_strain, np.nan)
    emissivity = np.where(there, surface.emissivity, np.nan)
    hottest = drawing.round_limit(temperature, 99.9, 50.0)
    name = result.plan.band_surface
    panels = (
        ImagePanel("a) temperature", "temperature / °C", temperature, (0.0, hottest), drawing.HEAT),
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
    floor = (result.camera.floor or KELVIN) - KELVIN
    top = drawing.round_limit(np.asarray(truth, np.float64), 99.9, 50.0)
    figure = drawing.image_figure(result.raster, 2.8, rows=1)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    shown = (max(floor - 50.0, 0.0), max(top, floor + 50.0))
    drawing.show_image(left, truth, result.raster, result.tool, drawing.HEAT, shown)
    picture = drawing.show_image(
        right, measured, surface.measurement.raster, result.tool, drawing.HEAT, shown
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
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, len(result.instants)))
    first = result.instants[0].start
    for axes, (name, surface) in zip(panels, result.surfaces.items(), strict=True):
        for i, (instant, curve) in enumerate(zip(result.instants, surface.curves, strict=True)):
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
        limit = drawing.round_limit(np.stack(images)[seen], 99.0, 10.0)
        for axes, name, error, image in zip(axes_row, names, errors, images, strict=True):
            picture = drawing.show_image(
                axes, image, error.raster, result.tool, drawing.SIGNED, (-limit, limit)
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
    _draw_error_line(left, rake.line.distance, rake.case_1, rake.psf_portion)
    left.plot(
        rake.line.distance * 1e6,
        rake.mean_case_1,
        color=BLUE,
        linestyle=":",
        label="error, mean over the contact",
    )
    paper_rake = PAPER.rake_error.value
    _draw_point(left, 0.0, paper_rake, BLUE, "the paper's error")
    _draw_point(
        left, 0.0, paper_rake * PAPER.rake_psf_share.value, VERMILLION, "the paper's PSF portion"
    )
    left.set_title(f"a) across the rake face, {result.plan.rake_surface}")
    left.set_xlabel("distance from the rake face / µm\n← tool      chip →")
    _draw_error_line(right, band.line.distance, band.case_1, band.psf_portion)
    paper_band = PAPER.band_error.value
    _draw_point(right, 0.0, paper_band, BLUE, "the paper's error")
    _draw_point(
        right,
        0.0,
        paper_band * PAPER.band_psf_share.value,
        VERMILLION,
        "the paper's PSF portion",
    )
    right.axhline(
        PAPER.band_worst.value,
        color=BLUE,
        linestyle="--",
        linewidth=1.0,
        label="the paper's error beside the band",
    )
    # The line is no axis: it needs room below.
    right.set_ylim(bottom=min(right.get_ylim()[0], 1.1 * PAPER.band_worst.value))
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
        cmap=drawing.PLAIN,
        vmin=-4.0,
        vmax=0.0,
    )
    _draw_sensor(left, result.camera.pitch)
    left.set_xlabel("x / µm")
    left.set_ylabel("y / µm")
    left.set_title("a) kernel")
    drawing.colour_bar(figure, picture, left, "log₁₀ of the share over the greatest")
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
    axes.axvspan(time[0], segments.start * 1e6, color=drawing.VOID, label="first build-up")
    duration = result.camera.integration_time
    begin, end = result.instants[0].start, result.instants[-1].start + duration
    axes.axvspan(begin * 1e6, end * 1e6, ymax=0.03, color=GREEN, label="seen by the camera")
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
    strain = np.where(frame.material == Material.WORKPIECE, frame.plastic_strain, np.nan)
    picture = drawing.show_image(
        left, strain, result.raster, result.tool, drawing.PLAIN, (0.0, 4.0)
    )
    drawing.colour_bar(figure, picture, left, "plastic strain")
    thickness = float(np.interp(frame.time, scan.time, scan.thickness))
    foot, normal = result.tool.rake_point(scan.height), np.array(result.tool.rake_normal)
    across = np.stack([foot, foot + thickness * normal])
    drawing.draw_line(left, across, VERMILLION, "thickness")
    drawing.draw_line(left, (result.momentary_band or result.band).ridge.points, BLUE, "band")
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
    """Headline errors and the PSF's shares against its width, for both orders."""
    figure = drawing.new_figure(5.2)
    grid = figure.subplots(2, 2, sharex=True)
    for axes, panel in zip(grid.flat, _sensitivity_panels(result), strict=True):
        for series in result.sensitivity:
            colour, label = _ORDER_STYLE[series.psf_order]
            axes.plot(
                series.widths * 1e6,
                panel.scale * getattr(series, panel.name),
                color=colour,
                marker="o",
                markersize=3.0,
                label=label,
            )
        axes.axhline(
            panel.scale * panel.paper, color="black", linestyle="--", linewidth=1.0, label="paper"
        )
        if result.camera.psf is not None:
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
    """One quantity of the sensitivity: its name there, the study's value and the paper's."""

    title: str
    name: str
    scale: float
    own: float
    paper: float


def _sensitivity_panels(result: StudyResult) -> tuple[_SensitivityPanel, ...]:
    rake, band = result.rake, result.band_errors
    return (
        _SensitivityPanel(
            "a) error at the rake face", "rake_error", 1, rake.error, PAPER.rake_error.value
        ),
        _SensitivityPanel(
            "b) error at the band's centre", "band_error", 1, band.error, PAPER.band_error.value
        ),
        _SensitivityPanel(
            "c) PSF's share, rake face",
            "rake_share",
            100,
            rake.psf_share,
            PAPER.rake_psf_share.value,
        ),
        _SensitivityPanel(
            "d) PSF's share, band's centre",
            "band_share",
            100,
            band.psf_share,
            PAPER.band_psf_share.value,
        ),
    )


def _celsius(temperature: NDArray[np.floating], where: NDArray[np.bool_]) -> NDArray[np.float64]:
    return np.where(where, temperature.astype(np.float64) - KELVIN, np.nan)


def _instant_label(result: StudyResult, index: int, first: float) -> str:
    after = (result.instants[index].start - first) * 1e6
    return f"{after:.0f} µs" + (" (full)" if index == result.developed else "")


def _draw_floor(axes: Axes, result: StudyResult) -> None:
    if result.camera.floor is not None:
        axes.axhline(result.camera.floor - KELVIN, color=GREY, linestyle="--", linewidth=1.0)


def _draw_analysis_lines(axes: Axes, result: StudyResult) -> None:
    drawing.draw_line(axes, result.rake.line.points, GREEN)
    drawing.draw_line(axes, result.band_errors.line.points, GREEN)
    axes.plot(*(result.band.ridge.points * 1e6).T, color="black", linestyle="--", linewidth=0.8)


def _draw_error_line(
    axes: Axes,
    distance: NDArray[np.float64],
    case_1: NDArray[np.float64],
    portion: NDArray[np.float64],
) -> None:
    axes.plot(distance * 1e6, case_1, color=BLUE, label="error")
    axes.plot(distance * 1e6, portion, color=VERMILLION, label="PSF's portion")


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


def _draw_sensor(axes: Axes, pitch: float) -> None:
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
    axes.set_ylabel("share over the greatest")
    axes.set_title("b) cross-section")


def _surface(result: StudyResult) -> SurfaceResult:
    return result.surfaces[result.plan.band_surface]


def _fields_caption(result: StudyResult) -> str:
    return (
        f"The scene {result.frame.time * 1e6:.1f} µs into the cut, when its shear band is fully "
        "developed. The paper's Figure 5. Grey: no material, or not of this field."
    )


def _measurement_caption(result: StudyResult) -> str:
    floor = ""
    if result.camera.floor is not None:
        share = float(np.mean(_surface(result).errors.flagged))
        floor = (
            " Grey on the right: under the camera's floor of "
            f"{result.camera.floor - KELVIN:.0f} °C, {100 * share:.0f} % of the sensors."
        )
    return (
        "What the simulated camera (the paper's Figure 6) makes of the scene: radiance temperature "
        f"of the scene's samples at one moment, and of the sensors over the exposure.{floor}"
    )


def _curves_caption(result: StudyResult) -> str:
    return (
        "Measured radiance temperature along the ridge of the shear band, by time after the first "
        "exposure. A curve begins where the band does, and its distance counts straight from the "
        "cutting edge to there. The paper's Figure 9 b and c. The thick curve is the fully "
        "developed band, that of the greatest mean temperature; the dashed line is the camera's "
        "floor."
    )


def _images_caption(result: StudyResult) -> str:
    return (
        f"{error_definition(result)} With the band fully developed; below, the part that the PSF "
        "makes. The paper's Figure 10. Green: the lines of the next figure. Dashed: the "
        "band's ridge. Paler: under the camera's floor; the scale is that of the others."
    )


def _lines_caption(result: StudyResult) -> str:
    return (
        "Errors along the green lines of the figure before: through mid-contact along the normal "
        "of the rake face, and through the middle of the shear band. The paper's Figure 11, its "
        "stated figures drawn as diamonds and as a dashed line."
    )


def _psf_caption(result: StudyResult) -> str:
    return (
        f"The camera's point spread function on the scene's plane: {result.camera.psf!r}. The "
        "paper gives its own as a picture (Figure 2). White square: one sensor."
    )


def _forces_caption(result: StudyResult) -> str:
    return "Force history of the cut. Each peak is a segment. The paper does not show forces."


def _sensitivity_caption(result: StudyResult) -> str:
    return (
        "The headline errors with Gaussian PSFs of several widths, applied from sensor to sensor "
        "as in the paper, or to the light before the sensors integrate it. Dashed: the paper's "
        "figures, whose PSF's width is not stated. Diamond: this camera's PSF, which is not a "
        "Gaussian, at its own width."
    )


def _chip_caption(result: StudyResult) -> str:
    return (
        f"Distance from the rake face to the chip's free surface at right angles to the face, "
        f"{result.chip.scan.height * 1e6:.0f} µm up from the edge: the lowest line on which "
        "the surface is in the view and over 1.2 times the feed all the time. Peak, mean and "
        "valley are those of whole segments at the end of the scene."
    )


_DRAWINGS: Final = (
    _Drawing("fields", "The scene", _fields_caption, fields),
    _Drawing("measurement", "The measurement", _measurement_caption, measurement),
    _Drawing("band-curves", "The shear band as it develops", _curves_caption, band_curves),
    _Drawing("error-images", "The measurement error", _images_caption, error_images),
    _Drawing("error-lines", "Across the rake face and the shear band", _lines_caption, error_lines),
    _Drawing(
        "psf-sensitivity", "How much the PSF's width decides", _sensitivity_caption, psf_sensitivity
    ),
    _Drawing("psf", "The camera's point spread function", _psf_caption, point_spread),
    _Drawing("forces", "The forces", _forces_caption, forces),
    _Drawing("chip", "The chip's thickness", _chip_caption, chip),
)
