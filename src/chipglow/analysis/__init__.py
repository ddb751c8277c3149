"""The virtual camera's error against its scene: images, places, distributions, causes."""

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
from chipglow.analysis.places import LinePlace, Place, PointPlace, RegionPlace
from chipglow.analysis.rake_error import RakeErrors, rake_errors
from chipglow.analysis.ratio_error import RATIO_CAUSES, RatioErrors, ratio_errors
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
    "BandErrors",
    "Distribution",
    "Draws",
    "ErrorImages",
    "ErrorParts",
    "Headline",
    "LineDraws",
    "LinePlace",
    "LocalError",
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
    "band_errors",
    "cut_spots",
    "error_images",
    "error_parts",
    "point_spots",
    "rake_errors",
    "ratio_errors",
    "reference_temperature",
    "scene_errors",
    "sensitivity",
    "wavelength_errors",
]
