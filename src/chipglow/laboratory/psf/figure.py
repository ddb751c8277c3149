"""A point spread function by the knife edge, as a picture and in sentences."""

from math import cos, hypot, sin, sqrt
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.camera import AnnularAperturePSF, GaussianPSF
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import BLUE, GREY, VERMILLION, VOID
from chipglow.laboratory.psf.psf_fit import FittedEdge, ModelFit
from chipglow.laboratory.psf.psf_models import is_length
from chipglow.quantities import uncertain_text
from chipglow.scene import Raster
from chipglow.scene.figures import ImagePanel, length_unit

if TYPE_CHECKING:
    from chipglow.laboratory.psf.knife_edge import EdgeResult, KnifeEdge

_EDGE_HEIGHT: Final = 5.6
"""Height in inches of an edge's panels."""

_APERTURES_HEIGHT: Final = 2.6
"""Height in inches of the panel of apertures."""

_CURVE_POINTS: Final = 801
"""Points of a fitted curve."""

_SHOWN_WIDTHS: Final = 5.0
"""Distance from the edge that is shown, in widths of the line-spread function."""


def draw_knife_edge(found: "KnifeEdge") -> Figure:
    """Draw each image, the edge-spread function with fit and residuals, and the MTF."""
    heights = [_EDGE_HEIGHT] * len(found.edges) + ([_APERTURES_HEIGHT] if found.apertures else [])
    with drawing.style():
        figure = drawing.new_figure(sum(heights) + 0.4)
        width = uncertain_text(found.fwhm * 1e6, found.fwhm_uncertainty * 1e6)
        figure.suptitle(f"{found.best.model.name}: optics {width} µm wide (FWHM)")
        parts: Any = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)
        for k, edge in enumerate(found.edges):
            _draw_edge(parts[k, 0], found, k, edge)
        if found.apertures is not None:
            _draw_apertures(parts[-1, 0].subplots(), found)
    return figure


def _draw_edge(figure: Any, found: "KnifeEdge", k: int, edge: "EdgeResult") -> None:
    grid = figure.add_gridspec(3, 2, height_ratios=(3.0, 1.1, 3.2))
    _draw_image(figure, figure.add_subplot(grid[0:2, 0]), edge, found.best.edges[k])
    spread = figure.add_subplot(grid[0, 1])
    residual = figure.add_subplot(grid[1, 1], sharex=spread)
    response = found.best.response(k, edge.pixels)
    shown = min(_SHOWN_WIDTHS * edge.line_fwhm, edge.pixels.reach)
    fine = np.linspace(-shown, shown, _CURVE_POINTS)
    _draw_spread(spread, residual, edge, fine, response(fine))
    _draw_line(figure.add_subplot(grid[2, 0]), edge, fine, response.slope(fine))
    _draw_transfer(figure.add_subplot(grid[2, 1]), edge)


def _draw_image(figure: Any, axes: Axes, edge: "EdgeResult", fitted: FittedEdge) -> None:
    image, pitch = edge.image, edge.image.pitch
    raster = Raster(
        float(image.x[0]) - pitch / 2, float(image.y[0]) + pitch / 2, pitch, *image.radiance.shape
    )
    usable = np.where(image.usable, image.radiance, np.nan)
    limits = float(np.nanmin(usable)), float(np.nanmax(usable))
    label = image.unit if image.unit == "counts" else f"radiance / ({image.unit})"
    ImagePanel(image.name, label, usable, limits, scales.HEAT).draw(figure, axes, raster)
    c, s = cos(fitted.line.normal), sin(fitted.line.normal)
    middle = np.array([image.x.mean(), image.y.mean()]) + fitted.line.position * np.array([c, s])
    along = image.pitch * hypot(*raster.shape) * np.array([-s, c])
    shown, factor = axes.axis(), length_unit(raster)[0]
    drawing.draw_line(axes, np.stack([middle - along, middle + along]), BLUE, factor=factor)
    axes.axis(shown)


def _draw_spread(axes: Axes, below: Axes, edge: "EdgeResult", distance: Any, model: Any) -> None:
    spread = edge.curves[["distance", "esf", "esf_uncertainty", "esf_residual"]].where(
        np.abs(edge.curves["distance"]) <= distance[-1]
    )
    where = spread["distance"] * 1e6
    bars: dict[str, Any] = {"fmt": ".", "color": GREY, "markersize": 3, "elinewidth": 0.7}
    axes.errorbar(where, spread["esf"], spread["esf_uncertainty"], label="measured", **bars)
    axes.plot(distance * 1e6, model, color=VERMILLION, label="fit")
    axes.set_title("edge-spread function")
    axes.legend(loc="upper left")
    axes.tick_params(labelbottom=False)
    residual, deviation = 100 * spread["esf_residual"], 100 * spread["esf_uncertainty"]
    below.errorbar(where, residual, deviation, **bars)
    below.axhline(0.0, color=VERMILLION, linewidth=1.0)
    below.set(ylabel="residual / %", xlabel="distance from the edge / µm")


