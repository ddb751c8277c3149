r"""
Emissivity that differs from place to place
===========================================

.. image:: images/sphx_glr_texture_001.png
   :alt: Emissivity that differs from place to place

Chip, shear band, workpiece and tool have an emissivity each, and each varies over its surface.
The workpiece becomes chip while the plastic strain rises from 0.3 to 0.5; the chip becomes shear
band while the strain rate rises from 6 000 /s to 30 000 /s:

.. math:: \varepsilon = (1 - b)\,\bigl[(1 - c)\,\varepsilon_\mathrm{workpiece}
   + c\,\varepsilon_\mathrm{chip}\bigr]
   + b\,\varepsilon_\mathrm{band} .

What you see: emissivities drawn from the paper's Table 1 in grains of 20 µm, and their effect on
the radiance temperature. The texture moves with the material.

Source: "Create emissivity maps for each feature" and Equation 3 of Heigel and Whitenton (2010).
More: :doc:`/understand/physics`.
"""

from samples.chip import closed_form_chip

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT, PLAIN
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.figures import show_image

scene = closed_form_chip(40)
camera = chipglow.Camera(
    psf=None, pitch=4e-6, integration_time=1e-7, lower_limit=None, reflected=293.0
)

with style():
    figure = new_figure(5.6)
    figure.set_layout_engine("compressed")
    rows = figure.subplots(2, 2, sharex=True, sharey=True)
    surfaces = {"chip 1": chipglow.CHIP_1, "chip 2": chipglow.CHIP_2}
    for axes, (name, surface) in zip(rows, surfaces.items(), strict=True):
        laid = camera.prepare(surface, scene).emissivity(scene.frame(24))
        seen = camera.measure(scene, surface, scene.times[24])
        celsius = seen.radiance_temperature()[0] - ZERO_CELSIUS
        left = show_image(axes[0], laid, scene.raster, scene.tool, PLAIN, (0.2, 1.0))
        right = show_image(axes[1], celsius, seen.raster, scene.tool, HEAT, (100.0, 600.0))
        axes[0].set_title(f"{name}: emissivity")
        axes[1].set_title(f"{name}: radiance temperature / °C")
        for one in axes:
            one.label_outer()
    figure.colorbar(left, ax=rows[:, 0], location="bottom", aspect=30)
    figure.colorbar(right, ax=rows[:, 1], location="bottom", aspect=30, extend="both")
