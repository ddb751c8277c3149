"""The fit of the damage to measured cuts, on cuts that are made up."""

from math import nan

import calibrate_cutting as calibrate
import numpy as np
import pytest
from calibrate_cutting import Fit, Observation
from experiments import Means, read_experiments

SLOPES = np.array([[0.10, -0.08, 0.02, 0.05], [0.05, -0.10, 0.03, 0.30], [0.02, 0.2, 0.0, 0.1]])


def made_up(place):
    """Three quantities whose logarithms are linear in the place."""
    return np.exp(np.array([6.0, 5.0, 4.0]) + SLOPES @ np.asarray(place))


def fit_of_three(truth):
    places = np.array(calibrate.design())
    observed = [
        Observation(f"cut {k}", "cutting_force", value, 0.05)
        for k, value in enumerate(made_up(truth))
    ]
    return Fit.through(places, np.array([made_up(place) for place in places]), observed)


def test_a_surface_meets_a_quadratic_without_products_exactly():
    places = np.array([*calibrate.design(), (0.3, 0.1, -0.4, 0.6), (0.5, -0.5, 0.2, 0.1)])
    logs = 1.0 + places @ np.array([0.1, 0.2, -0.3, 0.4]) + places**2 @ np.full(4, 0.05)
    fit = Fit.through(places, np.exp(logs)[:, None], [])
    at = np.array([0.2, -0.6, 0.5, 0.9])
    expected = 1.0 + at @ np.array([0.1, 0.2, -0.3, 0.4]) + (at**2).sum() * 0.05
    assert fit.logs(at) == pytest.approx(expected, abs=1e-9)
    assert fit.scatter < 1e-9


def test_the_forces_are_met_where_they_can_be():
    fit = fit_of_three((0.4, -0.2, 0.1, 0.5))
    # Three forces do not determine four numbers, but each force is met.
    assert made_up(fit.best_place()) == pytest.approx([one.value for one in fit.observed], rel=1e-3)


def test_the_covariance_is_that_of_linear_least_squares_and_of_the_ranges():
    covariance = fit_of_three((0.0, 0.0, 0.0, 0.0)).covariance_at(np.zeros(4))
    weights = SLOPES.T @ SLOPES / 0.05**2 + 3.0 * np.eye(4)
    half = np.array([0.5 * np.log(one.high / one.low) for one in calibrate.RANGES])
    assert covariance == pytest.approx(np.linalg.inv(weights) * np.outer(half, half), rel=1e-6)
    # The forces hardly depend on the third number: the standard deviation of its range is left.
    assert covariance[2, 2] == pytest.approx(half[2] ** 2 / 3, rel=0.1)


def test_places_and_values_are_inverse_and_the_front_varies_the_loss_alone():
    places = np.array(calibrate.front())
    for place, loss in zip(places, calibrate.FRONT_LOSSES, strict=True):
        values = [one.at(at) for one, at in zip(calibrate.RANGES, place, strict=True)]
        assert values == pytest.approx([1.0, loss, 8e3, 100e-6], rel=1e-12)


def test_the_paper_has_its_own_edge_and_the_others_the_fitted_one():
    experiments = {one.name: one for one in read_experiments()[1]}
    place = calibrate.front()[1]
    papers = calibrate.simulation(experiments["paper"], place)
    other = calibrate.simulation(experiments["amm-200-0.15-neg7"], place)
    assert papers.tool.edge_radius == 20e-6
    assert other.tool.edge_radius == pytest.approx(100e-6, rel=1e-12)
    assert papers.workpiece.damage.loss == pytest.approx(0.35, rel=1e-12)


@pytest.mark.parametrize(
    ("period", "degree", "met"),
    [
        (90e-6, 0.1, True),
        (90e-6, 0.09, False),
        (74e-6, 0.2, False),
        (106e-6, 0.2, False),
        (nan, 0.2, False),
    ],
)
def test_a_chip_without_the_papers_period_is_not_chosen(period, degree, met):
    means = Means(6e5, 2e5, 1e-3, 1e-3, period, 3, degree, 0.0, 0.0, 1.0)
    assert calibrate.segments({"paper": means}) is met


def test_four_cuts_are_measured_and_their_forces_compared():
    experiments = read_experiments()[1]
    observed = calibrate.observations(experiments)
    assert [one.quantity for one in observed].count("cutting_force") == 4
    assert observed[-1].quantity == "period"
    # Per width of 1.6 mm, as in shared tables: 1150 N at 0.3 mm and -7 deg.
    value = next(one.value for one in observed if one.cut == "amm-200-0.30-neg7")
    assert value == pytest.approx(1150 / 1.6e-3, rel=1e-3)
