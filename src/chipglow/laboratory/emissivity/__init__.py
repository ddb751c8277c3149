"""Emissivity from images of heated objects, and true temperatures by it."""

from chipglow.laboratory.emissivity.emissivity import (
    AreaEmissivity,
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
    MeasuredArea,
    MeasuredEmissivity,
    read_emissivity_map,
    read_measured_areas,
    read_region_emissivity,
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
    KnownEmissivity,
    ReflectedTemperature,
    RegionTemperatures,
    TrueTemperature,
    true_temperature,
    true_temperatures,
)

__all__ = [
    "AreaEmissivity",
    "EmissivityLine",
    "EmissivityMap",
    "EmissivityMapFile",
    "Heating",
    "KnownEmissivity",
    "MeasuredArea",
    "MeasuredEmissivity",
    "ReflectedTemperature",
    "RegionEmissivities",
    "RegionEmissivity",
    "RegionSection",
    "RegionTemperatures",
    "TrueTemperature",
    "determine_emissivities",
    "determine_emissivity",
    "emissivity_covariance",
    "emissivity_line",
    "load_regions",
    "measured_features",
    "measured_text",
    "read_emissivity_map",
    "read_measured_areas",
    "read_region_emissivity",
    "surface_text",
    "true_temperature",
    "true_temperatures",
    "write_emissivity",
]
