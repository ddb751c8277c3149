"""Convolution with a point spread function."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import fft, sparse

from chipglow.camera.optics.kernel import resized
from chipglow.camera.optics.psf import PointSpreadFunction
from chipglow.camera.optics.sampling import line_weights
from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.surface.blend import in_blocks

Beyond: TypeAlias = Literal["edge", "nothing"]
"""What is taken to be beyond the edges of a field."""

_Kernel: TypeAlias = tuple[Array, tuple[Array, ...]]
"""A kernel, and its sums over all that is beyond the left, right, upper and lower edge."""

_ROUNDING: Final = 1e-13
_COLUMNS: Final = 32
_FARTHEST: Final = 2048
"""Squares that a kernel reaches at most: light that goes farther is taken to go so far."""


def blur(
    radiance: Array, psf: PointSpreadFunction, spacing: float, beyond: Beyond = "edge"
) -> Array:
    """Return the image of a field of radiance (y, x) behind a point spread function.

    Beyond its edges the field goes on with the value at the nearest edge, however far, or there is
    nothing. Nothing wraps around, and no tail of the point spread function is left out.
    """
    image = _transfer(psf, spacing, radiance.shape).within(radiance)
    if beyond == "edge":
        image += _edges(psf, spacing, radiance.shape).light(radiance)
    return _without_rounding(image)


def blurs(radiance: Array, psf: PointSpreadFunction, spacing: float) -> tuple[Array, Array]:
    """Return both images by `blur`: of a field that goes on, and of one with nothing beyond."""
    within = _transfer(psf, spacing, radiance.shape).within(radiance)
    light = _edges(psf, spacing, radiance.shape).light(radiance)
    return _without_rounding(within + light), _without_rounding(within)


def images_on_pixels(
    radiance: Array, psf: PointSpreadFunction, scene: Raster, sensors: Raster, fill_factor: float
) -> tuple[Array, Array]:
    """Return what pixels integrate of the images by `blur`, formed on the pixels alone.

    The first is of a field that goes on beyond its edges, the second of one with nothing there.
    """
    seen = _seen(psf, scene, sensors, fill_factor)
    within = seen.within(radiance)
    return _without_rounding(within + seen.from_edges(radiance)), _without_rounding(within)


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
