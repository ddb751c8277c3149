"""From counts to radiance: calibrations and their fit to blackbodies."""

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

__all__ = [
    "MODELS",
    "Blackbody",
    "Calibration",
    "CalibrationErrors",
    "CalibrationFit",
    "FactoryCalibration",
    "FittedCalibration",
    "LinearCalibration",
    "SakumaHattori",
    "fit_linear",
    "fit_models",
    "fit_sakuma_hattori",
    "preferred",
]
