"""Emissivity maps: textures, blends, and how they move."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tolerances import DOUBLE, SINGLE

from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Raster, Scene
from chipglow.study import Study
from chipglow.study.surface_section import surfaces_of
from chipglow.surface import (
    CHIP_1,
    CHIP_2,
    Dispersion,
    Emissivity,
    EmissivityStack,
    Fresnel,
    HagenRubens,
    ParabolicOxide,
    SpectralTable,
    Texture,
    UniformSurface,
    Wedge,
    chip_fraction,
    shear_band_fraction,
)
from chipglow.surface.feature import _blend
from chipglow.surface.texture import MAP_SIZE, _look_up

RASTER = Raster(left=-60e-6, top=80e-6, spacing=2e-6, rows=50, columns=60)
VOID, WORKPIECE, TOOL = 0, 1, 2


def texture(mean=0.5, standard_deviation=0.05, grain=20e-6, seed=1, restore=True):
    generator = np.random.default_rng(seed)
    emissivity = Emissivity(mean, standard_deviation)
    return Texture.random(emissivity, grain, generator, restore_standard_deviation=restore)


def a_scene(times=(0.0,), coordinates=None, raster=RASTER, **changed):
    """A scene of workpiece at rest; fields that are changed broadcast over (time, y, x)."""
    shape = (len(times), *raster.shape)
    values = {**dict.fromkeys(FIELD_UNITS, 0.0), "temperature": 300.0, "material": WORKPIECE}
    values.update(changed)
    if coordinates is not None:
        values["material_x"], values["material_y"] = coordinates
    fields = {name: np.broadcast_to(value, shape) for name, value in values.items()}
    return Scene.from_fields(raster, times, fields)


def a_random_scene(seed):
    generator = np.random.default_rng(seed)
    shape = (1, *RASTER.shape)
    return a_scene(
        coordinates=generator.uniform(-1e-3, 1e-3, (2, *shape)),
        plastic_strain=generator.uniform(0.0, 0.8, shape),
        plastic_strain_rate=generator.uniform(0.0, 4e4, shape),
        material=generator.integers(0, 3, shape).astype(np.uint8),
    )


def at_rest(raster=RASTER):
    return np.meshgrid(raster.x, raster.y)


def keys(distance):
    """Cubic convolution with a = -1/2: 1 and 0 at the nodes, 9/16 and -1/16 half way between."""
    u = abs(distance)
    if u <= 1:
        return 1.5 * u**3 - 2.5 * u**2 + 1
    return -0.5 * u**3 + 2.5 * u**2 - 4 * u + 2 if u < 2 else 0.0


def keys_by_hand(nodes, u, v):
    """Bicubic enlarging, node by node: Keys' kernel across and down, the map repeated."""
    total = 0.0
    for i in range(int(np.floor(v)) - 1, int(np.floor(v)) + 3):
        for j in range(int(np.floor(u)) - 1, int(np.floor(u)) + 3):
            total += keys(u - j) * keys(v - i) * nodes[i % MAP_SIZE, j % MAP_SIZE]
    return total


@given(st.floats(-500.0, 500.0), st.floats(-500.0, 500.0))
@settings(max_examples=100)
def test_enlarging_is_bicubic(u, v):
    map_ = texture(grain=1.0)
    expected = 0.5 + 0.05 * keys_by_hand(map_.nodes, u, v)
    # Eight sums and products one after another of float32 numbers up to 5, times 0.05: 1.2e-7;
    # as much by the rounding of their weights, and 0.6e-7 of the result.
    assert map_.at(u, v) == pytest.approx(expected, abs=3e-7)


def samples(map_):
    """Values at even steps over one period, ten to a node: good to 1e-4 of their scatter."""
    position = np.arange(10 * MAP_SIZE) * map_.grain / 10
    return map_.at(position[None, :], position[:, None]).astype(np.float64)


def test_restoring_gives_the_deviation_asked_for():
    # The sampled standard deviation is good to 1e-4 of itself.
    assert samples(texture(0.42, 0.07)).std() == pytest.approx(0.07, rel=1e-4)


