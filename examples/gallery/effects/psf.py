r"""
Point spread functions
======================

.. image:: images/sphx_glr_psf_001.png
   :alt: Point spread functions

The optics image every point as a spot. The spot of a pupil :math:`P` with a path difference
:math:`W` (defocus, and aberrations as Zernike polynomials) is, at one wavelength,

.. math:: \mathrm{PSF}_\lambda(x, y) \propto \left| \iint P(u, v)\,
   e^{2\pi \mathrm{i} W(u, v) / \lambda}\, e^{-2\pi \mathrm{i} (ux + vy)/\lambda}\,
   \mathrm{d}u\, \mathrm{d}v \right|^2 ,

and what the camera has is its mean over the band. Diffusion of charge, motion and vibration blur it
further.

What you see: a pupil of numerical aperture 0.28 with an obscuration of 0.35 over 3.8 µm to 5.1 µm,
and the spot with each effect alone; the root of the density, so that the faint parts show, and
the peak.

Source: Goodman, *Introduction to Fourier Optics*; Zernike's polynomials in Noll's order. More:
:doc:`/understand/optics`.
"""

from dataclasses import replace

import numpy as np

from chipglow.camera import BlurredPSF, Camera, ChargeDiffusion, LinearMotion, PupilPSF, Vibration
from chipglow.drawing.drawing import new_figure, style

PERFECT = PupilPSF(Camera().band, 0.28, 0.35)
HALF, SPACING = 40, 0.5e-6
shown = {
    "pupil over the band": PERFECT,
    "defocus 50 µm": replace(PERFECT, defocus=50e-6),
    "coma Z8, 0.4 µm": replace(PERFECT, zernike=((8, 0.4e-6),)),
    "astigmatism Z6, 0.4 µm,\ndefocus 15 µm": replace(
        PERFECT, zernike=((6, 0.4e-6),), defocus=15e-6
    ),
    "spherical Z11, 0.4 µm": replace(PERFECT, zernike=((11, 0.4e-6),)),
    "charge diffusion 2 µm": BlurredPSF(PERFECT, (ChargeDiffusion(2e-6),)),
    "motion 12 µm": BlurredPSF(PERFECT, (LinearMotion(12e-6),)),
    "vibration 8 µm, 45°": BlurredPSF(PERFECT, (Vibration(8e-6, np.pi / 4),)),
}


def density(psf):
    """Energy in each square of 0.5 µm; the outermost ones hold all that goes farther."""
    return psf.view_kernel(SPACING, 2 * HALF, 2 * HALF)[HALF:-HALF, HALF:-HALF]


reach = (HALF + 0.5) * SPACING * 1e6
images = {name: density(psf) for name, psf in shown.items()}
largest = images["pupil over the band"].max()
with style():
    figure = new_figure(4.3)
    figure.set_layout_engine("compressed")
    panels = figure.subplots(2, 4, sharex=True, sharey=True)
    for axes, (name, image) in zip(panels.flat, images.items(), strict=True):
        part = image / largest
        picture = axes.imshow(np.sqrt(part), extent=(-reach, reach, -reach, reach), vmin=0, vmax=1)
        axes.set_title(f"{name}\npeak {part.max():.2f}", fontsize=8)
    figure.supxlabel("x / µm", fontsize=9.5)
    figure.supylabel("y / µm", fontsize=9.5)
    figure.colorbar(picture, ax=panels, label="root of the density over the pupil's peak")
