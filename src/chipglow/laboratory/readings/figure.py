"""Figures of temperatures over time, along a line, and by their frequency."""

from typing import TYPE_CHECKING

from matplotlib.axes import Axes

from chipglow.drawing import drawing
from chipglow.quantities import ZERO_CELSIUS

if TYPE_CHECKING:
    from chipglow.laboratory.readings.curves import Histogram, PlaceCurves, Profile

_CELSIUS = "radiance temperature / °C"


def plot_curves(curves: "PlaceCurves", ax: Axes | None = None) -> Axes:
    """Plot the mean of each place in °C over the time in µs."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        for place, mean in zip(curves.places, curves.mean, strict=True):
            axes.plot(1e6 * curves.times, mean - ZERO_CELSIUS, label=place)
        axes.set(xlabel="time / µs", ylabel=_CELSIUS)
        axes.legend()
    return axes


def plot_profile(profile: "Profile", ax: Axes | None = None) -> Axes:
    """Plot the temperature along a line in °C over the distance in µm."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        axes.plot(1e6 * profile.distance, profile.kelvins - ZERO_CELSIUS)
        axes.set(xlabel="distance / µm", ylabel=_CELSIUS, title=profile.place)
    return axes


def plot_histogram(histogram: "Histogram", ax: Axes | None = None) -> Axes:
    """Plot the number of pixels over the temperature in °C."""
    with drawing.style():
        axes = drawing.axes_or_new(ax)
        axes.stairs(histogram.pixels, histogram.edges - ZERO_CELSIUS, fill=True)
        axes.set(xlabel=_CELSIUS, ylabel="pixels", title=histogram.place)
    return axes
