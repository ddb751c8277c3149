"""The virtual camera: optics, sampling, exposure, and the measurement that comes out."""

from chipglow.camera.camera import Camera
from chipglow.camera.detector import Detector
from chipglow.camera.exposure import Exposure
from chipglow.camera.measurement import UNUSABLE, Flag, Measurement
from chipglow.camera.psf import AnnularAperturePSF, GaussianPSF, MeasuredPSF, PointSpreadFunction
from chipglow.camera.recording import PlanckConversion, Recording

__all__ = [
    "UNUSABLE",
    "AnnularAperturePSF",
    "Camera",
    "Detector",
    "Exposure",
    "Flag",
    "GaussianPSF",
    "MeasuredPSF",
    "Measurement",
    "PlanckConversion",
    "PointSpreadFunction",
    "Recording",
]
