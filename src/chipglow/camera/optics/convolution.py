"""Convolution with a point spread function."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, Literal, NamedTuple, TypeAlias

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
"""Assumption about the field beyond its edges."""

_Grid: TypeAlias = tuple[Raster, Raster, float]
"""Samples and pixels of an image, and the pixels' fill factor."""

_ROUNDING: Final = 1e-13
_COLUMNS: Final = 32
_FARTHEST: Final = 2048
"""Squares that a kernel reaches at most: light that goes farther is taken to go so far."""


def blur(
    radiance: Array, psf: PointSpreadFunction, spacing: float, beyond: Beyond = "edge"
) -> Array:
    """Return the image of a field of radiance (y, x) behind a point spread function.

    Beyond its edges the field continues with the value at the nearest edge, or there is
    nothing. Nothing wraps around, and no tail of the point spread function is left out.
    """
    edge, nothing = blurs(radiance, psf, spacing)
    return edge if beyond == "edge" else nothing


def blurs(radiance: Array, psf: PointSpreadFunction, spacing: float) -> tuple[Array, Array]:
    """Return both images by `blur`: of a field that continues, and of one with nothing beyond."""
    return _optics(psf, spacing, radiance.shape, None).images(radiance)


def images_on_pixels(
    radiance: Array, psf: PointSpreadFunction, scene: Raster, sensors: Raster, fill_factor: float
) -> tuple[Array, Array]:
    """Return what pixels integrate of both images by `blur`, formed on the pixels alone."""
    grid = scene, sensors, fill_factor
    return _optics(psf, scene.spacing, scene.shape, grid).images(radiance)


class _Kernel(NamedTuple):
    """A kernel for fields of one shape."""

    spectrum: NDArray[np.complex128]
    shape: tuple[int, int]
    """Size of the transform, so large that what wraps around falls beside the field."""
    beyond: tuple[Array, ...]
    """Sums over all beyond the left, right, upper and lower edge, for each line beside it."""


@dataclass(frozen=True, eq=False)
class _Strip:
    """What the values of one edge of a field, which go on beyond it, send into the field.

    `spectrum` (n, frequency) is the transform along the edge of the kernel's sums over all that is
    beyond, for the `lines` beside the edge that its light reaches; `length` is that of what is
    transformed, and `reach` that of the kernel to either side.
    """

    lines: NDArray[np.intp]
    spectrum: NDArray[np.complex128]
    length: int
    reach: int

    @classmethod
    def of(cls, sums: Array, weights: sparse.csr_array, count: int) -> "_Strip":
        """Return that of an edge of `count` values, for weighted sums of the lines beside it."""
        lines = weights[:, : len(sums)] @ sums[: weights.shape[1]]
        lit = np.flatnonzero(lines.any(axis=1))
        reach = sums.shape[1] // 2
        length = fft.next_fast_len(count + 2 * reach, real=True)
        return cls(lit, fft.rfft(lines[lit], n=length), length, reach)

    def add(self, edge: Array, beyond: Literal["edge", "constant"], light: Array) -> None:
        """Add the light of an edge that continues at its ends, or not, to the lines."""
        line = fft.rfft(np.pad(edge, self.reach, mode=beyond), n=self.length)
        sent = fft.irfft(line * self.spectrum, n=self.length, overwrite_x=True)
        light[self.lines] += sent[:, 2 * self.reach :][:, : edge.size]


