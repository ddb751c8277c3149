"""Convolution with a point spread function."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import fft, sparse

from chipglow.camera.optics.kernel import resized
from chipglow.camera.optics.psf import PointSpreadFunction
from chipglow.camera.optics.sampling import line_weights
from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.surface.blocks import in_blocks

_Kernel: TypeAlias = tuple[Array, tuple[Array, ...]]
"""A kernel, and its sums over all that is beyond the left, right, upper and lower edge."""

_ROUNDING: Final = 1e-13
_COLUMNS: Final = 32
_FARTHEST: Final = 2048
"""Squares that a kernel reaches at most: light that goes farther is taken to go so far."""


def blur(radiance: Array, psf: PointSpreadFunction, spacing: float) -> Array:
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
    within = _transfer(psf, spacing, radiance.shape).within(radiance)
    return _without_rounding(within + _edges(psf, spacing, radiance.shape).light(radiance))


def blur_of_like(radiance: Array, psf: PointSpreadFunction, spacing: float) -> Array:
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


def both_borders(radiance: Array, psf: PointSpreadFunction, spacing: float) -> tuple[Array, Array]:
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
    within = _transfer(psf, spacing, radiance.shape).within(radiance)
    like = within / (1 - light_from_beyond(psf, spacing, radiance.shape))
    within += _edges(psf, spacing, radiance.shape).light(radiance)
    return _without_rounding(within), _without_rounding(like)


def image_on_pixels(
    radiance: Array, psf: PointSpreadFunction, scene: Raster, sensors: Raster, fill_factor: float
) -> Array:
    """What pixels integrate of the image by `blur`, which is formed nowhere but on them.

    Parameters
    ----------
    radiance : ndarray
        Radiance of the scene's samples in W/(m² sr), shape `scene.shape`.
    psf : PointSpreadFunction
        How a point is spread.
    scene, sensors : Raster
        Where the samples and the pixels are.
    fill_factor : float
        Fraction of a pixel's square that is sensitive: a square in its middle.

    Returns
    -------
    ndarray
        Radiance in W/(m² sr), shape `sensors.shape`.
    """
    seen = _seen(psf, scene, sensors, fill_factor)
    return _without_rounding(seen.within(radiance) + seen.from_edges(radiance))


def both_images_on_pixels(
    radiance: Array, psf: PointSpreadFunction, scene: Raster, sensors: Raster, fill_factor: float
) -> tuple[Array, Array]:
    """The same, and the image if beyond the scene there is for each pixel the like of within.

    Parameters
    ----------
    radiance, psf, scene, sensors, fill_factor
        As `image_on_pixels`.

    Returns
    -------
    tuple of ndarray
        Radiance in W/(m² sr), each of shape `sensors.shape`.
    """
    seen = _seen(psf, scene, sensors, fill_factor)
    within = seen.within(radiance)
    image = _without_rounding(within + seen.from_edges(radiance))
    return image, _without_rounding(within / seen.own_light)


@lru_cache(maxsize=2)
def light_from_beyond(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> Array:
    """Return the fraction of each value's light that comes from beyond a field; read-only."""
    fraction = 1 - _transfer(psf, spacing, shape).within(np.ones(shape))
    fraction = np.where(fraction > _ROUNDING, fraction, 0.0)
    fraction.flags.writeable = False
    return fraction


@dataclass(frozen=True, eq=False)
class _Strip:
    """What the values of one edge of a field, which go on beyond it, send into the field.

    `spectrum` (n, frequency) is the transform along the edge of the kernel's sums over all that is
    beyond, for the n lines of the field beside the edge that its light reaches, or n means of them;
    `length` is that of what is transformed, and `reach` that of the kernel to either side.
    """

    spectrum: NDArray[np.complex128]
    length: int
    reach: int

    @classmethod
    def of(cls, lines: Array, count: int) -> "_Strip":
        """Make that of an edge of so many values, from the kernel's sums (n, along the edge)."""
        reach = lines.shape[1] // 2
        length = fft.next_fast_len(count + 2 * reach, real=True)
        return cls(fft.rfft(lines, n=length), length, reach)

    def light(self, edge: Array, beyond: Literal["edge", "constant"]) -> Array:
        """Return the light of an edge that goes on at its ends, or not, shape (n, edge.size)."""
        line = fft.rfft(np.pad(edge, self.reach, mode=beyond), n=self.length)
        sent = fft.irfft(line * self.spectrum, n=self.length, overwrite_x=True)
        return np.asarray(sent[:, 2 * self.reach :][:, : edge.size])


class _Edges(NamedTuple):
    """Light from beyond each edge of a field."""

    left: _Strip
    right: _Strip
    top: _Strip
    bottom: _Strip

    def light(self, field: Array) -> Array:
        """Return the light from beyond a field that goes on with the value at the nearest edge."""
        light = np.zeros(field.shape)
        left, right, top, bottom = self.strips(field)
        for towards, sent in (
            (light.T, left),
            (light[:, ::-1].T, right),
            (light, top),
            (light[::-1], bottom),
        ):
            towards[: len(sent)] += sent
        return light

    def strips(self, field: Array) -> tuple[Array, ...]:
        """Return the light by the edge it comes over, (lines away from the edge, along it)."""
        # Above and below the field the left and the right edge go on as its corners.
        return (
            self.left.light(field[:, 0], "edge"),
            self.right.light(field[:, -1], "edge"),
            self.top.light(field[0], "constant"),
            self.bottom.light(field[-1], "constant"),
        )


