"""Point spread functions of a pupil against closed forms and an independent Hankel transform."""

from math import exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from scipy.special import j0
from tolerances import DOUBLE

from chipglow.camera import AiryAperture, AnnularAperturePSF, Pupil, PupilPSF
from chipglow.camera.optics.pupil import annular_transfer, zernike_polynomial
from chipglow.radiometry import Band, TabulatedResponse, spectral_radiance

WAVELENGTH, APERTURE = 4.5e-6, 0.28
CUTOFF = 2 * APERTURE / WAVELENGTH
LINE = Band(WAVELENGTH * (1 - 1e-7), WAVELENGTH * (1 + 1e-7))
"""One wavelength, but for a ten-millionth."""

MWIR = Band(3.8e-6, 5.1e-6)


def pupil(obscuration=0.0, defocus=0.0, zernike=(), band=LINE):
    return PupilPSF(band, APERTURE, obscuration, defocus, zernike)


def variation(first, second):
    """Fraction of the light that is elsewhere, twice."""
    return np.abs(first - second).sum()


@pytest.mark.parametrize("obscuration", [0.0, 0.35])
@pytest.mark.parametrize(("spacing", "half"), [(2e-6 / 3, 30), (6e-6, 30)])
def test_without_aberrations_it_is_the_closed_form(obscuration, spacing, half):
    psf = pupil(obscuration)
    expected = AnnularAperturePSF(WAVELENGTH, APERTURE, obscuration)
    kernel = psf.view_kernel(spacing, half, half)
    assert kernel.shape == (2 * half + 1, 2 * half + 1)
    assert kernel.sum() == pytest.approx(1.0, abs=DOUBLE)
    # The closed form's kernel estimates what is beyond its own squares: a larger one knows more.
    far = 4 * half
    middle = slice(far - half + 1, far + half)
    exact = expected.view_kernel(spacing, far, far)[middle, middle]
    # One wavelength is the worst case: a band's far rings cancel.
    assert variation(kernel[1:-1, 1:-1], exact) < 1e-4
    assert np.abs(kernel[1:-1, 1:-1] - exact).max() < 5e-5 * exact.max()


def test_the_kernel_holds_the_stated_light():
    for psf in (pupil(0.35), pupil(0.35, 30e-6)):
        assert 0.99 <= psf.kernel(2e-6).sum() < 0.996


@given(st.floats(0.0, 0.9))
def test_transfer_of_an_annulus(obscuration):
    # The sum of all frequencies is the density in the middle: that of the open area.
    kinks = [obscuration, (1 - obscuration) / 2, (1 + obscuration) / 2]
    density = quad(
        lambda nu: float(annular_transfer(np.array([nu]), obscuration)[0]) * nu,
        0.0,
        1.0,
        points=kinks,
    )[0]
    # The tolerance of SciPy's quad, 1.5e-8, for one density of 1/8.
    assert 8 * density == pytest.approx(1 - obscuration**2, rel=1.5e-7)
    values = annular_transfer(np.linspace(0, 1.2, 200), obscuration)
    assert values[0] == pytest.approx(1.0)
    assert (values[-30:] == 0.0).all()
    assert (values >= -1e-14).all()


def radial_kernel(psf, spacing, half):
    """Fractions on squares, by Hankel's transform of the pupil: for round aberrations."""
    inner = psf.obscuration
    node, weight = np.polynomial.legendre.leggauss(300)
    rho = inner + (1 - inner) * (node + 1) / 2
    path = psf.defocus * (np.sqrt(1 - (APERTURE * rho) ** 2) - 1)
    for index, rms in psf.zernike:
        path = path + rms * {11: sqrt(5) * (6 * rho**4 - 6 * rho**2 + 1)}[index]
    wave = np.exp(2j * pi * path / WAVELENGTH) * rho * weight * (1 - inner) / 2
    radius = np.linspace(0, 1.5 * (half + 1) * spacing, 3000)
    amplitude = 2 * pi * j0(2 * pi * APERTURE / WAVELENGTH * np.outer(radius, rho)) @ wave
    density = np.abs(amplitude) ** 2 * (APERTURE / WAVELENGTH) ** 2 / (pi * (1 - inner**2))
    place = spacing * np.arange(-half, half + 1)
    node, weight = np.polynomial.legendre.leggauss(3)
    total = np.zeros((2 * half + 1, 2 * half + 1))
    for across, one in zip(node * spacing / 2, weight / 2, strict=True):
        for down, other in zip(node * spacing / 2, weight / 2, strict=True):
            r = np.hypot(place + across, (place + down)[:, None])
            total += one * other * spacing**2 * np.interp(r, radius, density)
    return total


@pytest.mark.parametrize(
    ("obscuration", "defocus", "zernike"),
    [(0.0, 30e-6, ()), (0.35, 60e-6, ()), (0.35, -40e-6, ((11, 0.3e-6),))],
)
def test_defocus_and_spherical_aberration(obscuration, defocus, zernike):
    psf, spacing, half = pupil(obscuration, defocus, zernike), 1e-6, 50
    kernel = psf.kernel(spacing)
    middle = kernel.shape[0] // 2
    own = slice(middle - half, middle + half + 1)
    # A pupil of 256 samples across: the error falls with the square of their size.
    assert variation(kernel[own, own], radial_kernel(psf, spacing, half)) < 5e-4


def density_in_the_middle(psf):
    step = CUTOFF / 24
    frequency = step * np.arange(-24, 25)
    return psf.transfer(frequency, frequency[:, None]).real.sum()


