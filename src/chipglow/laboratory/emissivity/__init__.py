"""Emissivity from images of heated objects, and true temperatures by it."""

from chipglow.laboratory.emissivity.emissivity import (
    LABORATORY as LABORATORY,
    EmissivityLine as EmissivityLine,
    EmissivityMap as EmissivityMap,
    Heating as Heating,
    RegionEmissivity as RegionEmissivity,
    determine_emissivity as determine_emissivity,
    emissivity_covariance as emissivity_covariance,
    emissivity_line as emissivity_line,
)
from chipglow.laboratory.emissivity.file import (
    EmissivityMapFile as EmissivityMapFile,
    MeasuredEmissivity as MeasuredEmissivity,
    StoredEmissivities as StoredEmissivities,
    SurfaceFile as SurfaceFile,
    doubts as doubts,
    emissivity_trend as emissivity_trend,
    measured_features as measured_features,
    measured_text as measured_text,
    read_emissivity_lines as read_emissivity_lines,
    read_emissivity_map as read_emissivity_map,
    read_origin as read_origin,
    surface_text as surface_text,
    write_emissivity as write_emissivity,
)
from chipglow.laboratory.emissivity.places import (
    PlacesDescription as PlacesDescription,
    RegionSection as RegionSection,
    load_places as load_places,
    load_regions as load_regions,
)
from chipglow.laboratory.emissivity.region_emissivities import (
    RegionEmissivities as RegionEmissivities,
    determine_emissivities as determine_emissivities,
)
from chipglow.laboratory.emissivity.temperature import (
    RegionTemperatures as RegionTemperatures,
    TrueTemperature as TrueTemperature,
    reflected_temperature as reflected_temperature,
    true_temperature as true_temperature,
    true_temperatures as true_temperatures,
)
