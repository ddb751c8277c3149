"""Shapley values of the effects of a camera: closed forms, all orders, closure."""

from dataclasses import replace
from itertools import permutations
from math import factorial

import numpy as np
import pytest
from tolerances import DOUBLE

from chipglow.analysis import error_images
from chipglow.analysis.attribution import (
    REST,
    attribute,
    interaction_matrix,
    read_attribution,
    sampled_shapley,
    shapley_matrix,
)
from chipglow.analysis.places import HottestPlace
from chipglow.camera import (
    Camera,
    Detector,
    EnergyResponse,
    GaussianPSF,
    MeasuredPSF,
    ReadNoise,
    ShotNoise,
    Veil,
)
from chipglow.radiometry import Band
from chipglow.report import attribution
from chipglow.report.facts import Facts
from chipglow.scene import Raster, Scene
from chipglow.surface import UniformSurface

ROUNDING = 1e-10
"""In K: temperatures of 1000 K in double precision, 1e-13, after some sums."""

GRID = Raster(left=-48e-6, top=48e-6, spacing=2e-6, rows=48, columns=48)
DETECTOR = Detector(
    response=EnergyResponse(1e4), full_well=1e7, terms=(ShotNoise(), ReadNoise(2000.0))
)
CAMERA = Camera(
    band=Band(3.8e-6, 5.1e-6),
    pitch=6e-6,
    psf=GaussianPSF(8e-6),
    reflected=600.0,
    detector=DETECTOR,
    lower_limit=750.0,
)
# Sums of up to 256 temperatures of about 1000 K, each with a rounding of 1e-13 K.
ROUNDING = 1e-10


@pytest.fixture(scope="module")
def scene():
    """A hot band that moves across the pixels."""
    times = 1e-6 * np.arange(12)
    x, y = np.meshgrid(GRID.x, GRID.y)
    frames = [700 + 500 * np.exp(-(((x + 0.3 * y - 3.0 * t) / 8e-6) ** 2)) for t in times]
    return Scene.from_fields(GRID, times, {"temperature": np.stack(frames)})


def error_of(data):
    return (data.measured - data.reference).values


def test_the_matrix_gives_the_mean_over_all_orders():
    count, generator = 5, np.random.default_rng(1)
    values = generator.normal(size=2**count)
    mean = np.zeros(count)
    for order in permutations(range(count)):
        coalition = 0
        for player in order:
            mean[player] += values[coalition | 1 << player] - values[coalition]
            coalition |= 1 << player
    mean /= factorial(count)
    np.testing.assert_allclose(shapley_matrix(count) @ values, mean, atol=DOUBLE)


def test_interactions_are_those_of_the_products_of_a_polynomial():
    # v = 3 a b + 2 a b c: the index of a pair is its coefficient, and half of the triple's.
    values = [3 * a * b + 2 * a * b * c for c in (0, 1) for b in (0, 1) for a in (0, 1)]
    expected = [[0, 4, 1], [4, 0, 1], [1, 1, 0]]
    np.testing.assert_allclose(interaction_matrix(3) @ values, expected, atol=DOUBLE)


def test_sampled_values_close_and_lie_within_their_standard_errors():
    players = [frozenset({str(i)}) for i in range(9)]
    generator = np.random.default_rng(3)
    weights, pairs = generator.normal(size=9), generator.normal(size=(9, 9))

    def value(on):
        chosen = np.array([str(i) in on for i in range(9)], float)
        return np.array([weights @ chosen + chosen @ pairs @ chosen + np.prod(1 + chosen)])

    number = [value(frozenset(str(i) for i in range(9) if n >> i & 1)) for n in range(512)]
    exact = shapley_matrix(9) @ np.array(number)
    sampled, error = sampled_shapley(value, players, 400, seed=1)
    np.testing.assert_allclose(sampled.sum(axis=0), number[-1] - number[0], rtol=DOUBLE)
    # Nine values at four standard errors of 200 pairs: 0.06 % by chance, and the seed is fixed.
    assert (np.abs(sampled - exact) <= 4 * error + 1e-12).all()
    assert error.max() > 0