def test_without_restoring_enlarging_takes_a_fifth():
    # Over many maps the variance falls by the square of ∫k², which for the cubics is 57/70.
    found = samples(texture(0.5, 0.05, restore=False)).std()
    # 16384 deviates: 0.55 % standard deviation of a standard deviation; four of it.
    assert found == pytest.approx(0.05 * 57 / 70, rel=0.022)


@pytest.mark.parametrize(
    ("mean", "standard_deviation"),
    [(0.05, 0.04), (0.03, 0.03), (0.95, 0.06), (0.5, 0.3), (0.42, 0.09)],
)
def test_low_and_high_emissivities_keep_mean_and_deviation_within_0_to_1(mean, standard_deviation):
    """Cut off at 0, mean and standard deviation of the first would be 0.057 and 0.033."""
    maps = [texture(mean, standard_deviation, seed=seed) for seed in range(12)]
    values = np.concatenate([samples(map_).ravel() for map_ in maps])
    assert not Emissivity(mean, standard_deviation).is_normal
    assert values.min() >= 0.0
    assert values.max() <= 1.0  # no emissivity is beyond these
    # What would be cut off is 11 % of the first; of a beta distribution float32 rounds a few.
    assert ((values == 0.0) | (values == 1.0)).mean() < 1e-3
    # 12 x 16384 deviates: four standard errors of the mean, and as much of a deviation whose
    # fourth moment is under eight times that of a normal distribution.
    error = 1.25 * standard_deviation / (MAP_SIZE * np.sqrt(12))
    assert values.mean() == pytest.approx(mean, abs=4 * error)  # four standard errors
    # Four standard errors, at most.
    assert values.std() == pytest.approx(standard_deviation, abs=4 * error * 2)


def test_surfaces_beside_each_other_are_those_alone():
    scene = a_random_scene(7)
    frame = scene.frame(0)
    many = [replace(chip, seed=seed) for seed in (3, 1, 2) for chip in (CHIP_1, CHIP_2)]
    low = replace(CHIP_1, chip=Emissivity(0.05, 0.04))
    for surfaces in ([*many, low], [CHIP_1, UniformSurface(0.3), low], [CHIP_2]):
        fields = [surface.prepare(scene) for surface in surfaces]
        found = EmissivityStack(fields).emissivities(frame)
        for one, field in zip(found, fields, strict=True):
            # The sums of one map and of several are fused in another order: one unit of float32.
            np.testing.assert_allclose(one, field.emissivity(frame), rtol=0, atol=1.2e-7)


def test_same_seed_same_maps_and_each_feature_its_own():
    again, other = replace(CHIP_1), replace(CHIP_1, seed=2)
    first, again, other = (chip.textures for chip in (CHIP_1, again, other))
    for name in first:
        np.testing.assert_array_equal(first[name].nodes, again[name].nodes)
        assert not np.array_equal(first[name].nodes, other[name].nodes)
    deviates = [texture.nodes.ravel() for texture in first.values()]
    # Independent streams: correlations of 16384 pairs scatter by 1/128; four of it.
    correlation = np.corrcoef(deviates) - np.eye(4)
    assert np.abs(correlation).max() < 4 / MAP_SIZE


def test_presets_are_table_1():
    for surface, chip, band in (
        (CHIP_1, (0.42, 0.07), (0.53, 0.05)),
        (CHIP_2, (0.77, 0.03), (0.85, 0.02)),
    ):
        assert (surface.chip.mean, surface.chip.standard_deviation) == chip
        assert (surface.shear_band.mean, surface.shear_band.standard_deviation) == band
        assert surface.workpiece == Emissivity(0.40, 0.03)
        assert surface.tool == Emissivity(0.58, 0.06)
        features = (surface.chip, surface.shear_band, surface.workpiece, surface.tool)
        assert all(feature.is_normal for feature in features)


def test_shares_of_the_blends():
    np.testing.assert_allclose(chip_fraction([0, 0.3, 0.35, 0.4, 0.5, 7]), [0, 0, 0.25, 0.5, 1, 1])
    np.testing.assert_allclose(
        shear_band_fraction([0, 6e3, 12e3, 18e3, 30e3, 1e6]), [0, 0, 0.25, 0.5, 1, 1], atol=DOUBLE
    )


