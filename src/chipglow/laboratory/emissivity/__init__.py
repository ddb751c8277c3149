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
    StoredEmissivity,
    read_emissivity_map,
    read_region_emissivity,
    write_emissivity,
    write_emissivity_table,
    write_temperature_table,
)
from chipglow.laboratory.emissivity.heated import HeatedObject, HeatedRow
from chipglow.laboratory.emissivity.regions import RegionSection, load_regions
from chipglow.laboratory.emissivity.study_sections import surface_text
from chipglow.laboratory.emissivity.temperature import (
    KnownEmissivity,
    ReflectedTemperature,
    TrueTemperature,
    true_temperature,
)

__all__ = [
    "EmissivityLine",
    "EmissivityMap",
    "EmissivityMapFile",
    "HeatedObject",
    "HeatedRow",
    "Heating",
    "KnownEmissivity",
    "ReflectedTemperature",
    "RegionEmissivity",
    "RegionSection",
    "StoredEmissivity",
    "TrueTemperature",
    "determine_emissivity",
    "emissivity_covariance",
    "emissivity_line",
    "load_regions",
    "read_emissivity_map",
    "read_region_emissivity",
    "surface_text",
    "true_temperature",
    "write_emissivity",
    "write_emissivity_table",
    "write_temperature_table",
]
