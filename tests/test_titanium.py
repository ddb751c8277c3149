"""The benchmark that sets measured cuts of Ti-6Al-4V beside computed ones: data, means, ratios."""

import pytest
import titanium
from titanium import Condition, Cut, Trial

SLOW, FAST = 60 / 60, 120 / 60
FINE, COARSE = 0.1e-3, 0.2e-3


def trial(**changes):
    first = Trial("V1", SLOW, FINE, 100.0, 60.0, 30e-6, 120e-6, "L", "ok")
    return first._replace(**changes)


def test_every_test_of_the_data_is_a_cut_that_can_be_computed():
    source, trials = titanium.read_trials()
    assert "10.1007/s00170-024-14597-2" in source
    assert len({one.name for one in trials}) == len(trials)
    tests = titanium.repeats(trials)
    assert sum(map(len, tests.values())) == len(trials)
    for at, found in tests.items():
        for rake in titanium.RAKES:
            cut = titanium.simulation(found, rake, 10e-6)
            assert (cut.conditions.speed, cut.conditions.feed) == at
            assert cut.conditions.feed / cut.numerics.cell >= 10 * (1 - 1e-9)
            assert cut.tool.edge_radius / cut.numerics.cell > 2.5


def test_the_data_are_those_of_the_source():
    _, trials = titanium.read_trials()
    # As they stand in the file that was read: force, force, radius in um, thickness in um.
    read = {one.name: one for one in trials}["V0055"]
    assert (read.speed, read.feed) == pytest.approx((212.2 / 60, 0.4e-3))
    assert (read.cutting_force, read.feed_force) == (483.4, 216.1)
    assert (read.edge_radius, read.thickness) == pytest.approx((33.4e-6, 351.4e-6))
    assert (read.wear, read.status) == ("M", "short")


def test_a_mean_is_over_the_tests_and_a_spread_needs_two():
    trials = [trial(), trial(cutting_force=110.0, feed_force=80.0, thickness=160e-6)]
    assert titanium.mean(trials) == pytest.approx((105.0, 70.0, 140e-6))
    # Deviations of ±5 from the mean of two values: 5 √2.
    assert titanium.spread([100.0, 110.0], 2) == "105.00 ± 7.07"
    assert titanium.spread([100.0], 1) == "100.0"


def test_ratios_by_hand():
    cuts = {
        Condition(SLOW, FINE): Cut(100.0, 60.0, 130e-6),
        Condition(SLOW, COARSE): Cut(160.0, 80.0, 220e-6),
        Condition(FAST, FINE): Cut(90.0, 45.0, 110e-6),
    }
    assert titanium.ratios(cuts) == pytest.approx(
        {
            "Ff / Fc at 60 m/min, 0.1 mm": 0.6,
            "Ff / Fc at 120 m/min, 0.1 mm": 0.5,
            "Ff / Fc at 60 m/min, 0.2 mm": 0.5,
            "thickness / feed at 60 m/min, 0.1 mm": 1.3,
            "thickness / feed at 120 m/min, 0.1 mm": 1.1,
            "thickness / feed at 60 m/min, 0.2 mm": 1.1,
            "Fc(0.2 mm) / Fc(0.1 mm) at 60 m/min": 1.6,
            "Fc(120 m/min) / Fc(60 m/min) at 0.1 mm": 0.9,
        }
    )
