"""The linear map from a scene's radiance to the pixels, and its adjoint."""

from dataclasses import replace

import numpy as np
import pytest
from tolerances import DOUBLE

import chipglow.camera as cam
from chipglow.camera.optics.sampling import largest
from chipglow.scene import Raster

SCENE = Raster(-20e-6, 60e-6, 1e-6, 47, 61)
BAND = cam.Camera().band
PSFS = {
    "none": None,
    "Gaussian": cam.GaussianPSF(8e-6),
    "annular": cam.AnnularAperturePSF(),
    "pupil": cam.Pupil(0.28, defocus=10e-6).for_camera(BAND, None),
    "with footprint": cam.MeasuredPSF(
        np.outer([1, 2, 1], [1, 3, 1]), 1e-6, includes=("footprint",)
    ),
    "blurred": cam.BlurredPSF(cam.GaussianPSF(6e-6), (cam.LinearMotion(5e-6),)),
}
BLURS = [
    (name, order)
    for name in PSFS
    for order in ("optics", "detector")
    # A point spread function with the footprint acts on samples.
    if (name, order) != ("with footprint", "detector")
]
TERMS = {
    "none": (),
    "veil": (cam.Veil(0.1, 12e-6),),
    "distortion": (cam.Distortion(0.02, 20e-6),),
    "field blur": (cam.FieldBlur(3e-6, 20e-6),),
    "several": (cam.Distortion(-0.02, 20e-6), cam.Veil(0.1, 12e-6), cam.OpticalElement(0.9)),
}

ROUNDING = 1e-12
"""Error bound of two inner products whose sums have about 3,000 terms and whose transforms have
about 12 levels: 12 levels of 1.1e-16 each, with a factor of 1,000 to spare."""


def camera(psf, **settings):
    return cam.Camera(pitch=5e-6, psf=psf, lower_limit=None, **settings)


def dot_products(formation):
    """Return ⟨A x, y⟩ and ⟨x, Aᵀ y⟩ of random x and y of both signs, and ‖A x‖ ‖y‖."""
    generator = np.random.default_rng(7)
    field = generator.normal(size=formation.samples.shape)
    image = generator.normal(size=formation.pixels.shape)
    sent = formation.forward(field)
    returned = formation.adjoint(image)
    size = np.linalg.norm(sent) * np.linalg.norm(image)
    return (sent * image).sum(), (field * returned).sum(), size


@pytest.mark.parametrize("beyond", ["edge", "nothing"])
@pytest.mark.parametrize("offset", [(0.0, 0.0), (1.7e-6, 3.1e-6)])
@pytest.mark.parametrize("fill_factor", [1.0, 0.6])
@pytest.mark.parametrize(("name", "order"), BLURS)
def test_the_adjoint_of_each_blur(name, order, fill_factor, offset, beyond):
    one = camera(PSFS[name], psf_order=order, fill_factor=fill_factor, offset=offset, shape=(7, 9))
    sent, returned, size = dot_products(cam.image_formation(one, SCENE, beyond))
    assert abs(sent - returned) < ROUNDING * size


@pytest.mark.parametrize("beyond", ["edge", "nothing"])
@pytest.mark.parametrize("order", ["optics", "detector"])
@pytest.mark.parametrize("name", TERMS)
def test_the_adjoint_of_the_optics(name, order, beyond):
    one = camera(cam.GaussianPSF(8e-6), psf_order=order, optics=TERMS[name])
    sent, returned, size = dot_products(cam.image_formation(one, SCENE, beyond))
    assert abs(sent - returned) < ROUNDING * size


@pytest.mark.parametrize("order", ["optics", "detector"])
@pytest.mark.parametrize("name", ["none", "Gaussian", "annular", "blurred"])
def test_the_map_is_the_one_of_the_camera(name, order):
    one = camera(PSFS[name], psf_order=order, offset=(1.7e-6, 3.1e-6))
    radiance = np.random.default_rng(3).uniform(1.0, 50.0, SCENE.shape)
    image = cam.image_formation(one, SCENE).forward(radiance)
    np.testing.assert_allclose(image, one.form_image(radiance, SCENE), rtol=DOUBLE)


def test_the_adjoint_is_the_transposed_matrix():
    scene = replace(SCENE, rows=12, columns=14)
    formation = cam.image_formation(camera(cam.AnnularAperturePSF(), fill_factor=0.6), scene)
    units = np.eye(scene.rows * scene.columns).reshape(-1, *scene.shape)
    matrix = np.stack([formation.forward(unit).ravel() for unit in units], axis=1)
    pixels = np.eye(matrix.shape[0]).reshape(-1, *formation.pixels.shape)
    transposed = np.stack([formation.adjoint(pixel).ravel() for pixel in pixels], axis=1)
    np.testing.assert_allclose(transposed, matrix.T, atol=ROUNDING)
    # Radiance beyond the edges continues, so no light is lost.
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, rtol=ROUNDING)


def test_a_term_without_an_adjoint_is_refused():
    class Mirrored(cam.OpticsTerm):
        kind = "mirrored"

        def on_samples(self, radiance, scene, pixels, blurred):
            return radiance[:, ::-1]

    formation = cam.image_formation(camera(None, optics=(Mirrored(),)), SCENE)
    formation.forward(np.ones(SCENE.shape))
    with pytest.raises(ValueError, match="adjoint of mirrored"):
        formation.adjoint(np.ones(formation.pixels.shape))


def test_the_maximum_over_a_pixel_has_no_adjoint():
    formation = cam.image_formation(camera(None), SCENE, gather=largest)
    with pytest.raises(ValueError, match="not linear"):
        formation.adjoint(np.ones(formation.pixels.shape))


def test_shapes_are_checked():
    formation = cam.image_formation(camera(None), SCENE)
    with pytest.raises(ValueError, match="radiance has shape"):
        formation.forward(np.ones((3, 3)))
    with pytest.raises(ValueError, match="image has shape"):
        formation.adjoint(np.ones((3, 3)))