@dataclass(frozen=True, eq=False)
class _Transfer:
    """Transform of a kernel, `shape` so large that what wraps around falls beside the field."""

    spectrum: NDArray[np.complex128]
    shape: tuple[int, int]

    def within(self, field: Array, down: sparse.csr_array | None = None) -> Array:
        """Return the convolution of a field with nothing beyond, or weighted sums of its rows."""
        rows, columns = field.shape
        # Rows beyond the field hold nothing: they are transformed in one direction only.
        lines = fft.rfft(field, n=self.shape[1], axis=1)
        kept = np.empty((rows if down is None else down.shape[0], lines.shape[1]), np.complex128)

        def convolve(begin: int, end: int) -> None:
            block = fft.fft(lines[:, begin:end], n=self.shape[0], axis=0)
            block *= self.spectrum[:, begin:end]
            own = fft.ifft(block, axis=0, overwrite_x=True)[:rows]
            kept[:, begin:end] = own if down is None else down @ own

        # So few columns stay in a processor's cache from one transform to the other.
        in_blocks(lines.shape[1], convolve, _COLUMNS)
        return np.asarray(fft.irfft(kept, n=self.shape[1], axis=1)[:, :columns])


@dataclass(frozen=True, eq=False)
class _Seen:
    """What pixels see of a scene: weights `down` and `across` of the samples in the pixels.

    `edges` is light from beyond: over the left and the right edge on columns of pixels and rows of
    samples, over the others on rows of pixels and columns of samples.
    """

    transfer: _Transfer
    down: sparse.csr_array
    across: sparse.csr_array
    edges: _Edges

    def within(self, radiance: Array) -> Array:
        """Return the light from within the scene."""
        return np.asarray((self.across @ self.transfer.within(radiance, self.down).T).T)

    def from_edges(self, radiance: Array) -> Array:
        """Return the light from beyond the scene, which goes on as at its edges."""
        left, right, top, bottom = self.edges.strips(radiance)
        beside, over = self.down @ (left + right).T, self.across @ (top + bottom).T
        return np.asarray(beside + over.T)

    @cached_property
    def own_light(self) -> Array:
        """Fraction of each pixel's light that comes from within the scene."""
        fraction = self.within(np.ones((self.down.shape[1], self.across.shape[1])))
        return np.where(fraction < 1 - _ROUNDING, fraction, 1.0)


@lru_cache(maxsize=2)
def _kernel(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Kernel:
    rows, columns = (min(count, _FARTHEST) for count in shape)
    kernel = psf.view_kernel(spacing, rows, columns)
    beyond = (
        _sums_beyond(kernel, shape[1]),
        _sums_beyond(kernel[:, ::-1], shape[1]),
        _sums_beyond(kernel.T, shape[0]),
        _sums_beyond(kernel[::-1].T, shape[0]),
    )
    return kernel, beyond


def _sums_beyond(kernel: Array, count: int) -> Array:
    """Return sums of a kernel over all beyond the left edge, for so many lines beside it."""
    return kernel[:, : kernel.shape[1] // 2 : -1].cumsum(axis=1)[:, ::-1][:, :count].T


@lru_cache(maxsize=2)
def _transfer(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Transfer:
    kernel, _ = _kernel(psf, spacing, shape)
    # No value of the field is farther from another than this.
    reach = tuple(min(n // 2, most - 1) for n, most in zip(kernel.shape, shape, strict=True))
    inner = resized(kernel, *reach)
    padded = (
        fft.next_fast_len(shape[0] + reach[0]),
        fft.next_fast_len(shape[1] + reach[1], real=True),
    )
    whole = np.zeros(padded)
    whole[: inner.shape[0], : inner.shape[1]] = inner
    centred = np.roll(whole, (-reach[0], -reach[1]), axis=(0, 1))
    return _Transfer(fft.rfft2(centred, overwrite_x=True), padded)


@lru_cache(maxsize=2)
def _edges(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Edges:
    """Return the light from beyond on the values of a field."""
    (left, right, top, bottom), (rows, columns) = _kernel(psf, spacing, shape)[1], shape
    return _Edges(
        _Strip.of(left, rows),
        _Strip.of(right, rows),
        _Strip.of(top, columns),
        _Strip.of(bottom, columns),
    )


@lru_cache(maxsize=4)
def _seen(psf: PointSpreadFunction, scene: Raster, sensors: Raster, fill_factor: float) -> _Seen:
    rows, columns = shape = scene.shape
    down, across = line_weights(scene, sensors, fill_factor)
    left, right, top, bottom = _kernel(psf, scene.spacing, shape)[1]
    edges = _Edges(
        _Strip.of(across[:, : len(left)] @ left, rows),
        _Strip.of(across[:, ::-1][:, : len(right)] @ right, rows),
        _Strip.of(down[:, : len(top)] @ top, columns),
        _Strip.of(down[:, ::-1][:, : len(bottom)] @ bottom, columns),
    )
    return _Seen(_transfer(psf, scene.spacing, shape), down, across, edges)


def _without_rounding(image: Array) -> Array:
    """Return an image without the 1e-16 that a transform leaves where there is no light."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
