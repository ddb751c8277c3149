"""The image that a camera forms: the radiance of its pixels before the detector."""

from functools import lru_cache
from typing import Final

import numpy as np

from chipglow.camera.description import CameraDescription
from chipglow.camera.optics.convolution import Beyond, images, without_rounding
from chipglow.camera.optics.image_formation import Gather, ImageFormation, sensitive_fraction
from chipglow.camera.optics.sampling import integrate, whole_raster
from chipglow.quantities import Array
from chipglow.scene import Raster
from chipglow.scene.raster import check_shape

_ROUNDING: Final = 1e-13
"""Fractions of a pixel's light that are the rounding of sums of float64."""


def form_image(
    camera: CameraDescription, radiance: Array, scene: Raster, gather: Gather = integrate
) -> Array:
    """Form the image of a radiance map on the pixels by optics, PSF and footprint.

    Parameters
    ----------
    camera : CameraDescription
        The camera.
    radiance : ndarray
        Radiance of the samples in W/(m² sr), shape (y, x), a mean over the integration time such as
        `Exposure.mean_radiance`.
    scene : Raster
        The samples.
    gather : callable
        Takes samples, their raster, the raster of the pixels and the fill factor; returns what the
        pixels receive, such as the mean over each square.

    Returns
    -------
    ndarray
        Radiance of the pixels, shape (y, x).

    Raises
    ------
    ValueError
        If the radiance has another shape than the samples, is negative or not finite.
    """
    image = np.asarray(radiance, np.float64)
    check_shape("camera: radiance", image.shape, scene.shape)
    if not (np.isfinite(image).all() and (image >= 0).all()):
        raise ValueError("camera: radiance must be finite and not negative")
    if camera.psf is None or camera.optics or gather is not integrate:
        return displayed(camera, _collect(camera, image, scene, "edge", gather), scene)
    return received(camera, image, scene)[0]


def image_formation(
    camera: CameraDescription,
    samples: Raster,
    beyond: Beyond = "edge",
    gather: Gather = integrate,
    pixels: Raster | None = None,
) -> ImageFormation:
    """Return the linear map from the radiance of samples to the radiance of the pixels.

    It has an adjoint, for corrections of measured images. Radiance beyond the samples continues as
    at the edge, or is zero; `gather` is as in `form_image`. By default the camera determines the
    pixels.
    """
    return ImageFormation(
        samples,
        camera.pixels(samples) if pixels is None else pixels,
        camera.psf,
        camera.psf_order == "detector",
        camera.fill_factor,
        camera.optics,
        beyond,
        gather,
    )


def received(camera: CameraDescription, image: Array, scene: Raster) -> tuple[Array, Array]:
    """Return the received radiance if the scene's edges continue, and if nothing is beyond."""
    if camera.psf is None or camera.optics:
        edge = _collect(camera, image, scene, "edge")
        return edge, _collect(camera, image, scene, "nothing")
    pixels = camera.pixels(scene)
    if camera.psf_order == "optics":
        sensitive = sensitive_fraction(camera.psf, camera.fill_factor, scene, pixels)
        return images(image, camera.psf, scene.spacing, (scene, pixels, sensitive))
    whole, own = whole_raster(scene, pixels)
    of_pixels = integrate(image, scene, whole, camera.fill_factor)
    edge, nothing = images(of_pixels, camera.psf, camera.pitch)
    return edge[own], nothing[own]


def displayed(camera: CameraDescription, image: Array, scene: Raster) -> Array:
    """Return the radiance of the pixels with the effects of the optics on it."""
    pixels = camera.pixels(scene)
    for term in camera.optics:
        image = term.on_pixels(image, pixels, camera.band)
    return image


@lru_cache(maxsize=2)
def light_from_beyond(camera: CameraDescription, scene: Raster) -> Array:
    """Return the fraction of each pixel's light that comes from beyond a scene, (y, x)."""
    fraction = received(camera, np.ones(scene.shape), scene)[1]
    return np.where(fraction < 1 - _ROUNDING, 1 - fraction, 0.0)


def _collect(
    camera: CameraDescription,
    image: Array,
    scene: Raster,
    beyond: Beyond,
    gather: Gather = integrate,
) -> Array:
    """Apply point spread function, optics and footprint."""
    collected = image_formation(camera, scene, beyond, gather).forward(image)
    is_blurred = camera.psf is not None or camera.optics
    return without_rounding(collected) if is_blurred else collected
