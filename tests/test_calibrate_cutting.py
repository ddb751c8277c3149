"""The fit of the damage to measured cuts, on cuts that are made up."""

import calibrate_cutting as calibrate
import numpy as np
import pytest
from calibrate_cutting import Fit, Observation
from experiments import read_experiments
from tolerances import DOUBLE

NUMBERS = len(calibrate.RANGES)
SLOPES = 0.1 * np.random.default_rng(1).normal(size=(3, NUMBERS))
SLOPES[:, 2] = 0.001


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
    linear, square = np.linspace(-0.3, 0.4, NUMBERS), np.linspace(0.05, 0.1, NUMBERS)
    places = np.array([*calibrate.design(), np.linspace(-0.5, 0.5, NUMBERS)])
    values = np.exp(1.0 + places @ linear + places**2 @ square)
    values[2] = np.nan  # a chip without segments has no period: the others determine the surface
    fit = Fit.through(places, np.stack([values, values], axis=1), [])
    at = np.linspace(0.9, -0.6, NUMBERS)
    assert fit.logs(at) == pytest.approx([1.0 + at @ linear + at**2 @ square] * 2, abs=DOUBLE)
    assert fit.scatter.max() < 1e-12  # rounding


def test_the_forces_are_met_where_they_can_be():
    fit = fit_of_three(np.linspace(-0.4, 0.5, NUMBERS))
    # Three forces do not determine all numbers, but each force is met.
    assert made_up(fit.best_place()) == pytest.approx([one.value for one in fit.observed], rel=1e-3)


def test_the_covariance_is_that_of_linear_least_squares_and_of_the_ranges():
    covariance = fit_of_three(np.zeros(NUMBERS)).covariance_at(np.zeros(NUMBERS))
    weights = SLOPES.T @ SLOPES / 0.05**2 + 3.0 * np.eye(NUMBERS)
    half = np.array([0.5 * np.log(one.high / one.low) for one in calibrate.RANGES])
    # By difference quotients of the fit: 4e-8 measured.
    assert covariance == pytest.approx(np.linalg.inv(weights) * np.outer(half, half), rel=1e-6)
    # The forces hardly depend on the third number: the standard deviation of its range is left.
    assert covariance[2, 2] == pytest.approx(half[2] ** 2 / 3, rel=1e-3)


def test_the_paper_has_its_own_edge_and_the_others_the_fitted_one():
    experiments = {one.name: one for one in read_experiments()[1]}
    place = (1.0, *calibrate.design()[0][1:])
    papers = calibrate.simulation(experiments["paper"], place)
    other = calibrate.simulation(experiments["amm-200-0.15-neg7"], place)
    assert papers.tool.edge_radius == 20e-6
    assert other.tool.edge_radius == pytest.approx((70e-6 * 122e-6) ** 0.5, rel=DOUBLE)
    assert papers.workpiece.flow_stress.thermal_stress == pytest.approx(1.25 * 1533.7e6, rel=DOUBLE)
    assert papers.workpiece.damage.loss == pytest.approx((0.6 * 0.92) ** 0.5, rel=DOUBLE)


def test_four_cuts_are_measured_and_their_forces_compared():
    experiments = read_experiments()[1]
    observed = calibrate.observations(experiments)
    assert [one.quantity for one in observed].count("cutting_force") == 4
    assert [one.quantity for one in observed[-2:]] == ["period", "degree"]
    # Per width of 1.6 mm, as in shared tables: 1150 N at 0.3 mm and -7 deg.
    value = next(one.value for one in observed if one.cut == "amm-200-0.30-neg7")
    assert value == pytest.approx(1150 / 1.6e-3)
