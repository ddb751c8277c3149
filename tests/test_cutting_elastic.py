"""Elastic constants and volume over the temperature: what a point answers, and what it holds."""

from dataclasses import replace

import numpy as np
import pytest
from cases import expansion
from solver import Block

from chipglow.cutting import workpiece
from chipglow.cutting.momentum import EXPANSION_WORK, MODULI_LOSS
from chipglow.cutting.stress import BULK

STRAIN = 1e-4
RATE = 1e3
TITANIUM = workpiece("ti-6al-4v")
UNYIELDING = replace(
    TITANIUM,
    density=4430.0,
    damage=None,
    flow_stress=replace(TITANIUM.flow_stress, yield_stress=1e15),
)
# Rows of the library's tables: E in Pa and nu by the temperature in K.
ROWS = {300.0: (105.0e9, 0.338), 900.0: (75.1e9, 0.366)}


def stretched(temperature, lateral):
    """A block stretched along x by `STRAIN`, and across by `lateral` times that; its deviator."""
    # So heavy that nothing slows it: the velocities stay as they were set.
    block = Block((60e-6, 60e-6), material=UNYIELDING, mass=1e9, time_step=STRAIN / RATE / 50)
    block.points["temperature"] = temperature
    block.set_velocity(lambda x, y: RATE * x + 0 * y, lambda x, y: lateral * RATE * y + 0 * x)
    block.advance(50)
    return block


def stresses(block):
    """Mean xx, yy and xy of the Cauchy stress in Pa, and its scatter."""
    p, step = block.points, block.step
    row = int(p["temperature"][0] - 200.0)
    tension = block.elastic[row, BULK] * step.bulk_modulus * (p["volume"] / p["free_volume"] - 1.0)
    xx, yy, xy = block.deviator()
    each = np.array([xx + tension, yy + tension, xy])
    return each.mean(axis=1), each.std(axis=1).max()


@pytest.mark.parametrize("temperature", ROWS)
def test_uniaxial_tension_has_the_modulus_of_the_table(temperature):
    """Plane strain with free sides: stress E/(1 - nu2) times strain along, none across."""
    young, poisson = ROWS[temperature]
    block = stretched(temperature, -poisson / (1 - poisson))
    expected = young / (1 - poisson**2) * STRAIN
    (xx, yy, xy), scatter = stresses(block)
    # Logarithmic against linear strain: of the order of the strain itself, 1e-4.
    assert xx == pytest.approx(expected, rel=5e-4)
    assert abs(yy) < 5e-4 * xx and abs(xy) < 1e-9 * xx and scatter < 1e-5 * xx
    # What it holds is the work done: half stress times strain, times the volume.
    work = 0.5 * expected * STRAIN * 3600e-12
    assert block.energy()[1] == pytest.approx(work, rel=2e-4)  # half of the strain: 5e-5 measured


def test_warmed_at_constant_strain_stress_and_energy_fall_with_the_moduli_and_come_back():
    block = stretched(300.0, 0.4)
    cold, before = stresses(block)[0], block.energy()[1]
    block.set_velocity(lambda x, y: 0 * x * y, lambda x, y: 0 * x * y)
    block.points["temperature"] = 900.0
    block.advance(1)
    warm, held = stresses(block)[0], block.energy()[1]
    moduli = [
        (young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson)))
        for young, poisson in ROWS.values()
    ]
    shear, bulk = np.divide(moduli[1], moduli[0])
    # In-plane difference is shear alone; the whole is both. Moduli are sampled at whole kelvins.
    assert warm[0] - warm[1] == pytest.approx(shear * (cold[0] - cold[1]), rel=1e-12)
    assert shear < held / before < bulk
    # Nothing moves: what is not held any more is the account's entry for it.
    assert block.sums[MODULI_LOSS] == pytest.approx(before - held, rel=1e-12)
    block.points["temperature"] = 300.0
    block.advance(1)
    # By the moduli at 300 K again: 1e-10 measured; what is 0 stays 0.
    assert stresses(block)[0] == pytest.approx(cold, rel=1e-9, abs=1e-9)
    assert block.energy()[1] == pytest.approx(before, rel=1e-12)  # rounding
    assert block.sums[MODULI_LOSS] == pytest.approx(held - before, rel=1e-12)  # rounding of a sum


def test_without_room_expansion_becomes_pressure_and_the_account_tells_its_energy():
    # So heavy that nothing moves it.
    block = Block((60e-6, 60e-6), material=expansion.STEEL, mass=1e9)
    block.points["temperature"] = expansion.COLD
    block.advance(1)
    before = block.energy()[1]
    block.points["temperature"] = expansion.MIDDLE
    block.advance(1)
    # Kernels take the volume as linear within a kelvin: 3e-8 of the pressure here, 1e-5 when cold.
    free = expansion.GROWTH_AT_MIDDLE
    # Those 3e-8.
    assert expansion.tension(block) == pytest.approx(expansion.BULK * (1.0 / free - 1.0), rel=1e-7)
    stored = 0.5 * expansion.BULK * (1.0 / free - 1.0) ** 2 * free * 3600e-12
    # That, in work of 3e-2 J/m among much more.
    assert block.energy()[1] - before == pytest.approx(stored, rel=1e-6)
    assert block.sums[EXPANSION_WORK] == pytest.approx(stored, rel=1e-6)  # likewise
    block.points["temperature"] = expansion.COLD
    block.advance(1)
    assert block.sums[EXPANSION_WORK] == pytest.approx(-stored, rel=1e-6)  # likewise
    assert np.abs(expansion.tension(block)).max() < 1e-5 * expansion.BULK
