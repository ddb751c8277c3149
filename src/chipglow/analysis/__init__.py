"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.error import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.find_tool import FoundTool, find_tool
from chipglow.analysis.inertia import Inertia, inertia
from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.analysis.mutual_information import ImageFit, fit_images
from chipglow.analysis.paper import PAPER, Plan, StudyResult, analyse
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.rake_grid import RakeGrid, rake_grid
from chipglow.analysis.registration import PointFit, Registration, fit_points
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import NoShearBandError, ShearBand, find_shear_band
from chipglow.analysis.time_alignment import TimeAlignment, align_times, simultaneous_frames

__all__ = [
    "PAPER",
    "BandErrors",
    "ChipMetrics",
    "ChipScan",
    "ErrorImages",
    "FoundTool",
    "ImageFit",
    "Inertia",
    "Line",
    "NoShearBandError",
    "Plan",
    "PointFit",
    "RakeErrors",
    "RakeGrid",
    "ReferenceKind",
    "Registration",
    "Segmentation",
    "Sensitivity",
    "Setting",
    "ShearBand",
    "StudyResult",
    "TimeAlignment",
    "align_times",
    "analyse",
    "band_errors",
    "chip_metrics",
    "contact_length",
    "error_images",
    "find_shear_band",
    "find_tool",
    "fit_images",
    "fit_points",
    "inertia",
    "rake_errors",
    "rake_grid",
    "reference_temperature",
    "sample",
    "segmentation",
    "sensitivity",
    "simultaneous_frames",
    "straight_line",
]
