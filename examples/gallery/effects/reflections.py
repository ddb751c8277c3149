r"""
Reflections between tool and chip
=================================

.. image:: images/sphx_glr_reflections_001.png
   :alt: Reflections between tool and chip

At the rake face the chip's side bulges, and with the tool it makes a wedge in which radiation goes
to and fro. A wedge looks blacker than its walls: its *effective emissivity* is what the camera sees
over what a blackbody as warm as the chip would send,

.. math:: \varepsilon_\mathrm{eff} = \frac{\varepsilon L + (1 - \varepsilon) H}{L} ,

with the irradiation :math:`H` from all that is around.

What you see: the wedge in cross-section at three angles, and its effective emissivity over the
depth from the rake face. A tool as warm as the chip (solid) brings 0.42 to over 0.8 in the corner;
a cold one (dashed) does little.

Source: the Discussion of Heigel and Whitenton (2010); view factors by rays. More:
:doc:`/understand/reflections`.
"""

from math import radians

import numpy as np

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION
from chipglow.surface import Wedge

ANGLES = {30.0: VERMILLION, 45.0: BLUE, 60.0: GREEN}

with style():
    figure = new_figure(3.0)
    section, effective = figure.subplots(1, 2)
    for angle, colour in ANGLES.items():
        wedge = Wedge(angle=radians(angle))
        section.plot(*np.vstack([1e6 * wedge.outline, [130, 0]]).T, color=colour)
        for warmth, line in ((1.0, "-"), (0.35, "--")):
            depth, found = wedge.effective_emissivity(0.42, 0.58, warmth)
            label = f"{angle:.0f}°" if line == "-" else None
            effective.plot(1e6 * depth, found, line, color=colour, label=label)
    section.fill_between([-60, 0], -60, 0, color=GREY, lw=0)
    section.annotate("tool", (-30, -30), color="white", ha="center")
    section.annotate("chip", (95, -30), ha="center")
    section.annotate(
        "to the camera", (90, 32), (90, 8), arrowprops={"arrowstyle": "->"}, ha="center"
    )
    section.set(xlim=(-60, 130), ylim=(-60, 40), aspect="equal")
    section.set(xlabel="depth from the rake face / µm", ylabel="height / µm")
    effective.axhline(0.42, color=GREY, lw=0.8)
    effective.set(xlim=(0, 80), ylim=(0.4, 1.0))
    effective.set(xlabel="depth from the rake face / µm", ylabel="effective emissivity")
    effective.legend(title="angle", loc="upper right")
