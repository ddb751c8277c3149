"""Radiometry: Planck's law, spectral bands, in-band radiance and radiance temperature."""

from chipglow.radiometry.band import Band, TabulatedResponse, spectral_radiance
from chipglow.radiometry.object_parameters import ObjectParameters, blackbody_radiance
from chipglow.radiometry.ratio import RatioThermometer

__all__ = [
    "Band",
    "ObjectParameters",
    "RatioThermometer",
    "TabulatedResponse",
    "blackbody_radiance",
    "spectral_radiance",
]