@pytest.mark.parametrize("reference", ["true-maximum", "maximum"])
def test_contributions_and_waterfall_add_up_to_the_error_of_every_pixel(scene, reference):
    data = attribute(scene, CAMERA, UniformSurface(0.6), reference=reference)
    names = ["motion", "psf", "footprint", "detector", "digitiser"]
    expected = ["emissivity", "reflection", *names] if reference == "true-maximum" else names
    assert list(data.effect.values) == expected
    for name in ("contribution", "waterfall"):
        total = data[name].sum("effect").values
        np.testing.assert_allclose(total, error_of(data), atol=ROUNDING)
    assert float(np.abs(error_of(data)).max()) > 100.0


def test_removal_of_the_psf_is_the_papers_difference(scene):
    camera = replace(CAMERA, lower_limit=None)
    data = attribute(scene, camera, UniformSurface(0.6), 0.0, reference="maximum")
    errors = error_images(camera, camera.expose(scene, UniformSurface(0.6), 0.0))
    np.testing.assert_allclose(data.removal.sel(effect="psf"), errors.psf_portion, atol=ROUNDING)
    np.testing.assert_allclose(error_of(data), errors.case_1, atol=ROUNDING)


def test_two_effects_have_the_mean_of_both_orders_of_figure_6(scene):
    camera = Camera(band=CAMERA.band, pitch=6e-6, psf=None)
    data = attribute(scene, camera, UniformSurface(0.6), 0.0, reference="maximum")
    exposure = camera.expose(scene, UniformSurface(0.6), 0.0)
    by_pixel = (16, 3, 16, 3)

    def kelvins(radiance):
        return camera.band.temperature(np.asarray(radiance, np.float64))

    mean, peak = exposure.mean_radiance, exposure.peak_radiance
    hottest, moved = (kelvins(one.reshape(by_pixel).max(axis=(1, 3))) for one in (peak, mean))
    still, both = (
        kelvins(np.mean(np.asarray(one, np.float64).reshape(by_pixel), axis=(1, 3)))
        for one in (peak, mean)
    )
    exposing = (moved - hottest + both - still) / 2
    gathering = (still - hottest + both - moved) / 2
    np.testing.assert_allclose(data.contribution.sel(effect="motion"), exposing, atol=ROUNDING)
    np.testing.assert_allclose(data.contribution.sel(effect="footprint"), gathering, atol=ROUNDING)
    expected = both - still - moved + hottest
    pair = data.interaction.sel(effect="motion", other_effect="footprint")
    np.testing.assert_allclose(pair, expected, atol=ROUNDING)


def test_a_still_uniform_scene_has_an_error_of_emissivity_alone():
    times = 1e-6 * np.arange(12)
    scene = Scene.from_fields(GRID, times, {"temperature": np.full((12, *GRID.shape), 900.0)})
    camera = replace(CAMERA, reflected=None, detector=None, lower_limit=None)
    data = attribute(scene, camera, UniformSurface(0.6))
    others = data.contribution.drop_sel(effect="emissivity")
    # Peak radiance is float32: 6e-8 of the radiance is 1e-5 K here.
    np.testing.assert_allclose(others, 0.0, atol=1e-5)
    expected = camera.band.temperature(0.6 * camera.band.radiance(900.0)) - 900.0
    # The same 1e-5 K.
    np.testing.assert_allclose(data.contribution.sel(effect="emissivity"), expected, atol=1e-5)


def test_lost_pixels_are_divided_among_the_effects_that_lose_them(scene):
    camera = replace(CAMERA, detector=None, lower_limit=690.0, reflected=None)
    data = attribute(scene, camera, UniformSurface(0.6))
    assert 0.1 < float(data.lost.mean()) < 0.9  # some pixels are lost, not all
    np.testing.assert_allclose(data.lost_contribution.sum("effect"), data.lost, atol=DOUBLE)
    # The scene itself is above the limit everywhere: the emissivity loses most pixels.
    shares = data.lost_contribution.mean(("y", "x"))
    assert shares.idxmax() == "emissivity"
    # Below the limit a pixel reads the temperature of its radiance, as without a limit.
    unlimited = attribute(scene, replace(camera, lower_limit=None), UniformSurface(0.6))
    np.testing.assert_array_equal(data.contribution, unlimited.contribution)
    assert float(data.measured.min()) < 690.0


def test_the_default_exposure_is_within_the_longest_part_of_a_scene_with_a_gap(scene):
    times = scene.times + 5e-5 * (np.arange(12) >= 4)
    late = Scene.from_fields(GRID, times, {"temperature": scene.data["temperature"].values})
    start = attribute(late, replace(CAMERA, integration_time=3e-6), UniformSurface(0.6)).attrs[
        "start"
    ]
    assert late.times[4] < start <= late.times[-1] - 2e-6


