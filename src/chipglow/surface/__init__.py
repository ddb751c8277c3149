"""Surfaces: emissivity maps that follow the material."""

from chipglow.surface.directional import (
    DIRECTIONS as DIRECTIONS,
    Direction as Direction,
    Fresnel as Fresnel,
)
from chipglow.surface.exchange import Exchange as Exchange
from chipglow.surface.feature import (
    CHIP_1 as CHIP_1,
    CHIP_2 as CHIP_2,
    PAPER_ORIGIN as PAPER_ORIGIN,
    EmissivityStack as EmissivityStack,
    Features as Features,
    FeatureSettings as FeatureSettings,
    FeatureSurface as FeatureSurface,
    FeatureTrends as FeatureTrends,
    chip_fraction as chip_fraction,
    feature_fractions as feature_fractions,
    shear_band_fraction as shear_band_fraction,
)
from chipglow.surface.map import MapSurface as MapSurface
from chipglow.surface.oxide import (
    OXIDES as OXIDES,
    Oxide as Oxide,
    OxideHistory as OxideHistory,
    ParabolicOxide as ParabolicOxide,
)
from chipglow.surface.side_flow import (
    REFLECTIONS as REFLECTIONS,
    SideElements as SideElements,
    SideShape as SideShape,
    Wedge as Wedge,
)
from chipglow.surface.spectral import (
    SPECTRA as SPECTRA,
    Dispersion as Dispersion,
    HagenRubens as HagenRubens,
    SpectralSurface as SpectralSurface,
    SpectralTable as SpectralTable,
)
from chipglow.surface.surface import (
    MODIFIERS as MODIFIERS,
    SURFACES as SURFACES,
    Change as Change,
    EmissivityField as EmissivityField,
    ModifiedSurface as ModifiedSurface,
    Modifier as Modifier,
    Origin as Origin,
    Surface as Surface,
    bare_surface as bare_surface,
)
from chipglow.surface.temperature import (
    EmissivityTrend as EmissivityTrend,
    HomogeneousSurface as HomogeneousSurface,
    PhaseSurface as PhaseSurface,
    TemperatureSurface as TemperatureSurface,
    TrendSurface as TrendSurface,
    UniformSurface as UniformSurface,
)
from chipglow.surface.texture import Emissivity as Emissivity, Texture as Texture