def greatest_slope(map_):
    """Greatest change of a map along a node's width, from differences over a tenth of it."""
    values = samples(map_)
    return 10 * max(np.abs(np.diff(values, axis=axis)).max() for axis in (0, 1))


@given(st.integers(0, 2**32))
@settings(max_examples=10)
def test_blend_against_plain_numpy(seed):
    scene = a_random_scene(seed)
    frame = scene.frame(0)
    maps = {
        name: CHIP_1.textures[name].at(frame.material_x, frame.material_y)
        for name in ("workpiece", "chip", "shear_band")
    }
    chip, band = chip_fraction(frame.plastic_strain), shear_band_fraction(frame.plastic_strain_rate)
    expected = (1 - chip) * maps["workpiece"] + chip * maps["chip"]
    expected = (1 - band) * expected + band * maps["shear_band"]
    tool = CHIP_1.textures["tool"].at(RASTER.x[None, :], RASTER.y[:, None])
    expected = np.choose(frame.material, [np.zeros_like(tool), expected, tool])
    # Positions of up to 50 nodes are rounded to float32, by 2^-19 across and down: the steepest
    # slope of a map times that. Besides, some 16 roundings of numbers below 1.
    steepest = max(greatest_slope(CHIP_1.textures[name]) for name in maps)
    found = CHIP_1.prepare(scene).emissivity(frame)
    assert found.dtype == np.float32
    tolerance = 2 * steepest * 2.0**-19 + 16 * 2.0**-24
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance)


def test_void_is_0_and_the_tool_does_not_move():
    material = np.full(RASTER.shape, WORKPIECE)
    material[:, :20], material[:, 40:] = VOID, TOOL
    x, y = at_rest()
    times = (0.0, 1e-6, 2e-6)
    moved = (np.stack([x, x - 4e-6, x - 8e-6]), np.stack([y, y, y]))
    scene = a_scene(times, moved, material=material, velocity_x=4.0)
    for follow in ("material", "mean"):
        field = replace(CHIP_1, follow=follow).prepare(scene)
        maps = [field.emissivity(frame) for frame in scene.frames()]
        tool = CHIP_1.textures["tool"].at(x[:, 40:], y[:, 40:])
        for found in maps:
            assert (found[:, :20] == 0).all()
            np.testing.assert_array_equal(found[:, 40:], tool)
        assert not np.array_equal(maps[0][:, 20:40], maps[2][:, 20:40])


STATES = {"workpiece": (0.0, 0.0), "chip": (0.9, 100.0), "shear_band": (0.9, 5e4)}


@pytest.mark.parametrize("feature", STATES)
@pytest.mark.parametrize("follow", ["material", "mean"])
def test_texture_moves_with_the_material(feature, follow):
    # Three columns right a frame, and two rows up; the workpiece's map goes along the cut only.
    across, up = 3, 0 if feature == "workpiece" else 2
    step, times = RASTER.spacing, np.array([0.0, 1e-6, 2e-6, 3e-6])
    velocity = (across * step / 1e-6, up * step / 1e-6)
    pairs = zip(at_rest(), velocity, strict=True)
    coordinates = [grid - speed * times[:, None, None] for grid, speed in pairs]
    names = ("plastic_strain", "plastic_strain_rate", "velocity_x", "velocity_y")
    state = dict(zip(names, (*STATES[feature], *velocity), strict=True))
    scene = a_scene(times, coordinates, **state)
    field = replace(CHIP_1, follow=follow).prepare(scene)
    first, *_, last = (field.emissivity(frame) for frame in scene.frames())
    down, right = RASTER.rows - 3 * up, RASTER.columns - 3 * across
    moved, still = last[:down, 3 * across :], first[3 * up :, :right]
    # Positions in float32 are good to 1e-11 m, and the texture changes by 0.01 a micrometre;
    # emissivities are rounded twice.
    np.testing.assert_allclose(moved, still, rtol=0, atol=4e-7)
    assert first.std() > 0.01


