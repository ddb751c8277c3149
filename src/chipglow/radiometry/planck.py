"""Planck's law: spectral radiance of a blackbody."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

FIRST_RADIATION_CONSTANT: Final = 1.191042972397188e-16
"""c1L = 2hc² in W m²/sr (CODATA 2018); the paper's 1.191e-4 W µm² is this, rounded."""

SECOND_RADIATION_CONSTANT: Final = 1.438776877503933e-2
"""c2 = hc/k in m K (CODATA 2018); the paper's 14387.752 µm K."""


def spectral_radiance(
    wavelength: NDArray[np.float64], temperature: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Spectral radiance of a blackbody.

    Parameters
    ----------
    wavelength : ndarray
        Wavelength in m, broadcast against `temperature`.
    temperature : ndarray
        Temperature in K, positive.

    Returns
    -------
    ndarray
        Spectral radiance in W/(m² sr m): the integrand of Equation 1 of the paper.
    """
    exponent = SECOND_RADIATION_CONSTANT / (wavelength * temperature)
    # exp(-x) / (1 - exp(-x)) is 1 / (exp(x) - 1) without overflow at large x.
    occupation = np.exp(-exponent) / -np.expm1(-exponent)
    return np.asarray(FIRST_RADIATION_CONSTANT / wavelength**5 * occupation, dtype=np.float64)
