"""The image of a surface in pyBSM, for `camera_pass.py`.

Its Gaussian times its square detector, from a distance of 1 m. pyBSM crops the kernel to what holds
95 % of the light, convolves by sums, and takes the values at the pixels' middles.
"""

from math import log, pi, sqrt

import numpy as np
from pybsm.otf import functional

FREQUENCIES = 256


def prepared(_kernel, fwhm, spacing, group):
    """What forms an image: radiance of squares to that of `group` times larger ones."""
    pitch = group * spacing
    # So many steps of the kernel are the samples': pyBSM does not resample it.
    df = 1 / (FREQUENCIES * 2 * np.arctan(spacing / 2))
    u, v = np.meshgrid(*[df * (np.arange(FREQUENCIES) - FREQUENCIES // 2)] * 2)
    # exp(-π (b u)²) of pyBSM is exp(-2 (π σ u)²).
    blur = fwhm / (2 * sqrt(2 * log(2))) * sqrt(2 * pi)
    otf = functional.gaussian_OTF(u=u, v=v, blur_size_x=blur, blur_size_y=blur)
    otf = otf * functional.detector_OTF(u=u, v=v, w_x=pitch, w_y=pitch, f=1.0)

    def form(radiance):
        image, _ = functional.apply_otf_to_image(
            ref_img=radiance, ref_gsd=spacing, ref_range=1.0, otf=otf, df=df, ifov=pitch
        )
        return image

    return form
