"""Fit what no source gives of AISI 1045 in a cut: onset, loss and energy of its failure.

    python benchmarks/calibrate_cutting.py [--points 24] [--processes 2] [--markdown]

The four cuts of the assessment of machining models whose forces are known, and the paper's, are
computed at every point of a design; each cut takes minutes, all are kept in build/experiments. The
edge radius of the four is not told: it is fitted with them, and stands for rounding and wear.

Quadratic surfaces through the logarithms of the forces stand for the solver between the points.
What is found: the best point, what a cut there gives, the valley of points that are as good, and
which combinations of the numbers the forces do not tell apart.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import exp, log

import numpy as np
from experiments import Experiment, Means, means_of

from chipglow.cutting import AISI_1045, CuttingSimulation, Numerics

CELL = 20e-6
LENGTHS = {"amm-200-0.15": 1.0e-3, "amm-200-0.30": 1.5e-3, "paper": 2.8e-3}
"""Cutting lengths by the beginning of a cut's name: several segments, or a steady force."""

FORCES = {"cutting_force": 0.05, "thrust_force": 0.1}
"""Measured forces, and the relative standard uncertainty taken for each: none is told."""

PERIOD, PERIOD_UNCERTAINTY = 90e-6, 15e-6
AXIAL = 0.7
"""Distance of the design's outer points from its middle, of the half range."""


@dataclass(frozen=True)
class Range:
    """A number that is fitted: its unit in SI, and where it is looked for (on a log scale)."""

    name: str
    unit: str
    scale: float
    low: float
    high: float

    def at(self, place: float) -> float:
        """Value in SI at a place from -1 to 1."""
        return self.scale * exp(log(self.low) + 0.5 * (place + 1) * log(self.high / self.low))


RANGES = (
    Range("onset (d1, d2 over those in use)", "", 1.0, 0.7, 2.0),
    Range("loss", "", 1.0, 0.12, 0.5),
    Range("fracture energy", "kJ/m2", 1e3, 2.0, 15.0),
    Range("edge radius of the four", "um", 1e-6, 40.0, 120.0),
)
BASE = {"d1": 0.006, "d2": 0.331}
"""A tenth of the constants that circulate for medium carbon steel."""


def simulation(experiment: Experiment, place: Iterable[float]) -> CuttingSimulation:
    """A cut at a place of the design."""
    onset, loss, energy, edge = (r.at(p) for r, p in zip(RANGES, place, strict=True))
    length = next(value for name, value in LENGTHS.items() if experiment.name.startswith(name))
    cut = experiment.simulation(CELL, length)
    assert AISI_1045.damage is not None
    damage = replace(
        AISI_1045.damage,
        **{name: onset * value for name, value in BASE.items()},
        loss=loss,
        fracture_energy=energy,
    )
    tool = cut.tool if experiment.name == "paper" else replace(cut.tool, edge_radius=edge)
    numerics: Numerics = cut.numerics
    return replace(cut, workpiece=replace(AISI_1045, damage=damage), tool=tool, numerics=numerics)


def compute(task: tuple[Experiment, tuple[float, ...]]) -> Means:
    """Means of a cut at a place, kept or computed now."""
    experiment, place = task
    return means_of(simulation(experiment, place), f"fit-{experiment.name}")


def design() -> list[tuple[float, ...]]:
    """Places of the design: the middle, then each number alone below and above it."""
    axes = np.eye(len(RANGES)) * AXIAL
    return [(0.0,) * len(RANGES), *(tuple(sign * axis) for axis in axes for sign in (-1, 1))]
