"""The virtual camera's error against its scene: images, places, distributions, causes."""

from chipglow.analysis.cut import lacking, spread_starts
from chipglow.analysis.distribution import Distribution, VarianceComponent
from chipglow.analysis.engine import analyse
from chipglow.analysis.error_images import (
    ErrorImages,
    Unblurred,
    error_images,
    reference_temperature,
)
from chipglow.analysis.error_parts import ErrorParts, error_parts
from chipglow.analysis.looks import CASES, Effect, pixel_phases
from chipglow.analysis.places import (
    BandPlace,
    HottestPlace,
    LinePlace,
    Place,
    PointPlace,
    RakePlace,
    RegionPlace,
)
from chipglow.analysis.plan import Plan
from chipglow.analysis.ratio_error import RATIO_CAUSES, RatioErrors, ratio_errors
from chipglow.analysis.reductions import (
    Headline,
    OneDraw,
    headline,
    headlines,
    image_error,
    image_psf_portion,
    line_change,
    line_error,
    line_psf_portion,
    line_steepest,
    one_draw,
    readings_frame,
    sensitivity_error,
    sensitivity_psf_fraction,
    with_errors,
)
from chipglow.analysis.result import Analysis, Cut, CuttingForces
from chipglow.analysis.wavelengths import (
    Spot,
    WavelengthPlan,
    cut_spots,
    point_spots,
    wavelength_errors,
    wavelengths_frame,
)

__all__ = [
    "CASES",
    "RATIO_CAUSES",
    "Analysis",
    "BandPlace",
    "Cut",
    "CuttingForces",
    "Distribution",
    "Effect",
    "ErrorImages",
    "ErrorParts",
    "Headline",
    "HottestPlace",
    "LinePlace",
    "OneDraw",
    "Place",
    "Plan",
    "PointPlace",
    "RakePlace",
    "RatioErrors",
    "RegionPlace",
    "Spot",
    "Unblurred",
    "VarianceComponent",
    "WavelengthPlan",
    "analyse",
    "cut_spots",
    "error_images",
    "error_parts",
    "headline",
    "headlines",
    "image_error",
    "image_psf_portion",
    "lacking",
    "line_change",
    "line_error",
    "line_psf_portion",
    "line_steepest",
    "one_draw",
    "pixel_phases",
    "point_spots",
    "ratio_errors",
    "readings_frame",
    "reference_temperature",
    "sensitivity_error",
    "sensitivity_psf_fraction",
    "spread_starts",
    "wavelength_errors",
    "wavelengths_frame",
    "with_errors",
]