def test_strehl_ratio_of_small_aberrations():
    perfect = density_in_the_middle(pupil())
    for indices in ((5,), (8,), (11,), (6, 7, 12)):
        rms = 0.04 * WAVELENGTH / sqrt(len(indices))
        psf = pupil(zernike=tuple((index, rms) for index in indices))
        phase = 2 * pi * 0.04
        # Maréchal: 1 − φ² but for φ⁴, and coefficients add as their squares.
        ratio = density_in_the_middle(psf) / perfect
        assert ratio == pytest.approx(exp(-(phase**2)), abs=phase**4)  # that φ⁴; 0.2 of it measured
        assert ratio < 1 - 0.9 * phase**2


def test_coma_moves_the_light_by_the_mean_slope():
    # Z8 is √8 (3ρ³ − 2ρ) cos θ: its mean slope over the disc is √8, and rays land at ∇W / NA.
    rms, step = 0.1e-6, 0.02 * CUTOFF
    for index, axis in ((8, 0), (7, 1)):
        frequency = np.zeros((2, 2))
        frequency[axis] = step, 2 * step
        found = pupil(zernike=((index, rms),)).transfer(*frequency)
        one, two = -np.angle(found) / (2 * pi * frequency[axis])
        # The overlap of two pupils shrinks in proportion to how far they are apart.
        assert 2 * one - two == pytest.approx(sqrt(8) * rms / APERTURE, rel=1e-2)
    kernel = pupil(zernike=((8, rms),)).view_kernel(1e-6, 40, 40)
    assert kernel[:, 41:].sum() > kernel[:, :40].sum() + 0.02
    up = pupil(zernike=((7, rms),)).view_kernel(1e-6, 40, 40)
    np.testing.assert_allclose(up, kernel.T[::-1], atol=DOUBLE)


def test_zernike_polynomials_are_orthonormal():
    node, weight = np.polynomial.legendre.leggauss(20)
    radius, angle = (node + 1) / 2, 2 * pi * np.arange(32) / 32
    values = np.array([zernike_polynomial(j, radius[:, None], angle) for j in range(1, 37)])
    inner = np.einsum("iab,jab,a->ij", values, values, weight * radius) / 32
    np.testing.assert_allclose(inner, np.eye(36), atol=DOUBLE)


def test_zernike_polynomials_are_in_the_order_of_noll():
    r, t = np.array(0.8), np.array(0.4)
    table = {
        4: sqrt(3) * (2 * r**2 - 1),
        5: sqrt(6) * r**2 * np.sin(2 * t),
        6: sqrt(6) * r**2 * np.cos(2 * t),
        7: sqrt(8) * (3 * r**3 - 2 * r) * np.sin(t),
        10: sqrt(8) * r**3 * np.cos(3 * t),
        12: sqrt(10) * (4 * r**4 - 3 * r**2) * np.cos(2 * t),
        22: sqrt(7) * (20 * r**6 - 30 * r**4 + 12 * r**2 - 1),
    }
    for index, expected in table.items():
        assert zernike_polynomial(index, r, t) == pytest.approx(expected, rel=DOUBLE)


def test_wavelengths_count_as_in_the_radiance():
    # A detector that counts photons: relative to energy its response is proportional to λ.
    photons = Band(3.8e-6, 5.1e-6, TabulatedResponse((3.8e-6, 5.1e-6), (3.8, 5.1)))
    for band, response in ((MWIR, lambda w: 1.0), (photons, lambda w: w)):
        wavelengths, weights = band.spectrum(800.0, 8)

        def moment(power, response=response):
            return quad(
                lambda w: (
                    response(w * 1e-6)
                    * spectral_radiance(np.array(w * 1e-6), np.array(800.0))
                    * w**power
                ),
                3.8,
                5.1,
            )[0]

        for power in (0, 1, 7, 15):
            found = (weights * (1e6 * wavelengths) ** power).sum()
            assert found == pytest.approx(moment(power) / moment(0), rel=DOUBLE)


def test_a_band_is_the_sum_of_its_wavelengths():
    psf, spacing, half = pupil(0.35, band=MWIR), 2e-6, 60
    node, weight = np.polynomial.legendre.leggauss(40)
    wavelengths = 4.45e-6 + 0.65e-6 * node
    weights = weight * spectral_radiance(wavelengths, np.array(1000.0))
    one_by_one = sum(
        part * AnnularAperturePSF(float(w), APERTURE, 0.35).view_kernel(spacing, half, half)
        for w, part in zip(wavelengths, weights / weights.sum(), strict=True)
    )
    # Twelve wavelengths: 1.4e-4 from forty; the one in the middle alone is 7 % off.
    assert variation(psf.view_kernel(spacing, half, half), one_by_one) < 3e-4
    single = AnnularAperturePSF(4.45e-6, APERTURE, 0.35).view_kernel(spacing, half, half)
    assert variation(single, one_by_one) > 0.02


def test_an_f_number_is_a_numerical_aperture():
    found = Pupil(f_number=2.5, obscuration=0.3).for_camera(MWIR, 2.5)
    airy = AiryAperture(f_number=2.5).for_camera(MWIR, 2.5)
    assert found == PupilPSF(MWIR, airy.numerical_aperture, 0.3)
    assert airy.wavelength == pytest.approx(4.45e-6)


def test_a_working_f_number_is_that_of_the_light_at_the_detector():
    # Abbe's sine condition: NA at the detector, 1 / (2 N), times the magnification.
    assert AiryAperture(working_f_number=2.5).aperture(4.0) == pytest.approx(0.8)
    assert AiryAperture(working_f_number=2.5).aperture(1.0) == pytest.approx(0.2)
    # A lens that takes less light than the cold stop admits decides.
    both = AiryAperture(numerical_aperture=0.25, working_f_number=2.5)
    assert both.aperture(2.5) == 0.25
    assert both.aperture(1.0) == pytest.approx(0.2)
