"""Regions over edges: the stated interval holds the temperature of the larger part."""

import numpy as np
import pytest
from heated_chip import BAND, CELSIUS
from scipy.special import ndtr

from chipglow.camera import Flag, Measurement
from chipglow.laboratory import emissivity as em
from chipglow.laboratory.emissivity.uniformity import noise_around, uniformity
from chipglow.scene import Area, Raster

RASTER = Raster(0.0, 0.0, 6e-6, 40, 60)
TRUE, COLD = 650.0 + CELSIUS, 400.0 + CELSIUS
NOISE = 5.0
"""In W/(m² sr); 0.5 K at 650 °C."""


def edge_image(seed, frames, angle=0.0, blur=1.3):
    """An edge near column 30, hot on its left, of emissivity 0.42; blur in pixels."""
    generator = np.random.default_rng(seed)
    y, x = np.mgrid[: RASTER.rows, : RASTER.columns] + 0.5
    distance = (30 + generator.uniform(-0.5, 0.5) - x) * np.cos(angle) + (20 - y) * np.sin(angle)
    hot, cold, room = BAND.radiance(np.array([TRUE, COLD, 293.0]))
    part = ndtr(distance / blur)
    radiance = 0.42 * (part * hot + (1 - part) * cold) + 0.58 * room
    radiance = radiance + NOISE * generator.standard_normal((frames, *RASTER.shape))
    found = Measurement.from_radiance(radiance, BAND, np.arange(frames) / 600.0, RASTER)
    vars(found)["band"] = BAND  # the same, with its tables
    return found


def rectangle(rows, columns, right):
    mask = np.zeros(RASTER.shape, np.bool_)
    mask[15 : 15 + rows, right - columns : right] = True
    return Area("region", "region", mask, True)


def temperature(image, area):
    return em.true_temperature([image], area, em.EmissivityLine.constant(0.42))


@pytest.mark.parametrize("frames", [1, 5])
@pytest.mark.parametrize("side", [2, 3, 5, 10, 20])
def test_intervals_hold_the_truth_at_all_offsets_from_an_edge(side, frames):
    """Regions from far inside to 30 % beyond the edge, 8 offsets with 15 images each.

    Of 120 intervals of 95 %, 107 or more hold it with a probability of 0.99; without the unevenness
    it is fewer than 60.
    """
    reaches = np.linspace(-8, 0.3 * side, 8).round().astype(int)
    held = 0
    for reach in reaches:
        for seed in range(15):
            image = edge_image(seed, frames, 0.5 * (seed % 2))
            found = temperature(image, rectangle(side, side, 30 + reach)).estimate
            held += abs(found.values - TRUE) <= found.expanded_uncertainty()
    assert held >= 107


@pytest.mark.parametrize("emissivity_uncertainty", [0.0, 0.2])
def test_unevenness_is_told_however_uncertain_the_emissivity_is(emissivity_uncertainty):
    line = em.EmissivityLine.constant(0.42, emissivity_uncertainty)
    image = edge_image(1, 5)
    over = em.true_temperature([image], rectangle(10, 10, 31), line).estimate
    assert "region: is uneven: across it the true temperature varies by" in over.warnings[0]
    inside = em.true_temperature([image], rectangle(10, 10, 20), line).estimate
    assert inside.warnings == ()
    assert inside.contribution("uniformity") == 0


def test_the_emissivity_of_a_region_follows_the_same_rule():
    heating = em.Heating(TRUE)
    found = em.determine_emissivity([edge_image(3, 5)], heating)
    over, inside = (found.of(rectangle(12, 12, right)) for right in (31, 20))
    assert abs(over.mean - 0.42) > 0.01
    assert abs(over.mean - 0.42) <= over.estimate.expanded_uncertainty()
    assert any("emissivity varies by" in text for text in over.estimate.warnings)
    assert inside.estimate.warnings == ()
    assert abs(inside.mean - 0.42) <= 3 * inside.estimate.standard_uncertainty


def test_texture_and_noise_alone_are_even():
    """At 1 % for counting, of 200 regions 8 or fewer count with a probability of 0.999."""
    mask = np.ones((12, 12), np.bool_)
    counted = sum(
        uniformity(mask, 100 + np.random.default_rng(seed).normal(0, 1, (3, 144)))
        .standard_deviation > 0
        for seed in range(200)
    )  # fmt: skip
    assert counted <= 8


@pytest.mark.parametrize("fraction", [0.1, 0.2, 0.3, 0.5])
def test_a_step_has_the_standard_deviation_of_its_surface(fraction):
    """A strip of a fraction f along one side: R² = 3 f (1 − f) + 5 f (1 − f) (1 − 2 f)².

    These are the squares of the projections on Legendre's polynomials of first and second order.
    """
    side = 100
    x = (np.arange(side) + 0.5) / side
    image = np.broadcast_to((x < fraction).astype(float), (side, side))
    found = uniformity(np.ones((side, side), np.bool_), image.reshape(1, -1))
    variance = fraction * (1 - fraction)
    explained = 3 * variance + 5 * variance * (1 - 2 * fraction) ** 2
    # By chance, 5 of 10 000 pixels times the 49 that vary together.
    assert found.standard_deviation == pytest.approx(np.sqrt(explained * variance), rel=0.03)
    assert found.is_uneven
    assert 1.96 * found.standard_deviation > fraction  # of the mean, by the strip


def test_one_pixel_is_a_region_with_its_own_noise():
    several, single = edge_image(2, 200), edge_image(2, 1)
    pixel = rectangle(1, 1, 10)
    kelvins = NOISE / 0.42 / BAND.slope(TRUE)
    found = temperature(several, pixel).estimate
    # The standard deviation of 200 frames is known to 5 %; three of them.
    assert found.contribution("noise") == pytest.approx(kelvins / np.sqrt(200), rel=0.15)
    assert np.isfinite(found.expanded_uncertainty())
    # Of 24 pixels around it, to 15 %.
    alone = temperature(single, pixel).estimate
    # Three times 15 %.
    assert alone.contribution("noise") == pytest.approx(kelvins, rel=0.45)
    assert np.isnan(alone.contribution("repeatability"))
    row = em.determine_emissivity([single], em.Heating(TRUE)).of(pixel)
    assert abs(row.mean - 0.42) <= row.estimate.expanded_uncertainty()
    assert np.isnan(row.standard_deviation)


def test_a_pixel_beside_dead_ones_has_no_known_noise():
    mask = np.zeros((9, 9), np.bool_)
    mask[4, 4] = True
    radiance = np.full((9, 9), np.nan)
    radiance[4, 3:6] = 1.0
    assert np.isnan(noise_around(mask, radiance))
    flags = np.zeros((1, *RASTER.shape), np.uint8)
    flags[0, 10:22] = Flag.DEAD
    flags[0, 15, 9] = 0
    image = edge_image(1, 1)
    dead = Measurement.from_radiance(image.radiance, BAND, np.zeros(1), RASTER, flags=flags)
    found = temperature(dead, rectangle(1, 1, 10)).estimate
    assert np.isnan(found.contribution("noise"))
