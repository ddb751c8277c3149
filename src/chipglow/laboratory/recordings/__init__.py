"""From a file of a camera to a measurement in radiance temperature."""

from chipglow.laboratory.recordings.blackbody_calibration import (
    BlackbodyCalibration as BlackbodyCalibration,
    calibrate_blackbodies as calibrate_blackbodies,
)
from chipglow.laboratory.recordings.calibration_file import (
    CalibrationDescription as CalibrationDescription,
    calibration_text as calibration_text,
    load_calibration as load_calibration,
    write_calibration as write_calibration,
)
from chipglow.laboratory.recordings.calibration_fit import (
    Blackbody as Blackbody,
    CalibrationFit as CalibrationFit,
    fit_calibration as fit_calibration,
)
from chipglow.laboratory.recordings.camera_file import (
    Conversion as Conversion,
    load_measurement as load_measurement,
    load_recording as load_recording,
    measurement_of as measurement_of,
    uniform_counts as uniform_counts,
)
from chipglow.laboratory.recordings.description import (
    MeasurementDescription as MeasurementDescription,
    load_description as load_description,
    measurement_text as measurement_text,
)
from chipglow.laboratory.recordings.frames import (
    CameraFrames as CameraFrames,
    StoredFrames as StoredFrames,
)
from chipglow.laboratory.recordings.radiometric_calibration import (
    ImagePosition as ImagePosition,
    calibrate_recording as calibrate_recording,
    flag_fractions as flag_fractions,
    repaired_signal as repaired_signal,
)
