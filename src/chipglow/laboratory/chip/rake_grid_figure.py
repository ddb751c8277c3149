"""The analysis grid on the image, and its profiles (the paper's Figure 7)."""

from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.camera import Measurement
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import KELVIN
from chipglow.laboratory.chip.rake_grid import RakeGrid
from chipglow.quantities import Array

_HEIGHT: Final = 3.8
_AROUND: Final = 60e-6
_ASIDE: Final = 0.08
_MARKERS: Final = "osD^vP*X"


def draw_rake_grid(measurement: Measurement, grid: RakeGrid) -> Figure:
    """Draw a grid on the image that it was read from, and its profiles along the rake face."""
    with drawing.style():
        figure = drawing.new_figure(_HEIGHT)
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_image(figure, left, measurement, grid)
        _draw_profiles(right, grid)
        partly = ((grid.frame_count > 0) & (grid.frame_count < grid.times.size)).any()
        title = "depth into the chip" + "; hollow: usable in some frames only" * bool(partly)
        figure.legend(loc="outside lower right", ncols=grid.depth.size, title=title)
    return figure


def _draw_image(figure: Figure, axes: Axes, measurement: Measurement, grid: RakeGrid) -> None:
    image = _mean_image(measurement, grid) - KELVIN
    known = image[np.isfinite(image)]
    limits = (float(known.min()), float(np.percentile(known, 99.9)) + 1.0)
    picture = drawing.show_image(axes, image, measurement.raster, grid.tool, scales.HEAT, limits)
    corners = 1e6 * grid.corners()
    for line in (*corners, *corners.transpose(1, 0, 2)):
        axes.plot(*line.T, color="black", linewidth=1.1, alpha=0.6)
        axes.plot(*line.T, color="white", linewidth=0.6)
    drawing.crop(axes, grid.corners(), measurement.raster, _AROUND)
    axes.set_title("a) analysis grid")
    drawing.colour_bar(figure, picture, axes, "radiance temperature / °C")


def _mean_image(measurement: Measurement, grid: RakeGrid) -> Array:
    """Mean over the grid's frames of what is usable in K; NaN where no frame has a value."""
    frames = np.isin(measurement.times, grid.times)
    values = measurement.radiance_temperature()[frames]
    known = np.isfinite(values)
    count = known.sum(axis=0)
    mean = np.where(known, values, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.asarray(np.where(count > 0, mean, np.nan), dtype=np.float64)


def _draw_profiles(axes: Axes, grid: RakeGrid) -> None:
    several = grid.times.size > 1
    mean = grid.frame_mean - KELVIN
    bars = grid.frame_standard_deviation if several else grid.standard_deviation[0]
    uncertainty = grid.frame_estimate.standard_uncertainty
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, grid.depth.size))
    for m, depth in enumerate(grid.depth):
        if not grid.usable[:, m].any():
            continue
        aside = _ASIDE * (m - (grid.depth.size - 1) / 2) * grid.size
        along = 1e6 * (grid.along + aside)
        marker = _MARKERS[m % len(_MARKERS)]
        axes.errorbar(
            along,
            mean[m],
            np.nan_to_num(bars[m]),
            color=colours[m],
            marker=marker,
            markersize=4,
            linewidth=1.2,
            elinewidth=0.8,
            capsize=2,
            label=f"{1e6 * depth:.3g} µm",
        )
        if grid.estimate.components:
            drawing.shade(axes, along, mean[m], uncertainty[m], colours[m])
        partly = grid.frame_count[m] < grid.times.size
        hollow = {"color": colours[m], "markerfacecolor": "white", "linestyle": "none"}
        axes.plot(along[partly], mean[m, partly], marker=marker, markersize=4, zorder=3, **hollow)
    axes.set_xlabel("distance along the rake face / µm")
    axes.set_ylabel("radiance temperature / °C")
    over = f"between {grid.times.size} frames" if several else "in a square"
    bands = "\nbands: ± 1 standard uncertainty" * bool(grid.estimate.components)
    axes.set_title(f"b) profiles\nbars: standard deviation {over}{bands}")
