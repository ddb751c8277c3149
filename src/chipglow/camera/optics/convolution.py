"""Convolution with a point spread function."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from chipglow.camera.optics.kernel import resized
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
    transfer = _transfer(psf, spacing, radiance.shape)
    return _without_rounding(transfer.within(radiance) + transfer.from_edges(radiance))


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
    within = _transfer(psf, spacing, radiance.shape).within(radiance)
    return _without_rounding(within / (1 - light_from_beyond(psf, spacing, radiance.shape)))


def both_borders(
    radiance: NDArray[np.float64], psf: PointSpreadFunction, spacing: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Images by `blur` and by `blur_of_like`: the light from within the field is computed once.

    Parameters
    ----------
    radiance, psf, spacing
        As `blur`.

    Returns
    -------
    tuple of ndarray
        Radiance in W/(m² sr), each of shape (y, x).
    """
    transfer = _transfer(psf, spacing, radiance.shape)
    within = transfer.within(radiance)
    like = within / (1 - light_from_beyond(psf, spacing, radiance.shape))
    within += transfer.from_edges(radiance)
    return _without_rounding(within), _without_rounding(like)


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
    fraction = 1 - _transfer(psf, spacing, shape).within(np.ones(shape))
    fraction = np.where(fraction > _ROUNDING, fraction, 0.0)
    fraction.flags.writeable = False
    return fraction


@dataclass(frozen=True, eq=False)
class _Strip:
    """What the values of one edge of a field, which go on beyond it, send into the field.

    Parameters
    ----------
    spectrum : ndarray
        Transform along the edge of the kernel's sums over all that is beyond, shape (n, frequency),
        for the n lines of the field beside the edge that its light reaches.
    length, reach : int
        Of what is transformed, and of the kernel to either side.
    """

    spectrum: NDArray[np.complex128]
    length: int
    reach: int

    @classmethod
    def of(cls, kernel: NDArray[np.float64], shape: tuple[int, int]) -> "_Strip":
        """That of the left edge of a field of this shape."""
        reach = kernel.shape[0] // 2
        beyond = kernel[:, : kernel.shape[1] // 2 : -1].cumsum(axis=1)[:, ::-1]
        length = fft.next_fast_len(shape[0] + 2 * reach, real=True)
        return cls(fft.rfft(beyond[:, : shape[1]].T, n=length), length, reach)

    def light(
        self, edge: NDArray[np.float64], beyond: Literal["edge", "constant"]
    ) -> NDArray[np.float64]:
        """Light of an edge that goes on at its ends, or does not, shape (n, edge.size)."""
        line = fft.rfft(np.pad(edge, self.reach, mode=beyond), n=self.length)
        sent = fft.irfft(line * self.spectrum, n=self.length, overwrite_x=True)
        return np.asarray(sent[:, 2 * self.reach :][:, : edge.size])


@dataclass(frozen=True, eq=False)
class _Transfer:
    """Transforms of a kernel for fields of one shape.

    Parameters
    ----------
    spectrum : ndarray
        The transform.
    shape : tuple of int
        Shape of what is transformed: so much larger than the field that what wraps around falls
        beside it.
    left, right, top, bottom : _Strip
        What comes from beyond each edge.
    """

    spectrum: NDArray[np.complex128]
    shape: tuple[int, int]
    left: _Strip
    right: _Strip
    top: _Strip
    bottom: _Strip

    def within(self, field: NDArray[np.float64]) -> NDArray[np.float64]:
        """The convolution of a field with nothing beyond it."""
        rows, columns = field.shape
        # Rows beyond the field hold nothing: they are transformed in one direction only.
        lines = fft.rfft(field, n=self.shape[1], axis=1)
        whole = fft.fft(lines, n=self.shape[0], axis=0)
        whole *= self.spectrum
        kept = fft.ifft(whole, axis=0, overwrite_x=True)[:rows]
        return np.asarray(fft.irfft(kept, n=self.shape[1], axis=1)[:, :columns])

    def from_edges(self, field: NDArray[np.float64]) -> NDArray[np.float64]:
        """Light from beyond a field that goes on with the value at the nearest edge."""
        light = np.zeros(field.shape)
        # Above and below the field the left and the right edge go on as its corners.
        for strip, edge, beyond, towards in (
            (self.left, field[:, 0], "edge", light.T),
            (self.right, field[:, -1], "edge", light[:, ::-1].T),
            (self.top, field[0], "constant", light),
            (self.bottom, field[-1], "constant", light[::-1]),
        ):
            sent = strip.light(edge, cast(Literal["edge", "constant"], beyond))
            towards[: len(sent)] += sent
        return light


@lru_cache(maxsize=2)
def _transfer(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Transfer:
    rows, columns = (min(count, _FARTHEST) for count in shape)
    kernel = psf.view_kernel(spacing, rows, columns)
    # No value of the field is farther from another than this.
    reach = tuple(min(n // 2, most - 1) for n, most in zip(kernel.shape, shape, strict=True))
    inner = resized(kernel, *reach)
    padded = (
        fft.next_fast_len(shape[0] + reach[0]),
        fft.next_fast_len(shape[1] + reach[1], real=True),
    )
    whole = np.zeros(padded)
    whole[: inner.shape[0], : inner.shape[1]] = inner
    spectrum = fft.rfft2(np.roll(whole, (-reach[0], -reach[1]), axis=(0, 1)), overwrite_x=True)
    return _Transfer(
        spectrum,
        padded,
        left=_Strip.of(kernel, shape),
        right=_Strip.of(kernel[:, ::-1], shape),
        top=_Strip.of(kernel.T, shape[::-1]),
        bottom=_Strip.of(kernel[::-1].T, shape[::-1]),
    )


def _without_rounding(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """The transform leaves some 1e-16 of the largest value where there is no light."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
