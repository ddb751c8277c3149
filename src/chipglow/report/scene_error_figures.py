"""Figures of a scene's measurement error: without a word of cutting."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from chipglow.analysis import SceneErrors
from chipglow.analysis.scene_error import PlaceErrors, Profile, SurfaceErrors
from chipglow.drawing import drawing, scales
from chipglow.drawing.drawing import Drawing, FigureFile, ImagePanel
from chipglow.drawing.scales import BLUE, GREEN, GREY, KELVIN, VERMILLION
from chipglow.report.evidence import definition_of
from chipglow.scene import Material

_MOST_CURVES: Final = 6


def draw_scene_errors(result: SceneErrors, folder: Path) -> Iterator[FigureFile]:
    """Draw every figure into a folder, one after the other.

    Parameters
    ----------
    result : SceneErrors
        What was found.
    folder : Path
        An existing folder; ``<name>.png`` and ``<name>.svg`` are written.
    """
    for one in _DRAWINGS:
        if (figure := one.write(result, folder)) is not None:
            yield figure


def scene(result: SceneErrors) -> Figure:
    """True temperature and emissivities at the shown moment."""
    frame = result.frame
    there = frame.material != Material.VOID
    temperature = np.where(there, frame.temperature - KELVIN, np.nan)
    known = temperature[there]
    ends = scales.ends(known, 0.0, 99.9, 1.0)
    panels = [ImagePanel("temperature", "temperature / °C", temperature, ends, scales.HEAT)]
    for name, surface in result.surfaces.items():
        emissivity = np.where(there, surface.emissivity, np.nan)
        panels.append(
            ImagePanel(_titled("emissivity", name, result), "emissivity", emissivity, (0.0, 1.0))
        )
    return _grid_of(panels, result)


def measurement(result: SceneErrors) -> Figure:
    """The scene's radiance temperature at one moment, and what the camera measures."""
    surfaces = list(result.surfaces.items())
    figure = drawing.image_figure(result.raster, 2.8, rows=len(surfaces))
    rows = figure.subplots(len(surfaces), 2, sharex=True, sharey=True, squeeze=False)
    for axes, (name, surface) in zip(rows, surfaces, strict=True):
        truth = surface.scene_temperature - KELVIN
        measured = surface.measurement.radiance_temperature()[result.shown] - KELVIN
        lower_limit = result.camera.lower_limit
        low, high = scales.ends(truth, 0.5, 99.9, 1.0)
        low = low if lower_limit is None else max(lower_limit - KELVIN - 50.0, low)
        shown = (low, max(high, low + 50.0))
        drawing.show_image(axes[0], truth, result.raster, result.tool, scales.HEAT, shown)
        pixels = surface.measurement.raster
        picture = drawing.show_image(axes[1], measured, pixels, result.tool, scales.HEAT, shown)
        axes[0].set_title(_titled("scene, one moment", name, result))
        axes[1].set_title("as measured")
        axes[0].label_outer()
        axes[1].label_outer()
        drawing.colour_bar(figure, picture, list(axes), "radiance temperature / °C")
    return figure


def error_images(result: SceneErrors) -> Figure:
    """Error images with all effects, and the PSF's portion, with the places."""
    surfaces = list(result.surfaces.items())
    figure = drawing.image_figure(result.raster, 2.8, rows=len(surfaces))
    rows = figure.subplots(len(surfaces), 2, sharex=True, sharey=True, squeeze=False)
    for axes, (name, surface) in zip(rows, surfaces, strict=True):
        errors = surface.errors
        seen = np.ones_like(errors.flagged) if errors.flagged.all() else ~errors.flagged
        for one, image, what in (
            (axes[0], errors.case_1, "error"),
            (axes[1], errors.psf_portion, "PSF's portion"),
        ):
            limit = scales.round_limit(image[seen], 99.5, 10.0)
            panel = ImagePanel(
                _titled(what, name, result), f"{what} / °C", image, (-limit, limit), scales.SIGNED
            )
            panel.draw(figure, one, errors.raster, result.tool)
            drawing.veil(one, errors.flagged, errors.raster)
            _draw_places(one, result)
    return figure


def profiles(result: SceneErrors) -> Figure | None:
    """Temperatures and errors along the user's lines."""
    found = [
        (_titled(one.name, name, result), one)
        for name, surface in result.surfaces.items()
        for one in surface.profiles
    ]
    if not found:
        return None
    figure = drawing.new_figure(2.7 * len(found) + 0.5)
    rows = figure.subplots(len(found), 2, squeeze=False)
    factor, unit = drawing.length_unit(result.raster)
    for (left, right), (title, one) in zip(rows, found, strict=True):
        along = one.line.distance * factor
        _draw_temperatures(left, along, one)
        for values, colour, label in (
            (one.error, BLUE, "error"),
            (one.psf_portion, VERMILLION, "PSF's portion"),
        ):
            mean, deviation = _over_draws(values)
            right.plot(along, mean, color=colour, label=label)
            drawing.shade(right, along, mean, deviation, colour, 0.2)
        right.axhline(0.0, color=GREY, linewidth=0.6)
        left.set_title(title)
        left.set_ylabel("radiance temperature / °C")
        right.set_ylabel("error / °C")
        for axes in (left, right):
            axes.set_xlabel(f"distance / {unit}")
            axes.legend()
    return figure


