"""Figure of an analysis: the error of every pixel, and where errors are read."""

from typing import TYPE_CHECKING, Any

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import FigureBase

from chipglow.analysis.reductions import image_error
from chipglow.drawing import drawing, scales
from chipglow.scene.figures import ImagePanel, length_unit, veil

if TYPE_CHECKING:
    from chipglow.analysis.engine import Analysis


def plot_error(analysis: "Analysis", surface: str, ax: Axes | None) -> Axes:
    """Draw the error of every pixel of a surface."""
    error = image_error(analysis.data).sel(surface=surface)
    limit = error_limit(error, analysis.data.flagged.sel(surface=surface))
    title = f"error, {surface}" if len(analysis.surfaces) > 1 else "error"
    panel = ImagePanel(title, "error / K", error.values, (-limit, limit), scales.SIGNED)
    with drawing.style():
        axes = drawing.axes_or_new(ax, "compressed")
        draw_error(axes.figure, axes, analysis, surface, panel)
    return axes


def error_limit(images: xr.DataArray, flagged: xr.DataArray) -> float:
    """Return the limit of a colour scale of errors in K: of the pixels without flags, if any."""
    shown = images if bool(flagged.all()) else images.where(~flagged)
    return scales.round_limit(shown.values, 99.0, 10.0)


def draw_error(
    figure: FigureBase, axes: Axes, analysis: "Analysis", surface: str, panel: ImagePanel
) -> None:
    """Draw an image of errors, pale where the camera shows no temperature, and what is read."""
    raster = analysis.measurements[surface].raster
    panel.draw(figure, axes, raster, analysis.tool)
    veil(axes, analysis.data.flagged.sel(surface=surface).values, raster)
    draw_marks(axes, analysis)


def draw_marks(axes: Axes, analysis: "Analysis") -> None:
    """Draw the points and lines at which errors are read, and the ridge of the shear band."""
    factor, _ = length_unit(analysis.raster)
    for points in analysis.read_curves():
        if len(points) == 1:
            look: Any = {"color": scales.GREEN, "markersize": 9, "markeredgewidth": 1.6}
            axes.plot(*(points[0] * factor), "+", **look)
        else:
            drawing.draw_line(axes, points, scales.GREEN, factor=factor)
    if analysis.cut is not None:
        ridge = analysis.cut.band.ridge.points * factor
        axes.plot(*ridge.T, color="black", linestyle="--", linewidth=0.8)
