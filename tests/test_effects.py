"""The effects of the chain: every way to switch one off gives the same kelvins."""

from dataclasses import replace

import numpy as np
import pytest
from analytic_chip import AnalyticChip
from tolerances import DOUBLE

from chipglow.analysis import attribute, error_images, error_parts
from chipglow.camera import (
    EVERY,
    Camera,
    Chain,
    Detector,
    Effect,
    EnergyResponse,
    GaussianPSF,
    ReadNoise,
    ShotNoise,
    Veil,
)
from chipglow.scene import Raster, Scene
from chipglow.surface import CHIP_1, CHIP_2, UniformSurface

DETECTOR = Detector(
    response=EnergyResponse(1e3), full_well=1e7, terms=(ShotNoise(), ReadNoise(2000.0))
)
CAMERA = Camera(
    pitch=6e-6,
    psf=GaussianPSF(9e-6),
    optics=(Veil(0.03, 30e-6),),
    reflected=600.0,
    integration_time=6e-6,
    detector=DETECTOR,
)
OF_ONE_CAMERA = tuple(
    effect for effect in Effect if effect not in (Effect.MISREGISTRATION, Effect.DELAY)
)
# Two orders of the same sums of double precision, at about 1000 K.
ROUNDING = 1e-9


def moving():
    """A hot band that moves across the pixels."""
    raster = Raster(left=-48e-6, top=48e-6, spacing=2e-6, rows=48, columns=48)
    times = 1e-6 * np.arange(12)
    x, y = np.meshgrid(raster.x, raster.y)
    frames = [700 + 500 * np.exp(-(((x + 0.3 * y - 3.0 * t) / 8e-6) ** 2)) for t in times]
    return Scene.from_fields(raster, times, {"temperature": np.stack(frames)})


@pytest.fixture(scope="module")
def scenes():
    chip = AnalyticChip().scene()
    return {
        "band": (moving(), UniformSurface(0.6), 0.0),
        "chip 1": (chip, CHIP_1, 12e-6),
        "chip 2": (chip, CHIP_2, 20e-6),
    }


def without(effect, camera, surface):
    """Describe camera and surface anew, without an effect; None where the camera always has it."""
    if effect is Effect.EMISSIVITY:
        return camera, UniformSurface(1.0)
    changes = {
        Effect.REFLECTION: {"reflected": None},
        Effect.PSF: {"psf": None},
        Effect.OPTICS: {"optics": ()},
        Effect.DETECTOR: {"detector": replace(DETECTOR, terms=())},
        Effect.DIGITISER: {"detector": DETECTOR.undigitised()},
    }
    return (replace(camera, **changes[effect]), surface) if effect in changes else None


@pytest.mark.parametrize("effect", OF_ONE_CAMERA)
@pytest.mark.parametrize("name", ["band", "chip 1", "chip 2"])
def test_every_way_to_switch_an_effect_off_gives_the_same_reading(scenes, name, effect):
    scene, surface, start = scenes[name]
    exposed = Chain(CAMERA, scene, surface).at(start)
    off = exposed.reading(EVERY - {effect})
    # By the Shapley values' own table.
    data = attribute(scene, CAMERA, surface, start)
    removed = (data.measured - data.removal.sel(effect=effect)).values
    np.testing.assert_allclose(removed, off, atol=ROUNDING)
    # By another description of camera or surface.
    if described := without(effect, CAMERA, surface):
        camera, bare = described
        measured = camera.measure(scene, bare, start)
        radiance = measured.radiance[0]
        expected = np.where(np.isnan(off), np.nan, camera.band.temperature(radiance))
        np.testing.assert_allclose(expected, off, atol=ROUNDING)
    # The effect does something.
    assert np.nanmax(np.abs(exposed.reading() - off)) > 1e-3


@pytest.mark.parametrize("name", ["band", "chip 1", "chip 2"])
def test_the_cases_and_parts_are_readings_of_the_chain(scenes, name):
    scene, surface, start = scenes[name]
    chain = Chain(CAMERA, scene, surface)
    exposed = chain.at(start)
    errors = error_images(CAMERA, exposed.exposure)
    ideal = exposed.reading(EVERY - {Effect.PSF}) - exposed.reference()
    np.testing.assert_allclose(errors.case_2, ideal, atol=ROUNDING)
    parts = error_parts(CAMERA, exposed.exposure, "true-maximum")
    true = chain.at(start, "true-maximum")
    lit = {Effect.EMISSIVITY, Effect.REFLECTION}
    np.testing.assert_allclose(
        parts.emissivity, true.reading(lit) - true.reference(), atol=ROUNDING
    )
    names = "emissivity", "motion", "footprint", "optics", "psf", "detector"
    np.testing.assert_allclose(sum(parts[one] for one in names), parts.case_1, atol=ROUNDING)


@pytest.mark.parametrize("kind", ["maximum", "mean", "centre"])
def test_a_reading_without_effects_is_the_reference(scenes, kind):
    scene, surface, start = scenes["chip 1"]
    exposed = Chain(CAMERA, scene, surface).at(start, kind)
    np.testing.assert_array_equal(exposed.reading(()), exposed.reference(f"true-{kind}"))
    lit = exposed.reading({Effect.EMISSIVITY, Effect.REFLECTION})
    np.testing.assert_allclose(lit, exposed.reference(), atol=ROUNDING)


def test_the_chain_is_linear_and_has_an_adjoint(scenes):
    scene, surface, _ = scenes["band"]
    chain = Chain(replace(CAMERA, detector=None), scene, surface)
    generator = np.random.default_rng(4)
    radiance = generator.random(scene.raster.shape)
    image = generator.random(CAMERA.pixels(scene.raster).shape)
    forward, back = chain.forward(radiance), chain.adjoint(image)
    assert np.vdot(forward, image) == pytest.approx(np.vdot(radiance, back), rel=DOUBLE)
