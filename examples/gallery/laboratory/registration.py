r"""
Infrared on visible images
==========================

Two cameras look at the same chip, and a map leads from one image to the other. With points in both it is fitted by
least squares; without them by what both images have in common, their mutual information

.. math:: I = \sum_{a, b} p(a, b) \ln \frac{p(a, b)}{p(a)\, p(b)} .

What you see: the infrared image with the tool's outline, and the visible picture with the infrared image laid over it;
then both in turns. Registration by points and by a target of dots: :doc:`/do/registration`.

Source: Viola and Wells (1997); Mattes et al. (2003).
"""

import sample_files
from dual_spectrum import DualSpectrum

from chipglow import fit_images
from chipglow.laboratory.registration.figure import blink_pictures, draw_registration
from chipglow.laboratory.registration.picture_file import write_blink

pair = DualSpectrum()
seen = pair.infrared
fit = fit_images(seen.radiance[0], seen.raster, pair.visible, "affine")
shown = (seen.radiance_temperature()[0], seen.raster, pair.visible, pair.tool)
figure = draw_registration(fit.registration, *shown)

# %%
# Both in turns, which shows a misfit of a pixel:

write_blink(blink_pictures(fit.registration, *shown), sample_files.GENERATED / "registration.gif")

# %%
# .. image:: /generated/registration.gif
#    :alt: Both images in turns
