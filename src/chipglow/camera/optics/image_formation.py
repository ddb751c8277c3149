"""Formation of an image: the linear map from a scene's radiance to that of the pixels."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from chipglow.camera.optics.convolution import Beyond, Grid, convolution
from chipglow.camera.optics.psf import PointSpreadFunction
from chipglow.camera.optics.sampling import integrate, line_weights, whole_raster
from chipglow.camera.optics.terms import OpticsTerm
from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.scene.raster import check_shape

Gather: TypeAlias = Callable[[Array, Raster, Raster, float], Array]
"""Function from samples, their raster, pixels and fill factor to the values of the pixels."""


class _Step(NamedTuple):
    """A linear map and its adjoint."""

    forward: Callable[[Array], Array]
    adjoint: Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class ImageFormation:
    """The linear map from the radiance of samples to the radiance that the pixels receive.

    It applies point spread function, further optics and footprint; not the detector. Radiance that
    lenses emit themselves is not included: it does not depend on the scene.

    Parameters
    ----------
    samples, pixels : Raster
        Samples of the scene, and pixels on it.
    psf : PointSpreadFunction or None
        Point spread function.
    pixels_first : bool
        Whether the pixels integrate before the blur, as in the paper.
    fill_factor : float
        Sensitive fraction of a pixel's area.
    terms : sequence of OpticsTerm
        Further effects of the optics.
    beyond : {"edge", "nothing"}
        Radiance beyond the samples: that of the edge continues, or none.
    gather : callable
        Function from samples to pixels; by default the mean over each pixel's square. The adjoint
        is defined for the default alone.

    Notes
    -----
    All steps are real and linear, so the adjoint satisfies ⟨A x, y⟩ = ⟨x, Aᵀ y⟩ for all x and y.
    """

    samples: Raster
    pixels: Raster
    psf: PointSpreadFunction | None
    pixels_first: bool
    fill_factor: float
    terms: Sequence[OpticsTerm] = ()
    beyond: Beyond = "edge"
    gather: Gather = integrate

    def forward(self, radiance: ArrayLike) -> Array:
        """Return the radiance of the pixels in W/(m² sr), from that of the samples, each (y, x)."""
        image = np.asarray(radiance, np.float64)
        check_shape("image formation: radiance", image.shape, self.samples.shape)
        for step in self._steps:
            image = step.forward(image)
        return image

    def adjoint(self, image: ArrayLike) -> Array:
        """Return the adjoint map, from values of the pixels to values of the samples, (y, x)."""
        values = np.asarray(image, np.float64)
        check_shape("image formation: image", values.shape, self.pixels.shape)
        if self.gather is not integrate:
            raise ValueError("image formation: the map from samples to pixels is not linear")
        for step in reversed(self._steps):
            values = step.adjoint(values)
        return values

    @cached_property
    def _steps(self) -> tuple[_Step, ...]:
        return tuple(self._in_order())

    def _in_order(self) -> Iterator[_Step]:
        """Yield the steps in the order in which the light meets them."""
        psf = self.psf
        if psf is not None and not self.pixels_first:
            if not self.terms and self.gather is integrate:
                grid = self.samples, self.pixels, self._sensitive
                yield self._blur(psf, self.samples, grid)
                return
            yield self._blur(psf, self.samples)
        for term in self.terms:
            yield _Step(
                partial(term.on_samples, scene=self.samples, pixels=self.pixels, blurred=self._add),
                partial(
                    term.from_samples, scene=self.samples, pixels=self.pixels, blurred=self._return
                ),
            )
        if psf is None or not self.pixels_first:
            yield self._integration(self.pixels, self._sensitive)
            return
        # Pixels that are not read out supply the radiance around the others.
        whole, own = whole_raster(self.samples, self.pixels)
        yield self._integration(whole, self.fill_factor)
        yield self._blur(psf, whole)
        yield _Step(lambda image: image[own], partial(_embedded, shape=whole.shape, part=own))

    def _blur(self, psf: PointSpreadFunction, raster: Raster, grid: Grid | None = None) -> _Step:
        blur = convolution(psf, raster.spacing, raster.shape, grid)
        which = 0 if self.beyond == "edge" else 1
        return _Step(
            lambda field: blur.forward(field)[which], partial(blur.adjoint, beyond=self.beyond)
        )

    def _add(self, field: Array, psf: PointSpreadFunction, spacing: float) -> Array:
        """Convolve a field with a term's point spread function."""
        images = convolution(psf, spacing, field.shape).forward(field)
        return images[0 if self.beyond == "edge" else 1]

    def _return(self, image: Array, psf: PointSpreadFunction, spacing: float) -> Array:
        """Return the adjoint of `_add`."""
        return convolution(psf, spacing, image.shape).adjoint(image, self.beyond)

    def _integration(self, pixels: Raster, fill_factor: float) -> _Step:
        down, across = line_weights(self.samples, pixels, fill_factor)
        return _Step(
            lambda field: self.gather(field, self.samples, pixels, fill_factor),
            lambda image: np.asarray((across.T @ (down.T @ image).T).T),
        )

    @property
    def _sensitive(self) -> float:
        return sensitive_fraction(self.psf, self.fill_factor, self.samples, self.pixels)


def sensitive_fraction(
    psf: PointSpreadFunction | None, fill_factor: float, samples: Raster, pixels: Raster
) -> float:
    """Return the fraction of a pixel to integrate: one sample if the PSF has a footprint."""
    if psf is None or "footprint" not in psf.includes:
        return fill_factor
    return min((samples.spacing / pixels.spacing) ** 2, 1.0)


def _embedded(image: Array, shape: tuple[int, int], part: tuple[slice, slice]) -> Array:
    """Return an image as a part of a larger one that is zero elsewhere."""
    whole = np.zeros(shape)
    whole[part] = image
    return whole
