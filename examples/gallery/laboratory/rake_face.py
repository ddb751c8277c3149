r"""
Temperature along the rake face
===============================

.. image:: images/sphx_glr_rake_face_001.png
   :alt: Temperature along the rake face

The paper lays squares of 3 by 3 pixels on the chip, which stand on the rake face, and averages the
radiance temperature in each. Pixels in a turned square are not distributed evenly around its
centre, so the mean weights them:

.. math:: \sum_i w_i = 1, \qquad \sum_i w_i\,\mathbf{r}_i = \mathbf{r}_\mathrm{middle}, \qquad
   \sum_i w_i^2 \to \min .

What you see: the grid on an image of a chip in closed form, and the profiles along the face at
several depths; bars are one standard deviation between the four frames.

Source: Figure 7 of Heigel and Whitenton (2010). More: :doc:`/do/rake-face`.
"""

from math import degrees

import sample_files

import chipglow
from chipglow.laboratory.chip.figure import draw_rake_grid

measured = chipglow.read_measurement(sample_files.folder("rake-face") / "chip-2.nc")
grid = chipglow.rake_grid(measured, measured.tool)
figure = draw_rake_grid(measured, grid)

# %%
# If the tool's position is not given, it is found in the image, with its uncertainty:

found = chipglow.find_tool(measured)
print(f"true rake angle: {degrees(measured.tool.rake_angle):.1f}°")
print(f"found: {degrees(found.tool.rake_angle):.1f}° ± {degrees(found.uncertainty.angle):.1f}°")
