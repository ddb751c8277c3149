"""Effects of the detector: electrons, noise, counts, non-uniformity, bad pixels, and its range."""

from chipglow.camera.detector.bad_pixels import (
    LEAST_FRAMES,
    BadPixels,
    find_bad_pixels,
    replace_bad_pixels,
)
from chipglow.camera.detector.detector import Detector
from chipglow.camera.detector.flat_field import (
    FlatFieldCalibration,
    flat_field_calibration,
    lower_range_limit,
)
from chipglow.camera.detector.nonuniformity import NonUniformity
from chipglow.camera.detector.response import (
    RESPONSES,
    DetectorResponse,
    EnergyResponse,
    OperationPoint,
    PhotonResponse,
    RangeResponse,
)
from chipglow.camera.detector.terms import (
    DETECTOR_TERMS,
    ColumnNoise,
    DarkCurrent,
    DeadElements,
    DetectorTerm,
    EquivalentNoise,
    FlickerNoise,
    GainPattern,
    Lag,
    NonLinearity,
    OffsetPattern,
    ReadNoise,
    Readout,
    ShotNoise,
    Stage,
)

__all__ = [
    "DETECTOR_TERMS",
    "LEAST_FRAMES",
    "RESPONSES",
    "BadPixels",
    "ColumnNoise",
    "DarkCurrent",
    "DeadElements",
    "Detector",
    "DetectorResponse",
    "DetectorTerm",
    "EnergyResponse",
    "EquivalentNoise",
    "FlatFieldCalibration",
    "FlickerNoise",
    "GainPattern",
    "Lag",
    "NonLinearity",
    "NonUniformity",
    "OffsetPattern",
    "OperationPoint",
    "PhotonResponse",
    "RangeResponse",
    "ReadNoise",
    "Readout",
    "ShotNoise",
    "Stage",
    "find_bad_pixels",
    "flat_field_calibration",
    "lower_range_limit",
    "replace_bad_pixels",
]
