"""Radiometry: Planck's law, spectral bands, in-band radiance and radiance temperature."""

from chipglow.radiometry.band import Band
from chipglow.radiometry.object_parameters import ObjectParameters
from chipglow.radiometry.planck import spectral_radiance
from chipglow.radiometry.response import TabulatedResponse

__all__ = [
    "Band",
    "ObjectParameters",
    "TabulatedResponse",
    "spectral_radiance",
]
