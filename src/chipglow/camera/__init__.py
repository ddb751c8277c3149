"""The virtual camera: optics, sampling, exposure, and the measurement that comes out."""

from chipglow.camera.camera import Camera
from chipglow.camera.exposure import Exposure
from chipglow.camera.measurement import Flag, Measurement
from chipglow.camera.psf import AnnularAperturePSF, GaussianPSF, MeasuredPSF, PointSpreadFunction

__all__ = [
    "AnnularAperturePSF",
    "Camera",
    "Exposure",
    "Flag",
    "GaussianPSF",
    "MeasuredPSF",
    "Measurement",
    "PointSpreadFunction",
]
