"""The virtual camera's error against its scene: images, places, distributions, causes."""

from chipglow.errors.band_error import BandErrors, band_errors
from chipglow.errors.cut_error import Plan, StudyResult, analyse
from chipglow.errors.distribution import Distribution, VarianceComponent
from chipglow.errors.draws import Draws, Headline, LineDraws
from chipglow.errors.error_images import (
    ErrorImages,
    ReferenceKind,
    error_images,
    reference_temperature,
)
from chipglow.errors.error_parts import ErrorParts, error_parts
from chipglow.errors.local_error import LocalError
from chipglow.errors.places import LinePlace, Place, PointPlace, RegionPlace
from chipglow.errors.rake_error import RakeErrors, rake_errors
from chipglow.errors.scene_error import SceneErrors, ScenePlan, scene_errors
from chipglow.errors.sensitivity import Sensitivity, sensitivity

__all__ = [
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
    "ReferenceKind",
    "RegionPlace",
    "SceneErrors",
    "ScenePlan",
    "Sensitivity",
    "StudyResult",
    "VarianceComponent",
    "analyse",
    "band_errors",
    "error_images",
    "error_parts",
    "rake_errors",
    "reference_temperature",
    "scene_errors",
    "sensitivity",
]
