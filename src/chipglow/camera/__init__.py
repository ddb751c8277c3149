"""Virtual and real cameras: optics, exposure, detector, calibration and measurement."""

from chipglow.camera.agreement import (
    alike as alike,
    check_camera as check_camera,
    check_value as check_value,
    difference_text as difference_text,
)
from chipglow.camera.calibration import (
    MODELS as MODELS,
    Calibration as Calibration,
    CalibrationErrors as CalibrationErrors,
    FactoryCalibration as FactoryCalibration,
    FittedCalibration as FittedCalibration,
    LinearCalibration as LinearCalibration,
    SakumaHattori as SakumaHattori,
)
from chipglow.camera.camera import PAPER_LIMIT as PAPER_LIMIT, Camera as Camera
from chipglow.camera.chain import (
    Chain as Chain,
    ExposedChain as ExposedChain,
    PixelReading as PixelReading,
    read_temperature as read_temperature,
)
from chipglow.camera.description import (
    CameraDescription as CameraDescription,
    CameraSettings as CameraSettings,
)
from chipglow.camera.detector.detector import Detector as Detector
from chipglow.camera.detector.flat_field import (
    FlatFieldCalibration as FlatFieldCalibration,
    flat_field_calibration as flat_field_calibration,
    lower_range_limit as lower_range_limit,
)
from chipglow.camera.detector.pixels import (
    LEAST_FRAMES as LEAST_FRAMES,
    BadPixels as BadPixels,
    NonUniformity as NonUniformity,
    find_bad_pixels as find_bad_pixels,
    replace_bad_pixels as replace_bad_pixels,
)
from chipglow.camera.detector.response import (
    RESPONSES as RESPONSES,
    DetectorResponse as DetectorResponse,
    EnergyResponse as EnergyResponse,
    OperationPoint as OperationPoint,
    PhotonResponse as PhotonResponse,
    RangeResponse as RangeResponse,
)
from chipglow.camera.detector.terms import (
    DETECTOR_TERMS as DETECTOR_TERMS,
    ColumnNoise as ColumnNoise,
    DarkCurrent as DarkCurrent,
    DeadElements as DeadElements,
    DetectorTerm as DetectorTerm,
    EquivalentNoise as EquivalentNoise,
    FlickerNoise as FlickerNoise,
    GainPattern as GainPattern,
    Lag as Lag,
    NonLinearity as NonLinearity,
    OffsetPattern as OffsetPattern,
    ReadNoise as ReadNoise,
    Readout as Readout,
    ShotNoise as ShotNoise,
    Stage as Stage,
)
from chipglow.camera.effect import EVERY as EVERY, Effect as Effect
from chipglow.camera.exposure import (
    Exposure as Exposure,
    SpectralView as SpectralView,
    expose as expose,
    frame_weights as frame_weights,
)
from chipglow.camera.image import image_formation as image_formation
from chipglow.camera.measurement import (
    UNUSABLE as UNUSABLE,
    Flag as Flag,
    Measurement as Measurement,
    range_flags as range_flags,
)
from chipglow.camera.optics.blurs import (
    BLURS as BLURS,
    BlurredPSF as BlurredPSF,
    BlurTerm as BlurTerm,
    ChargeDiffusion as ChargeDiffusion,
    Jitter as Jitter,
    LinearMotion as LinearMotion,
    Vibration as Vibration,
)
from chipglow.camera.optics.convolution import blur as blur
from chipglow.camera.optics.image_formation import ImageFormation as ImageFormation
from chipglow.camera.optics.psf import (
    PSFS as PSFS,
    AiryAperture as AiryAperture,
    AnnularAperturePSF as AnnularAperturePSF,
    GaussianPSF as GaussianPSF,
    MeasuredPSF as MeasuredPSF,
    MeasuredPSFFile as MeasuredPSFFile,
    PointSpreadFunction as PointSpreadFunction,
    PSFChoice as PSFChoice,
)
from chipglow.camera.optics.pupil import Pupil as Pupil, PupilPSF as PupilPSF
from chipglow.camera.optics.terms import (
    OPTICS_TERMS as OPTICS_TERMS,
    Distortion as Distortion,
    FieldBlur as FieldBlur,
    Narcissus as Narcissus,
    OpticalElement as OpticalElement,
    OpticsTerm as OpticsTerm,
    Veil as Veil,
)
from chipglow.camera.recording import PlanckConversion as PlanckConversion, Recording as Recording
from chipglow.camera.reference import (
    ReferenceKind as ReferenceKind,
    reference_temperature as reference_temperature,
)
