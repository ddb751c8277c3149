"""Analysis grid and shear band on the image, and their profiles (the paper's Figures 7 and 9)."""

from typing import TYPE_CHECKING, Any, Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase

from chipglow.camera import Measurement
from chipglow.drawing import drawing, scales
from chipglow.laboratory.chip.stage import Stage
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.scene import Tool
from chipglow.scene.figures import ImagePanel, crop

if TYPE_CHECKING:
    from chipglow.laboratory.chip.band_profile import BandProfile
    from chipglow.laboratory.chip.rake_grid import RakeGrid

_HEIGHT: Final = 3.8
"""Height in inches of the figure of a grid."""

_BAND_HEIGHT: Final = 4.2
"""Height in inches of the figure of a shear band."""

_AROUND: Final = 60e-6
"""Margin in m around the grid or the band in the image."""

_ASIDE: Final = 0.08
"""Distance between the bars of two depths, in sides of a square: they do not hide each other."""

_MOST_BARS: Final = 20
"""Squares along the face up to which each has a bar."""
_MARKERS: Final = "osD^vP*X"

_LEGEND_COLUMNS: Final = 3
"""Columns of a legend."""

_MOST_NAMES: Final = 12
"""Frames up to which each has a name in the legend."""

_BRIGHTEST: Final = 0.9
"""Fraction of the colour map that is used: its end is too bright for a line on white."""

_COLOURS: Final = matplotlib.colors.ListedColormap(
    matplotlib.colormaps["viridis"](np.linspace(0.0, _BRIGHTEST, 256))
)
"""Colours of frames over the time, as many as 8 bits distinguish."""

_LINES: Final = {
    Stage.DEVELOPING: (0, (4, 2)),
    Stage.DEVELOPED: "solid",
    Stage.MOVED: (0, (1, 1.5)),
    Stage.NONE: "solid",
}
"""Line styles; dashes are lengths and gaps in line widths."""


def draw_rake_grid(measurement: Measurement, grid: "RakeGrid") -> Figure:
    """Draw a grid on the image that it was read from, and its profiles along the rake face."""
    with drawing.style():
        figure = drawing.new_figure(_HEIGHT)
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_grid(figure, left, measurement, grid)
        draw_rake_profiles(right, grid)
        right.set_title(f"b) profiles\n{_bars(grid)}")
        figure.legend(loc="outside lower right", ncols=grid.depth.size, title=_depths(grid))
    return figure


def plot_rake_grid(grid: "RakeGrid", ax: Axes | None) -> Axes:
    """Draw the profiles of a grid along the rake face."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        draw_rake_profiles(axes, grid)
        axes.set_title(_bars(grid))
        axes.legend(title=_depths(grid), ncols=2)
    return axes


def _draw_grid(figure: Figure, axes: Axes, measurement: Measurement, grid: "RakeGrid") -> None:
    frames = np.isin(measurement.times, grid.times)
    known = np.ma.masked_invalid(measurement.radiance_temperature()[frames])
    image = known.mean(axis=0).filled(np.nan) - ZERO_CELSIUS
    _panel("a) analysis grid", image).draw(figure, axes, measurement.raster, grid.tool)
    corners = 1e6 * grid.corners()
    for line in (*corners, *corners.transpose(1, 0, 2)):
        axes.plot(*line.T, color="black", linewidth=1.1, alpha=0.6)
        axes.plot(*line.T, color="white", linewidth=0.6)
    crop(axes, grid.corners(), measurement.raster, _AROUND)


def draw_rake_profiles(axes: Axes, grid: "RakeGrid") -> None:
    """Draw the profiles of a grid on axes, without their legend."""
    mean, bars = grid.frame_mean - ZERO_CELSIUS, grid.bars
    uncertainty = grid.frame_estimate.standard_uncertainty
    colours = matplotlib.colormaps["viridis"](np.linspace(0.0, _BRIGHTEST, grid.depth.size))
    # Many bars would hide each other: those of the depths take turns.
    turns = grid.depth.size if grid.along.size > _MOST_BARS else 1
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
            errorevery=(m % turns, turns),
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
    axes.set(xlabel="distance along the rake face / µm", ylabel="radiance temperature / °C")


def _bars(grid: "RakeGrid") -> str:
    """Return what the bars and bands of the profiles show."""
    over = f"between {grid.times.size} frames" if grid.times.size > 1 else "in a square"
    bands = "\nbands: ± 1 standard uncertainty" * bool(grid.estimate.components)
    return f"bars: standard deviation {over}{bands}"


def _depths(grid: "RakeGrid") -> str:
    """Return the title of the legend of the profiles."""
    partly = ((grid.frame_count > 0) & (grid.frame_count < grid.times.size)).any()
    return "depth into the chip" + "; hollow: usable in some frames only" * bool(partly)


def draw_band_profile(measurement: Measurement, tool: Tool, profile: "BandProfile") -> Figure:
    """Draw the curves on the image of the reference, and the temperature along them."""
    with drawing.style():
        figure = drawing.new_figure(_BAND_HEIGHT)
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_curves(figure, left, measurement, tool, profile)
        handles = _draw_along(figure, right, profile)
        right.set_title("b) along the band, ± 1 standard uncertainty")
        figure.legend(handles=handles, loc="outside lower center", ncols=_LEGEND_COLUMNS)
    return figure


def plot_band_profile(profile: "BandProfile", ax: Axes | None) -> Axes:
    """Draw the temperature along the band in each frame."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        handles = _draw_along(axes.figure, axes, profile)
        axes.set_title("along the shear band, ± 1 standard uncertainty")
        axes.legend(handles=handles)
    return axes


