"""Damage that was fitted to measured cuts: what is known of it, and draws from it."""

from dataclasses import replace

import numpy as np
import pytest

from chipglow.cutting import AISI_1045, FittedDamage, workpiece

NAMES = ("d1", "d2", "loss", "fracture_energy")
COVARIANCE = (
    (0.04, 0.04, 0.01, 0.0),
    (0.04, 0.04, 0.01, 0.0),
    (0.01, 0.01, 0.09, -0.06),
    (0.0, 0.0, -0.06, 0.25),
)


def test_draws_have_the_covariance_and_the_same_seed_gives_the_same():
    fitted = FittedDamage(NAMES, COVARIANCE)
    small = replace(AISI_1045.damage, loss=0.01)  # far from the largest loss
    draws = [fitted.draw(small, np.random.default_rng(seed)) for seed in range(4000)]
    logs = np.log([[getattr(one, name) for name in NAMES] for one in draws])
    centre = np.log([getattr(small, name) for name in NAMES])
    # Standard error of a variance of 4000 draws: 2.2 %; of the means 0.008.
    assert np.cov(logs.T) == pytest.approx(np.array(COVARIANCE), abs=0.02)
    assert logs.mean(axis=0) == pytest.approx(centre, abs=0.03)
    assert np.ptp(logs[:, 0] - logs[:, 1]) < 1e-6  # d1 and d2 go together
    assert fitted.draw(small, np.random.default_rng(7)) == draws[7]


def test_the_steel_is_drawn_and_differs_in_its_damage_only():
    drawn = AISI_1045.drawn(np.random.default_rng(1))
    assert drawn.damage != AISI_1045.damage
    assert replace(drawn, damage=AISI_1045.damage) == AISI_1045
    assert drawn.damage.d4 == AISI_1045.damage.d4


def test_a_material_whose_damage_was_not_fitted_is_not_drawn():
    with pytest.raises(ValueError, match="was not fitted"):
        workpiece("al-7075-t6").drawn(np.random.default_rng(1))