def _draw_line(axes: Axes, edge: "EdgeResult", distance: Any, model: Any) -> None:
    line = edge.curves[["line_distance", "lsf", "lsf_uncertainty"]].where(
        np.abs(edge.curves["line_distance"]) <= distance[-1]
    )
    axes.errorbar(
        line["line_distance"] * 1e6, line["lsf"] * 1e-6, line["lsf_uncertainty"] * 1e-6,
        fmt=".", color=GREY, markersize=3, elinewidth=0.7,
    )  # fmt: skip
    axes.plot(distance * 1e6, model * 1e-6, color=VERMILLION)
    axes.set(title="line-spread function", xlabel="distance from the edge / µm", ylabel="1/µm")


def _draw_transfer(axes: Axes, edge: "EdgeResult") -> None:
    frequency, mtf, spread, model, optics = (
        edge.curves[name].values
        for name in ("frequency", "mtf", "mtf_uncertainty", "mtf_model", "mtf_optics")
    )
    frequency = frequency * 1e-3
    drawing.shade(axes, frequency, mtf, 2 * spread, GREY, opacity=0.3)
    axes.plot(frequency, mtf, color=GREY, label="measured, 2 u")
    axes.plot(frequency, model, color=VERMILLION, label="fit: optics and pixel")
    axes.plot(frequency, optics, color=BLUE, linestyle="--", label="fit: optics alone")
    axes.axvline(0.5e-3 / edge.image.pitch, color=VOID, linewidth=1.2, label="Nyquist", zorder=0)
    axes.set_ylim(-0.05, 1.05)  # from 0 to 1, with a margin
    axes.set(title="modulation transfer function", xlabel="frequency / (1/mm)")
    # The curves go from one corner to the other: beside them there is no place for it.
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), ncols=2)


def _draw_apertures(axes: Axes, found: "KnifeEdge") -> None:
    signals, best = found.apertures, found.best
    assert signals is not None
    fraction = (signals.radiance - best.aperture_background) / best.source
    model = signals.weights @ best.model.mean_transfer(best.values, signals.frequency)
    order = np.argsort(signals.diameters)
    diameters = signals.diameters[order] * 1e6
    axes.errorbar(
        diameters, 100 * fraction[order], 200 * signals.sigma[order] / best.source, fmt=".",
        color=GREY, label="measured, 2 u",
    )  # fmt: skip
    axes.plot(diameters, 100 * model[order], color=VERMILLION, label="fit")
    axes.set_xscale("log")
    axes.set_title("size-of-source effect: signal in the middle of an aperture")
    axes.set_xlabel("diameter / µm")
    axes.set_ylabel("fraction of an endless source / %")
    axes.legend(loc="lower right")


def sentences(found: "KnifeEdge") -> list[str]:
    """Return the result, and how to use it."""
    width = uncertain_text(found.fwhm * 1e6, found.fwhm_uncertainty * 1e6)
    lines = [
        f"The optics' point spread function is {width} um wide (full width at half maximum, with "
        f"its standard uncertainty; {found.best.model.name}: {_parameters(found.best)})."
    ]
    if found.oval:
        lines[0] += f" Across the edges alone it is known to {found.edge_uncertainty * 1e6:.2g} um."
    lines += _directions(found)
    if (text := _study_section(found)) is not None:
        lines.append(f"For a study's camera: psf_order: optics, psf: {text}")
    return lines


def _study_section(found: "KnifeEdge") -> str | None:
    """Return the best model as a study's camera section; None if only a file can hold it."""
    psf = found.psf()
    if isinstance(psf, GaussianPSF):
        return f"{{kind: gaussian, fwhm: {psf.fwhm * 1e6:.4g} um}}"
    if isinstance(psf, AnnularAperturePSF):
        assert psf.wavelength is not None
        return (
            f"{{kind: annular-aperture, wavelength: {psf.wavelength * 1e6:.4g} um, "
            f"numerical_aperture: {psf.numerical_aperture:.4g}, "
            f"obscuration: {psf.obscuration:.4g}}}"
        )
    return None


def _parameters(fit: ModelFit) -> str:
    texts = []
    for name, value, deviation in zip(
        fit.model.parameters, fit.values, fit.uncertainties, strict=True
    ):
        scale, unit = (1e6, " um") if is_length(name) else (1.0, "")
        number = uncertain_text(float(value) * scale, float(deviation) * scale)
        texts.append(f"{name.replace('_', ' ')} {number}{unit}")
    return ", ".join(texts)


def _directions(found: "KnifeEdge") -> list[str]:
    """Return whether edges of several orientations agree."""
    if len(found.edges) < 2:
        return []
    widths = np.array([edge.fwhm for edge in found.edges])
    spread = np.array([edge.fwhm_uncertainty for edge in found.edges])
    apart = float(np.ptp(widths))
    unsure = sqrt(float(spread[widths.argmax()] ** 2 + spread[widths.argmin()] ** 2))
    verdict = "agree" if apart < 2 * unsure else "differ: the point spread function is not round"
    return [
        f"The edges' own widths lie {apart * 1e6:.2g} um apart, with a standard uncertainty of "
        f"{unsure * 1e6:.2g} um: they {verdict}."
    ]
