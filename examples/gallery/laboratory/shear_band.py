r"""
Temperature along the shear band
================================

.. image:: images/sphx_glr_shear_band_001.png
   :alt: Temperature along the shear band

A band is a ridge of the radiance temperature: across it the second derivative, after a Gaussian
blur, is most negative. The path from the edge that gathers the most of it,

.. math:: \max_{s} \int_s -\frac{\partial^2 (G_\sigma * T)}{\partial n^2}\, \mathrm{d}s ,

is found by dynamic programming.

What you see: the bands of four frames of a chip in closed form on the image of the reference, and
the radiance temperature along them.

Source: Figure 9 of Heigel and Whitenton (2010). More: :doc:`/do/shear-band`.
"""

import sample_files

import chipglow
from chipglow.laboratory.chip.figure import draw_band_profile

measured = chipglow.read_measurement(sample_files.folder("shear-band") / "measured.nc")
profile = chipglow.band_profile(measured, measured.tool)
figure = draw_band_profile(measured, measured.tool, profile)

# %%
# The stage of each frame, judged by the distance from the reference:

for time, stage, offset in zip(profile.times, profile.stage, profile.offset, strict=True):
    print(f"{1e6 * time:.0f} µs: {stage}, {1e6 * offset:.1f} µm")
