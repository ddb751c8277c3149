"""What the optics do besides: radiometry in closed form, and a study that chooses the terms."""

from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import pytest
from scipy.special import ndtr
from tolerances import DOUBLE

from chipglow import camera as cam
from chipglow.camera.measuring import measurement_of
from chipglow.camera.optics.sampling import integrate, whole_raster
from chipglow.scene import Raster
from chipglow.study import Study, load_study, study_text

SCENE = Raster(-300e-6, 270e-6, 2e-6, 270, 300)
IDEAL = cam.Camera(psf=None, lower_limit=None)
BAND = IDEAL.band


def seen(radiance, *terms, camera=IDEAL):
    return replace(camera, optics=terms).form_image(radiance, SCENE)


def even(kelvins):
    return np.full(SCENE.shape, float(BAND.radiance(kelvins)))


def rough():
    return np.random.default_rng(1).uniform(0.0, 900.0, SCENE.shape)


@pytest.mark.parametrize("order", ["optics", "detector"])
@pytest.mark.parametrize("psf", [None, cam.AnnularAperturePSF()], ids=repr)
def test_without_terms_it_is_the_camera_without_them(order, psf):
    camera = cam.Camera(psf=psf, psf_order=order, shape=(60, 70), offset=(30e-6, 24e-6))
    radiance = rough()
    sensors = camera.pixels(SCENE)
    if psf is None:
        expected = integrate(radiance, SCENE, sensors, 1.0)
    elif order == "optics":
        expected = integrate(cam.blur(radiance, psf, SCENE.spacing), SCENE, sensors, 1.0)
    else:
        whole, own = whole_raster(SCENE, sensors)
        expected = cam.blur(integrate(radiance, SCENE, whole, 1.0), psf, camera.pitch)[own]
    found = camera.form_image(radiance, SCENE)
    if psf is not None and order == "optics":
        # The pixels' sums are taken before the last transform: rounding.
        np.testing.assert_allclose(found, expected, rtol=1e-13)
    else:
        np.testing.assert_array_equal(found, expected)
    assert camera.optics == ()


def test_an_element_in_the_calibration_and_one_that_is_not():
    hot, warm, cool = (float(BAND.radiance(t)) for t in (1000.0, 330.0, 300.0))
    window = cam.OpticalElement(0.8, 330.0)
    np.testing.assert_allclose(seen(even(1000.0), window), 0.8 * hot + 0.2 * warm, rtol=DOUBLE)
    # In a cavity of one temperature nothing is to be seen of it.
    np.testing.assert_allclose(seen(even(330.0), window), warm, rtol=1e-9)
    lens = cam.OpticalElement(0.8, 330.0, calibrated_at=300.0)
    shown = hot + (warm - cool) * 0.2 / 0.8
    np.testing.assert_allclose(seen(even(1000.0), lens), shown, rtol=DOUBLE)
    image = rough()
    same = cam.OpticalElement(0.8, 300.0, calibrated_at=300.0)
    np.testing.assert_array_equal(seen(image, same), seen(image))


def test_narcissus_is_missing_light_round_the_axis():
    term = cam.Narcissus(0.02, 120e-6, housing=320.0, detector=80.0)
    missing = 0.02 * float(BAND.radiance(320.0) - BAND.radiance(80.0))
    camera = replace(IDEAL, shape=(89, 99))
    loss = even(700.0)[0, 0] - seen(even(700.0), term, camera=camera)
    sensors = camera.pixels(SCENE)
    rounding = DOUBLE * even(700.0)[0, 0]  # a loss is a difference of radiances
    assert loss[44, 49] == pytest.approx(missing, abs=rounding)
    assert loss[44, 69] == pytest.approx(missing / 2, abs=rounding)
    assert loss[0, 0] == pytest.approx(
        missing * exp(-log(2) * (49**2 + 44**2) * sensors.spacing**2 / 120e-6**2), abs=rounding
    )
    corrected = replace(term, corrected_at=320.0)
    np.testing.assert_array_equal(seen(rough(), corrected), seen(rough()))


def test_veil_of_a_disc():
    radius, scattered, half = 150e-6, 0.05, 80e-6
    x, y = SCENE.x, SCENE.y[:, None]
    middle = x[150], y[135, 0]
    disc = np.where(np.hypot(x - middle[0], y - middle[1]) <= radius, 400.0, 0.0)
    lit = replace(IDEAL, pitch=2e-6)
    image = seen(disc, cam.Veil(scattered, half), camera=lit)
    expected = 1 - scattered / sqrt(1 + 3 * radius**2 / half**2)
    # A disc of squares of 2 um.
    assert image[135, 150] / 400 == pytest.approx(expected, abs=2e-4)
    assert image[135, 5] > 0.2
    # Sums of 1e5 weights: 3e-10 measured.
    np.testing.assert_allclose(seen(even(800.0), cam.Veil(0.3, 1e-3)), even(800.0)[0, 0], rtol=1e-9)
    np.testing.assert_array_equal(seen(disc, cam.Veil(0.0, half)), seen(disc))


