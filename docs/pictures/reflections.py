"""Draws the picture of the page on reflections: ``python docs/pictures/reflections.py``.

The cut is the quick one, in the middle of its time; the tool is as warm as it was cut.
"""

from math import radians
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

import chipglow
from chipglow.camera import Measurement
from chipglow.drawing import drawing
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.laboratory.chip import rake_grid
from chipglow.quantities import ZERO_CELSIUS
from chipglow.surface import CHIP_1, Wedge

matplotlib.use("Agg")
HERE = Path(__file__).parent
ANGLES = {30.0: VERMILLION, 45.0: BLUE, 60.0: GREEN}
SHAPE = Wedge()
CLOSE_UP = (-120e-6, 25e-6, 0.0, 260e-6)


def main() -> None:
    """Measure with and without, draw, and print what is measured."""
    study = chipglow.Study.quick()
    scene, camera = chipglow.open_scene(chipglow.cut(study)), study.camera.build()
    start = float(scene.times[len(scene.times) // 2])
    without = camera.measure(scene, CHIP_1, start)
    reflecting = camera.measure(scene, CHIP_1.modified(SHAPE), start)
    with drawing.style():
        figure = drawing.new_figure(6.2)
        upper, lower = figure.subplots(2, 2)
        draw_section(upper[0])
        draw_emissivity(upper[1])
        draw_profiles(lower[0], without, reflecting)
        draw_added(lower[1], without, reflecting)
    figure.savefig(HERE / "reflections.png", dpi=150)


def draw_section(axes: Axes) -> None:
    """Return the wedge in cross-section."""
    for angle, colour in ANGLES.items():
        side = 1e6 * Wedge(angle=radians(angle)).outline
        axes.plot(*np.vstack([side, [130, 0]]).T, color=colour)
    axes.fill_between([-60, 0], -60, 0, color=GREY, lw=0)
    axes.annotate("tool", (-30, -30), color="white", ha="center")
    axes.annotate("chip", (95, -30), ha="center")
    axes.annotate("to the camera", (90, 32), (90, 8), arrowprops={"arrowstyle": "->"}, ha="center")
    axes.set(xlim=(-60, 130), ylim=(-60, 40), aspect="equal")
    axes.set(xlabel="depth from the rake face / µm", ylabel="height / µm")


def draw_emissivity(axes: Axes) -> None:
    """Effective emissivity along the chip's side."""
    for angle, colour in ANGLES.items():
        for warmth, line in ((1.0, "-"), (0.35, "--")):
            depth, found = Wedge(angle=radians(angle)).effective_emissivity(0.42, 0.58, warmth)
            label = f"{angle:.0f}°" if line == "-" else None
            axes.plot(1e6 * depth, found, line, color=colour, label=label)
    axes.axhline(0.42, color=GREY, lw=0.8)
    axes.set(xlim=(0, 80), ylim=(0.4, 1.0))
    axes.set(xlabel="depth from the rake face / µm", ylabel="effective emissivity")
    axes.legend(title="angle", loc="upper right")
    axes.set_title("solid: tool as warm as the chip; dashed: 0.35 of its radiance", fontsize=7)


def draw_profiles(axes: Axes, without: Measurement, reflecting: Measurement) -> None:
    """Radiance temperature along the rake face in two rows of squares."""
    for measured, colour, label in ((without, BLUE, "without"), (reflecting, VERMILLION, "with")):
        assert measured.tool is not None
        grid = rake_grid(measured, measured.tool)
        for row, line in ((0, "-o"), (1, "--s")):
            values = grid.frame_mean[row] - ZERO_CELSIUS
            depth = f"{1e6 * grid.depth[row]:.0f} µm"
            text = f"{label}, {depth}"
            axes.plot(1e6 * grid.along, values, line, color=colour, ms=3, label=text)
            print(text, np.round(values, 0))
    axes.set(xlabel="distance along the rake face / µm", ylabel="radiance temperature / °C")
    axes.legend(fontsize=7)


def draw_added(axes: Axes, without: Measurement, reflecting: Measurement) -> None:
    """Image of what reflections add."""
    added = np.asarray(reflecting.radiance_temperature() - without.radiance_temperature())[0]
    left, right, bottom, top = (1e6 * edge for edge in without.raster.extent)
    picture = axes.imshow(added, extent=(left, right, bottom, top), cmap="inferno", vmin=0)
    axes.set(xlim=[1e6 * e for e in CLOSE_UP[:2]], ylim=[1e6 * e for e in CLOSE_UP[2:]])
    axes.set(xlabel="x / µm", ylabel="y / µm")
    axes.figure.colorbar(picture, ax=axes, label="added by reflections / K")
    print("added at most", np.nanmax(added))


if __name__ == "__main__":
    main()
