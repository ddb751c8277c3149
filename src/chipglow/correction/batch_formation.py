"""Formation of the images of many fields: fast, and accurate enough for second derivatives."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft, sparse

from chipglow.camera import ImageFormation, PointSpreadFunction
from chipglow.camera.optics.convolution import Beyond
from chipglow.camera.optics.sampling import line_weights
from chipglow.camera.optics.terms import OpticsTerm
from chipglow.correction.cells import cells_of
from chipglow.quantities import Array
from chipglow.scene import Raster

_FAR_LIGHT: Final = 0.02
"""Part of the light that is far: its image follows from means over groups of values."""

_GROUP: Final = 16
"""Side in pixels of square groups, and of parts of edges, over which far light hardly changes."""

_BEYOND: Final = 4
"""Pixels beyond the edges in which each value of an edge continues by itself."""


@dataclass(frozen=True, eq=False)
class BatchFormation:
    """The formation of images from the light of cells, which continues beyond the edges.

    Each pixel has values at the same places: of its cells, or one mean of them if the pixels
    integrate before the blur. Near light is a sum of convolutions on the raster of the pixels, one
    for each place; far light follows from means over groups of values. In single precision.
    """

    pixels: Raster
    means: Any
    """Sparse array (value, cell) of the pixels' means; None if cells are the values."""
    spectra: NDArray[np.complex64]
    """Transforms of the kernels, (down, right, y, x) by the place of the value in its pixel."""
    size: tuple[int, int]
    """Size of the transforms in pixels, large enough to prevent wraparound into the image."""
    groups: sparse.csr_array
    """Means over square groups, and over parts of edges that continue, (group, value)."""
    far: NDArray[np.float32]
    """Images of the far light of groups that send 1 W/(m² sr), (pixel, group)."""

    def forward(self, light: NDArray[Any]) -> NDArray[Any]:
        """Return the images (pixel, field) of the light of cells, (cell, field)."""
        values = light if self.means is None else self.means @ light
        near = np.stack([self._near(field) for field in values.T], axis=1)
        return np.asarray(near + self.far @ (self.groups @ values))

    def adjoint(self, images: NDArray[Any]) -> NDArray[Any]:
        """Return the adjoint map, from images (pixel, field) to values of cells (cell, field)."""
        near = np.stack([self._near_adjoint(image) for image in images.T], axis=1)
        values = near + self.groups.T @ (self.far.T @ images)
        return np.asarray(values if self.means is None else self.means.T @ values)

    def far_of(self, group: NDArray[np.intp], exact: ImageFormation, beyond: Beyond) -> Array:
        """Return the far light of a group of values that are 1 W/(m² sr)."""
        values = np.zeros(exact.samples.shape)
        values.flat[group] = 1.0
        whole = replace(exact, beyond=beyond).forward(values).ravel()
        return whole - self._near(values, "edge" if beyond == "edge" else "constant")

    @property
    def _places(self) -> int:
        """Values along the side of a pixel."""
        return int(self.spectra.shape[0])

    def _near(self, field: Array, beyond: Literal["edge", "constant"] = "edge") -> Array:
        """Return the image of the near light; beyond the edges they continue, or nothing is."""
        (rows, columns), places = self.pixels.shape, self._places
        values = field.reshape(places * rows, places * columns)
        padded = np.pad(values, places * _BEYOND, mode=beyond)
        shape = rows + 2 * _BEYOND, places, columns + 2 * _BEYOND, places
        by_place = np.ascontiguousarray(padded.reshape(shape).transpose(1, 3, 0, 2))
        # Rows beyond the field are zero: they are transformed in one direction only.
        lines = fft.rfft(by_place, self.size[1])
        transforms = fft.fft(lines, self.size[0], axis=-2, overwrite_x=True)
        transforms *= self.spectra
        image = fft.irfft2(transforms.sum(axis=(0, 1)), self.size)
        inside = image[_BEYOND : _BEYOND + rows, _BEYOND : _BEYOND + columns]
        return np.asarray(inside).ravel()

    def _near_adjoint(self, image: Array) -> Array:
        (rows, columns), places = self.pixels.shape, self._places
        padded = np.pad(image.reshape(rows, columns), ((_BEYOND, 0), (_BEYOND, 0)))
        transforms = fft.rfft2(padded, self.size) * self.spectra.conj()
        lines = fft.ifft(transforms, axis=-2, overwrite_x=True)[..., : rows + 2 * _BEYOND, :]
        by_place = fft.irfft(lines, self.size[1])[..., : columns + 2 * _BEYOND]
        shape = [places * (count + 2 * _BEYOND) for count in (rows, columns)]
        values = by_place.transpose(2, 0, 3, 1).reshape(shape)
        beyond = places * _BEYOND
        return _folded(_folded(values, beyond).T, beyond).T.ravel()


def _folded(field: Array, beyond: int) -> Array:
    """Return the adjoint of the continuation of the first and the last line."""
    inside = field[beyond:-beyond].copy()
    inside[0] += field[:beyond].sum(axis=0)
    inside[-1] += field[-beyond:].sum(axis=0)
    return inside


