"""Blurs besides the optics: each counts once, by variances, closed forms and what they say."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.special import erf
from tolerances import DOUBLE

from chipglow import camera as cam
from chipglow.camera.optics.pupil import annular_transfer
from chipglow.scene import Raster

OPTICS = cam.GaussianPSF(8e-6)
SIGMA = 8e-6 / 2.354820045
BLURS = [
    (cam.Jitter(2e-6), 4e-12, 4e-12),
    (cam.ChargeDiffusion(1.5e-6), 2.25e-12, 2.25e-12),
    (cam.LinearMotion(6e-6), 36e-12 / 12, 0.0),
    (cam.LinearMotion(6e-6, pi / 2), 0.0, 36e-12 / 12),
    (cam.Vibration(3e-6, pi / 4), 9e-12 / 4, 9e-12 / 4),
]


def variances(kernel, spacing):
    place = spacing * (np.arange(kernel.shape[0]) - kernel.shape[0] // 2)
    return (kernel.sum(axis=0) @ place**2, kernel.sum(axis=1) @ place**2)


@pytest.mark.parametrize(("blur", "across", "up"), BLURS, ids=lambda value: repr(value)[:24])
@pytest.mark.parametrize("spacing", [2e-6 / 3, 5e-6])
def test_variances_add_and_the_squares_count_once(blur, across, up, spacing):
    psf = cam.BlurredPSF(OPTICS, (blur,))
    kernel = psf.kernel(spacing)
    own = SIGMA**2 + spacing**2 / 12
    found = variances(kernel, spacing)
    # Sheppard's correction of squares that are wider than the Gaussian holds within 1e-3.
    np.testing.assert_allclose(found, [own + across, own + up], rtol=2e-3)
    view = psf.view_kernel(spacing, 40, 50)
    assert view.sum() == pytest.approx(1.0, abs=DOUBLE)
    assert (view >= 0).all()


def test_vibration_is_the_mean_of_displaced_kernels():
    spacing, amplitude = 1e-6, 5e-6
    found = cam.BlurredPSF(OPTICS, (cam.Vibration(amplitude),)).view_kernel(spacing, 30, 30)
    edges = spacing * (np.arange(-30, 32) - 0.5)
    # Equal times of a sine: Chebyshev's nodes.
    places = amplitude * np.cos(pi * (np.arange(64) + 0.5) / 64)
    lines = [np.diff(erf((edges - p) / (sqrt(2) * SIGMA))) / 2 for p in (0.0, *places)]
    expected = np.outer(lines[0], np.mean(lines[1:], axis=0))
    assert np.abs(found - expected)[1:-1, 1:-1].sum() < 1e-10  # rounding of 4000 weights


def test_blurs_multiply_and_keep_far_light():
    psf = cam.BlurredPSF(
        cam.AnnularAperturePSF(), (cam.ChargeDiffusion(1.5e-6), cam.LinearMotion(4e-6))
    )
    kernel = psf.view_kernel(2e-6, 120, 120)
    plain = cam.AnnularAperturePSF().view_kernel(2e-6, 120, 120)
    # Far away diffraction is as it was; near by the middle is lower.
    assert kernel[1:21].sum() == pytest.approx(plain[1:21].sum(), rel=5e-3)
    wide, beyond = (one.view_kernel(4e-6, 100, 100)[:30] for one in (psf, cam.AnnularAperturePSF()))
    # Farther than 32 widths it is left as it is, and nothing is moved to where that ends.
    np.testing.assert_allclose(wide, beyond, rtol=1e-9)
    assert kernel.sum() == pytest.approx(1.0, abs=DOUBLE)
    change = psf.view_kernel(4e-6, 100, 100) - cam.AnnularAperturePSF().view_kernel(4e-6, 100, 100)
    place = 4e-6 * np.arange(-100, 101)
    # Of all light: 1.8e-3 measured.
    assert np.abs(change[np.hypot(place, place[:, None]) > 150e-6]).sum() < 2e-3
    assert kernel.max() < 0.9 * plain.max()
    frequency = 0.5 / 8e-6
    place = 2e-6 * np.arange(-120, 121)
    change = (kernel.sum(0) - plain.sum(0)) @ np.cos(2 * pi * frequency * place)
    own = annular_transfer(np.array(frequency * 4.5e-6 / 0.56), 0.35) * np.sinc(2e-6 * frequency)
    blurs = np.exp(-2 * (pi * 1.5e-6 * frequency) ** 2) * np.sinc(4e-6 * frequency)
    # Samples of 2 um: 1.6e-6 measured.
    assert change == pytest.approx(float(own) * (blurs - 1), abs=5e-6)


def edge_scene():
    scene = Raster(0.0, 0.0, 1e-6, 90, 120)
    return scene, np.where(scene.x > 60e-6, 50.0, 1.0) * np.ones((90, 1))


def test_a_point_spread_function_with_the_footprint_counts_it_once():
    scene, radiance = edge_scene()
    optics = cam.GaussianPSF(8e-6)
    box = np.ones((5, 5))
    spacing = 6e-6 / 5
    fine = optics.kernel(spacing)
    # Optics and a pixel of 6 um: five squares of the kernel, each side.
    count = fine.shape[0] + 4
    system = np.fft.irfft2(
        np.fft.rfft2(fine, (count, count)) * np.fft.rfft2(box, (count, count)), (count, count)
    )
    whole = cam.MeasuredPSF(np.maximum(system, 0), spacing, includes=("footprint",))
    camera = cam.Camera(psf=whole, lower_limit=None)
    expected = cam.Camera(psf=optics, lower_limit=None).form_image(radiance, scene)
    # The kernel's squares and the sample in a pixel's middle: 1.2²/12 and 1/12 um² of 14.5.
    np.testing.assert_allclose(camera.form_image(radiance, scene), expected, atol=0.5)
    twice = cam.Camera(psf=cam.MeasuredPSF(whole.weights, spacing), lower_limit=None)
    assert np.abs(twice.form_image(radiance, scene) - expected).max() > 1.0


def test_what_is_in_a_measured_kernel_is_not_added_again():
    measured = cam.MeasuredPSF(np.ones((3, 3)), 2e-6, includes=("footprint", "charge-diffusion"))
    blurred = cam.BlurredPSF(measured, (cam.Jitter(1e-6),))
    assert blurred.includes == ("footprint", "charge-diffusion", "jitter")
    with pytest.raises(ValueError, match="already includes jitter"):
        cam.BlurredPSF(blurred, (cam.Jitter(1e-6),))


def test_a_file_says_what_it_includes(tmp_path):
    path = tmp_path / "psf.csv"
    np.savetxt(path, np.ones((3, 3)), delimiter=",")
    part = cam.MeasuredPSFFile(str(path), 2e-6, ("footprint",))
    assert part.for_camera(cam.Camera().band, None).includes == ("footprint",)
    assert cam.MeasuredPSF.from_file(path, 2e-6).includes == ()
