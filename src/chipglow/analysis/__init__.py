"""Analysis: errors of the measurement, the rake face, the shear band and the segments."""

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.chip import ChipMetrics, ChipScan, chip_metrics
from chipglow.analysis.edge_image import EdgeImage, edge_image
from chipglow.analysis.edge_line import EdgeLine, NoEdgeError, find_edge
from chipglow.analysis.error import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.inertia import Inertia, inertia
from chipglow.analysis.knife_edge import EdgeResult, KnifeEdge, knife_edge
from chipglow.analysis.lines import Line, sample, straight_line
from chipglow.analysis.paper import PAPER, Plan, StudyResult, analyse
from chipglow.analysis.psf_fit import ModelFit
from chipglow.analysis.radial_psf import RadialPSF
from chipglow.analysis.rake import RakeErrors, contact_length, rake_errors
from chipglow.analysis.segmentation import Segmentation, segmentation
from chipglow.analysis.sensitivity import Sensitivity, Setting, sensitivity
from chipglow.analysis.shear_band import NoShearBandError, ShearBand, find_shear_band
from chipglow.analysis.size_of_source import ApertureImage, aperture_image

__all__ = [
    "PAPER",
    "ApertureImage",
    "BandErrors",
    "ChipMetrics",
    "ChipScan",
    "EdgeImage",
    "EdgeLine",
    "EdgeResult",
    "ErrorImages",
    "Inertia",
    "KnifeEdge",
    "Line",
    "ModelFit",
    "NoEdgeError",
    "NoShearBandError",
    "Plan",
    "RadialPSF",
    "RakeErrors",
    "ReferenceKind",
    "Segmentation",
    "Sensitivity",
    "Setting",
    "ShearBand",
    "StudyResult",
    "analyse",
    "aperture_image",
    "band_errors",
    "chip_metrics",
    "contact_length",
    "edge_image",
    "error_images",
    "find_edge",
    "find_shear_band",
    "inertia",
    "knife_edge",
    "rake_errors",
    "reference_temperature",
    "sample",
    "segmentation",
    "sensitivity",
    "straight_line",
]
