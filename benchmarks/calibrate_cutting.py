"""Fit the onset, loss and energy of failure of AISI 1045 to measured cuts.

    python benchmarks/calibrate_cutting.py [--processes 2] [--markdown]

The four cuts of the assessment of machining models whose forces are known, and the paper's, are
computed at every point of a design; each cut takes minutes, all are kept in build/experiments. The
edge radius of the four is not told: it is fitted with them, and stands for rounding and wear.

Quadratic surfaces through the logarithms of the forces stand for the solver between the points. The
forces alone would have next to no softening, and a chip without segments: so along the front
between the two, where only the loss differs, the loss is chosen that segments the chip and comes
closest to the paper's period. Printed are all points, what is found, its uncertainty, and the
valley of numbers that are as good.
"""

import argparse
import os
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import exp, log, sqrt
from multiprocessing import get_context
from typing import TypeAlias

import numpy as np
from experiments import Experiment, Means, aligned, markdown, means_of, read_experiments
from numpy.typing import NDArray
from scipy.optimize import minimize

from chipglow.cutting import AISI_1045, SOLVER_VERSION, CuttingSimulation

Array: TypeAlias = NDArray[np.float64]

CELL = 20e-6
LENGTHS = {"amm-200-0.15": 1.0e-3, "amm-200-0.30": 1.5e-3, "paper": 2.8e-3}
"""Cutting lengths by the beginning of a cut's name: several segments, or a steady force."""

FORCES = {"cutting_force": 0.05, "thrust_force": 0.1}
"""Measured forces and their assumed relative standard uncertainties (none is published)."""

PERIOD, PERIOD_UNCERTAINTY = 90e-6, 15e-6
LEAST_DEGREE = 0.1
"""Degree of segmentation under which a chip is wavy rather than segmented."""

AXIAL = 0.7
"""Distance of the design's outer points from its middle, of the half range."""


FRONT = (1.0, 8e3, 100e-6)
"""Onset, fracture energy and edge radius of the points whose loss alone is varied, in SI."""

FRONT_LOSSES = (0.3, 0.35, 0.4, 0.45)


@dataclass(frozen=True)
class Range:
    """A fitted number: its unit in SI and its range (on a log scale)."""

    name: str
    unit: str
    scale: float
    low: float
    high: float

    def at(self, place: float) -> float:
        """Return the value in SI at a place from -1 to 1."""
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
    """Return a cut at a place of the design."""
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
    return replace(cut, workpiece=replace(AISI_1045, damage=damage), tool=tool)


def compute(task: tuple[Experiment, tuple[float, ...]]) -> Means:
    """Return the means of a cut at a place, stored or computed."""
    experiment, place = task
    return means_of(simulation(experiment, place), f"fit-{experiment.name}")


def design() -> list[tuple[float, ...]]:
    """Return the design: the middle, then each number alone below and above it."""
    axes = np.eye(len(RANGES)) * AXIAL
    return [(0.0,) * len(RANGES), *(tuple(sign * axis) for axis in axes for sign in (-1, 1))]


@dataclass(frozen=True)
class Observation:
    """A cut's quantity, its measured value and relative standard uncertainty."""

    cut: str
    quantity: str
    value: float
    uncertainty: float


def observations(experiments: Iterable[Experiment]) -> list[Observation]:
    """Return the measured forces of the four cuts, and the period of the paper's."""
    forces = [
        Observation(one.name, entry.quantity, entry.value, FORCES[entry.quantity])
        for one in experiments
        for entry in one.published
        if entry.kind == "measured" and entry.quantity in FORCES
    ]
    return [*forces, Observation("paper", "period", PERIOD, PERIOD_UNCERTAINTY / PERIOD)]


def terms(places: Array) -> Array:
    """Return the terms of a surface: one, each number, each squared; (n, 1 + 2 numbers)."""
    return np.column_stack([np.ones(len(places)), places, places**2])


@dataclass(frozen=True)
class Fit:
    """Quadratic surfaces through the logarithms of what is observed, without products of numbers.

    `weights` has the shape (terms, observations); `scatter` is the standard deviation of each.
    """

    observed: list[Observation]
    weights: Array
    scatter: Array

    @classmethod
    def through(cls, places: Array, values: Array, observed: list[Observation]) -> "Fit":
        """Fit computed values of shape (places, observations) by least squares."""
        basis, logs = terms(places), np.log(values)
        weights, *_ = np.linalg.lstsq(basis, logs, rcond=None)
        residuals = logs - basis @ weights
        free = max(len(places) - np.linalg.matrix_rank(basis), 1)
        return cls(observed, weights, np.sqrt((residuals**2).sum(axis=0) / free))

    def logs(self, place: Array) -> Array:
        """Return the logarithms of the quantities at a place."""
        return np.asarray(terms(place[None])[0] @ self.weights)

    def differences(self, place: Array) -> Array:
        """Return differences of the logarithms over their uncertainty and the surfaces' scatter."""
        measured = np.log([one.value for one in self.observed])
        widths = np.hypot([one.uncertainty for one in self.observed], self.scatter)
        return np.asarray((self.logs(place) - measured) / widths)

    def best_place(self) -> Array:
        """Return the place of least squares of the differences within the ranges."""
        results = [
            minimize(
                lambda place: float((self.differences(place) ** 2).sum()),
                np.array(start),
                bounds=[(-1.0, 1.0)] * len(RANGES),
            )
            for start in design()
        ]
        return np.asarray(min(results, key=lambda result: result.fun).x)

    def covariance_at(self, place: Array) -> Array:
        """Return the covariance of the numbers' logarithms, by observations and ranges.

        A range counts as a rectangular distribution: from -1 to 1 its variance is 1/3.
        """
        step = 1e-4
        slopes = np.array(
            [
                self.differences(place + axis) - self.differences(place - axis)
                for axis in step * np.eye(len(RANGES))
            ]
        ) / (2 * step)
        covariance = np.linalg.inv(slopes @ slopes.T + 3.0 * np.eye(len(RANGES)))
        half = np.array([0.5 * log(one.high / one.low) for one in RANGES])
        return np.asarray(covariance * np.outer(half, half))