@pytest.mark.parametrize("camera", [IDEAL, replace(IDEAL, psf_order="detector")])
def test_distortion_moves_where_pixels_see(camera):
    term = cam.Distortion(0.02, 250e-6)
    sensors = camera.pixels(SCENE)
    x, y = sensors.x, sensors.y[:, None]
    ramp = 700.0 + SCENE.x / 1e-6 + 0.5 * SCENE.y[:, None] / 1e-6
    farther = 1 + 0.02 * (x**2 + y**2) / 250e-6**2
    expected = 700.0 + (x + 0.5 * y) * farther / 1e-6
    image = seen(ramp, term, camera=camera)
    inside = (slice(8, -8), slice(8, -8))
    # The mean over a pixel is that of its middle but for 0.02 · x · 2 · 6² / 12 / R²: 0.03 at most.
    np.testing.assert_allclose(image[inside], expected[inside], atol=0.03)
    assert np.abs(image - seen(ramp, camera=camera))[inside].max() > 3.0


def test_the_blur_of_an_edge_grows_with_the_square_of_the_distance_from_the_axis():
    term, spacing = cam.FieldBlur(20e-6, 250e-6), SCENE.spacing
    border = SCENE.x[220] - spacing / 2
    edge = np.where(SCENE.x > border, 400.0, 0.0) * np.ones(SCENE.shape)
    camera = replace(IDEAL, pitch=spacing)
    x, y = SCENE.x - SCENE.x.mean(), (SCENE.y - SCENE.y.mean())[:, None]
    deviation = 20e-6 * (x**2 + y**2) / 250e-6**2
    expected = 400 * ndtr((SCENE.x - border) / deviation)
    image = seen(edge, term, camera=camera)
    # Between variances that double: the mixture of two Gaussians is off by 0.8 % at most.
    np.testing.assert_allclose(image, expected, atol=0.01 * 400)
    np.testing.assert_allclose(seen(even(800.0), term), even(800.0)[0, 0], rtol=DOUBLE)
    np.testing.assert_array_equal(seen(rough(), cam.FieldBlur(0.0, 250e-6)), seen(rough()))


def test_form_image_stands_alone():
    camera, radiance = cam.Camera(psf=cam.GaussianPSF(8e-6)), rough()
    image = camera.form_image(radiance, SCENE)
    assert image.shape == camera.pixels(SCENE).shape
    frames = measurement_of(camera, image[None], np.zeros(1), SCENE)
    np.testing.assert_array_equal(frames.radiance[0], image)
    for wrong in (radiance[1:], np.where(radiance > 890, np.nan, radiance), -radiance):
        with pytest.raises(ValueError, match="camera: radiance"):
            camera.form_image(wrong, SCENE)


STUDY = """\
camera:
  psf:
    kind: pupil
    numerical_aperture: 0.28
    obscuration: 0.35
    defocus: 10 um
    zernike: {8: -120 nm, 11: 0.2 um}
  blur:
    - {kind: jitter, standard_deviation: 1 um}
  optics:
    - {kind: element, transmittance: 0.9, temperature: 40 degC, calibrated_at: 25 degC}
    - {kind: narcissus, reflectance: 0.01, radius: 150 um}
    - {kind: veil, fraction: 0.03, radius: 300 um}
    - {kind: distortion, fraction: 0.01, radius: 300 um}
"""


def test_a_study_chooses_them(tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    study = load_study(path)
    camera = study.camera.build()
    pupil = cam.PupilPSF(BAND, 0.28, 0.35, 10e-6, ((8, -0.12e-6), (11, 0.2e-6)))
    assert camera == replace(
        cam.Camera.paper(),
        psf=cam.BlurredPSF(pupil, (cam.Jitter(1e-6),)),
        optics=(
            cam.OpticalElement(0.9, 313.15, 298.15),
            cam.Narcissus(0.01, 150e-6),
            cam.Veil(0.03, 300e-6),
            cam.Distortion(0.01, 300e-6),
        ),
    )
    path.write_text(study_text(study))
    assert load_study(path) == study
    assert Study().camera.build() == cam.Camera.paper()
