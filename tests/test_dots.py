"""Dots of a target in both images: found, put to each other, and the map that they give."""

from dataclasses import replace
from math import pi, radians

import numpy as np
import pytest
from command import typed, words
from dot_target import DotTarget
from hypothesis import given, settings, strategies as st
from PIL import Image
from scipy.ndimage import gaussian_filter
from scipy.stats import f

from chipglow.camera import Measurement
from chipglow.io import write_measurement
from chipglow.laboratory.registration import find_dots, fit_dots, load_registration
from chipglow.laboratory.registration.dot_matching import Arrangement, match_dots
from chipglow.radiometry import Band
from chipglow.scene import Raster

RASTER = Raster(left=-240e-6, top=180e-6, spacing=6e-6, rows=60, columns=80)
SMALL = DotTarget(
    columns=5,
    rows=4,
    spacing=80e-6,
    radius=20e-6,
    gaps=(7,),
    raster=RASTER,
    visible_shape=(240, 320),
)
CORNERS = np.array([[-200e-6, -150e-6], [200e-6, 150e-6], [0.0, 0.0]])


def drawn(seed):
    draw = np.random.default_rng([seed, 5]).uniform
    return replace(
        SMALL,
        seed=seed,
        noise=draw(0.002, 0.03),
        contrast=draw(0.2, 0.8),
        radius=draw(16e-6, 24e-6),
        turn=radians(draw(-20, 20)),
        pitch=draw(1.4e-6, 2e-6),
        jitter=draw(0.0, 5e-6),
    )


@pytest.mark.slow
def test_a_target_gives_the_map_within_its_uncertainty():
    """Hotelling's T^2 of three places in targets whose contrast, noise, turn and size differ."""
    inside = 0
    for seed in range(4):
        target = drawn(seed)
        found = fit_dots(target.infrared, RASTER, target.visible).registration
        assert found.method == "dots"
        off = found.pixels(CORNERS) - target.pixels(CORNERS)
        # A quarter of a pixel at the image's corner, beyond the outermost dots.
        assert np.abs(off).max() * target.pitch < 0.25 * RASTER.spacing
        limit = 2 * f.ppf(0.95, 2, found.degrees_of_freedom)
        for error, covariance in zip(off, found.pixel_covariance(CORNERS), strict=True):
            inside += error @ np.linalg.solve(covariance, error) < limit
    # Twelve trials, three to a target: at 0.95, one target whose three fail leaves nine.
    assert inside >= 9


@given(
    column=st.floats(-0.5, 0.5),
    row=st.floats(-0.5, 0.5),
    radius=st.floats(2.5, 6.0),
    sign=st.sampled_from([-1.0, 1.0]),
    slope=st.floats(-1e-3, 1e-3),
)
@settings(max_examples=12)
def test_dots_of_either_sign_are_found_at_a_fraction_of_a_pixel(column, row, radius, sign, slope):
    """Discs drawn eight times finer, blurred, in light that falls off to one side."""
    finer, spacing = 8, 5 * radius
    x = (np.arange(110 * finer) + 0.5) / finer - 0.5
    y = (np.arange(80 * finer) + 0.5) / finer - 0.5
    places = np.stack(
        np.meshgrid(column + 20 + spacing * np.arange(3), row + 20 + spacing * np.arange(2)), -1
    ).reshape(-1, 2)
    image = np.full((y.size, x.size), 100.0)
    for place in places:
        inside = radius - np.hypot(*np.meshgrid(x - place[0], y - place[1]))
        image += 60 * sign * np.clip(inside * finer + 0.5, 0.0, 1.0)
    image = gaussian_filter(image, 0.8 * finer) * (1 + slope * (x - 55))
    found = find_dots(image.reshape(80, finer, 110, finer).mean(axis=(1, 3)))
    assert found.bright == (sign > 0)
    # The blur, and the mean over a pixel, move half the height of a bent edge inward by half of
    # their variance over the radius; the next term is of the order of its square.
    variance = 0.8**2 + 1 / 12
    expected = radius - variance / (2 * radius)
    # That square; 0.3 of it measured.
    assert found.radius == pytest.approx(expected, abs=variance**2 / radius**3)
    apart = np.linalg.norm(found.pixels[:, None] - places, axis=-1)
    # The ramp that draws an edge is off the area it covers by at most 0.043 squares of an eighth of
    # a pixel, at a slant of 45 degrees; a disc's middle by 4 / pi of that if all are off one way.
    assert apart.min(axis=0).max() < 4 / pi * 0.043 / finer
    assert len(found.pixels) == len(places)


def errors(found, true):
    apart = np.linalg.norm(found.pixels[:, None] - true, axis=-1)
    # In pixels: nearer to a dot than to any other; 0.46 measured.
    assert apart.min(axis=1).max() < 1.0
    return found.pixels - true[apart.argmin(axis=1)]


def in_sensors(target):
    x, y = target.holes.T
    return np.stack([x - RASTER.x[0], RASTER.y[0] - y], axis=1) / RASTER.spacing


def test_the_uncertainty_of_a_dot_is_its_scatter_over_repeats():
    """Of white noise: 19 dots in three images; that of 114 errors is within 20 %."""
    pulls = []
    for seed in range(3):
        target = replace(SMALL, seed=100 + seed, noise=0.03)
        found = find_dots(target.infrared)
        pulls.append(errors(found, in_sensors(target)) / found.uncertainty[:, None])
    # That 20 %, three standard deviations.
    assert np.sqrt((np.concatenate(pulls) ** 2).mean()) == pytest.approx(1.0, abs=0.2)


