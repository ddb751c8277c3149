"""What makes the error of every pixel: the paper's differences, one effect after the other."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error_images import (
    ErrorImages,
    ReferenceKind,
    Unblurred,
    error_images,
    reference_temperature,
)
from chipglow.camera import Camera, Exposure


@dataclass(frozen=True)
class ErrorParts:
    """Parts of the error of every pixel, in K of radiance temperature, each of shape (y, x).

    The effects are added one after the other, in the order of the light, and each part is the
    difference that its effect makes: `emissivity`, `motion`, `footprint`, `psf` and `detector` sum
    to the error of case 1. `texture` is in them.

    `emissivity` is radiance temperature less true temperature if the reference is the true one;
    `motion` the mean over the exposure less its greatest, at the samples that make the reference;
    `footprint` the mean over the pixel's area less the reference of a scene that stands still;
    `psf` the paper's case 1 − case 2; `texture`, if known, the error less that of a surface whose
    features have no texture.
    """

    errors: ErrorImages
    emissivity: NDArray[np.float64]
    motion: NDArray[np.float64]
    footprint: NDArray[np.float64]
    psf: NDArray[np.float64]
    detector: NDArray[np.float64]
    texture: NDArray[np.float64] | None


def error_parts(
    camera: Camera,
    exposure: Exposure,
    reference: ReferenceKind = "maximum",
    untextured: Exposure | None = None,
) -> ErrorParts:
    """Tell apart what makes the error of every pixel in one exposure.

    Parameters
    ----------
    camera : Camera
        The camera.
    exposure : Exposure
        What reached it.
    reference : ReferenceKind
        What to compare with; the paper's is the maximum.
    untextured : Exposure, optional
        The same exposure with the surface's `Surface.without_texture`.

    Notes
    -----
    Heigel and Whitenton (2010) tell the point spread function's part from the rest (case 1 and
    case 2, their Figure 10); motion and footprint continue that within case 2.
    """
    unblurred = Unblurred.of(camera, exposure, reference)
    formed = camera.form_image(exposure.mean_radiance, exposure.raster)
    errors = unblurred.errors(formed)
    noiseless = replace(unblurred, camera=replace(camera, detector=None)).errors(formed)
    radiant, of_radiance = errors.reference, reference
    if reference == "true":
        of_radiance = "maximum"
        radiant = reference_temperature(camera, exposure, of_radiance)
    still = reference_temperature(camera, _standing_still(exposure), of_radiance)
    return ErrorParts(
        errors=errors,
        emissivity=radiant - errors.reference,
        motion=still - radiant,
        footprint=noiseless.reference + noiseless.case_2 - still,
        psf=noiseless.psf_portion,
        detector=errors.case_1 - noiseless.case_1,
        texture=None
        if untextured is None
        else errors.case_1 - error_images(camera, untextured, reference).case_1,
    )


def _standing_still(exposure: Exposure) -> Exposure:
    """The exposure as of a scene that has its mean radiance all the time."""
    mean = exposure.mean_radiance
    return replace(exposure, peak_radiance=mean.astype(np.float32), centre_radiance=mean)
