"""From counts to radiance: calibrations and their fit to blackbodies."""

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

__all__ = [
    "Blackbody",
    "Calibration",
    "CalibrationErrors",
    "CalibrationFit",
    "FittedCalibration",
    "LinearCalibration",
    "MakersCalibration",
    "SakumaHattori",
    "fit_linear",
    "fit_sakuma_hattori",
]
