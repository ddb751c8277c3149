"""Convolution with a point spread function."""

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from chipglow.camera.psf import PointSpreadFunction

_ROUNDING: Final = 1e-13


def blur(
    radiance: NDArray[np.float64], psf: PointSpreadFunction, spacing: float
) -> NDArray[np.float64]:
    """Image of a field of radiance behind a point spread function.

    Parameters
    ----------
    radiance : ndarray
        Radiance in W/(m² sr), shape (y, x).
    psf : PointSpreadFunction
        How a point is spread.
    spacing : float
        Distance between the values in m.

    Returns
    -------
    ndarray
        Radiance in W/(m² sr), shape (y, x).

    Notes
    -----
    Beyond its edges the field goes on with the value at the nearest edge; nothing wraps around.
    """
    rows, columns = radiance.shape
    transfer, shape, half = _transfer_function(psf, spacing, rows, columns)
    spectrum = fft.rfft2(np.pad(radiance, half, mode="edge"), s=shape)
    spectrum *= transfer
    whole = fft.irfft2(spectrum, s=shape)
    image = whole[2 * half : 2 * half + rows, 2 * half : 2 * half + columns]
    # The transform's rounding leaves some 1e-16 of the largest value where there is no light.
    return np.where(image > _ROUNDING * image.max(), image, 0.0)


@lru_cache(maxsize=8)
def _transfer_function(
    psf: PointSpreadFunction, spacing: float, rows: int, columns: int
) -> tuple[NDArray[np.complex128], tuple[int, int], int]:
    """Transform of the kernel, the padded shape, and the kernel's half size."""
    kernel = psf.kernel(spacing)
    half = kernel.shape[0] // 2
    shape = (
        fft.next_fast_len(rows + 2 * half, real=True),
        fft.next_fast_len(columns + 2 * half, real=True),
    )
    return fft.rfft2(kernel, s=shape), shape, half
