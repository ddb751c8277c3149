"""Convolution with a point spread function."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from chipglow.camera.optics.psf import PointSpreadFunction

_ROUNDING: Final = 1e-13
_FARTHEST: Final = 2048
"""Squares that a kernel reaches at most: light that goes farther is taken to go so far."""


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
    Beyond its edges the field goes on with the value at the nearest edge, however far; nothing
    wraps around, and no tail of the point spread function is left out. What truly is there is not
    known: `light_from_beyond` says how much of the light it decides, and `blur_of_like` gives the
    image under another assumption.
    """
    return _without_rounding(_transfer(psf, spacing, radiance.shape).apply(radiance, "edge"))


def blur_of_like(
    radiance: NDArray[np.float64], psf: PointSpreadFunction, spacing: float
) -> NDArray[np.float64]:
    """The same where beyond the field there is, for each value, the like of what it sees within.

    Parameters
    ----------
    radiance, psf, spacing
        As `blur`.

    Returns
    -------
    ndarray
        Radiance in W/(m² sr), shape (y, x): the light from within the field, over its fraction.
    """
    within = _transfer(psf, spacing, radiance.shape).apply(radiance, "constant")
    return _without_rounding(within / (1 - light_from_beyond(psf, spacing, radiance.shape)))


@lru_cache(maxsize=2)
def light_from_beyond(
    psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]
) -> NDArray[np.float64]:
    """Fraction of the light of each value that comes from beyond the field.

    Parameters
    ----------
    psf : PointSpreadFunction
        How a point is spread.
    spacing : float
        Distance between the values in m.
    shape : tuple of int
        Rows and columns of the field.

    Returns
    -------
    ndarray
        From 0 to under 1, of this shape, read-only.
    """
    fraction = 1 - _transfer(psf, spacing, shape).apply(np.ones(shape), "constant")
    fraction = np.where(fraction > _ROUNDING, fraction, 0.0)
    fraction.flags.writeable = False
    return fraction


@dataclass(frozen=True, eq=False)
class _Transfer:
    """Transform of a kernel for fields of one shape.

    Parameters
    ----------
    spectrum : ndarray
        The transform.
    shape : tuple of int
        Shape of what is transformed.
    down, right : int
        Rows and columns of the kernel to either side of its middle.
    """

    spectrum: NDArray[np.complex128]
    shape: tuple[int, int]
    down: int
    right: int

    def apply(
        self, field: NDArray[np.float64], beyond: Literal["edge", "constant"]
    ) -> NDArray[np.float64]:
        """The convolution of a field with its edges, or with nothing, beyond it."""
        rows, columns = field.shape
        # The rows beyond the field are none but its first and last: they are transformed once.
        wide = np.pad(field, ((0, 0), (self.right, self.right)), mode=beyond)
        lines = fft.rfft(wide, n=self.shape[1], axis=1)
        whole = np.pad(lines, ((self.down, self.down), (0, 0)), mode=beyond)
        whole = fft.fft(whole, n=self.shape[0], axis=0, overwrite_x=True)
        whole *= self.spectrum
        kept = fft.ifft(whole, axis=0, overwrite_x=True)[2 * self.down :][:rows]
        image = fft.irfft(kept, n=self.shape[1], axis=1)
        return np.asarray(image[:, 2 * self.right :][:, :columns])


@lru_cache(maxsize=2)
def _transfer(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Transfer:
    rows, columns = (min(count, _FARTHEST) for count in shape)
    kernel = psf.view_kernel(spacing, rows, columns)
    down, right = kernel.shape[0] // 2, kernel.shape[1] // 2
    padded = (
        fft.next_fast_len(shape[0] + 2 * down, real=True),
        fft.next_fast_len(shape[1] + 2 * right, real=True),
    )
    return _Transfer(fft.rfft2(kernel, s=padded), padded, down, right)


def _without_rounding(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transform leaves some 1e-16 of the largest value where there is no light."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
