"""What the optics and the detector elements do to a radiance image."""

from chipglow.camera.optics.convolution import blur
from chipglow.camera.optics.psf import (
    AnnularAperturePSF,
    GaussianPSF,
    MeasuredPSF,
    PointSpreadFunction,
)

__all__ = [
    "AnnularAperturePSF",
    "GaussianPSF",
    "MeasuredPSF",
    "PointSpreadFunction",
    "blur",
]
