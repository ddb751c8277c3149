"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.band_profile import BandProfile, Stage, band_profile
from chipglow.analysis.band_ridge import ThermalImage, find_band
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.comparison import (
    BandComparison,
    Comparison,
    Fit,
    GridComparison,
    PlaceResult,
    StatedUncertainties,
    compare,
    normalised_error,
    reading,
)
from chipglow.analysis.distribution import Cause, Distribution
from chipglow.analysis.dots import DotFit, Dots, find_dots, fit_dots
from chipglow.analysis.draws import Draws, Headline, LineDraws
from chipglow.analysis.edge_image import EdgeImage, counts_image, edge_image
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
from chipglow.analysis.heated import HeatedObject, HeatedRow
from chipglow.analysis.inertia import Inertia, inertia
from chipglow.analysis.knife_edge import EdgeResult, KnifeEdge, knife_edge
from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.analysis.local_error import LocalError
from chipglow.analysis.mutual_information import ImageFit, fit_images
from chipglow.analysis.paper import PAPER, Plan, StudyResult, analyse
from chipglow.analysis.places import LinePlace, Place, PointPlace, RegionPlace
from chipglow.analysis.psf_fit import ModelFit
from chipglow.analysis.radial_psf import RadialPSF
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.rake_grid import RakeGrid, rake_grid
from chipglow.analysis.regions import Area, Circle, Polygon, Region, areas, shared_pixels
from chipglow.analysis.registration import PointFit, Registration, fit_points
from chipglow.analysis.ridge import NoShearBandError
from chipglow.analysis.scene_error import SceneErrors, ScenePlan, scene_errors
from chipglow.analysis.segment import Instant, Segment
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, sensitivity
from chipglow.analysis.shear_band import ShearBand, find_shear_band
from chipglow.analysis.size_of_source import ApertureImage, aperture_image
from chipglow.analysis.temperature import (
    KnownEmissivity,
    Surroundings,
    TrueTemperature,
    true_temperature,
)
from chipglow.analysis.time_alignment import TimeAlignment, align_times, simultaneous_frames
from chipglow.analysis.tool_position import ToolUncertainty

__all__ = [
    "PAPER",
    "ApertureImage",
    "Area",
    "BandComparison",
    "BandErrors",
    "BandProfile",
    "Cause",
    "ChipMetrics",
    "ChipScan",
    "Circle",
    "Comparison",
    "Distribution",
    "DotFit",
    "Dots",
    "Draws",
    "EdgeImage",
    "EdgeLine",
    "EdgeResult",
    "EmissivityLine",
    "EmissivityMap",
    "ErrorImages",
    "Fit",
    "FoundTool",
    "GridComparison",
    "Headline",
    "HeatedObject",
    "HeatedRow",
    "Heating",
    "ImageFit",
    "Inertia",
    "Instant",
    "KnifeEdge",
    "KnownEmissivity",
    "Line",
    "LineDraws",
    "LinePlace",
    "LocalError",
    "ModelFit",
    "NoEdgeError",
    "NoShearBandError",
    "Place",
    "PlaceResult",
    "Plan",
    "PointFit",
    "PointPlace",
    "Polygon",
    "RadialPSF",
    "RakeErrors",
    "RakeGrid",
    "ReferenceKind",
    "Region",
    "RegionEmissivity",
    "RegionPlace",
    "Registration",
    "SceneErrors",
    "ScenePlan",
    "Segment",
    "Segmentation",
    "Sensitivity",
    "ShearBand",
    "Stage",
    "StatedUncertainties",
    "StudyResult",
    "Surroundings",
    "ThermalImage",
    "TimeAlignment",
    "ToolUncertainty",
    "TrueTemperature",
    "align_times",
    "analyse",
    "aperture_image",
    "areas",
    "band_errors",
    "band_profile",
    "chip_metrics",
    "compare",
    "contact_length",
    "counts_image",
    "determine_emissivity",
    "edge_image",
    "emissivity_covariance",
    "emissivity_line",
    "error_images",
    "find_band",
    "find_dots",
    "find_edge",
    "find_shear_band",
    "find_tool",
    "fit_dots",
    "fit_images",
    "fit_points",
    "inertia",
    "knife_edge",
    "normalised_error",
    "rake_errors",
    "rake_grid",
    "reading",
    "reference_temperature",
    "sample",
    "scene_errors",
    "segmentation",
    "sensitivity",
    "shared_pixels",
    "simultaneous_frames",
    "straight_line",
    "true_temperature",
]
