"""The benchmark that sets published cuts beside computed ones: its data, means, cache, table."""

from dataclasses import replace
from math import nan, radians

import experiments
import numpy as np
import pytest
from experiments import Experiment, Means, Published
from tolerances import DOUBLE

from chipglow.cutting import EnergyHistory, ForceHistory
from chipglow.cutting.recording import ENERGIES

MEANS = Means(
    cutting_force=330e3,
    thrust_force=150e3,
    thickness=nan,
    contact=0.25e-3,
    period=80e-6,
    segments=3,
    degree=0.2,
    drift=-0.02,
    unaccounted=0.008,
    seconds=60.0,
)


def experiment(*published):
    return Experiment(
        name="ours",
        source="someone",
        read=True,
        speed=200 / 60,
        feed=0.15e-3,
        rake=radians(5),
        clearance=radians(7),
        edge_radius=20e-6,
        tool="uncoated carbide",
        tool_material="carbide",
        assumed=("edge radius",),
        published=published,
    )


def test_every_entry_of_the_data_is_a_cut_that_can_be_computed():
    sources, entries = experiments.read_experiments()
    assert len({entry.name for entry in entries}) == len(entries)
    used = {entry.source for entry in entries}
    used |= {value.source for entry in entries for value in entry.published}
    assert used == set(sources)
    kinds = {value.kind for entry in entries for value in entry.published}
    assert kinds == {"measured", "correlation", "computed"}
    for entry in entries:
        simulation = entry.simulation(20e-6, 2e-3)
        assert 50 / 60 < simulation.conditions.speed < 500 / 60
        assert 0.05e-3 < simulation.conditions.feed < 0.5e-3
        left, right, bottom, top = experiments.view(simulation).extent
        # A chip as thick as Merchant's limit of about four feeds is seen whole.
        assert left < -3.5 * entry.feed
        assert right > simulation.tool.rake_point(top)[0]
        assert bottom < 0 < top


def test_handbook_forces_are_those_of_their_correlations():
    _, entries = experiments.read_experiments()
    fits = {
        ("cutting_force", "kienzle-1957"): (2220.0, 0.86),
        ("cutting_force", "konig-1973"): (1659.0, 0.79),
        ("thrust_force", "konig-1973"): (521.0, 0.51),
    }
    checked = 0
    for entry in entries:
        for value in entry.published:
            if value.kind == "correlation":
                factor, exponent = fits[value.quantity, value.source]
                expected = 1e3 * factor * (1e3 * entry.feed) ** exponent
                # Written in whole N/mm.
                assert value.value == pytest.approx(expected, abs=0.5e3)
                checked += 1
    assert checked == 12


def test_differences_are_computed_over_published_and_what_is_missing_is_a_dash():
    cut = experiment(
        Published("cutting_force", 300e3, "measured", "someone", True),
        Published("cutting_force", 440e3, "correlation", "other", False),
        Published("thickness", 0.4e-3, "measured", "someone", True),
    )
    rows = experiments.comparison([(cut, MEANS)])[1:]
    assert [row[1:] for row in rows] == [
        ["cutting force / (N/mm)", "300", "measured", "someone", "330", "+10 %"],
        ["cutting force / (N/mm)", "440 †", "correlation", "other", "330", "−25 %"],
        ["thrust force / (N/mm)", "–", "–", "–", "150", "–"],
        ["thickness / mm", "0.4", "measured", "someone", "–", "–"],
        ["contact / mm", "–", "–", "–", "0.25", "–"],
        ["period / us", "–", "–", "–", "80", "–"],
    ]
    conditions = experiments.cuts([(replace(cut, read=False), MEANS)])[1]
    assert conditions == [
        *("ours", "200", "0.15", "5", "someone †", "edge radius"),
        *("3", "20", "−2", "0.8", "60"),
    ]


def test_a_cut_is_computed_once_and_anew_at_other_settings(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(experiments, "compute", lambda cut: asked.append(cut) or MEANS)
    coarse, fine = (experiment().simulation(cell, 2e-3) for cell in (20e-6, 15e-6))
    first = experiments.means_of(coarse, "ours", tmp_path)
    again = experiments.means_of(coarse, "ours", tmp_path)
    # NaN is not equal to itself, so the text is compared.
    assert repr(first) == repr(again) == repr(MEANS)
    assert asked == [coarse]
    experiments.means_of(fine, "ours", tmp_path)
    faster = replace(experiment(), speed=300 / 60).simulation(20e-6, 2e-3)
    experiments.means_of(faster, "ours", tmp_path)
    monkeypatch.setattr(experiments, "SOLVER_VERSION", "next")
    experiments.means_of(coarse, "ours", tmp_path)
    assert asked == [coarse, fine, faster, coarse]


def test_drift_is_the_change_of_the_mean_from_half_to_half():
    time = 1e-6 * np.arange(1, 101)
    # Forty records do not count; the halves of what is left have means of 340 and 374 kN/m.
    cutting = np.repeat([100e3, 340e3, 374e3], [40, 30, 30])
    none = EnergyHistory(*np.zeros((ENERGIES, 100)))
    history = ForceHistory(
        time, cutting, np.full(100, 1e5), np.full(100, 4e-4), none, overview=None
    )
    assert experiments.drift(history) == pytest.approx(0.1, rel=DOUBLE)