def test_grain_whose_pixels_are_alike_makes_the_middles_less_sure():
    """With noise taken as white the errors would be five times what is stated."""
    target = replace(SMALL, contrast=0.3, visible_noise=1.0)
    found = find_dots(target.visible)
    pulls = errors(found, target.pixels(target.holes)) / found.uncertainty[:, None]
    assert 0.7 < np.sqrt((pulls**2).mean()) < 1.5  # 1.16 measured; 5 with noise taken as white


def test_the_skirts_of_blurred_neighbours_do_not_pull():
    """Dots without order, nearly as blurred as apart: with the skirts 0.22 pixels off."""
    target = replace(SMALL, radius=26e-6, blur=15e-6, jitter=4e-6, noise=1e-3)
    off = errors(find_dots(target.infrared), in_sensors(target))
    assert np.sqrt((off**2).mean()) < 0.06  # 0.03 measured; 0.22 with the skirts


@given(
    seed=st.integers(0, 2**32),
    turn=st.floats(-28.0, 28.0),
    scale=st.floats(0.6, 1.8),
    lost=st.integers(0, 3),
)
@settings(max_examples=12)
def test_an_arrangement_is_recognised(seed, turn, scale, lost):
    """Dots without order: some are missing in each image, some are in one only."""
    generator = np.random.default_rng(seed)
    places = np.stack(np.meshgrid(np.arange(6.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    places = 18 * (places + generator.uniform(-0.25, 0.25, places.shape)) + [30, 20]
    angle, middle = radians(turn), np.array([80.0, 60.0])
    linear = 4 * scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    seen = (places - middle) @ linear.T + 4 * middle + generator.normal(0, 0.3, places.shape)
    first = np.delete(np.arange(30), generator.choice(30, lost, replace=False))
    second = generator.permutation(np.delete(np.arange(30), generator.choice(30, lost, False)))
    (one, other), warnings = match_dots(
        Arrangement(places[first], (120, 160), 3.0), Arrangement(seen[second], (480, 640), 12.0)
    )
    assert (first[one] == second[other]).all()
    assert one.size == np.intersect1d(first, second).size
    assert warnings == ()


def a_grid(columns):
    x, y = np.meshgrid(np.arange(columns) * 20.0 + 30, np.arange(5) * 20.0 + 30)
    return np.stack([x, y], axis=-1).reshape(-1, 2)


def test_a_grid_that_goes_on_beyond_the_pictures_is_doubtful():
    """Seven columns in one and six of them in the other: where they belong is open."""
    whole = Arrangement(a_grid(7), (140, 180), 5.0)
    beyond = Arrangement(4 * a_grid(6) - [80, 0], (560, 520), 20.0)
    assert "match 80 visible pixels further on" in match_dots(whole, beyond)[1][0]
    decided = Arrangement(4 * a_grid(7), (560, 720), 20.0)
    assert match_dots(whole, decided)[1] == ()
    gap = np.delete(np.arange(35), 17)
    both = replace(whole, pixels=a_grid(7)[gap]), replace(decided, pixels=4 * a_grid(7)[gap])
    assert match_dots(*both)[1] == ()


def test_a_map_with_perspective_is_of_another_kind_than_an_affine_one():
    target = replace(SMALL, perspective=(200.0, -120.0))
    straight = fit_dots(target.infrared, RASTER, target.visible).registration
    assert any("another kind than the model" in warning for warning in straight.notes.warnings)
    found = fit_dots(target.infrared, RASTER, target.visible, "homography").registration
    assert found.notes.warnings == []
    # In pixels; 0.16 measured at the corners, beyond the dots.
    assert found.pixels(CORNERS) == pytest.approx(target.pixels(CORNERS), abs=0.5)


def test_dead_pixels_are_left_out():
    infrared = SMALL.infrared.copy()
    infrared[::9, ::7] = np.nan
    found = fit_dots(infrared, RASTER, SMALL.visible).registration
    # In pixels; 0.07 measured at the corners.
    assert found.pixels(CORNERS) == pytest.approx(SMALL.pixels(CORNERS), abs=0.2)


def test_the_command_registers_by_dots(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    radiance = np.repeat(SMALL.infrared[None], 2, axis=0)
    times = np.array([0.0, 1 / 600])
    measured = Measurement.from_radiance(radiance, Band(3.8e-6, 5.1e-6), times, RASTER)
    write_measurement(measured, "infrared.nc")
    Image.fromarray(SMALL.visible).save("visible.png")
    command = "register infrared.nc visible.png --dots --out map.yaml --overlay over.png"
    output = words(typed(command).output)
    assert "Infrared: 19 bright dots with a radius of" in output
    assert "Visible: 19 dark dots with a radius of" in output
    assert "Assumed: The visible picture is not mirrored, is turned by up to 30 degrees" in output
    found = load_registration("map.yaml")
    assert (found.method, found.notes.warnings) == ("dots", [])
    # In pixels; 0.03 measured at the corners.
    assert found.pixels(CORNERS) == pytest.approx(SMALL.pixels(CORNERS), abs=0.1)
    assert (tmp_path / "over.png").exists()
