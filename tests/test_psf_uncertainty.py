"""What is uncertain of a point spread function by the knife edge, in its kernel and its file."""

from math import sqrt

import numpy as np
import pytest
from scipy.special import erf
from synthetic_edge import edge_radiance, gaussian_edge, image_of, tailed_edge
from tolerances import DOUBLE

from chipglow.camera import Camera, MeasuredPSF
from chipglow.laboratory.psf import knife_edge, psf_kernel, write_psf
from chipglow.radiometry import Band
from chipglow.uncertainty import Cause, Component

FWHM = 10e-6


def seen(edge, noise=0.05, seed=0, side=40):
    return image_of(edge_radiance(edge, 5.0, side), noise, seed, None, "edge")


@pytest.fixture(scope="module")
def gaussian():
    return knife_edge([seen(gaussian_edge(FWHM))])


def encircled(psf, radius):
    """Light within a radius in m, as an estimate."""
    half = len(psf.weights) // 2
    x = (np.arange(len(psf.weights)) - half) * psf.spacing
    inside = np.hypot(x, x[:, None]) < radius
    return psf.estimate.linear(inside.reshape(1, -1).astype(float))[0]


def line_of(fwhm, spacing, half):
    """Light of a Gaussian on a row of squares."""
    edges = spacing * (np.arange(-half, half + 2) - 0.5)
    return np.diff(erf(edges * 2 * sqrt(np.log(2)) / fwhm)) / 2


def test_the_fit_s_part_is_that_of_a_wider_and_a_narrower_gaussian(gaussian):
    fit = gaussian.fit("gaussian")
    psf = psf_kernel(gaussian, "gaussian")
    half, spread = len(psf.weights) // 2, sqrt(float(fit.covariance[0, 0]))
    wide, narrow = (
        line_of(fit.values[0] + sign * spread, psf.spacing, half) for sign in (1.0, -1.0)
    )
    expected = np.abs(np.outer(wide, wide) - np.outer(narrow, narrow)) / 2
    found = psf.estimate.contribution("psf fit")
    np.testing.assert_allclose(found, expected, atol=1e-10 * expected.max())  # rounding of sums
    # All the light is there, whatever is uncertain.
    assert psf.estimate.sum().standard_uncertainty == pytest.approx(0.0, abs=1e-12)


def test_the_file_keeps_the_components(gaussian, tmp_path):
    psf = psf_kernel(gaussian)
    write_psf(gaussian, tmp_path / "psf.nc", psf)
    again = MeasuredPSF.from_file(tmp_path / "psf.nc")
    np.testing.assert_allclose(again.weights, psf.weights, rtol=DOUBLE)
    assert again.estimate.names == psf.estimate.names
    assert again.band == Band(3.8e-6, 5.1e-6)
    refused = r"band 3\.8 um to 5\.1 um, expected that of the camera, 8 um"
    with pytest.raises(ValueError, match=refused):
        Camera(psf=again, band=Band(8e-6, 12e-6))
    # `in_band` is for those who want the same kernel elsewhere.
    assert Camera(psf=again).in_band(Band(8e-6, 12e-6)).psf.fwhm == again.fwhm
    assert encircled(again, 5e-6).standard_uncertainty > 1e-4
    away = encircled(again, 5e-6) - encircled(psf, 5e-6)
    assert away.standard_uncertainty == pytest.approx(0.0, abs=DOUBLE)


def test_the_parts_are_those_of_the_width():
    """Their effects on the width of a smooth kernel make up what `KnifeEdge` says of it.

    An oval is too large for it: a fifth of the width is not linear in the kernel.
    """
    found = knife_edge([seen(tailed_edge(8e-6, 0.2, 20e-6), 0.01, side=64)])
    psf = psf_kernel(found)
    changes = []
    *others, oval = psf.components
    assert oval.cause.name == "psf oval"
    for component in others:
        for error in component.effects.T.reshape(-1, *psf.weights.shape):
            ends = [MeasuredPSF(psf.weights + sign * error, psf.spacing).fwhm for sign in (-1, 1)]
            changes.append((ends[1] - ends[0]) / 2)
    # Widths are not linear in the components: 2 % measured.
    assert np.hypot.reduce(changes) == pytest.approx(found.edge_uncertainty, rel=0.05)


def test_components_are_scaled_with_the_weights():
    effects = np.zeros((9, 1))
    effects[4] = 2.0
    psf = MeasuredPSF(np.full((3, 3), 2.0), 1e-6, (Component(Cause("noise"), effects),))
    # w / s with w = 2 ± 2 and s = 18 ± 2: 2/18 − 2·2/18² in the middle, −2·2/18² beside it.
    expected = np.full((3, 3), -4 / 18**2)
    expected[1, 1] += 2 / 18
    np.testing.assert_allclose(psf.estimate.effect("noise"), expected, rtol=DOUBLE)
    with pytest.raises(ValueError, match="has effects on 9 values, expected 25"):
        MeasuredPSF(np.ones((5, 5)), 1e-6, psf.components)