@dataclass(frozen=True, eq=False)
class SingleFormation:
    """The formation of one image after another, for optics that differ over the image."""

    formation: ImageFormation

    def forward(self, light: NDArray[Any]) -> NDArray[Any]:
        """Return the images (pixel, field) of the light of cells, (cell, field)."""
        shape = self.formation.samples.shape
        images = [self.formation.forward(field.reshape(shape)).ravel() for field in light.T]
        return np.stack(images, axis=1)

    def adjoint(self, images: NDArray[Any]) -> NDArray[Any]:
        """Return the adjoint map, from images (pixel, field) to values of cells (cell, field)."""
        shape = self.formation.pixels.shape
        fields = [self.formation.adjoint(image.reshape(shape)).ravel() for image in images.T]
        return np.stack(fields, axis=1)


def batch_formation(formation: ImageFormation) -> BatchFormation | SingleFormation:
    """Return the formation of the images of many fields of cells."""
    if any(type(term).on_samples is not OpticsTerm.on_samples for term in formation.terms):
        return SingleFormation(formation)
    return _batch_formation(
        formation.pixels, formation.psf, formation.pixels_first, formation.fill_factor
    )


@lru_cache(maxsize=2)
def _batch_formation(
    pixels: Raster, psf: PointSpreadFunction | None, pixels_first: bool, fill_factor: float
) -> BatchFormation:
    cells = cells_of(pixels)
    means = None
    exact = ImageFormation(cells, pixels, psf, pixels_first, fill_factor)
    if pixels_first or psf is None:
        means = sparse.kron(*line_weights(cells, pixels, fill_factor), "csr").astype(np.float32)
        exact = ImageFormation(pixels, pixels, psf, True, 1.0)
    spectra, size = _spectra(exact)
    squares, edges = _squares(exact.samples, pixels), _edges(exact.samples, pixels)
    groups = _means([*squares, *edges], exact.samples)
    near = BatchFormation(pixels, means, spectra, size, groups, np.empty((0, 0), np.float32))
    far = [near.far_of(square, exact, "nothing") for square in squares]
    for edge in edges:
        far.append(near.far_of(edge, exact, "edge") - near.far_of(edge, exact, "nothing"))
    return replace(near, far=np.stack(far, axis=1).astype(np.float32))


def _places_of(samples: Raster, pixels: Raster) -> int:
    return samples.rows // pixels.rows


def _spectra(exact: ImageFormation) -> tuple[NDArray[np.complex64], tuple[int, int]]:
    """Return the transforms of the kernels and their size, from the light that a pixel receives."""
    most, places = max(exact.pixels.shape), _places_of(exact.samples, exact.pixels)
    count = 2 * most + 1
    pixels = replace(exact.pixels, rows=count, columns=count)
    samples = replace(exact.samples, rows=places * count, columns=places * count)
    middle = np.zeros(pixels.shape)
    middle[most, most] = 1.0
    received = replace(exact, samples=samples, pixels=pixels, beyond="nothing").adjoint(middle)
    by_place = received.reshape(count, places, count, places).transpose(1, 3, 0, 2)
    reach = _reach(by_place.sum(axis=(0, 1)))
    near = slice(most - reach, most + reach + 1)
    # A value is sent to pixels in the opposite direction of that in which a pixel receives it.
    kernels = by_place[..., near, near][..., ::-1, ::-1]
    rows, columns = (length + 2 * _BEYOND + reach for length in exact.pixels.shape)
    size = fft.next_fast_len(rows), fft.next_fast_len(columns, real=True)
    whole = np.zeros((places, places, *size))
    whole[..., : 2 * reach + 1, : 2 * reach + 1] = kernels
    centred = np.roll(whole, (-reach, -reach), axis=(-2, -1))
    return fft.rfft2(centred).astype(np.complex64), size


def _reach(received: Array) -> int:
    """Return the half side in pixels of the square from which a pixel receives its near light."""
    middle = received.shape[0] // 2
    row, column = np.indices(received.shape) - middle
    distance = np.maximum(np.abs(row), np.abs(column)).ravel()
    within = np.bincount(distance, received.ravel()).cumsum()
    return int(np.searchsorted(within, (1 - _FAR_LIGHT) * within[-1]))


def _squares(samples: Raster, pixels: Raster) -> list[NDArray[np.intp]]:
    """Return the samples of square groups."""
    index = np.arange(samples.rows * samples.columns).reshape(samples.shape)
    down, right = (max(round(count / _GROUP), 1) for count in pixels.shape)
    return [
        square.ravel()
        for rows in np.array_split(index, down)
        for square in np.array_split(rows, right, axis=1)
    ]


def _edges(samples: Raster, pixels: Raster) -> list[NDArray[np.intp]]:
    """Return the samples of parts of the edges, and of corners, which continue in a quadrant."""
    index = np.arange(samples.rows * samples.columns).reshape(samples.shape)
    down, right = (max(round(count / _GROUP), 1) for count in pixels.shape)
    sides = (
        (index[1:-1, 0], down),
        (index[1:-1, -1], down),
        (index[0, 1:-1], right),
        (index[-1, 1:-1], right),
    )
    parts = [part for side, count in sides for part in np.array_split(side, count)]
    return [*parts, *np.split(index[[0, 0, -1, -1], [0, -1, 0, -1]], 4)]


def _means(groups: list[NDArray[np.intp]], samples: Raster) -> sparse.csr_array:
    """Return means over groups of samples, (group, sample)."""
    group = np.repeat(np.arange(len(groups)), [one.size for one in groups])
    weights = np.concatenate([np.full(one.size, 1 / one.size, np.float32) for one in groups])
    shape = len(groups), samples.rows * samples.columns
    return sparse.csr_array((weights, (group, np.concatenate(groups))), shape=shape)
