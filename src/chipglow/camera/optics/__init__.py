"""Effects of the optics and the detector elements on a radiance image."""

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

__all__ = [
    "BLURS",
    "OPTICS_TERMS",
    "PSFS",
    "AiryAperture",
    "AnnularAperturePSF",
    "BlurTerm",
    "BlurredPSF",
    "ChargeDiffusion",
    "Distortion",
    "FieldBlur",
    "GaussianPSF",
    "Jitter",
    "LinearMotion",
    "MeasuredPSF",
    "MeasuredPSFFile",
    "Narcissus",
    "OpticalElement",
    "OpticsTerm",
    "PSFChoice",
    "PointSpreadFunction",
    "Pupil",
    "PupilPSF",
    "Veil",
    "Vibration",
    "blur",
]
