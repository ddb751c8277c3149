"""Thermal expansion: pressure where there is no room for it, growth where there is."""

from math import exp

import numpy as np
import pytest
from cases.expansion import (
    BULK,
    COLD,
    GROWTH,
    GROWTH_AT_MIDDLE,
    HOT,
    MIDDLE,
    POISSON,
    STEEL,
    YOUNG,
    tension,
    warm,
)
from scipy.optimize import brentq
from solver import Block

from chipglow.cutting.momentum import EXPANSION_WORK, SHARING_LOSS


def test_without_room_it_becomes_pressure_and_the_account_tells_its_energy():
    # So heavy that nothing moves it.
    block = Block((60e-6, 60e-6), material=STEEL, mass=1e9)
    block.points["temperature"] = COLD
    block.advance(1)
    before = block.energy()[1]
    block.points["temperature"] = MIDDLE
    block.advance(1)
    # Kernels take the volume as linear within a kelvin: 3e-8 of the pressure here, 1e-5 at `COLD`.
    free = GROWTH_AT_MIDDLE
    assert tension(block) == pytest.approx(BULK * (1.0 / free - 1.0), rel=1e-7)
    stored = 0.5 * BULK * (1.0 / free - 1.0) ** 2 * free * 3600e-12
    assert block.energy()[1] - before == pytest.approx(stored, rel=1e-6)
    assert block.sums[EXPANSION_WORK] == pytest.approx(stored, rel=1e-6)
    block.points["temperature"] = COLD
    block.advance(1)
    assert block.sums[EXPANSION_WORK] == pytest.approx(-stored, rel=1e-6)
    assert np.abs(tension(block)).max() < 1e-5 * BULK


def free_growth():
    """Logarithmic strain in the plane of a free block at `HOT`, and its stress across the plane.

    Plane strain: nothing grows along the edge of the tool, so the plane grows by 1 + nu times more.
    """
    shear = YOUNG / (2 * (1 + POISSON))

    def stress(strain):
        return BULK * (exp(2 * strain) / GROWTH - 1.0) + 2 * shear * strain / 3

    strain = brentq(stress, 0.0, 0.1)
    return strain, 3 * BULK * (exp(2 * strain) / GROWTH - 1.0)


def test_free_it_grows_in_the_plane_only():
    block = Block((100e-6, 60e-6), material=STEEL, kept=0.0)
    block.points["temperature"] = COLD
    taken = warm(block, lambda points: HOT - COLD)
    strain, across = free_growth()
    assert strain == pytest.approx((1 + POISSON) * np.log(GROWTH) / 3, rel=0.005)
    p = block.points
    for axis in "xy":
        slope = np.polyfit(p[f"material_{axis}"], p[axis], 1)[0]
        # What the last waves still move: 0.3 %.
        assert np.log(slope) == pytest.approx(strain, rel=3e-3)
    assert 3 * tension(block).mean() == pytest.approx(across, rel=0.01)
    # Nobody pushed: all the energy that it holds came from heat.
    assert block.energy()[1] == pytest.approx(taken - block.sums[SHARING_LOSS], rel=0.02)
