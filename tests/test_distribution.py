"""Distributions of figures of merit: scatter, its causes, and where a value lies."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tolerances import DOUBLE

from chipglow.analysis import Headline
from chipglow.analysis.distribution import COVERAGE, TOGETHER, Distribution

CAUSES = ("segment", "texture", "pixel phase")


def drawn(generator, shape, deviations, together=0.0):
    """Draws of the random-effects model: a mean, one effect for each cause, and a rest."""
    values = np.full(shape, -40.0)
    for axis, deviation in enumerate(deviations):
        effect = generator.normal(0.0, deviation, shape[axis])
        others = tuple(other for other in range(len(shape)) if other != axis)
        values = values + np.expand_dims(effect, others)
    return values + generator.normal(0.0, together, shape)


def test_mean_deviation_and_range_are_those_of_all_draws():
    values = np.array([[[-30.0, -50.0], [-40.0, -44.0]]])
    found = Distribution(values, CAUSES)
    assert found.draws == 4
    assert found.mean == -41.0
    # Deviations of 11, -9, 1 and -3: squares of 212 over three degrees of freedom.
    assert found.standard_deviation == pytest.approx(np.sqrt(212 / 3))
    assert found.range == (-50.0, -30.0)


def test_parts_by_hand():
    # 10 from the first cause, 1 from the second, and nothing else: -11, -9, 9, 11.
    found = Distribution(np.array([[-11.0, -9.0], [9.0, 11.0]]), ("a", "b")).parts
    assert found["a"].standard_deviation == pytest.approx(np.sqrt(200.0))
    assert found["a"].fraction == pytest.approx(400 / 404)
    assert found["b"].fraction == pytest.approx(4 / 404)
    assert found[TOGETHER].fraction == pytest.approx(0.0, abs=DOUBLE)
    # Only the combination of both: no mean of either differs.
    both = Distribution(np.array([[1.0, -1.0], [-1.0, 1.0]]), ("a", "b")).parts
    assert both[TOGETHER].fraction == pytest.approx(1.0)
    assert both[TOGETHER].standard_deviation == pytest.approx(2.0)


@given(seed=st.integers(0, 10**6), shape=st.tuples(*[st.integers(1, 5)] * 3))
@settings(max_examples=50)
def test_fractions_sum_to_one(seed, shape):
    values = drawn(np.random.default_rng(seed), shape, (5.0, 3.0, 1.0), 2.0)
    found = Distribution(values, CAUSES).parts
    total = sum(part.fraction for part in found.values())
    assert total == pytest.approx(1.0 if values.size > 1 else 0.0, abs=DOUBLE)


@pytest.mark.parametrize(
    ("shape", "deviations", "together"),
    [
        ((3, 5, 9), (8.0, 3.0, 6.0), 4.0),
        ((3, 5, 9), (2.0, 2.0, 10.0), 1.0),
        ((3, 5, 9), (10.0, 1.0, 1.0), 1.0),
        ((3, 3, 4), (3.0, 3.0, 3.0), 3.0),
    ],
)
def test_the_interval_holds_one_more_draw_as_often_as_it_says(shape, deviations, together):
    generator = np.random.default_rng(11)
    held = held_mean = 0
    repeats = 1500
    # The phases are the same in every draw: a bounded population, far from normal.
    phases = deviations[2] * np.sqrt(3) * np.linspace(-1.0, 1.0, shape[2])
    others = (*deviations[:2], 0.0)
    total = np.sqrt(sum(d**2 for d in others) + together**2)
    for _ in range(repeats):
        found = Distribution(drawn(generator, shape, others, together) + phases, CAUSES)
        frame = generator.normal(-40.0, total) + generator.choice(phases)
        held += not found.differs_from(frame)
        held_mean += abs(found.mean + 40.0) <= found.expanded_uncertainty
    # Three standard errors of 1500 repeats are 1.7 %; the interval may be too wide by what the
    # other causes leave in the means of one, and by the degrees of freedom of few draws.
    assert COVERAGE - 0.017 <= held / repeats <= 0.995
    assert COVERAGE - 0.017 <= held_mean / repeats <= 0.9975


@pytest.mark.parametrize(
    ("shape", "few"),
    [
        ((2, 2, 16), {"segment": 2, "texture": 2}),
        ((2, 5, 16), {"segment": 2}),
        ((3, 2, 16), {"texture": 2}),
        ((3, 1, 2), {}),  # a surface without texture, two of all phases
        ((3, 3, 1), {}),
    ],
)
def test_two_values_of_a_random_cause_support_no_interval(shape, few):
    values = drawn(np.random.default_rng(2), shape, (1.0, 1.0, 5.0), 30.0)
    found = Distribution(values, CAUSES)
    assert found.too_few == few
    assert np.isinf([*found.interval, found.expanded_uncertainty]).all() == bool(few)


def test_three_draws_of_what_decides_count_as_three():
    values = np.broadcast_to(np.array([-50.0, -40.0, -30.0])[:, None, None], (3, 5, 9))
    low, high = Distribution(values, CAUSES).interval
    # t of two degrees of freedom, 4.303, times 10, times the root of 1 + 1/3.
    assert high == pytest.approx(-40.0 + 4.303 * 10.0 * np.sqrt(4 / 3), rel=1e-3)
    assert low == pytest.approx(-80.0 - high)


def test_a_part_of_an_error_of_unknown_sign_is_not_told():
    names, portion = ("rake face", "mid-contact", "chip 2"), Distribution(np.full(3, -10.0), "a")
    error, known = (Distribution(np.array([-30.0, one, -20.0]), "a") for one in (1.0, -10.0))
    assert Headline(error, portion, error, error, *names, error).psf_fraction is None
    fraction = Headline(known, portion, known, known, *names, known).psf_fraction.mean
    assert fraction == pytest.approx((1 / 3 + 1 + 1 / 2) / 3)


def test_a_single_draw_says_nothing_of_the_scatter():
    found = Distribution(np.full((1, 1, 1), -40.0), CAUSES)
    assert np.isnan(found.standard_deviation)
    assert found.interval == (-np.inf, np.inf)
    assert not found.differs_from(1000.0)


def test_draws_that_are_all_alike_differ_from_any_other_value():
    found = Distribution(np.full((1, 1, 4), -40.0), CAUSES)
    assert found.interval == (-40.0, -40.0)
    assert found.differs_from(-41.0)
    assert not found.differs_from(-40.0)


def test_pixel_phases_alone_are_a_known_population():
    values = np.linspace(-80.0, 0.0, 81).reshape(1, 1, 81)
    found = Distribution(values, CAUSES)
    # Of 81 equally likely values the middle 95 %, whatever factor a normal distribution would have.
    assert found.interval == pytest.approx((-78.0, -2.0))
    assert found.expanded_uncertainty == 0.0


def test_the_interval_of_phases_and_a_random_cause_is_that_of_the_mixture():
    generator = np.random.default_rng(3)
    phases = np.array([-60.0, -50.0, -10.0])
    segments = np.array([-1.0, -0.5, 0.1, 0.4, 1.0])
    values = segments[:, None, None] + phases[None, None]
    low, high = Distribution(values, CAUSES).interval
    # A second way: many t values of four degrees of freedom around phases drawn at random.
    scale = segments.std(ddof=1) * np.sqrt(1 + 1 / 5)
    many = generator.choice(phases, 10**6) + scale * generator.standard_t(4, 10**6)
    # Standard error of a quantile: sqrt(p (1 - p) / n) over the density, here under 0.01.
    assert (low, high) == pytest.approx(np.quantile(many, [0.025, 0.975]), abs=0.04)


def test_a_cause_of_one_value_leaves_no_interval():
    values = np.array([-47.0, -45.0, -49.0]).reshape(3, 1, 1)
    whole = Distribution(values, CAUSES)
    missing = Distribution(values, CAUSES, missing=("pixel phase",))
    assert np.isfinite(whole.interval).all()
    assert np.isinf([*missing.interval, missing.expanded_uncertainty]).all()
    assert not missing.differs_from(1000.0)


@pytest.mark.parametrize(
    ("values", "limits"),
    [([34e3, 151e3, 60e3], (0.0, np.inf)), ([5.0, 40.0, 60.0, 20.0], (0.0, 100.0))],
)
def test_the_interval_of_a_limited_number_is_within_its_limits(values, limits):
    free = Distribution(np.array(values), ("segment",))
    found = Distribution(np.array(values), ("segment",), limits=limits)
    assert free.interval[0] < limits[0]
    low, high = found.interval
    assert limits[0] < low < min(values)
    assert max(values) < high < limits[1]
    two = Distribution(np.array(values[:2]), ("segment",), limits=limits)
    assert np.isinf(two.interval).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros((0, 1, 1)), "expected at least one draw of each of segment, texture"),
        (np.zeros((2, 2)), r"values have shape \(2, 2\)"),
        (np.full((1, 1, 1), np.nan), "a value is not finite"),
    ],
)
def test_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Distribution(values, CAUSES)
