"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.edge_image import EdgeImage, edge_image
from chipglow.analysis.edge_line import EdgeLine, NoEdgeError, find_edge
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
from chipglow.analysis.knife_edge import EdgeResult, KnifeEdge, knife_edge
from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.analysis.paper import PAPER, Plan, StudyResult, analyse
from chipglow.analysis.psf_fit import ModelFit
from chipglow.analysis.radial_psf import RadialPSF
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.rake_grid import RakeGrid, rake_grid
from chipglow.analysis.regions import Area, Circle, Polygon, Region, areas, shared_pixels
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import NoShearBandError, ShearBand, find_shear_band
from chipglow.analysis.size_of_source import ApertureImage, aperture_image
from chipglow.analysis.temperature import (
    KnownEmissivity,
    Surroundings,
    TrueTemperature,
    true_temperature,
)

__all__ = [
    "PAPER",
    "ApertureImage",
    "Area",
    "BandErrors",
    "ChipMetrics",
    "ChipScan",
    "Circle",
    "EdgeImage",
    "EdgeLine",
    "EdgeResult",
    "EmissivityLine",
    "EmissivityMap",
    "ErrorImages",
    "FoundTool",
    "Heating",
    "Inertia",
    "KnifeEdge",
    "KnownEmissivity",
    "Line",
    "ModelFit",
    "NoEdgeError",
    "NoShearBandError",
    "Plan",
    "Polygon",
    "RadialPSF",
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
    "Surroundings",
    "TrueTemperature",
    "analyse",
    "aperture_image",
    "areas",
    "band_errors",
    "chip_metrics",
    "contact_length",
    "determine_emissivity",
    "edge_image",
    "emissivity_covariance",
    "emissivity_line",
    "error_images",
    "find_edge",
    "find_shear_band",
    "find_tool",
    "inertia",
    "knife_edge",
    "rake_errors",
    "rake_grid",
    "reference_temperature",
    "sample",
    "segmentation",
    "sensitivity",
    "shared_pixels",
    "straight_line",
    "true_temperature",
]
