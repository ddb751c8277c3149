r"""
Oxide and direction
===================

.. image:: images/sphx_glr_oxide_direction_001.png
   :alt: Oxide and direction

A hot chip oxidises, and a surface seen obliquely radiates otherwise than one seen straight on. The
oxide grows as :math:`\sqrt{k(T)\,t}`; the directional emissivity follows from Fresnel's equations
for :math:`n + \mathrm{i}k`.

What you see: left, how the emissivity of the paper's chip 1 would rise at one temperature. In the
time that the chip is in view (shaded) there is no oxide to speak of; while a chip is heated for
seconds in the laboratory there is. Right, metals shine more toward grazing angles, oxides less.

More: :doc:`/understand/physics`.
"""

import numpy as np

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.quantities import ZERO_CELSIUS
from chipglow.surface import Fresnel, ParabolicOxide

IN_VIEW = 0.4e-3
CHIP_1 = 0.42
TEMPERATURES = {800: VERMILLION, 700: BLUE, 600: GREEN}
SURFACES = {
    "metal, 4.6 + 15i": (Fresnel(n=4.6, k=15.0), VERMILLION),
    "oxide, 2.2 + 0.2i": (Fresnel(n=2.2, k=0.2), BLUE),
}
law, time = ParabolicOxide(), np.geomspace(1e-6, 100.0, 200)
angle = np.linspace(0.0, 90.0, 300)

with style():
    figure = new_figure(2.8)
    left, right = figure.subplots(1, 2)
    for celsius, colour in TEMPERATURES.items():
        grown = np.sqrt(law.growth(celsius + ZERO_CELSIUS) * time)
        left.plot(time, law.of_thickness(CHIP_1, grown), color=colour, label=f"{celsius} °C")
    left.axvspan(time[0], IN_VIEW, color=GREY, alpha=0.3, lw=0)
    left.text(1.6e-6, 0.72, "in view", fontsize=8)
    left.set(xscale="log", xlim=(time[0], time[-1]), ylim=(0.4, 0.8))
    left.set(xlabel="time at that temperature / s", ylabel="emissivity under oxide")
    left.legend(loc="center left", fontsize=7)
    for name, (surface, colour) in SURFACES.items():
        right.plot(angle, surface.ratio(np.cos(np.radians(angle))), color=colour, label=name)
    right.axhline(1.0, color=GREY, lw=0.8)
    right.set(xlim=(0, 90), ylim=(0, 2.2))
    right.set(xlabel="angle of sight / °", ylabel="emissivity, of that at 0°")
    right.legend(loc="upper left", fontsize=7)

# %%
# The page's table: thickness and change of the emissivity after 0.4 ms, and the ratio by angle.

for celsius in TEMPERATURES:
    seen = float(np.sqrt(law.growth(celsius + ZERO_CELSIUS) * IN_VIEW))
    change = float(law.of_thickness(CHIP_1, seen)) - CHIP_1
    print(f"{celsius} °C: {1e9 * seen:.2f} nm, {change:.4f}")
for name, (surface, _) in SURFACES.items():
    for at in (10, 20, 30, 40, 45, 60, 75):
        print(f"{name}, {at}°: {float(surface.ratio(np.cos(np.radians(at)))):.3f}")
