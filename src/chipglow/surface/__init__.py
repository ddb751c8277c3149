"""Surfaces: emissivity maps that follow the material."""

from chipglow.surface.emissivity import Emissivity
from chipglow.surface.feature import (
    CHIP_1,
    CHIP_2,
    FeatureField,
    FeatureFields,
    FeatureSurface,
    chip_fraction,
    shear_band_fraction,
)
from chipglow.surface.map import MapField, MapSurface
from chipglow.surface.surface import (
    SURFACES,
    EmissivityField,
    EmissivityStack,
    Surface,
    SurfaceChoice,
    UniformEmissivity,
    UniformSurface,
)
from chipglow.surface.temperature import PhaseEmissivity, TemperatureSurface, TemperatureTable
from chipglow.surface.texture import Texture

__all__ = [
    "CHIP_1",
    "CHIP_2",
    "SURFACES",
    "Emissivity",
    "EmissivityField",
    "EmissivityStack",
    "FeatureField",
    "FeatureFields",
    "FeatureSurface",
    "MapField",
    "MapSurface",
    "PhaseEmissivity",
    "Surface",
    "SurfaceChoice",
    "TemperatureSurface",
    "TemperatureTable",
    "Texture",
    "UniformEmissivity",
    "UniformSurface",
    "chip_fraction",
    "shear_band_fraction",
]