def computed(
    experiments: list[Experiment], places: list[tuple[float, ...]], processes: int
) -> list[dict[str, Means]]:
    """Return the means of every cut at every place; the paper's edge radius is fixed."""
    tasks = [
        (one, (*place[:-1], 0.0) if one.name == "paper" else place)
        for place in places
        for one in experiments
    ]
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        means = list(pool.map(compute, tasks))
    size = len(experiments)
    return [
        {one.name: mean for one, mean in zip(experiments, means[k : k + size], strict=True)}
        for k in range(0, len(means), size)
    ]


def number_table(free: Array, chosen: Array, covariance: Array) -> list[list[str]]:
    """Return the table of fitted numbers, standard uncertainties and correlations."""
    deviations = np.sqrt(np.diag(covariance))
    correlations = covariance / np.outer(deviations, deviations)
    rows = [["number", "range", "forces alone", "chosen", "standard uncertainty / %", *"1234"]]
    for k, one in enumerate(RANGES):
        rows.append(
            [
                f"{one.name} {f'/ {one.unit}' if one.unit else ''}".strip(),
                f"{one.low:g} to {one.high:g}",
                *(f"{one.at(place[k]) / one.scale:.3g}" for place in (free, chosen)),
                f"{100 * deviations[k]:.0f}",
                *(f"{value:+.2f}".replace("-", "−") for value in correlations[k]),
            ]
        )
    return rows


def valley_table(covariance: Array) -> list[list[str]]:
    """Return the table of the principal axes of the covariance."""
    squares, axes = np.linalg.eigh(covariance)
    rows = [["axis", "standard deviation / %", *(one.name for one in RANGES)]]
    for k in range(len(squares) - 1, -1, -1):
        length = sqrt(squares[k])
        along = [f"{100 * length * part:+.0f} %".replace("-", "−") for part in axes[:, k]]
        rows.append([f"{len(squares) - k}", f"{100 * length:.0f}", *along])
    return rows


def run_table(
    places: list[tuple[float, ...]], runs: list[dict[str, Means]], observed: list[Observation]
) -> list[list[str]]:
    """Return the table of all places: numbers and differences from measured values."""
    heads = [f"{one.cut} {one.quantity.split('_')[0]}" for one in observed]
    rows = [[*(one.name for one in RANGES), *heads, "degree of the paper's / %"]]
    for place, run in zip(places, runs, strict=True):
        numbers = [f"{r.at(p) / r.scale:.3g}" for r, p in zip(RANGES, place, strict=True)]
        here = [getattr(run[one.cut], one.quantity) / one.value - 1 for one in observed]
        texts = [
            "–" if value != value else f"{100 * value:+.0f} %".replace("-", "−") for value in here
        ]
        rows.append([*numbers, *texts, f"{100 * run['paper'].degree:.0f}"])
    return rows


def front() -> list[tuple[float, ...]]:
    """Return the places at which only the loss differs."""
    return [place_of((*FRONT[:1], loss, *FRONT[1:])) for loss in FRONT_LOSSES]


def place_of(values: Iterable[float]) -> tuple[float, ...]:
    """Return the place of values in SI."""
    return tuple(
        2 * log(value / one.scale / one.low) / log(one.high / one.low) - 1
        for value, one in zip(values, RANGES, strict=True)
    )


def segments(run: dict[str, Means]) -> bool:
    """Return whether the paper's cut is segmented with the published period."""
    paper = run["paper"]
    return abs(paper.period - PERIOD) <= PERIOD_UNCERTAINTY and paper.degree >= LEAST_DEGREE


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--processes", type=int, default=2, help="cuts at a time, one thread each")
    parser.add_argument("--markdown", action="store_true", help="print Markdown tables")
    given = parser.parse_args()
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    experiments = [
        one
        for one in read_experiments()[1]
        if one.name == "paper" or any(entry.kind == "measured" for entry in one.published)
    ]
    observed = observations(experiments)
    places = [*design(), *front()]
    runs = computed(experiments, places, given.processes)
    forces = observed[:-1]
    values = [[getattr(run[one.cut], one.quantity) for one in forces] for run in runs]
    fit = Fit.through(np.array(places), np.array(values, dtype=np.float64), forces)
    along = zip(places[-len(FRONT_LOSSES) :], runs[-len(FRONT_LOSSES) :], strict=True)
    segmented = [(place, run) for place, run in along if segments(run)]
    chosen, _ = min(segmented, key=lambda point: abs(point[1]["paper"].period - PERIOD))
    covariance = fit.covariance_at(np.array(chosen))
    table = markdown if given.markdown else aligned
    print(f"Cell {CELL * 1e6:g} um, solver {SOLVER_VERSION}, {len(places)} points.\n")
    print(f"{table(run_table(places, runs, observed))}\n")
    print("By the forces alone, and the front's point that segments the paper's cut in time:\n")
    print(f"{table(number_table(fit.best_place(), np.array(chosen), covariance))}\n")
    print(table(valley_table(covariance)))


if __name__ == "__main__":
    main()
