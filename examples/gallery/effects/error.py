r"""
The error, and the optics' part of it
=====================================

.. image:: images/sphx_glr_error_001.png
   :alt: The error, and the optics' part of it

The paper's error of a pixel is the measured radiance temperature minus the *largest* that was
there:

.. math:: e = T_\mathrm{measured}
   - \max_{(x, y) \in \text{pixel},\ t \in \text{exposure}} T_r(x, y, t) .

Case 1 has everything, case 2 no point spread function; their difference is the optics' part. The
rest is the mean over the detector's footprint and over the exposure.

What you see, where the radiance temperature is over the camera's lower range limit of 300 °C: the
error is largest where the temperature is steep, at the rake face and beside the shear band, and the
optics *reduce* it in places: light from hot areas falls on cold ones.

Source: Figures 10 and 11 of Heigel and Whitenton (2010). More: :doc:`/learn/paper-study`.
"""

import numpy as np
from samples.chip import closed_form_chip

import chipglow
from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import SIGNED
from chipglow.scene.figures import show_image

scene = closed_form_chip(40)
camera = chipglow.Camera(integration_time=8e-6, lower_limit=573.15)
exposure = camera.expose(scene, chipglow.CHIP_2, scene.times[24])
errors, pixels = chipglow.error_images(camera, exposure), camera.pixels(scene.raster)

shown = {
    "case 1: everything": errors.case_1,
    "case 2: without PSF": errors.case_2,
    "part of the PSF": errors.psf_portion,
}
in_range = errors.reference > camera.lower_limit
shown = {name: image.where(in_range).values for name, image in shown.items()}
with style():
    figure = new_figure(2.7)
    figure.set_layout_engine("compressed")
    for axes, (name, image) in zip(figure.subplots(1, 3, sharey=True), shown.items(), strict=True):
        picture = show_image(axes, image, pixels, scene.tool, SIGNED, (-120.0, 120.0))
        axes.set_title(name)
        axes.label_outer()
    figure.colorbar(picture, ax=figure.axes, label="K", extend="both")

# %%
# In the pixels that are shown:

for name, image in shown.items():
    values = image[np.isfinite(image)]
    print(f"{name}: median {np.median(values):.1f} K, 5 % below {np.percentile(values, 5):.0f} K")
