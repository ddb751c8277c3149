"""Thermal expansion: pressure where there is no room for it, growth where there is."""

from dataclasses import replace
from math import exp

import numpy as np
import pytest
from scipy.optimize import brentq
from solver import ELASTIC, Block

from chipglow.cutting import TemperatureTable
from chipglow.cutting.momentum import EXPANSION_WORK, SHARING_LOSS

COLD, HOT = 293.15, 693.15
GROWTH = 1.02
STEEL = replace(ELASTIC, density=TemperatureTable((COLD, HOT), (7850.0, 7850.0 / GROWTH)))
YOUNG, POISSON = STEEL.young_modulus, STEEL.poisson_ratio
BULK, SHEAR = YOUNG / (3 * (1 - 2 * POISSON)), YOUNG / (2 * (1 + POISSON))


def tension(block):
    """Mean stress of the points in Pa."""
    p = block.points
    return BULK * (p["volume"] / p["free_volume"] - 1.0)


def warmed(block, rise, cycles=150, settling=50):
    """Warm a block's points so slowly that waves die down; energy taken from heat in J/m."""
    taken = 0.0
    for cycle in range(cycles + settling):
        if cycle < cycles:
            block.points["temperature"] += rise(block.points) / cycles
        block.advance(20)
        taken += block.sums[EXPANSION_WORK]
    return taken


def test_without_room_it_becomes_pressure_and_the_account_tells_its_energy():
    # So heavy that nothing moves it.
    block = Block((60e-6, 60e-6), material=STEEL, mass=1e9)
    block.points["temperature"] = COLD
    block.advance(1)
    before = block.energy()[1]
    middle = 0.5 * (COLD + HOT)
    block.points["temperature"] = middle
    block.advance(1)
    # The density is linear over the temperature: half way its fall is half as well. Kernels take
    # the volume as linear within a kelvin: 3e-8 of the pressure here, and 1e-5 at the start.
    free = 2.0 / (1.0 + 1.0 / GROWTH)
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

    def stress(strain):
        return BULK * (exp(2 * strain) / GROWTH - 1.0) + 2 * SHEAR * strain / 3

    strain = brentq(stress, 0.0, 0.1)
    return strain, 3 * BULK * (exp(2 * strain) / GROWTH - 1.0)


def test_free_it_grows_in_the_plane_only():
    block = Block((100e-6, 60e-6), material=STEEL, kept=0.0)
    block.points["temperature"] = COLD
    taken = warmed(block, lambda points: HOT - COLD)
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


def test_unequal_temperatures_bend_it_without_stress_in_the_plane():
    """A free body whose temperature is linear bends, with stress across its plane only."""
    length, height = 160e-6, 80e-6
    block = Block((length, height), material=STEEL, kept=0.0)
    points = block.points
    points["temperature"] = 0.5 * (COLD + HOT)
    points["free_volume"] = block.spacing**2 * 2.0 / (1.0 + 1.0 / GROWTH)
    points["volume"] = points["free_volume"]
    span = 200.0
    warmed(block, lambda points: span * (points["material_y"] / height - 0.5))
    p = block.points
    assert np.ptp(p["temperature"]) == pytest.approx(span, rel=0.1)
    growth = (GROWTH - 1.0) / 3 / (HOT - COLD)
    x, y = p["material_x"] - length / 2, p["material_y"] - height / 2
    bent = np.linalg.lstsq(
        np.stack([np.ones_like(x), x, y, x * y], axis=-1), p["x"] - p["material_x"], rcond=None
    )[0][3]
    assert bent == pytest.approx((1 + POISSON) * growth * span / height, rel=0.03)
    inside = (np.abs(x) < 0.3 * length) & (np.abs(y) < 0.35 * height)
    xx, yy, _ = block.deviator()
    across = YOUNG * growth * span
    for part in (xx, yy):
        assert np.abs(part + tension(block))[inside].max() < 0.03 * across
    # A third of the stress across, at the middle of each cell: the points of a cell, 12 K apart,
    # share one dilation. Did they share one volume, it would alternate by 0.07 of it.
    cells = np.floor(p["material_y"] / block.cell) + 0.5 - height / 2 / block.cell
    expected = -across * cells * block.cell / height / 3
    assert np.abs(tension(block) - expected)[inside].max() < 0.01 * across
