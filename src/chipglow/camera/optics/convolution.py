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
"""Assumption about the field beyond its edges: continued, or zero."""

Grid: TypeAlias = tuple[Raster, Raster, float]
"""Samples and pixels of an image, and the pixels' fill factor."""

_ROUNDING: Final = 1e-13
_COLUMNS: Final = 32
_MAX_REACH: Final = 2048
"""Largest half size of a kernel in squares; its border squares contain the light beyond."""


def blur(
    radiance: Array, psf: PointSpreadFunction, spacing: float, beyond: Beyond = "edge"
) -> Array:
    """Convolve a field (y, x) with all of a point spread function, without wraparound."""
    edge, nothing = images(radiance, psf, spacing)
    return edge if beyond == "edge" else nothing


def images(
    radiance: Array, psf: PointSpreadFunction, spacing: float, grid: Grid | None = None
) -> tuple[Array, Array]:
    """Return both images by `blur`, with ``edge`` and ``nothing``, of samples or on pixels."""
    return _optics(psf, spacing, radiance.shape, grid).images(radiance)


class _Kernel(NamedTuple):
    """A kernel for fields of one shape."""

    spectrum: NDArray[np.complex128]
    shape: tuple[int, int]
    """Size of the transform, large enough to prevent wraparound into the field."""
    beyond: tuple[Array, ...]
    """Sums over the area beyond the left, right, upper and lower edge, for each line inside."""


@dataclass(frozen=True, eq=False)
class _Strip:
    """Light from beyond one edge of a field, where its values continue."""

    lines: NDArray[np.intp]
    """Lines inside that the light reaches."""
    spectrum: NDArray[np.complex128]
    """Transform along the edge of the kernel's sums over the area beyond, (line, frequency)."""
    length: int
    reach: int
    """Half size of the kernel."""

    @classmethod
    def from_sums(cls, sums: Array, weights: sparse.csr_array, count: int) -> "_Strip":
        """Return the strip of an edge of `count` values, for weighted sums of lines."""
        lines = weights[:, : len(sums)] @ sums[: weights.shape[1]]
        lit = np.flatnonzero(lines.any(axis=1))
        reach = sums.shape[1] // 2
        length = fft.next_fast_len(count + 2 * reach, real=True)
        return cls(lit, fft.rfft(lines[lit], n=length), length, reach)

    def add(self, edge: Array, beyond: Literal["edge", "constant"], light: Array) -> None:
        """Add the light to the lines; the edge itself is continued at its ends, or zero."""
        line = fft.rfft(np.pad(edge, self.reach, mode=beyond), n=self.length)
        sent = fft.irfft(line * self.spectrum, n=self.length, overwrite_x=True)
        light[self.lines] += sent[:, 2 * self.reach :][:, : edge.size]


@dataclass(frozen=True, eq=False)
class _Optics:
    """A kernel, the weights of samples in pixels, and edges: left, right, upper and lower."""

    kernel: _Kernel
    down: sparse.csr_array
    across: sparse.csr_array
    edges: tuple[_Strip, ...]

    def images(self, field: Array) -> tuple[Array, Array]:
        """Return the images of a field that continues beyond its edges, and that is zero there."""
        within = _sums(self.across, self._within(field).T).T
        left, right, top, bottom = self.edges
        sides = np.zeros((self.across.shape[0], field.shape[0]))
        ends = np.zeros((self.down.shape[0], field.shape[1]))
        # The left and right strips include the corners.
        left.add(field[:, 0], "edge", sides)
        right.add(field[:, -1], "edge", sides)
        top.add(field[0], "constant", ends)
        bottom.add(field[-1], "constant", ends)
        beyond = _sums(self.down, sides.T) + _sums(self.across, ends.T).T
        return _without_rounding(within + beyond), _without_rounding(within)

    def _within(self, field: Array) -> Array:
        """Return the convolution of a field that is zero beyond its edges, summed over rows."""
        (rows, columns), (spectrum, shape, _) = field.shape, self.kernel
        # Rows beyond the field are zero: they are transformed in one direction only.
        lines = fft.rfft(field, n=shape[1], axis=1)
        summed = np.empty((self.down.shape[0], lines.shape[1]), np.complex128)

        def convolve(begin: int, end: int) -> None:
            block = fft.fft(lines[:, begin:end], n=shape[0], axis=0)
            block *= spectrum[:, begin:end]
            inside = fft.ifft(block, axis=0, overwrite_x=True)[:rows]
            summed[:, begin:end] = _sums(self.down, inside)

        # A block of this size stays in the processor's cache between the transforms.
        in_blocks(lines.shape[1], convolve, _COLUMNS)
        return np.asarray(fft.irfft(summed, n=shape[1], axis=1)[:, :columns])


@lru_cache(maxsize=4)
def _optics(
    psf: PointSpreadFunction, spacing: float, shape: tuple[int, int], grid: Grid | None
) -> _Optics:
    (rows, columns), kernel = shape, _transformed(psf, spacing, shape)
    down, across = (
        line_weights(*grid)
        if grid is not None
        else (sparse.eye_array(count, format="csr") for count in shape)
    )
    left, right, top, bottom = kernel.beyond
    edges = (
        _Strip.from_sums(left, across, rows),
        _Strip.from_sums(right, across[:, ::-1], rows),
        _Strip.from_sums(top, down, columns),
        _Strip.from_sums(bottom, down[:, ::-1], columns),
    )
    return _Optics(kernel, down, across, edges)


@lru_cache(maxsize=2)
def _transformed(psf: PointSpreadFunction, spacing: float, shape: tuple[int, int]) -> _Kernel:
    rows, columns = shape
    kernel = psf.view_kernel(spacing, min(rows, _MAX_REACH), min(columns, _MAX_REACH))
    towards = (kernel, kernel[:, ::-1], kernel.T, kernel[::-1].T)
    # Values of the field are never farther apart.
    reach = tuple(min(n // 2, size - 1) for n, size in zip(kernel.shape, shape, strict=True))
    inner = resized(kernel, *reach)
    padded = (fft.next_fast_len(rows + reach[0]), fft.next_fast_len(columns + reach[1], real=True))
    whole = np.zeros(padded)
    whole[: inner.shape[0], : inner.shape[1]] = inner
    centred = np.roll(whole, (-reach[0], -reach[1]), axis=(0, 1))
    halves = (one[:, : one.shape[1] // 2 : -1] for one in towards)
    beyond = tuple(half.cumsum(axis=1)[:, ::-1].T for half in halves)
    return _Kernel(fft.rfft2(centred, overwrite_x=True), padded, beyond)


def _sums(weights: sparse.csr_array, values: NDArray[Any]) -> NDArray[Any]:
    """Return weighted sums of rows; the rows themselves if the weights are square."""
    return values if weights.shape[0] == weights.shape[1] else weights @ values


def _without_rounding(image: Array) -> Array:
    """Set the rounding errors of transforms to zero."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
