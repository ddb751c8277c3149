"""Studies: what to cut, look at and analyse, as a YAML file or in Python."""

from chipglow.study.cache import CachedScene, cache_folder, cached_scenes, clear_cache
from chipglow.study.cost import Cost, expected_cost
from chipglow.study.files import load_study, study_text
from chipglow.study.fitting import Fitted, fit
from chipglow.study.preview import preview_raster
from chipglow.study.running import (
    CUTTING_STEP,
    Progress,
    cut,
    errors,
    is_cut,
    is_damaged,
    kept_progress,
    run,
    wavelengths,
)
from chipglow.study.schema import Study

__all__ = [
    "CUTTING_STEP",
    "CachedScene",
    "Cost",
    "Fitted",
    "Progress",
    "Study",
    "cache_folder",
    "cached_scenes",
    "clear_cache",
    "cut",
    "errors",
    "expected_cost",
    "fit",
    "is_cut",
    "is_damaged",
    "kept_progress",
    "load_study",
    "preview_raster",
    "run",
    "study_text",
    "wavelengths",
]
