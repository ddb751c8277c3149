"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.emissivity import (
    EmissivityLine,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    determine_emissivity,
    emissivity_covariance,
    emissivity_line,
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
from chipglow.analysis.regions import Area, Circle, Polygon, Region, areas, shared_pixels
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import NoShearBandError, ShearBand, find_shear_band

__all__ = [
    "PAPER",
    "Area",
    "BandErrors",
    "ChipMetrics",
    "ChipScan",
    "Circle",
    "EmissivityLine",
    "EmissivityMap",
    "ErrorImages",
    "FoundTool",
    "Heating",
    "Inertia",
    "Line",
    "NoShearBandError",
    "Plan",
    "Polygon",
    "RakeErrors",
    "RakeGrid",
    "ReferenceKind",
    "Region",
    "RegionEmissivity",
    "Segmentation",
    "Sensitivity",
    "Setting",
    "ShearBand",
    "StudyResult",
    "analyse",
    "areas",
    "band_errors",
    "chip_metrics",
    "contact_length",
    "determine_emissivity",
    "emissivity_covariance",
    "emissivity_line",
    "error_images",
    "find_shear_band",
    "find_tool",
    "inertia",
    "rake_errors",
    "rake_grid",
    "reference_temperature",
    "sample",
    "segmentation",
    "sensitivity",
    "shared_pixels",
    "straight_line",
]