def over_time(result: SceneErrors) -> Figure | None:
    """The error at every place over the exposures."""
    if len(result.starts) < 2:
        return None
    figure = drawing.new_figure(3.2)
    panels = figure.subplots(1, len(result.surfaces), sharex=True, sharey=True, squeeze=False)[0]
    factor, unit = drawing.time_unit(float(result.starts[-1]))
    for axes, (name, surface) in zip(panels, result.surfaces.items(), strict=True):
        for reading in _first_readings(surface)[:_MOST_CURVES]:
            values = reading.error.values.reshape(len(result.starts), -1)
            axes.errorbar(
                result.starts * factor,
                values.mean(axis=1),
                values.std(axis=1),
                marker="o",
                markersize=3,
                capsize=2,
                label=f"{reading.place}: {reading.reading}",
            )
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.set_title(_titled("error", name, result))
        axes.set_xlabel(f"begin of the exposure / {unit}")
        axes.label_outer()
    panels[0].set_ylabel("error / °C")
    handles = panels[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=2)
    return figure


def _titled(what: str, surface: str, result: SceneErrors) -> str:
    """Title of a panel; with the surface's name where there are several."""
    return f"{what}, {surface}" if len(result.surfaces) > 1 else what


def _first_readings(surface: SurfaceErrors) -> list[PlaceErrors]:
    """The first reading of every place."""
    first: dict[str, PlaceErrors] = {}
    for reading in surface.readings:
        first.setdefault(reading.place, reading)
    return list(first.values())


def _draw_temperatures(axes: Axes, along: NDArray[np.float64], one: Profile) -> None:
    truth, _ = _over_draws(one.reference - KELVIN)
    measured, deviation = _over_draws(one.reference + one.error - KELVIN)
    axes.plot(along, truth, color=GREY, label="reference")
    axes.plot(along, measured, color=BLUE, label="measured")
    drawing.shade(axes, along, measured, deviation, BLUE, 0.2)


def _over_draws(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean and standard deviation over the draws; NaN where one is off the image."""
    return values.mean(axis=0), values.std(axis=0)


def _draw_places(axes: Axes, result: SceneErrors) -> None:
    factor, _ = drawing.length_unit(result.raster)
    for place in result.places:
        points = place.outline()
        if points is None:
            continue
        if len(points) == 1:
            axes.plot(*(points[0] * factor), "+", color=GREEN, markersize=9, markeredgewidth=1.6)
        else:
            drawing.draw_line(axes, points, GREEN, factor=factor)


def _grid_of(panels: list[ImagePanel], result: SceneErrors) -> Figure:
    rows = (len(panels) + 1) // 2
    figure = drawing.image_figure(result.raster, 2.8, rows=rows)
    grid = figure.subplots(rows, 2, sharex=True, sharey=True, squeeze=False)
    for axes, panel in zip(grid.flat, panels, strict=False):
        panel.draw(figure, axes, result.raster, result.tool)
    for axes in grid.flat[len(panels) :]:
        axes.remove()
    return figure


def _when(result: SceneErrors) -> str:
    factor, unit = drawing.time_unit(float(result.starts[-1]))
    return f"{result.frame.time * factor:.4g} {unit}"


def _scene_caption(result: SceneErrors) -> str:
    return (
        f"The scene at {_when(result)}, in the middle of the exposure in which it is hottest. "
        "Grey: no material."
    )


def _measurement_caption(result: SceneErrors) -> str:
    exposure, unit = drawing.time_unit(result.camera.integration_time)
    lower_limit = result.camera.lower_limit
    grey = (
        "" if lower_limit is None else f" Grey: under the camera's {lower_limit - KELVIN:.0f} °C."
    )
    return (
        "Radiance temperature of the scene's samples at one moment, and of the pixels over the "
        f"exposure of {result.camera.integration_time * exposure:.3g} {unit}.{grey}"
    )


def _errors_caption(result: SceneErrors) -> str:
    lower_limit = result.camera.lower_limit
    paler = "" if lower_limit is None else " Paler: under the lower limit of the camera's range."
    return (
        f"{definition_of(result.plan.reference)} On the right the part that the point spread "
        f"function makes. Green: the places.{paler}"
    )


def _profiles_caption(result: SceneErrors) -> str:
    return (
        "Along the lines, from their first corner: mean over the draws of texture and pixel phase "
        "in the exposure shown above; bands: ± 1 standard deviation."
    )


def _time_caption(result: SceneErrors) -> str:
    return "Error at each place, exposure by exposure; bars: standard deviation over the draws."


_DRAWINGS: Final[tuple[Drawing[SceneErrors], ...]] = (
    Drawing(
        "scene",
        "The scene",
        "",
        _scene_caption,
        lambda _: "Images of temperature and emissivity.",
        scene,
    ),
    Drawing(
        "measurement",
        "The measurement",
        "",
        _measurement_caption,
        lambda _: "Images of the radiance temperature as it is and as measured.",
        measurement,
    ),
    Drawing(
        "error-images",
        "The measurement error",
        "",
        _errors_caption,
        lambda _: "Images of the error and of the part that the point spread function makes.",
        error_images,
    ),
    Drawing(
        "profiles",
        "Along the lines",
        "",
        _profiles_caption,
        lambda _: "Curves of temperature and error along each line.",
        profiles,
    ),
    Drawing(
        "over-time",
        "Over time",
        "",
        _time_caption,
        lambda _: "Curves of the error at each place over the exposures.",
        over_time,
    ),
)
