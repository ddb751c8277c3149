"""Surfaces: emissivity maps that follow the material."""

from chipglow.surface.cross_section import SideElements
from chipglow.surface.directional import DIRECTIONS, Direction, Fresnel
from chipglow.surface.emissivity import Emissivity
from chipglow.surface.exchange import Exchange
from chipglow.surface.feature import (
    CHIP_1,
    CHIP_2,
    EmissivityStack,
    Features,
    FeatureSurface,
    FeatureTrends,
    chip_fraction,
    feature_fractions,
    shear_band_fraction,
)
from chipglow.surface.map import MapSurface
from chipglow.surface.oxide import OXIDES, Oxide, OxideHistory, ParabolicOxide
from chipglow.surface.side_flow import REFLECTIONS, SideShape, Wedge
from chipglow.surface.spectral import (
    SPECTRA,
    Dispersion,
    HagenRubens,
    SpectralSurface,
    SpectralTable,
)
from chipglow.surface.surface import (
    MODIFIERS,
    SURFACES,
    Change,
    EmissivityField,
    ModifiedSurface,
    Modifier,
    Surface,
)
from chipglow.surface.temperature import (
    EmissivityTrend,
    HomogeneousSurface,
    PhaseSurface,
    TemperatureSurface,
    TrendSurface,
    UniformSurface,
)
from chipglow.surface.texture import Texture

__all__ = [
    "CHIP_1",
    "CHIP_2",
    "DIRECTIONS",
    "MODIFIERS",
    "OXIDES",
    "REFLECTIONS",
    "SPECTRA",
    "SURFACES",
    "Change",
    "Direction",
    "Dispersion",
    "Emissivity",
    "EmissivityField",
    "EmissivityStack",
    "EmissivityTrend",
    "Exchange",
    "FeatureSurface",
    "FeatureTrends",
    "Features",
    "Fresnel",
    "HagenRubens",
    "HomogeneousSurface",
    "MapSurface",
    "ModifiedSurface",
    "Modifier",
    "Oxide",
    "OxideHistory",
    "ParabolicOxide",
    "PhaseSurface",
    "SideElements",
    "SideShape",
    "SpectralSurface",
    "SpectralTable",
    "Surface",
    "TemperatureSurface",
    "Texture",
    "TrendSurface",
    "UniformSurface",
    "Wedge",
    "chip_fraction",
    "feature_fractions",
    "shear_band_fraction",
]