def mean_shift(scene):
    return replace(CHIP_1, follow="mean").prepare(scene).features.shift


def test_mean_shift_is_velocity_times_time():
    times = np.array([0.0, 1e-6, 3e-6, 4e-6])
    upper = (RASTER.y > 0)[:, None]
    middle = np.abs(RASTER.x) < 20e-6
    scene = a_scene(
        times,
        plastic_strain=np.where(upper, 0.9, 0.0),
        plastic_strain_rate=np.where(upper & middle, 5e4, 0.0),
        velocity_x=np.where(upper, np.where(middle, 2.0, 1.0), 4.0),
        velocity_y=np.where(upper, np.where(middle, 1.5, 3.0), 0.5),
    )
    shift = mean_shift(scene)
    velocity = np.array([[4.0, 0.0], [1.0, 3.0], [2.0, 1.5]])
    for time in (0.0, 0.4e-6, 2e-6, 4e-6):
        np.testing.assert_allclose(shift(time), velocity * time, rtol=SINGLE, atol=1e-18)  # in m


def test_mean_shift_integrates_a_changing_velocity():
    times = np.linspace(0.0, 4e-6, 5)
    speed = 2.0 + 1e6 * times
    found = mean_shift(a_scene(times, velocity_x=speed[:, None, None]))(4e-6)
    # The trapezoidal rule is exact for a velocity that rises linearly.
    np.testing.assert_allclose(found, [[2.0 * 4e-6 + 0.5e6 * 4e-6**2, 0.0], [0.0] * 2, [0.0] * 2])


def test_a_feature_keeps_its_velocity_while_it_is_not_seen():
    times = np.array([0.0, 1e-6, 2e-6])
    rate = np.array([5e4, 0.0, 5e4])[:, None, None]
    scene = a_scene(times, plastic_strain=0.9, plastic_strain_rate=rate, velocity_y=3.0)
    np.testing.assert_allclose(mean_shift(scene)(2e-6)[2], [0.0, 6e-6])


def test_a_uniform_surface_is_black_but_for_the_void():
    material = np.full(RASTER.shape, WORKPIECE)
    material[0], material[1] = VOID, TOOL
    scene = a_scene(material=material)
    found = UniformSurface(1.0).prepare(scene).emissivity(scene.frame(0))
    assert (found[0] == 0).all()
    assert (found[1:] == 1).all()


def test_no_kernel_of_the_surface_waits_by_spinning():
    for kernel in (_blend, _look_up):
        assert kernel.targetoptions.get("nogil") and not kernel.targetoptions.get("parallel")


def test_a_study_lays_modifiers_over_each_other():
    metal = {"kind": "hagen-rubens", "resistivity": "6e-7 ohm*m", "coefficient": "0.005 K^-1"}
    section = {
        "spectral": metal,
        "measured_in": "3-5 um",
        "oxide": {"kind": "parabolic", "initial": "3 nm"},
        "directional": {"kind": "fresnel", "n": 4.6, "k": 15, "tilt": "10 deg"},
        "reflections": {"kind": "wedge", "angle": "60 deg"},
    }
    surface = surfaces_of(Study(surface=section).surface, 7)["chip 1"]
    law = HagenRubens(6e-7, 0.005)
    spectral, oxide, direction, shape = surface.modifiers
    assert (spectral, oxide) == (Dispersion(law, Band(3e-6, 5e-6)), ParabolicOxide(initial=3e-9))
    assert direction == Fresnel(n=4.6, k=15.0, tilt=direction.tilt)
    assert shape == Wedge(angle=shape.angle)
    assert np.degrees([direction.tilt, shape.angle]) == pytest.approx([10.0, 60.0])
    assert surfaces_of(Study().surface, 7)["chip 1"] == replace(CHIP_1, seed=7)
    assert surface.redrawn(2).bare.seed == 9
    assert Study(surface=metal).surface == law
    table = {"kind": "spectral", "table": [["3 um", "20 degC", 0.3], ["5 um", "20 degC", 0.2]]}
    rows = (3e-6, 293.15, 0.3), (5e-6, 293.15, 0.2)
    assert Study(surface=table).surface == SpectralTable(rows)
