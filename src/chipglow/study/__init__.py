"""Studies: what to cut, look at and analyse, as a YAML file or in Python."""

from chipglow.study.cache import CachedScene, cache_folder, cached_scenes, clear_cache
from chipglow.study.calibration_schema import CalibrationDescription
from chipglow.study.cost import Cost, expected_cost
from chipglow.study.emissivity import surface_text
from chipglow.study.files import (
    StudyError,
    load_apertures,
    load_calibration,
    load_description,
    load_import,
    load_regions,
    load_study,
)
from chipglow.study.fitting import Fitted, fit
from chipglow.study.import_schema import ImportDescription
from chipglow.study.measured import (
    UniformObjects,
    load_edge,
    load_measurement,
    load_recording,
    measurement_of,
    uniform_counts,
)
from chipglow.study.measurement_schema import MeasurementDescription
from chipglow.study.preview import preview_raster
from chipglow.study.reference import FieldEntry, field_entries, field_tables
from chipglow.study.registered import load_registration, write_registration
from chipglow.study.running import (
    CUTTING_STEP,
    Progress,
    cut,
    errors,
    is_cut,
    kept_progress,
    run,
)
from chipglow.study.schema import Study
from chipglow.study.template import calibration_text, import_text, measurement_text, study_text
from chipglow.study.tool_description import load_tool, tool_of

__all__ = [
    "CUTTING_STEP",
    "CachedScene",
    "CalibrationDescription",
    "Cost",
    "FieldEntry",
    "Fitted",
    "ImportDescription",
    "MeasurementDescription",
    "Progress",
    "Study",
    "StudyError",
    "UniformObjects",
    "cache_folder",
    "cached_scenes",
    "calibration_text",
    "clear_cache",
    "cut",
    "errors",
    "expected_cost",
    "field_entries",
    "field_tables",
    "fit",
    "import_text",
    "is_cut",
    "kept_progress",
    "load_apertures",
    "load_calibration",
    "load_description",
    "load_edge",
    "load_import",
    "load_measurement",
    "load_recording",
    "load_regions",
    "load_registration",
    "load_study",
    "load_tool",
    "measurement_of",
    "measurement_text",
    "preview_raster",
    "run",
    "study_text",
    "surface_text",
    "tool_of",
    "uniform_counts",
    "write_registration",
]
