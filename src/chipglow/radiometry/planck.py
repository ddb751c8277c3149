"""Planck's law: spectral radiance of a blackbody."""

from typing import Final

import numpy as np

from chipglow.quantities import Array

FIRST_RADIATION_CONSTANT: Final = 1.191042972397188e-16
"""c1L = 2hc² in W m²/sr (CODATA 2018); the paper's 1.191e-4 W µm² is this, rounded."""

SECOND_RADIATION_CONSTANT: Final = 1.438776877503933e-2
"""c2 = hc/k in m K (CODATA 2018); the paper's 14387.752 µm K."""


def spectral_radiance(wavelength: Array, temperature: Array) -> Array:
    """Return the spectral radiance of a blackbody in W/(m² sr m): the integrand of Equation 1.

    Wavelengths in m and temperatures in K are positive and are broadcast against each other.
    """
    exponent = SECOND_RADIATION_CONSTANT / (wavelength * temperature)
    # exp(-x) / (1 - exp(-x)) is 1 / (exp(x) - 1) without overflow at large x.
    occupation = np.exp(-exponent) / -np.expm1(-exponent)
    return np.asarray(FIRST_RADIATION_CONSTANT / wavelength**5 * occupation, dtype=np.float64)
