"""What the optics and the detector elements do to a radiance image."""

from chipglow.camera.optics.convolution import blur
from chipglow.camera.optics.psf import (
    PSFS,
    AiryAperture,
    AnnularAperturePSF,
    GaussianPSF,
    MeasuredPSF,
    MeasuredPSFFile,
    PointSpreadFunction,
    PSFChoice,
)

__all__ = [
    "PSFS",
    "AiryAperture",
    "AnnularAperturePSF",
    "GaussianPSF",
    "MeasuredPSF",
    "MeasuredPSFFile",
    "PSFChoice",
    "PointSpreadFunction",
    "blur",
]
