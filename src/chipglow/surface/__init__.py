"""Surfaces: emissivity maps that follow the material."""

from chipglow.surface.directional import (
    DIRECTIONS,
    Direction,
    DirectionalField,
    DirectionalSurface,
    Fresnel,
)
from chipglow.surface.dispersive import DispersiveField, DispersiveSurface
from chipglow.surface.emissivity import Emissivity
from chipglow.surface.exchange import Exchange
from chipglow.surface.feature import (
    CHIP_1,
    CHIP_2,
    FeatureField,
    FeatureFields,
    FeatureSurface,
    chip_fraction,
    shear_band_fraction,
)
from chipglow.surface.line import (
    EmissivityTrend,
    FeatureTrends,
    FeatureTrendsField,
    TrendSurface,
)
from chipglow.surface.map import MapField, MapSurface
from chipglow.surface.oxide import (
    OXIDES,
    Oxide,
    OxideHistory,
    OxidisedField,
    OxidisedSurface,
    ParabolicOxide,
)
from chipglow.surface.reflecting import ReflectingField, ReflectingSurface
from chipglow.surface.side_flow import REFLECTIONS, SideElements, SideShape, Wedge
from chipglow.surface.spectral import SPECTRA, HagenRubens, SpectralSurface, SpectralTable
from chipglow.surface.surface import (
    SURFACES,
    EmissivityField,
    EmissivityStack,
    Surface,
    SurfaceChoice,
    UniformEmissivity,
    UniformSurface,
    WrappedSurface,
)
from chipglow.surface.temperature import PhaseEmissivity, TemperatureSurface, TemperatureTable
from chipglow.surface.texture import Texture

__all__ = [
    "CHIP_1",
    "CHIP_2",
    "DIRECTIONS",
    "OXIDES",
    "REFLECTIONS",
    "SPECTRA",
    "SURFACES",
    "Direction",
    "DirectionalField",
    "DirectionalSurface",
    "DispersiveField",
    "DispersiveSurface",
    "Emissivity",
    "EmissivityField",
    "EmissivityStack",
    "EmissivityTrend",
    "Exchange",
    "FeatureField",
    "FeatureFields",
    "FeatureSurface",
    "FeatureTrends",
    "FeatureTrendsField",
    "Fresnel",
    "HagenRubens",
    "MapField",
    "MapSurface",
    "Oxide",
    "OxideHistory",
    "OxidisedField",
    "OxidisedSurface",
    "ParabolicOxide",
    "PhaseEmissivity",
    "ReflectingField",
    "ReflectingSurface",
    "SideElements",
    "SideShape",
    "SpectralSurface",
    "SpectralTable",
    "Surface",
    "SurfaceChoice",
    "TemperatureSurface",
    "TemperatureTable",
    "Texture",
    "TrendSurface",
    "UniformEmissivity",
    "UniformSurface",
    "Wedge",
    "WrappedSurface",
    "chip_fraction",
    "shear_band_fraction",
]
