"""Draws the picture of oxide and direction on the page on physics: ``docs/surface_pictures.py``."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes

from chipglow.drawing import drawing
from chipglow.drawing.drawing import BLUE, GREEN, GREY, KELVIN, VERMILLION
from chipglow.surface import Fresnel, ParabolicOxide

matplotlib.use("Agg")
HERE = Path(__file__).parent
IN_VIEW = 0.4e-3
CHIP_1 = 0.42
TEMPERATURES = {800: VERMILLION, 700: BLUE, 600: GREEN}
SURFACES = {
    "metal, 4.6 + 15i": (Fresnel(n=4.6, k=15.0), VERMILLION),
    "oxide, 2.2 + 0.2i": (Fresnel(n=2.2, k=0.2), BLUE),
}


def main() -> None:
    """Draw both, and print the tables."""
    with drawing.style():
        figure = drawing.new_figure(2.8)
        left, right = figure.subplots(1, 2)
        draw_oxide(left)
        draw_direction(right)
    figure.savefig(HERE / "surface-oxide-direction.png", dpi=150)


def draw_oxide(axes: Axes) -> None:
    """Emissivity of chip 1 over the time at one temperature."""
    law, time = ParabolicOxide(), np.geomspace(1e-6, 100.0, 200)
    for celsius, colour in TEMPERATURES.items():
        grown = np.sqrt(law.growth(celsius + KELVIN) * time)
        axes.plot(time, law.of_thickness(CHIP_1, grown), color=colour, label=f"{celsius} °C")
        seen = float(np.sqrt(law.growth(celsius + KELVIN) * IN_VIEW))
        change = float(law.of_thickness(CHIP_1, seen)) - CHIP_1
        print(f"{celsius} °C: {1e9 * seen:.2f} nm, {change:.4f}")
    axes.axvspan(time[0], IN_VIEW, color=GREY, alpha=0.3, lw=0)
    axes.text(1.6e-6, 0.72, "in view", fontsize=8)
    axes.set(xscale="log", xlim=(time[0], time[-1]), ylim=(0.4, 0.8))
    axes.set(xlabel="time at that temperature / s", ylabel="emissivity under oxide")
    axes.legend(loc="center left", fontsize=7)


def draw_direction(axes: Axes) -> None:
    """Emissivity over the angle of sight."""
    angle = np.linspace(0.0, 90.0, 300)
    for name, (law, colour) in SURFACES.items():
        axes.plot(angle, law.ratio(np.cos(np.radians(angle))), color=colour, label=name)
        for at in (10, 20, 30, 40, 45, 60, 75):
            print(f"{name}, {at}°: {float(law.ratio(np.cos(np.radians(at)))):.3f}")
    axes.axhline(1.0, color=GREY, lw=0.8)
    axes.set(xlim=(0, 90), ylim=(0, 2.2))
    axes.set(xlabel="angle of sight / °", ylabel="emissivity, of that at 0°")
    axes.legend(loc="upper left", fontsize=7)


if __name__ == "__main__":
    main()
