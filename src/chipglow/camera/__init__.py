"""Cameras, virtual and real: optics, exposure, calibration, and the measurement that comes out."""

from chipglow.camera.calibration.blackbody import Blackbody
from chipglow.camera.calibration.calibration import (
    Calibration,
    FactoryCalibration,
    FittedCalibration,
    LinearCalibration,
    SakumaHattori,
)
from chipglow.camera.calibration.errors import CalibrationErrors
from chipglow.camera.calibration.fit import (
    MODELS,
    CalibrationFit,
    fit_linear,
    fit_models,
    fit_sakuma_hattori,
    preferred,
)
from chipglow.camera.camera import Camera
from chipglow.camera.detector.bad_pixels import (
    LEAST_FRAMES,
    BadPixels,
    find_bad_pixels,
    replace_bad_pixels,
)
from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.nonuniformity import NonUniformity
from chipglow.camera.detector.terms import (
    DETECTOR_TERMS,
    DeadElements,
    DetectorTerm,
    FixedPattern,
    ReadNoise,
    ShotNoise,
)
from chipglow.camera.exposure import Exposure, expose, expose_all, frame_weights
from chipglow.camera.measurement import UNUSABLE, Flag, Measurement
from chipglow.camera.optics.blurs import (
    BLURS,
    BlurredPSF,
    BlurTerm,
    ChargeDiffusion,
    Jitter,
    LinearMotion,
    Vibration,
)
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
from chipglow.camera.optics.pupil import Pupil, PupilPSF
from chipglow.camera.optics.terms import (
    OPTICS_TERMS,
    Distortion,
    FieldBlur,
    Narcissus,
    OpticalElement,
    OpticsTerm,
    Veil,
)
from chipglow.camera.recording import PlanckConversion, Recording
from chipglow.camera.warning import ChipglowWarning

__all__ = [
    "BLURS",
    "DETECTOR_TERMS",
    "LEAST_FRAMES",
    "MODELS",
    "OPTICS_TERMS",
    "PSFS",
    "UNUSABLE",
    "AiryAperture",
    "AnnularAperturePSF",
    "BadPixels",
    "Blackbody",
    "BlurTerm",
    "BlurredPSF",
    "Calibration",
    "CalibrationErrors",
    "CalibrationFit",
    "Camera",
    "ChargeDiffusion",
    "ChipglowWarning",
    "DeadElements",
    "Detector",
    "DetectorTerm",
    "Distortion",
    "Exposure",
    "FactoryCalibration",
    "FieldBlur",
    "FittedCalibration",
    "FixedPattern",
    "Flag",
    "GaussianPSF",
    "Jitter",
    "LinearCalibration",
    "LinearMotion",
    "MeasuredPSF",
    "MeasuredPSFFile",
    "Measurement",
    "Narcissus",
    "NonUniformity",
    "OpticalElement",
    "OpticsTerm",
    "PSFChoice",
    "PlanckConversion",
    "PointSpreadFunction",
    "Pupil",
    "PupilPSF",
    "ReadNoise",
    "Recording",
    "SakumaHattori",
    "ShotNoise",
    "Veil",
    "Vibration",
    "blur",
    "expose",
    "expose_all",
    "find_bad_pixels",
    "fit_linear",
    "fit_models",
    "fit_sakuma_hattori",
    "frame_weights",
    "preferred",
    "replace_bad_pixels",
]
