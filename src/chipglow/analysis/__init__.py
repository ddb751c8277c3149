"""The virtual camera's error against its scene: images, places, distributions, causes."""

from chipglow.analysis.adapter import analysis_of
from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.cut_error import Plan, StudyResult, analyse
from chipglow.analysis.distribution import Distribution, VarianceComponent
from chipglow.analysis.draws import Draws, Headline, LineDraws
from chipglow.analysis.error_images import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.analysis.error_parts import ErrorParts, error_parts
from chipglow.analysis.local_error import LocalError
from chipglow.analysis.old_places import LinePlace, Place, PointPlace, RegionPlace
from chipglow.analysis.rake_error import RakeErrors, rake_errors
from chipglow.analysis.ratio_error import RATIO_CAUSES, RatioErrors, ratio_errors
from chipglow.analysis.reductions import (
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
from chipglow.analysis.scene_error import SceneErrors, ScenePlan, scene_errors
from chipglow.analysis.sensitivity import Sensitivity, sensitivity
from chipglow.analysis.wavelengths import (
    Spot,
    WavelengthError,
    WavelengthErrors,
    WavelengthPlan,
    cut_spots,
    point_spots,
    wavelength_errors,
)

__all__ = [
    "RATIO_CAUSES",
    "Analysis",
    "BandErrors",
    "Cut",
    "CuttingForces",
    "Distribution",
    "Draws",
    "ErrorImages",
    "ErrorParts",
    "Headline",
    "LineDraws",
    "LinePlace",
    "LocalError",
    "OneDraw",
    "Place",
    "Plan",
    "PointPlace",
    "RakeErrors",
    "RatioErrors",
    "ReferenceKind",
    "RegionPlace",
    "SceneErrors",
    "ScenePlan",
    "Sensitivity",
    "Spot",
    "StudyResult",
    "VarianceComponent",
    "WavelengthError",
    "WavelengthErrors",
    "WavelengthPlan",
    "analyse",
    "analysis_of",
    "band_errors",
    "cut_spots",
    "error_images",
    "error_parts",
    "headline",
    "headlines",
    "image_error",
    "image_psf_portion",
    "line_change",
    "line_error",
    "line_psf_portion",
    "line_steepest",
    "one_draw",
    "point_spots",
    "rake_errors",
    "ratio_errors",
    "readings_frame",
    "reference_temperature",
    "scene_errors",
    "sensitivity",
    "sensitivity_error",
    "sensitivity_psf_fraction",
    "wavelength_errors",
    "with_errors",
]
