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
"""Part of an image's maximum below which values are rounding errors of transforms."""

_COLUMNS_AT_ONCE: Final = 32
"""Columns that a thread transforms at once."""

_SMALL: Final = 2**16
"""Values of a field whose transform fits the processor's cache."""

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
    edge, nothing = convolution(psf, spacing, radiance.shape, grid).forward(radiance)
    return without_rounding(edge), without_rounding(nothing)


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

    def adjoint(self, light: Array, beyond: Literal["edge", "constant"]) -> Array:
        """Return the adjoint of `add`, from light on the lines to values of the edge."""
        count, reach = light.shape[1], self.reach
        received = np.zeros((self.lines.size, self.length))
        received[:, 2 * reach : 2 * reach + count] = light[self.lines]
        line = (fft.rfft(received) * self.spectrum.conj()).sum(axis=0)
        padded = fft.irfft(line, n=self.length)[: count + 2 * reach]
        edge = padded[reach : reach + count]
        if beyond == "edge":
            edge[0] += padded[:reach].sum()
            edge[-1] += padded[reach + count :].sum()
        return np.asarray(edge)


@dataclass(frozen=True, eq=False)
class Convolution:
    """The linear map from a field to its blurred image, on samples or on pixels.

    It consists of a kernel, the weights of samples in pixels, and the light from beyond the left,
    right, upper and lower edge.
    """

    kernel: _Kernel
    down: sparse.csr_array
    across: sparse.csr_array
    edges: tuple[_Strip, ...]

    def forward(self, field: Array) -> tuple[Array, Array]:
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
        return within + beyond, within

    def adjoint(self, image: Array, beyond: Beyond) -> Array:
        """Return the adjoint of `forward` for one assumption about the field beyond its edges."""
        rows = _sums(self.down.T, image)
        field = self._within_adjoint(_sums(self.across.T, rows.T).T)
        if beyond == "nothing":
            return field
        left, right, top, bottom = self.edges
        columns = _sums(self.across.T, image.T).T
        field[:, 0] += left.adjoint(rows.T, "edge")
        field[:, -1] += right.adjoint(rows.T, "edge")
        field[0] += top.adjoint(columns, "constant")
        field[-1] += bottom.adjoint(columns, "constant")
        return field

    def _within_adjoint(self, image: Array) -> Array:
        """Return the correlation with the kernel, of a field that is zero beyond its edges."""
        (rows, columns), (spectrum, shape, _) = image.shape, self.kernel
        transform = fft.rfft2(image, shape) * spectrum.conj()
        return np.asarray(fft.irfft2(transform, shape)[:rows, :columns])

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

        # A block of this size stays in the processor's cache between the transforms. All of a small
        # field does, and takes less time than to start threads.
        columns_at_once = _COLUMNS_AT_ONCE if field.size > _SMALL else lines.shape[1]
        in_blocks(lines.shape[1], convolve, columns_at_once)
        return np.asarray(fft.irfft(summed, n=shape[1], axis=1)[:, :columns])


@lru_cache(maxsize=4)
def convolution(
    psf: PointSpreadFunction, spacing: float, shape: tuple[int, int], grid: Grid | None = None
) -> Convolution:
    """Return the convolution of a field of this shape (y, x) with a point spread function.

    With `grid`, its images are sums over pixels.
    """
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
    return Convolution(kernel, down, across, edges)


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


def without_rounding(image: Array) -> Array:
    """Set the rounding errors of transforms to zero."""
    return np.where(image > _ROUNDING * image.max(), image, 0.0)
