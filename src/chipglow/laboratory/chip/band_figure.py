"""The shear band on the image, and the temperature along it (the paper's Figure 9)."""

from typing import Final

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from chipglow.camera import Measurement
from chipglow.drawing import drawing, scales
from chipglow.drawing.scales import KELVIN
from chipglow.laboratory.chip.band_profile import BandProfile, Stage
from chipglow.quantities import Array
from chipglow.scene import Tool

_HEIGHT: Final = 4.2
_AROUND: Final = 60e-6
_LEGEND_COLUMNS: Final = 3
_MOST_NAMES: Final = 12
_COLOURS: Final = matplotlib.colors.ListedColormap(
    matplotlib.colormaps["viridis"](np.linspace(0.0, 0.9, 256))
)
_LINES: Final = {
    Stage.DEVELOPING: (0, (4, 2)),
    Stage.DEVELOPED: "solid",
    Stage.MOVED: (0, (1, 1.5)),
    Stage.NONE: "solid",
}


def draw_band_profile(measurement: Measurement, tool: Tool, profile: BandProfile) -> Figure:
    """Draw the curves on the image of the reference, and the temperature along them."""
    first, last = profile.times[[0, -1]]
    colours = _COLOURS((profile.times - first) / max(last - first, 1e-12))
    with drawing.style():
        figure = drawing.new_figure(_HEIGHT)
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.25))
        _draw_image(figure, left, measurement, tool, profile, colours)
        for frame, colour in enumerate(colours):
            _draw_profile(right, profile, frame, colour)
        right.set_xlabel("distance from the cutting edge / µm")
        right.set_ylabel("radiance temperature / °C")
        right.set_title("b) along the band, ± 1 standard uncertainty")
        if profile.times.size > _MOST_NAMES:
            handles = [
                right.plot([], [], color="black", linestyle=_LINES[s], label=s)[0]
                for s in Stage
                if s in profile.stage and s is not Stage.NONE
            ]
            _draw_times(figure, right, profile.times)
        else:
            handles = right.get_legend_handles_labels()[0]
        figure.legend(handles=handles, loc="outside lower center", ncols=_LEGEND_COLUMNS)
    return figure


def _draw_times(figure: Figure, axes: Axes, times: Array) -> None:
    """Which colour is which time, where there are too many curves to name each."""
    span = matplotlib.colors.Normalize(1e6 * times[0], 1e6 * times[-1])
    key = matplotlib.cm.ScalarMappable(span, _COLOURS)
    figure.colorbar(key, ax=axes, label="time / µs", aspect=25)


def _draw_image(
    figure: Figure,
    axes: Axes,
    measurement: Measurement,
    tool: Tool,
    profile: BandProfile,
    colours: Array,
) -> None:
    away = np.abs(profile.offset)
    frame = int(np.nanargmin(away)) if np.isfinite(away).any() else 0
    number = int(np.flatnonzero(measurement.times == profile.times[frame])[0])
    image = measurement.data["radiance_temperature"][number].values - KELVIN
    known = image[np.isfinite(image)]
    limits = (float(known.min()), float(np.percentile(known, 99.9)) + 1.0)
    picture = drawing.show_image(axes, image, measurement.raster, tool, scales.HEAT, limits)
    for points, colour in zip(profile.points, colours, strict=True):
        axes.plot(*(1e6 * points).T, color=colour, linewidth=1.4)
    drawing.draw_line(axes, profile.reference.points, scales.BLUE)
    drawing.crop(axes, profile.points, measurement.raster, _AROUND)
    axes.set_title(f"a) {1e6 * profile.times[frame]:.4g} µs; blue: the reference")
    figure.colorbar(
        picture, ax=axes, label="radiance temperature / °C", location="bottom", aspect=25
    )


def _draw_profile(axes: Axes, profile: BandProfile, frame: int, colour: Array) -> None:
    values = profile.temperature[frame] - KELVIN
    if not np.isfinite(values).any():
        return
    along, uncertainty = 1e6 * profile.distance, profile.estimate.standard_uncertainty[frame]
    stage = profile.stage[frame]
    label = f"{1e6 * profile.times[frame]:.4g} µs, {stage}"
    axes.plot(along, values, color=colour, linestyle=_LINES[stage], label=label)
    drawing.shade(axes, along, values, uncertainty, colour)