def _colours(profile: "BandProfile") -> Array:
    """Return the colour of each frame by its time, shape (frames, 4)."""
    first, last = profile.times[[0, -1]]
    return np.asarray(_COLOURS((profile.times - first) / max(last - first, 1e-12)))


def _draw_along(figure: FigureBase, axes: Axes, profile: "BandProfile") -> list[Any]:
    """Draw the temperature along the band in each frame; return what the legend names."""
    for frame, colour in enumerate(_colours(profile)):
        _draw_profile(axes, profile, frame, colour)
    axes.set_xlabel("distance from the cutting edge / µm")
    axes.set_ylabel("radiance temperature / °C")
    if profile.times.size <= _MOST_NAMES:
        return list(axes.get_legend_handles_labels()[0])
    # Too many curves to name each: a colour bar shows their times.
    span = matplotlib.colors.Normalize(*(1e6 * profile.times[[0, -1]]))
    key = matplotlib.cm.ScalarMappable(span, _COLOURS)
    figure.colorbar(key, ax=axes, label="time / µs", aspect=drawing.BAR_ASPECT)
    return [
        axes.plot([], [], color="black", linestyle=_LINES[s], label=s)[0]
        for s in Stage
        if s in profile.stage and s is not Stage.NONE
    ]


def _draw_curves(
    figure: Figure, axes: Axes, measurement: Measurement, tool: Tool, profile: "BandProfile"
) -> None:
    away = np.abs(profile.offset)
    frame = int(np.nanargmin(away)) if np.isfinite(away).any() else 0
    number = int(np.flatnonzero(measurement.times == profile.times[frame])[0])
    image = measurement.data["radiance_temperature"][number].values - ZERO_CELSIUS
    title = f"a) {1e6 * profile.times[frame]:.4g} µs; blue: the reference"
    _panel(title, image).draw(figure, axes, measurement.raster, tool, "bottom")
    for points, colour in zip(profile.points, _colours(profile), strict=True):
        axes.plot(*(1e6 * points).T, color=colour, linewidth=1.4)
    drawing.draw_line(axes, profile.reference.points, scales.BLUE)
    crop(axes, profile.points, measurement.raster, _AROUND)


def _draw_profile(axes: Axes, profile: "BandProfile", frame: int, colour: Array) -> None:
    values = profile.temperature[frame] - ZERO_CELSIUS
    if not np.isfinite(values).any():
        return
    along, uncertainty = 1e6 * profile.distance, profile.estimate.standard_uncertainty[frame]
    stage = profile.stage[frame]
    label = f"{1e6 * profile.times[frame]:.4g} µs, {stage}"
    axes.plot(along, values, color=colour, linestyle=_LINES[stage], label=label)
    drawing.shade(axes, along, values, uncertainty, colour)


def _panel(title: str, celsius: Array) -> ImagePanel:
    low, high = scales.ends(celsius, 0.0, 99.9)
    return ImagePanel(title, "radiance temperature / °C", celsius, (low, high + 1.0), scales.HEAT)