def test_named_effects_and_terms_by_their_kind_leave_the_others_in_a_group(scene):
    camera = replace(CAMERA, optics=(Veil(0.1, 30e-6),), lower_limit=None)
    effects = ("emissivity", "veil", "shot-noise", "read-noise")
    data = attribute(scene, camera, UniformSurface(0.6), effects=effects)
    assert list(data.effect.values) == [*effects, REST]
    np.testing.assert_allclose(data.contribution.sum("effect"), error_of(data), atol=ROUNDING)
    spread = data.contribution.std(("y", "x"))
    # 2000 electrons are 0.2 W/(m² sr): a standard deviation between those at 1200 K and at 600 K.
    warmest, coldest = 0.2 / CAMERA.band.slope(np.array([1200.0, 600.0]))
    assert warmest < float(spread.sel(effect="read-noise")) < coldest
    # A veil lowers the band and raises its surroundings.
    veil = data.contribution.sel(effect="veil").values
    assert veil.min() < -1 < 1 < veil.max()


def test_terms_of_a_saturated_detector_have_the_effects_of_a_literal_computation():
    times = 1e-6 * np.arange(12)
    plate = Scene.from_fields(GRID, times, {"temperature": np.full((12, *GRID.shape), 900.0)})
    limited = Detector(
        response=EnergyResponse(1e4), full_well=8e6, bits=14, cold=500.0, hot=650.0,
        terms=(ShotNoise(), ReadNoise(300.0)),
    )  # fmt: skip
    # The same gain per electron to 1 part in 1000, and enough bits for all light of 900 K.
    wide = replace(limited, full_well=None, bits=32, gain=1e3 * limited.conversion_gain, offset=4e5)
    camera = Camera(band=CAMERA.band, pitch=6e-6, psf=None, detector=limited)
    surface = UniformSurface(1.0)
    players = ("shot-noise", "read-noise", "digitiser")
    data = attribute(plate, camera, surface, 0.0, effects=players)

    def reading(on):
        terms = tuple(one for one in limited.terms if one.kind in on)
        detector = replace(limited if "digitiser" in on else wide, terms=terms)
        if not on:
            detector = None
        image = replace(camera, detector=detector).measure(plate, surface, 0.0)
        return image.radiance_temperature(flagged=True)[0]

    mean = dict.fromkeys(players, 0.0)
    for order in permutations(players):
        for number, name in enumerate(order):
            mean[name] += (reading(order[: number + 1]) - reading(order[:number])) / 6
    for name in players:
        # A thousandth of a count, and float32 radiance: 1e-4 K each.
        np.testing.assert_allclose(data.contribution.sel(effect=name), mean[name], atol=2e-4)
    assert float(data.lost.mean()) > 0.95  # read noise lowers some
    # A full well at 650 K shows 900 K at least that much too cold.
    assert float(data.contribution.sel(effect="digitiser").max()) < -100.0
    # Noise of 8e6 electrons: 0.1 K measured.
    assert float(np.abs(data.contribution.sel(effect=["shot-noise", "read-noise"])).max()) < 0.3
    # Float32 radiance: 2e-6 K measured.
    assert float(np.abs(data.contribution.sel(effect=REST)).max()) < 2e-5


def test_over_eight_effects_are_sampled_and_close(scene):
    camera = replace(CAMERA, optics=(Veil(0.1, 30e-6),))
    effects = ("emissivity", "reflection", "motion", "psf", "footprint")
    terms = ("veil", "shot-noise", "read-noise")
    surface = UniformSurface(0.6)
    data = attribute(scene, camera, surface, effects=(*effects, *terms), permutations=16)
    assert data.sizes["effect"] == 9 and "standard_error" in data
    np.testing.assert_allclose(data.contribution.sum("effect"), error_of(data), atol=ROUNDING)
    exact = attribute(scene, camera, surface, effects=effects)
    difference = np.abs((data.contribution - exact.contribution).sel(effect="emissivity"))
    # Eight pairs: a Student factor of 5.4 covers 99.9 %, of 256 pixels with the same orders.
    assert (difference <= 5.4 * data.standard_error.sel(effect="emissivity") + 0.5).all()


