r"""
Exposure, detector footprint and optics: one step after the other
=================================================================

.. image:: images/sphx_glr_steps_001.png
   :alt: Exposure, detector footprint and optics: one step after the other

A detector element takes the mean of the radiance over its footprint and over the exposure, and the
optics spread each point before:

.. math:: \bar L_{ij} = \frac{1}{t_e A} \int_{t}^{t + t_e}
   \int_{A_{ij}} (L * \mathrm{PSF})(x, y, t')\,
   \mathrm{d}A\, \mathrm{d}t' ,

and only then is the radiance turned into a temperature.

What you see, with the highest value of each: a chip in closed form, its hot contact with the tool
and its shear band. An exposure of 8 µs smears the band, which moves and still grows; pixels of 12
µm and the point spread function reduce hot and narrow features most.

Source: Figure 6 of Heigel and Whitenton (2010). More: :doc:`/understand/physics`,
:doc:`/understand/optics`.
"""

from dataclasses import replace

import numpy as np
from samples.chip import closed_form_chip

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import HEAT
from chipglow.quantities import ZERO_CELSIUS
from chipglow.scene.figures import show_image

# %%
# Frames 1 µs apart; the band is full grown after 28 µs.

scene = closed_form_chip(40)
start = scene.times[24]
sharp = chipglow.Camera(
    psf=None, pitch=4e-6, integration_time=1e-7, lower_limit=None, reflected=293.0
)
cameras = {
    "scene": sharp,
    "exposure of 8 µs": replace(sharp, integration_time=8e-6),
    "pixels of 12 µm": replace(sharp, integration_time=8e-6, pitch=12e-6),
    "point spread function": replace(
        sharp, integration_time=8e-6, pitch=12e-6, psf=chipglow.AnnularAperturePSF(4.45e-6)
    ),
}

with style():
    figure = new_figure(6.0)
    figure.set_layout_engine("compressed")
    for axes, (name, camera) in zip(figure.subplots(2, 2).flat, cameras.items(), strict=True):
        seen = camera.measure(scene, chipglow.CHIP_2, start)
        celsius = seen.radiance_temperature()[0] - ZERO_CELSIUS
        picture = show_image(axes, celsius, seen.raster, scene.tool, HEAT, (100.0, 600.0))
        axes.label_outer()
        axes.set_title(f"{name}: {np.nanmax(celsius):.0f} °C")
    figure.colorbar(picture, ax=figure.axes, label="radiance temperature / °C", extend="both")
