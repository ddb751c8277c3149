"""Oxide by the parabolic law along material points: closed forms, and a block that moves."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tolerances import SINGLE

from chipglow.scene import Raster, Scene
from chipglow.surface import OxideHistory, ParabolicOxide, UniformSurface

RASTER = Raster(0.0, 60e-6, 1e-6, 60, 80)
OXIDE = ParabolicOxide()
BARE = 0.42
SURFACE = UniformSurface(BARE).modified(OXIDE)


def scene(times, temperature, speed=0.0, material=1):
    """A block that moves to the right in m/s, whose temperature is a function of (t, X, Y)."""
    times = np.asarray(times, float)
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    origin = [x - speed * time for time in times]
    fields = {
        "temperature": np.stack(
            [temperature(t, of, y) for t, of in zip(times, origin, strict=True)]
        ),
        "material": np.full((len(times), *RASTER.shape), material, np.uint8),
        "material_x": np.stack(origin),
        "material_y": np.stack([y] * len(times)),
    }
    return Scene.from_fields(RASTER, times, fields)


def grown(made, index, oxide=OXIDE):
    return OxideHistory.from_scene(made, oxide).thickness(made.frame(index))


@given(st.floats(500.0, 1400.0), st.floats(1e-6, 1e-3), st.floats(0.0, 20e-9))
@settings(max_examples=20)
def test_at_one_temperature_it_is_the_root_of_time(kelvins, duration, initial):
    made = scene(np.linspace(0, duration, 4), lambda t, x, y: np.full(x.shape, kelvins))
    found = grown(made, 3, ParabolicOxide(initial))
    expected = np.sqrt(initial**2 + OXIDE.growth(kelvins) * duration)
    # Scenes and sums are float32.
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_it_converges_with_the_square_of_the_interval():
    def error(count):
        times = np.linspace(0, 100e-6, count + 1)
        made = scene(times, lambda t, x, y: np.full(x.shape, 700.0 + 4e6 * t))
        fine = 700.0 + 4e6 * np.linspace(0, 100e-6, 100_001)
        exact = np.trapezoid(OXIDE.growth(fine), dx=1e-9)
        return abs(float(grown(made, count)[0, 0]) ** 2 - exact)

    # Of second order; the fourth is about (1/8)² of it.
    assert error(8) / error(16) == pytest.approx(4, rel=0.02)


def test_oxide_follows_the_material_and_not_the_place():
    """A hot strip of the block moves with it: oxide is where the strip is, not where it was."""
    speed, times = 1.0, 1e-6 * np.arange(31)

    def strip(t, x, y):
        return np.where((x > 20e-6) & (x < 32e-6), 1200.0, 300.0)

    made = scene(times, strip, speed)
    thickness = grown(made, 30)
    inside = (RASTER.x - 30e-6 > 24e-6) & (RASTER.x - 30e-6 < 28e-6)  # a cell from the edges
    away = (RASTER.x - 30e-6 < 15e-6) | (RASTER.x - 30e-6 > 37e-6)
    expected = np.sqrt(OXIDE.growth(1200.0) * 30e-6)
    # The strip's 30 um come through 30 frames, in each of which the whole cell is in it.
    np.testing.assert_allclose(thickness[:, inside], expected, rtol=1e-4)
    assert thickness[:, away].max() < 1e-3 * expected
    emissivity = SURFACE.prepare(made).emissivity(made.frame(30))
    np.testing.assert_allclose(
        emissivity[:, inside], OXIDE.of_thickness(BARE, expected), rtol=SINGLE
    )


def test_what_comes_into_view_later_grows_from_then_on():
    speed, times = 1.0, 1e-6 * np.arange(41)
    made = scene(times, lambda t, x, y: np.full(x.shape, 1000.0), speed)
    thickness = grown(made, 40)
    # The left column came into view a moment ago, the right of 40 um at the beginning.
    assert thickness[:, -1] == pytest.approx(np.sqrt(OXIDE.growth(1000.0) * 40e-6), rel=1e-4)
    since = (RASTER.x[10] - RASTER.left) / speed
    # In cells of 4 um: what is seen of one first counts for all of it.
    assert thickness[0, 10] ** 2 / OXIDE.growth(1000.0) == pytest.approx(since, abs=5e-6)


def test_the_tool_has_none_and_none_is_none():
    made = scene([0.0, 1e-3], lambda t, x, y: np.full(x.shape, 1200.0), material=2)
    assert not grown(made, 1).any()
    np.testing.assert_allclose(SURFACE.prepare(made).emissivity(made.frame(1)), BARE)
    assert OXIDE.of_thickness(BARE, 0.0) == BARE
    assert OXIDE.of_thickness(BARE, 1e-3) == pytest.approx(OXIDE.emissivity)


def test_growth_is_that_of_arrhenius():
    ratio = OXIDE.growth(1273.15) / OXIDE.growth(973.15)
    assert np.log(ratio) == pytest.approx(169_452 / 8.314462618 * (1 / 973.15 - 1 / 1273.15))
    # By hand at 700 °C: 6.1e-4 exp(-20.943) = 4.9e-13 m²/s, so 7 nm in 100 us.
    assert np.sqrt(OXIDE.growth(973.15) * 100e-6) == pytest.approx(7.0e-9, rel=0.01)
