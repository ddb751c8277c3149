"""Images of many fields, beside those of one after another."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from chipglow import AnnularAperturePSF, Camera, GaussianPSF, Raster
from chipglow.camera import image_formation
from chipglow.camera.optics.terms import Distortion, Veil
from chipglow.correction.batch_formation import BatchFormation, batch_formation
from chipglow.correction.cells import cells_of

PITCH = 6e-6
PIXELS = Raster(0.0, 0.0, PITCH, 40, 33)
CELLS = cells_of(PIXELS)
SINGLE = 2e-6
"""Rounding of sums of some thousand values in single precision, relative to the largest."""

CASES = [
    (psf, order, fill_factor)
    for psf in (AnnularAperturePSF(), GaussianPSF(fwhm=15e-6))
    for order in ("optics", "detector")
    for fill_factor in (1.0, 0.8)
]


def both(psf, order, fill_factor):
    """Return the formation of many fields, and that of one."""
    camera = Camera(pitch=PITCH, psf=psf, psf_order=order, fill_factor=fill_factor)
    exact = image_formation(camera, CELLS, pixels=PIXELS)
    return batch_formation(exact), exact


@pytest.mark.parametrize(("psf", "order", "fill_factor"), CASES)
def test_images_are_those_of_single_fields(psf, order, fill_factor):
    batch, exact = both(psf, order, fill_factor)
    assert isinstance(batch, BatchFormation)
    noise = np.random.default_rng(1).standard_normal((4, *CELLS.shape))
    fields = np.stack([gaussian_filter(field, 6.0) for field in noise])
    fields /= fields.std()
    light = fields.reshape(4, -1).T.astype(np.float32)
    expected = np.stack([exact.forward(field).ravel() for field in fields], axis=1)
    # 2 % of the light comes from far. Means over groups of these fields, which change over three
    # pixels, err by up to their standard deviation: by 0.2 of it for a typical pixel.
    assert (batch.forward(light) - expected).std() < 0.2 * 0.02

    uniform = batch.forward(np.ones((light.shape[0], 1), np.float32))
    assert uniform == pytest.approx(1.0, abs=SINGLE)


@pytest.mark.parametrize(("psf", "order", "fill_factor"), CASES)
def test_the_adjoint(psf, order, fill_factor):
    batch, _ = both(psf, order, fill_factor)
    draw = np.random.default_rng(2)
    light = draw.random((CELLS.rows * CELLS.columns, 2), np.float32)
    images = draw.random((PIXELS.rows * PIXELS.columns, 2), np.float32)
    forward, back = batch.forward(light).T @ images, light.T @ batch.adjoint(images)
    assert np.abs(forward - back).max() < SINGLE * np.abs(forward).max()


def test_optics_that_differ_over_the_image_form_one_image_after_another():
    light = np.random.default_rng(3).random((CELLS.rows * CELLS.columns, 2))
    images = np.random.default_rng(4).random((PIXELS.rows * PIXELS.columns, 2))
    for term in (Distortion(fraction=0.01, radius=100e-6), Veil(fraction=0.05, radius=60e-6)):
        camera = Camera(pitch=PITCH, psf=GaussianPSF(fwhm=15e-6), optics=(term,))
        exact = image_formation(camera, CELLS, pixels=PIXELS)
        batch = batch_formation(exact)
        field, image = light[:, 1].reshape(CELLS.shape), images[:, 1].reshape(PIXELS.shape)
        assert (batch.forward(light)[:, 1] == exact.forward(field).ravel()).all()
        assert (batch.adjoint(images)[:, 1] == exact.adjoint(image).ravel()).all()
