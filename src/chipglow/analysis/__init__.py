"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.band_profile import BandProfile, Stage, band_profile
from chipglow.analysis.band_ridge import ThermalImage, find_band
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.comparison import (
    BandComparison,
    Comparison,
    Doubts,
    Fit,
    GridComparison,
    PlaceResult,
    Reading,
    compare,
    normalised_error,
)
from chipglow.analysis.error import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.find_tool import FoundTool, find_tool
from chipglow.analysis.inertia import Inertia, inertia
from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.analysis.paper import PAPER, Plan, StudyResult, analyse
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.rake_grid import RakeGrid, rake_grid
from chipglow.analysis.ridge import NoShearBandError
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import ShearBand, find_shear_band

__all__ = [
    "PAPER",
    "BandComparison",
    "BandErrors",
    "BandProfile",
    "ChipMetrics",
    "ChipScan",
    "Comparison",
    "Doubts",
    "ErrorImages",
    "Fit",
    "FoundTool",
    "GridComparison",
    "Inertia",
    "Line",
    "NoShearBandError",
    "PlaceResult",
    "Plan",
    "RakeErrors",
    "RakeGrid",
    "Reading",
    "ReferenceKind",
    "Segmentation",
    "Sensitivity",
    "Setting",
    "ShearBand",
    "Stage",
    "StudyResult",
    "ThermalImage",
    "analyse",
    "band_errors",
    "band_profile",
    "chip_metrics",
    "compare",
    "contact_length",
    "error_images",
    "find_band",
    "find_shear_band",
    "find_tool",
    "inertia",
    "normalised_error",
    "rake_errors",
    "rake_grid",
    "reference_temperature",
    "sample",
    "segmentation",
    "sensitivity",
    "straight_line",
]
