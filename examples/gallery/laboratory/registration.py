r"""
Infrared on visible images
==========================

.. image:: images/sphx_glr_registration_001.png
   :alt: Infrared on visible images

Two cameras look at the same chip, and a map leads from one image to the other. With points that
are seen in both it is fitted by least squares,

.. math:: \min_{A,\, \mathbf{b}} \sum_i |A\,\mathbf{x}_i + \mathbf{b} - \mathbf{p}_i|^2 ,

and how far they miss says how surely it is known.

What you see: the infrared image with the tool's outline and six points, and the visible picture
with the infrared image laid over it; then both in turns.

Without points the map is found by a target's dots: :doc:`/do/registration`.
"""

import numpy as np
import sample_files
from dual_spectrum import DualSpectrum

from chipglow import fit_points
from chipglow.laboratory.registration.figure import blink_pictures, draw_registration
from chipglow.laboratory.registration.files import write_blink

pair = DualSpectrum()
seen = pair.infrared

# %%
# The sample files of the page have the points: column and row in either image.

table = sample_files.folder("registration") / "points.csv"
points = np.loadtxt(table, delimiter=",", skiprows=1)
columns, rows = points[:, :2].astype(int).T
positions = np.stack((seen.raster.x[columns], seen.raster.y[rows]), axis=-1)
fit = fit_points(positions, points[:, 2:])
shown = (seen.radiance_temperature()[0], seen.raster, pair.visible, pair.tool)
figure = draw_registration(fit.registration, *shown, points=(positions, points[:, 2:]))

# %%
# Both in turns, which shows a misfit of a pixel:

write_blink(blink_pictures(fit.registration, *shown), sample_files.GENERATED / "registration.gif")

# %%
# .. image:: /generated/registration.gif
#    :alt: Both images in turns
