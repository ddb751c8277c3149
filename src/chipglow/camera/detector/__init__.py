"""What the detector adds: noise, conversion to counts, non-uniformity, bad pixels."""

from chipglow.camera.detector.bad_pixels import (
    LEAST_FRAMES,
    BadPixels,
    find_bad_pixels,
    replace_bad_pixels,
)
from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.nonuniformity import NonUniformity

__all__ = [
    "LEAST_FRAMES",
    "BadPixels",
    "Detector",
    "NonUniformity",
    "find_bad_pixels",
    "replace_bad_pixels",
]