def test_a_psf_that_includes_the_footprint_is_one_effect_with_it(scene):
    weights = GaussianPSF(8e-6).kernel(2e-6)
    psf = MeasuredPSF(weights, 2e-6, includes=("footprint",))
    data = attribute(scene, replace(CAMERA, psf=psf), UniformSurface(0.6))
    assert "psf and footprint" in data.effect.values
    np.testing.assert_allclose(data.contribution.sum("effect"), error_of(data), atol=ROUNDING)


def test_half_the_exposure_of_a_moving_band_gains_at_its_centre(scene):
    camera = replace(CAMERA, detector=None, lower_limit=None, psf=None, pitch=2e-6)
    data = attribute(scene, camera, UniformSurface(1.0))
    gain, error = data.gain_half_exposure.values, np.abs(error_of(data))
    assert gain[error > np.quantile(error, 0.9)].mean() > 1.0
    still = scene.data.temperature.values[:1].repeat(12, axis=0)
    held = Scene.from_fields(GRID, scene.times, {"temperature": still})
    data = attribute(held, camera, UniformSurface(1.0))
    np.testing.assert_allclose(data.gain_half_exposure, 0.0, atol=ROUNDING)


def test_contributions_at_the_readings_add_up_to_their_true_errors(chip_analysis):
    data = chip_analysis.data
    shown = {"exposure": 0, "texture": 0, "pixel_phase": 0}  # one segment: its exposure is shown
    measured = data.measured.sel(effects="all")
    # In the shear band the pixels are below the range limit.
    for name in ("rake", "band"):
        expected = float((measured - data.true).sel(reading=name).isel(shown))
        total = float(data.attribution_reading.sel(reading=name).sum("effect"))
        assert total == pytest.approx(expected, abs=ROUNDING)
        sums = data.attribution_line.sum("effect", skipna=False).sel(line=name).values
        error = data.line_measured.sel(effects="all") - data.line_true
        along = error.sel(line=name).isel(shown).values
        known = np.isfinite(sums) & np.isfinite(along)
        assert known.sum() > 50
        np.testing.assert_allclose(sums[known], along[known], atol=ROUNDING)


def test_the_report_states_the_causes_of_each_main_error(chip_analysis):
    facts = Facts(chip_analysis)
    rake, *_ = attribution.sentences(facts)
    where = "Rake face, mid-contact (chip 2), in the shown exposure"
    assert rake.startswith(f"{where}: the measured temperature is ")
    values = attribution.contributions(facts)["rake"]
    assert f"emissivity −{abs(values['emissivity']):.0f} K" in rake
    assert f"is {abs(sum(values.values())):.0f} K below the true temperature" in rake


def test_a_peak_is_divided_at_the_hottest_pixel_of_the_reference(scene):
    camera = replace(CAMERA, detector=None, lower_limit=None, reflected=None)
    data = attribute(scene, camera, UniformSurface(0.6))
    images = data.reference.values, data.measured.values
    read, _ = read_attribution(data, HottestPlace(), images, camera.pixels(scene.raster))
    row, column = np.unravel_index(np.nanargmax(images[0]), images[0].shape)
    np.testing.assert_array_equal(read[0, :-1], data.contribution.values[:, row, column])
    total = images[1][row, column] - images[0][row, column]
    assert read[0, :-1].sum() == pytest.approx(total, abs=ROUNDING)


def test_a_sentence_describes_one_pixel(scene):
    camera = replace(CAMERA, detector=None, lower_limit=None, reflected=None)
    data = attribute(scene, camera, UniformSurface(0.6))
    text = attribution.attribution_sentence(data, 20e-6, 0.0)
    one = data.sel(x=20e-6, y=0.0, method="nearest")
    total = float(one.measured - one.reference)
    assert text.startswith(f"The measured temperature is {abs(total):.0f} K below")
    assert f"emissivity −{abs(float(one.contribution.sel(effect='emissivity'))):.0f} K" in text
    gain = float(one.gain_half_exposure)
    assert f"halving the exposure would reduce the error by {gain:.0f} K" in text


@pytest.mark.parametrize(
    ("effects", "text"),
    [
        (("emisivity",), "effects: 'emisivity' is unknown, expected any of emissivity"),
        (("psf", "psf"), "each effect can be named only once"),
    ],
)
def test_impossible_effects_are_refused(scene, effects, text):
    with pytest.raises(ValueError, match=text):
        attribute(scene, CAMERA, UniformSurface(0.6), effects=effects)
