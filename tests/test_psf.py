"""Point spread functions against what optics says of them, and the convolution with them."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import dblquad
from scipy.ndimage import convolve
from scipy.special import erf, j1
from tolerances import DOUBLE

from chipglow.camera import AnnularAperturePSF, GaussianPSF, MeasuredPSF
from chipglow.camera.optics.convolution import blur, images
from chipglow.camera.optics.psf import ANNULAR_ENERGY, GAUSSIAN_ENERGY
from chipglow.camera.optics.sampling import integrate, sensor_raster
from chipglow.scene import Raster

FWHM_PER_SIGMA = 2 * sqrt(2 * log(2))
LOPSIDED = np.array([[0, 1, 2], [3, 8, 1], [0, 2, 1]], dtype=float)
KINDS = [
    GaussianPSF(12e-6),
    AnnularAperturePSF(),
    AnnularAperturePSF(obscuration=0.0),
    MeasuredPSF(LOPSIDED, 4e-6),
]


def variance(kernel, spacing):
    """Variance of a kernel along x, in m²."""
    x = spacing * (np.arange(kernel.shape[1]) - kernel.shape[1] // 2)
    line = kernel.sum(axis=0)
    return float(line @ x**2 - (line @ x) ** 2)


def measured_width(kernel, spacing):
    """Full width at half maximum of a kernel's middle row, by straight lines, in m."""
    line = kernel[kernel.shape[0] // 2] / kernel.max()
    right = line[kernel.shape[1] // 2 :]
    k = int(np.argmax(right < 0.5))
    return 2 * spacing * (k - 1 + (right[k - 1] - 0.5) / (right[k - 1] - right[k]))


@pytest.mark.parametrize("psf", KINDS, ids=repr)
@pytest.mark.parametrize("spacing", [0.7e-6, 6e-6, 50e-6])
def test_the_sum_of_a_kernel_is_the_light_that_it_holds(psf, spacing):
    kernel = psf.kernel(spacing)
    assert kernel.dtype == np.float64
    assert kernel.shape[0] == kernel.shape[1]
    assert kernel.shape[0] % 2 == 1
    assert (kernel >= 0).all()
    held = ANNULAR_ENERGY if isinstance(psf, AnnularAperturePSF) else GAUSSIAN_ENERGY
    # The square holds more than the circle in it: beyond it are 4 √2 / 2π = 0.9 of what is beyond
    # the circle, or less by what a last square sticks out.
    assert held - 1e-12 <= kernel.sum() <= 1 + 1e-12
    # That last square: 0.3 of what is beyond measured.
    assert kernel.sum() == pytest.approx(held + 0.1 * (1 - held), abs=0.5 * (1 - held) + 1e-12)


@pytest.mark.parametrize("psf", KINDS, ids=repr)
@pytest.mark.parametrize("view", [(1, 1), (3, 40), (200, 200)])
def test_a_view_holds_all_the_light(psf, view):
    kernel = psf.view_kernel(2e-6, *view)
    assert all(n % 2 == 1 and n <= 2 * m + 1 for n, m in zip(kernel.shape, view, strict=True))
    assert kernel.sum() == pytest.approx(1.0, abs=DOUBLE)
    assert (kernel >= 0).all()
    # Within the view it is the kernel itself.
    half = min(kernel.shape) // 2
    own, most = psf.kernel(2e-6), min(half, psf.kernel(2e-6).shape[0] // 2 + 1) - 1
    near = [
        k[k.shape[0] // 2 - most : k.shape[0] // 2 + most + 1][
            :, k.shape[1] // 2 - most : k.shape[1] // 2 + most + 1
        ]
        for k in (own, kernel)
    ]
    # Far squares are differences of nearly equal integrals: 8e-13 was seen.
    np.testing.assert_allclose(*near, rtol=1e-11)


@pytest.mark.parametrize("psf", KINDS[:3], ids=repr)
def test_width_is_that_of_the_kernel(psf):
    # Straight lines between samples 1/40 of the width apart, and their own width: under 0.2 %.
    assert measured_width(psf.kernel(0.2e-6), 0.2e-6) == pytest.approx(psf.fwhm, rel=2e-3)


@given(st.floats(2e-6, 30e-6), st.floats(0.3e-6, 10e-6))
def test_gaussian_variance(fwhm, spacing):
    sigma = fwhm / FWHM_PER_SIGMA
    if sigma > 0.5 * spacing:
        # The squares add spacing² / 12, less the first term of Poisson's sum over their lattice;
        # the second is e^(-8 π² / 4) or less, 3e-9, times about 13 of the variance.
        aliased = (4 * sigma**2 + (spacing / pi) ** 2) * exp(-2 * (pi * sigma / spacing) ** 2)
        expected = sigma**2 + spacing**2 / 12 - aliased
        found = variance(GaussianPSF(fwhm).kernel(spacing), spacing)
        # The second term: 3e-9 · 13.
        assert found == pytest.approx(expected, rel=4e-8)


@pytest.mark.parametrize("psf", [GaussianPSF(10e-6), AnnularAperturePSF()], ids=repr)
def test_measured_kernel_round_trip(psf):
    spacing = 2e-6
    kernel = psf.kernel(spacing)
    measured = MeasuredPSF(100 * kernel, spacing)
    np.testing.assert_allclose(measured.kernel(spacing), kernel / kernel.sum(), rtol=DOUBLE)
    # Straight lines between samples a fifth of the width apart.
    assert measured.fwhm == pytest.approx(psf.fwhm, rel=0.05)


@given(st.floats(0.2e-6, 20e-6), st.floats(0.2e-6, 5e-6))
def test_resampling_keeps_the_middle_and_the_orientation(measured_spacing, spacing):
    psf = MeasuredPSF(LOPSIDED, measured_spacing)
    kernel = psf.kernel(spacing)
    x = spacing * (np.arange(kernel.shape[0]) - kernel.shape[0] // 2)
    expected = measured_spacing * (LOPSIDED.sum(axis=0) @ [-1, 0, 1]) / LOPSIDED.sum()
    centroid = kernel.sum(axis=0) @ x
    # Light that is even in a square is moved to the middle of a coarser one: half of it at most.
    assert centroid == pytest.approx(expected, abs=spacing / 2)


def test_width_of_a_measured_kernel():
    x = np.arange(-20, 21)
    disc = (np.hypot(x - 3, x[:, None] + 6) <= 12.5).astype(float)
    # Its own middle row and column have 25 samples, the kernel's 21 and 25, its top row 7.
    assert MeasuredPSF(disc, 1e-6).fwhm == pytest.approx(25e-6)
    # Along the row and the column through a single sample it is as wide as the sample.
    alone = [[0, 0, 1], [0, 0, 0], [1, 0, 0]]
    assert MeasuredPSF(alone, 1e-6).fwhm == pytest.approx(1e-6)


def test_kernel_from_a_file(tmp_path):
    np.save(tmp_path / "psf.npy", LOPSIDED)
    np.savetxt(tmp_path / "psf.csv", LOPSIDED, delimiter=",")
    for name in ("psf.npy", "psf.csv"):
        psf = MeasuredPSF.from_file(tmp_path / name, 2e-6)
        np.testing.assert_allclose(psf.kernel(2e-6), LOPSIDED / LOPSIDED.sum())


CSV = (b"", b"1,2\n3\n", b"1,2\n3,4\n", b"a", b"\xff\xfe\x00", b"nan", b"inf", b"-1", b"0")
NPY = (b"", b"\x93NUMPY\x01\x00", b"not an array at all", None)


@pytest.mark.parametrize(
    ("name", "content"),
    [("psf.txt", b"1"), *(("psf.csv", one) for one in CSV), *(("psf.npy", one) for one in NPY)],
)
def test_files_without_a_kernel_are_refused(tmp_path, name, content):
    path = tmp_path / name
    if content is None:
        np.save(path, np.array([[object()]]), allow_pickle=True)
    else:
        path.write_bytes(content)
    with pytest.raises(ValueError, match=r"psf: .*psf\.(txt|csv|npy)"):
        MeasuredPSF.from_file(path, 1e-6)


@pytest.mark.parametrize("shape", [(1, 1), (7, 30), (31, 29)])
@pytest.mark.parametrize("psf", KINDS, ids=repr)
def test_blur_is_the_direct_sum_and_never_wraps_around(shape, psf):
    radiance = np.random.default_rng(3).uniform(1, 100, shape)
    direct = convolve(radiance, psf.view_kernel(5e-6, *shape), mode="nearest")
    # The transform's rounding: some 1e-16 of the largest value.
    np.testing.assert_allclose(blur(radiance, psf, 5e-6), direct, rtol=1e-12)
    # A kernel that goes on far beyond the view: where it ends, the mean of the rings stands for
    # them, which moves some of 4 % of the light along the border.
    huge = convolve(radiance, psf.view_kernel(5e-6, 150, 150), mode="nearest")
    # Of the 4 % less than 1 % moves.
    np.testing.assert_allclose(blur(radiance, psf, 5e-6), huge, rtol=3e-4)


def irradiance(radius, wavelength, aperture, obscuration):
    """Fraction of a point's light per area in 1/m² behind an annular pupil (Born and Wolf)."""
    v = 2 * pi * aperture * radius / wavelength
    amplitude = (2 * j1(v) - obscuration * 2 * j1(obscuration * v)) / v
    # In the middle it is π NA² (1 − o²) / λ², by Parseval.
    scale = pi * (aperture / wavelength) ** 2 / (1 - obscuration**2)
    return scale * amplitude**2


@pytest.mark.parametrize("spacing", [1e-6, 6e-6])
@pytest.mark.parametrize("right", [0, 1, 7, 40])
def test_a_square_holds_what_an_adaptive_quadrature_finds_there(spacing, right):
    psf, down = AnnularAperturePSF(4.5e-6, 0.28, 0.35), 3
    sides = [(spacing * (n - 0.5), spacing * (n + 0.5)) for n in (down, right)]
    expected, _ = dblquad(
        lambda x, y: irradiance(np.hypot(x, y), 4.5e-6, 0.28, 0.35),
        *sides[0],
        *sides[1],
        epsabs=0,
        epsrel=1e-9,
    )
    kernel = psf.kernel(spacing)
    middle = kernel.shape[0] // 2
    # Two or three Gauss nodes along a side are good for 1.6e-6 where a ring is dark.
    assert kernel[middle + down, middle + right] == pytest.approx(expected, rel=2e-6)


@pytest.mark.parametrize("obscuration", [0.0, 0.35, 0.6])
@pytest.mark.parametrize("samples", [20, 120, 390])
def test_the_light_of_a_point_reaches_every_sample(obscuration, samples):
    spacing, psf = 1.5e-6, AnnularAperturePSF(4.5e-6, 0.28, obscuration)
    point = np.zeros((40, 400))
    point[12, 5] = 1.0
    place = spacing * (np.arange(20) - 9.5) / 20
    radius = np.hypot(spacing * samples + place, place[:, None])
    expected = spacing**2 * irradiance(radius, 4.5e-6, 0.28, obscuration).mean()
    # Quadratures of 9 and of 400 nodes over a square, which tell most where a ring is dark; far
    # away there are 1e-9 of the light, of which rounding of the transform is 1e-7.
    assert blur(point, psf, spacing)[12, 5 + samples] == pytest.approx(expected, rel=3e-3)


@pytest.mark.parametrize("psf", KINDS, ids=repr)
def test_the_light_from_beyond_is_what_the_view_does_not_send(psf):
    shape, spacing = (25, 31), 3e-6
    beyond = 1 - blur(np.ones(shape), psf, spacing, "nothing")
    within = convolve(np.ones(shape), psf.view_kernel(spacing, 40, 40), mode="constant")
    np.testing.assert_allclose(beyond, 1 - within, atol=DOUBLE)
    radiance = np.random.default_rng(4).uniform(1, 100, shape)
    inside = convolve(radiance, psf.view_kernel(spacing, 40, 40), mode="constant")
    np.testing.assert_allclose(blur(radiance, psf, spacing, "nothing"), inside, rtol=DOUBLE)


# A pixel of samples, of parts of them, of less than one, and the middle of one.
@pytest.mark.parametrize(
    ("pitch", "fill"), [(6e-6, 1.0), (7.3e-6, 1.0), (1.7e-6, 1.0), (6e-6, 0.1)]
)
@pytest.mark.parametrize("psf", KINDS, ids=repr)
def test_an_image_on_pixels_is_what_they_integrate_of_the_whole_one(psf, pitch, fill):
    # Rows and columns differ, and no edge of the pixels is one of the scene.
    scene = Raster(-10e-6, 20e-6, 2e-6, 37, 52)
    sensors = sensor_raster(scene, pitch, (3.1e-6, 4.7e-6), None)
    radiance = np.random.default_rng(6).lognormal(0.0, 3.0, scene.shape)
    # What transforms round is a part of the largest value, not of each.
    exact = {"rtol": 1e-13, "atol": 1e-15 * radiance.max()}
    both = images(radiance, psf, scene.spacing, (scene, sensors, fill))
    for image, beyond in zip(both, ("edge", "nothing"), strict=True):
        expected = integrate(blur(radiance, psf, scene.spacing, beyond), scene, sensors, fill)
        np.testing.assert_allclose(image, expected, **exact)


def test_where_there_is_no_light_there_is_none_after_the_blur():
    radiance = np.zeros((60, 60))
    radiance[:, 40:] = 1e4
    assert (blur(radiance, GaussianPSF(4e-6), 1e-6)[:, :20] == 0).all()


def test_knife_edge_of_a_gaussian():
    spacing, psf = 0.5e-6, GaussianPSF(9e-6)
    edge = np.where(np.arange(200) < 100, 0.0, 1.0) * np.ones((50, 1))
    x = spacing * (np.arange(200) - 99.5)
    expected = (1 + erf(x / (sqrt(2) * psf.fwhm / FWHM_PER_SIGMA))) / 2
    # Exact for a field that is even within each sample.
    np.testing.assert_allclose(blur(edge, psf, spacing)[25], expected, atol=1e-9)
