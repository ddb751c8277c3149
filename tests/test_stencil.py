"""Sums over nodes, and adding to them, against plain loops."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from chipglow.cutting.stencil import ADDED, SUMMED, add_to_nodes, sum_nodes

FEW_ROUNDINGS = 32 * np.finfo(float).eps


@njit
def summed(nodes, i, j, wx, wy, dx, dy):
    return sum_nodes(nodes, i, j, wx, wy, dx, dy)


@njit
def added(nodes, i, j, wx, wy, dx, dy, level, by_x, by_y):
    add_to_nodes(nodes, i, j, wx, wy, dx, dy, level, by_x, by_y)


def three(rng):
    return tuple(rng.uniform(-1.0, 1.0, 3))


@pytest.mark.parametrize("place", [(0, 0), (2, 4), (5, 7)])
def test_sums_are_those_of_nested_loops(place):
    rng = np.random.default_rng(1)
    nodes = rng.normal(size=(8, 10, SUMMED))
    wx, wy, dx, dy = (three(rng) for _ in range(4))
    i, j = place
    part = nodes[i : i + 3, j : j + 3]
    expected = [
        np.einsum("a,b,abv", left, right, part)
        for left, right in ((wx, wy), (np.multiply(wx, dx), wy), (wx, np.multiply(wy, dy)))
    ]
    found = summed(nodes, i, j, wx, wy, dx, dy)
    np.testing.assert_allclose(found, expected, rtol=0, atol=FEW_ROUNDINGS)


@pytest.mark.parametrize("given", [1, 5, 6, ADDED])
def test_adding_reaches_nine_nodes_and_as_many_values_as_are_given(given):
    rng = np.random.default_rng(2)
    before = rng.normal(size=(8, 10, ADDED))
    nodes = before.copy()
    wx, wy, dx, dy = (three(rng) for _ in range(4))
    level, by_x, by_y = (tuple(rng.normal(size=given)) for _ in range(3))
    added(nodes, 5, 7, wx, wy, dx, dy, level, by_x, by_y)
    change = np.zeros_like(before)
    for a in range(3):
        for b in range(3):
            value = np.add(level, np.multiply(dx[a], by_x) + np.multiply(dy[b], by_y))
            change[5 + a, 7 + b, :given] = wx[a] * wy[b] * value
    np.testing.assert_allclose(nodes, before + change, rtol=0, atol=FEW_ROUNDINGS)
    untouched = change == 0.0
    np.testing.assert_array_equal(nodes[untouched], before[untouched])


def test_nodes_that_do_not_lie_side_by_side_are_refused():
    nodes = np.zeros((8, 10, 2 * SUMMED))[..., ::2]
    with pytest.raises(TypingError, match="nodes: expected"):
        summed(nodes, 0, 0, *[(1.0, 1.0, 1.0)] * 4)
