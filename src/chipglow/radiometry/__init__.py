"""Radiometry: Planck's law, spectral bands, in-band radiance and radiance temperature."""

from chipglow.radiometry.band import Band
from chipglow.radiometry.object_parameters import ObjectParameters
from chipglow.radiometry.planck import spectral_radiance
from chipglow.radiometry.ratio import RatioThermometer
from chipglow.radiometry.response import TabulatedResponse

__all__ = ["Band", "ObjectParameters", "RatioThermometer", "TabulatedResponse", "spectral_radiance"]
