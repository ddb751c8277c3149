"""Emissivity from images of heated objects, and true temperatures by it."""

from chipglow.laboratory.emissivity.emissivity import (
    EmissivityLine,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    determine_emissivity,
    emissivity_covariance,
    emissivity_line,
)
from chipglow.laboratory.emissivity.file import (
    EmissivityMapFile,
    MeasuredEmissivity,
    SurfaceFile,
    emissivity_trend,
    read_emissivity_lines,
    read_emissivity_map,
    write_emissivity,
)
from chipglow.laboratory.emissivity.region_emissivities import (
    RegionEmissivities,
    determine_emissivities,
)
from chipglow.laboratory.emissivity.regions import RegionSection, load_regions
from chipglow.laboratory.emissivity.study_sections import (
    measured_features,
    measured_text,
    surface_text,
)
from chipglow.laboratory.emissivity.temperature import (
    ReflectedTemperature,
    RegionTemperatures,
    TrueTemperature,
    true_temperature,
    true_temperatures,
)

__all__ = [
    "EmissivityLine",
    "EmissivityMap",
    "EmissivityMapFile",
    "Heating",
    "MeasuredEmissivity",
    "ReflectedTemperature",
    "RegionEmissivities",
    "RegionEmissivity",
    "RegionSection",
    "RegionTemperatures",
    "SurfaceFile",
    "TrueTemperature",
    "determine_emissivities",
    "determine_emissivity",
    "emissivity_covariance",
    "emissivity_line",
    "emissivity_trend",
    "load_regions",
    "measured_features",
    "measured_text",
    "read_emissivity_lines",
    "read_emissivity_map",
    "surface_text",
    "true_temperature",
    "true_temperatures",
    "write_emissivity",
]
