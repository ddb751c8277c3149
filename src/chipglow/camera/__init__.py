"""Cameras, virtual and real: optics, exposure, calibration, and the measurement that comes out."""

from chipglow.camera.calibration.blackbody import Blackbody
from chipglow.camera.calibration.calibration import (
    Calibration,
    FittedCalibration,
    LinearCalibration,
    MakersCalibration,
    SakumaHattori,
)
from chipglow.camera.calibration.errors import CalibrationErrors
from chipglow.camera.calibration.fit import CalibrationFit, fit_linear, fit_sakuma_hattori
from chipglow.camera.camera import Camera
from chipglow.camera.detector.bad_pixels import (
    LEAST_FRAMES,
    BadPixels,
    find_bad_pixels,
    replace_bad_pixels,
)
from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.nonuniformity import NonUniformity
from chipglow.camera.exposure import Exposure, expose, expose_all, frame_weights
from chipglow.camera.measurement import UNUSABLE, Flag, Measurement
from chipglow.camera.optics.convolution import blur
from chipglow.camera.optics.psf import (
    AnnularAperturePSF,
    GaussianPSF,
    MeasuredPSF,
    PointSpreadFunction,
)
from chipglow.camera.recording import PlanckConversion, Recording
from chipglow.camera.warning import ChipglowWarning

__all__ = [
    "LEAST_FRAMES",
    "UNUSABLE",
    "AnnularAperturePSF",
    "BadPixels",
    "Blackbody",
    "Calibration",
    "CalibrationErrors",
    "CalibrationFit",
    "Camera",
    "ChipglowWarning",
    "Detector",
    "Exposure",
    "FittedCalibration",
    "Flag",
    "GaussianPSF",
    "LinearCalibration",
    "MakersCalibration",
    "MeasuredPSF",
    "Measurement",
    "NonUniformity",
    "PlanckConversion",
    "PointSpreadFunction",
    "Recording",
    "SakumaHattori",
    "blur",
    "expose",
    "expose_all",
    "find_bad_pixels",
    "fit_linear",
    "fit_sakuma_hattori",
    "frame_weights",
    "replace_bad_pixels",
]