@dataclass(frozen=True, eq=False)
class _Optics:
    """A kernel and the pixels on which images are formed.

    `down` and `across` are weights of a column's and a row's values in the pixels; `edges` are the
    left, right, upper and lower one.
    """

    kernel: _Kernel
    down: sparse.csr_array
    across: sparse.csr_array
    edges: tuple[_Strip, ...]

    def images(self, field: Array) -> tuple[Array, Array]:
        """Return the image of a field that continues beyond its edges, or with nothing beyond."""
        within = _sums(self.across, self._within(field).T).T
        left, right, top, bottom = self.edges
        beside = np.zeros((self.across.shape[0], field.shape[0]))
        over = np.zeros((self.down.shape[0], field.shape[1]))
        # Above and below the field the left and the right edge continue as its corners.
        left.add(field[:, 0], "edge", beside)
        right.add(field[:, -1], "edge", beside)
        top.add(field[0], "constant", over)
        bottom.add(field[-1], "constant", over)
        beyond = _sums(self.down, beside.T) + _sums(self.across, over.T).T
        return _without_rounding(within + beyond), _without_rounding(within)

    def _within(self, field: Array) -> Array:
        """Return weighted sums of the rows of the convolution of a field with nothing beyond."""
        (rows, columns), (spectrum, shape, _) = field.shape, self.kernel
        # Rows beyond the field hold nothing: they are transformed in one direction only.
        lines = fft.rfft(field, n=shape[1], axis=1)
        kept = np.empty((self.down.shape[0], lines.shape[1]), np.complex128)

        def convolve(begin: int, end: int) -> None:
            block = fft.fft(lines[:, begin:end], n=shape[0], axis=0)
            block *= spectrum[:, begin:end]
            own = fft.ifft(block, axis=0, overwrite_x=True)[:rows]
            kept[:, begin:end] = _sums(self.down, own)

        # So few columns stay in a processor's cache from one transform to the other.
        in_blocks(lines.shape[1], convolve, _COLUMNS)
        return np.asarray(fft.irfft(kept, n=shape[1], axis=1)[:, :columns])


@lru_cache(maxsize=4)
def _optics(
    psf: PointSpreadFunction, spacing: float, shape: tuple[int, int], grid: _Grid | None
) -> _Optics:
    (rows, columns), kernel = shape, _transformed(psf, spacing, shape)
    down, across = (
        line_weights(*grid)
        if grid is not None
        else (sparse.eye_array(count, format="csr") for count in shape)
    )
    left, right, top, bottom = kernel.beyond
    edges = (
        _Strip.of(left, across, rows),
        _Strip.of(right, across[:, ::-1], rows),
        _Strip.of(top, down, columns),
        _Strip.of(bottom, down[:, ::-1], columns),
    )
    return _Optics(kernel, down, across, edges)


@lru_cache(maxsize=2)
def _transformed(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Kernel:
    rows, columns = shape
    kernel = psf.view_kernel(spacing, min(rows, _FARTHEST), min(columns, _FARTHEST))
    towards = (kernel, kernel[:, ::-1], kernel.T, kernel[::-1].T)
    # No value of the field is farther from another than this.
    reach = tuple(min(n // 2, most - 1) for n, most in zip(kernel.shape, shape, strict=True))
    inner = resized(kernel, *reach)
    padded = (
        fft.next_fast_len(rows + reach[0]),
        fft.next_fast_len(columns + reach[1], real=True),
    )
    whole = np.zeros(padded)
    whole[: inner.shape[0], : inner.shape[1]] = inner
    centred = np.roll(whole, (-reach[0], -reach[1]), axis=(0, 1))
    beyond = tuple(_sums_beyond(one) for one in towards)
    return _Kernel(fft.rfft2(centred, overwrite_x=True), padded, beyond)


def _sums_beyond(kernel: Array) -> Array:
    """Return sums of a kernel over all beyond the left edge, for each line beside it."""
    return kernel[:, : kernel.shape[1] // 2 : -1].cumsum(axis=1)[:, ::-1].T


def _sums(weights: sparse.csr_array, values: NDArray[Any]) -> NDArray[Any]:
    """Return weighted sums of rows; as many pixels as samples are the samples themselves."""
    return values if weights.shape[0] == weights.shape[1] else weights @ values


def _without_rounding(image: Array) -> Array:
    """Return an image without the 1e-16 that a transform leaves where there is no light."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
