"""What the detector adds: noise, conversion to counts, non-uniformity, bad pixels."""

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

__all__ = [
    "DETECTOR_TERMS",
    "LEAST_FRAMES",
    "BadPixels",
    "DeadElements",
    "Detector",
    "DetectorTerm",
    "FixedPattern",
    "NonUniformity",
    "ReadNoise",
    "ShotNoise",
    "find_bad_pixels",
    "replace_bad_pixels",
]
