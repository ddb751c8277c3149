"""From a file of a camera to a measurement in radiance temperature."""

from chipglow.laboratory.measurement.blackbody_calibration import (
    BlackbodyCalibration,
    calibrate_blackbodies,
)
from chipglow.laboratory.measurement.calibration_file import (
    CalibrationDescription,
    calibration_text,
    load_calibration,
    write_calibration,
)
from chipglow.laboratory.measurement.camera_file import (
    load_measurement,
    load_recording,
    measurement_of,
    pixel_correction,
    uniform_counts,
)
from chipglow.laboratory.measurement.description import (
    MeasurementDescription,
    load_description,
    measurement_text,
)
from chipglow.laboratory.measurement.radiometric_calibration import (
    ImagePosition,
    calibrate_recording,
    flag_fractions,
    repaired_signal,
)
from chipglow.laboratory.measurement.summary import MeasurementSummary, measurement_summary

__all__ = [
    "BlackbodyCalibration",
    "CalibrationDescription",
    "ImagePosition",
    "MeasurementDescription",
    "MeasurementSummary",
    "calibrate_blackbodies",
    "calibrate_recording",
    "calibration_text",
    "flag_fractions",
    "load_calibration",
    "load_description",
    "load_measurement",
    "load_recording",
    "measurement_of",
    "measurement_summary",
    "measurement_text",
    "pixel_correction",
    "repaired_signal",
    "uniform_counts",
    "write_calibration",
]
