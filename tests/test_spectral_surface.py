"""Emissivity by wavelength and temperature: tables, and metals by their resistivity."""

import numpy as np
import pytest
from scipy.constants import c, epsilon_0
from scipy.integrate import quad
from tolerances import DOUBLE, SINGLE

from chipglow.camera import Camera
from chipglow.radiometry import Band
from chipglow.radiometry.band import spectral_radiance
from chipglow.scene import Raster, Scene
from chipglow.surface import HagenRubens, SpectralTable

BAND = Band(3.8e-6, 5.1e-6)
RASTER = Raster(0.0, 0.0, 2e-6, 4, 5)
TABLE = SpectralTable(
    ((3e-6, 300.0, 0.6), (3e-6, 1300.0, 0.8), (6e-6, 300.0, 0.2), (6e-6, 1300.0, 0.4))
)


def plane(wavelength, temperature):
    """The table in closed form: it is linear in both."""
    return 0.6 - 0.4 * (wavelength - 3e-6) / 3e-6 + 0.2 * (temperature - 300) / 1000


def scene(temperature):
    values = np.full((1, *RASTER.shape), temperature)
    return Scene.from_fields(RASTER, [0.0], {"temperature": values})


def seen(surface, temperature, reflected=None):
    camera = Camera(band=BAND, pitch=2e-6, psf=None, lower_limit=None, reflected=reflected)
    return camera.expose(scene(temperature), surface, 0.0).mean_radiance[0, 0]


@pytest.mark.parametrize("reflected", [None, 293.0, 600.0])
@pytest.mark.parametrize("temperature", [480.0, 600.0, 903.2, 1200.0])
def test_what_a_camera_sees_of_a_table(temperature, reflected):
    # The integral of both parts by another quadrature. Temperatures every 5 K of a smooth curve
    # change it by under 1e-5; at the surroundings' own temperature nothing is left to see of e.
    def integrand(wavelength):
        own = plane(wavelength, temperature)
        total = own * spectral_radiance(wavelength, temperature)
        if reflected is not None:
            total += (1 - own) * spectral_radiance(wavelength, reflected)
        return float(total)

    expected = 1e-6 * quad(lambda um: integrand(um * 1e-6), 3.8, 5.1)[0]
    assert seen(TABLE, temperature, reflected) == pytest.approx(expected, rel=SINGLE)


def test_a_grey_table_is_grey():
    grey = SpectralTable(((4e-6, 300.0, 0.37),))
    surface = grey.in_band(BAND, 293.0)
    np.testing.assert_allclose(surface.columns[1], 0.37, rtol=DOUBLE)


def test_beyond_its_ends_a_table_is_constant():
    found = TABLE.spectral_emissivity(np.array([2e-6, 9e-6]), np.array([200.0, 2000.0]))
    np.testing.assert_allclose(found, [0.6, 0.4])


def test_hagen_and_rubens():
    # To the first order; the next is a half of its square, and small at long waves.
    metal = HagenRubens(1.7e-7)
    wavelength = np.array([4e-6, 20e-6, 100e-6])
    first = np.sqrt(16 * np.pi * epsilon_0 * c * 1.7e-7 / wavelength)
    # Half of the last digit of 0.36528 is 1.4e-5 of it.
    np.testing.assert_allclose(first, 0.36528 * np.sqrt(1.7e-7 / wavelength), rtol=1.5e-5)
    found = metal.spectral_emissivity(wavelength, np.array(293.15))
    assert (np.abs(found - first + first**2 / 2) < 0.2 * first**3).all()
    assert (found < first).all()


def test_resistivity_grows_with_temperature():
    metal = HagenRubens(1.7e-7, 0.005)
    surface = metal.in_band(BAND, None)
    values = surface.at(np.array([293.15, 1093.15]))
    # Resistivity is 5 times as large there; the emissivity nearly goes as its root.
    assert values[1] / values[0] == pytest.approx(np.sqrt(5), rel=0.06)
    # The hotter of two equal bands weights shorter waves: another reason to grow, of some permille.
    assert values[0] == pytest.approx(0.365 * np.sqrt(1.7e-7 / 4.7e-6), rel=0.07)
