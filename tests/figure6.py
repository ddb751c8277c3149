"""The loop of the paper's Figure 6, literally: the oracle of the camera, and its peer in speed."""

import numpy as np
from scipy.ndimage import convolve


def figure_6(temperatures, emissivities, radiance, invert, kernel, group=9):
    """Radiance temperature of one camera frame.

    `temperatures` and `emissivities` hold one image for each sub-frame; `radiance` is Equation 1
    and `invert` its inverse; `kernel` is the point spread function on the pixels' grid.
    """
    rows, columns = temperatures[0].shape
    frames = []
    for temperature, emissivity in zip(temperatures, emissivities, strict=True):
        image = emissivity * radiance(temperature)
        groups = image.reshape(rows // group, group, columns // group, group)
        frame = groups.mean(axis=(1, 3))
        frames.append(convolve(frame, kernel, mode="nearest"))
    return invert(np.mean(frames, axis=0))
