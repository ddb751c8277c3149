"""Fit strength, onset, loss and energy of failure, friction and edge radius to cuts of AISI 1045.

    python benchmarks/calibrate_cutting.py [--processes 2] [--markdown]

The four cuts whose forces are known, and the paper's, are computed at every point of a design; each
takes minutes, all are kept in build/experiments. Quadratic surfaces through the logarithms of the
results stand for the solver between the points. Forces, period and degree of segmentation are
fitted together. Printed are all points, the best place with its differences, its uncertainty, and
the principal axes of the covariance.
"""

import os
from collections import namedtuple
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import exp, isnan, log, sqrt
from multiprocessing import get_context

import numpy as np
from common import arguments, minus, print_tables
from experiments import means_of, read_experiments
from scipy.optimize import minimize

from chipglow.cutting import AISI_1045, SOLVER_VERSION, workpiece

CELL = 14e-6
LENGTHS = {"amm-200-0.15": 1.4e-3, "amm-200-0.30": 2.0e-3, "paper": 2.8e-3}
"""Cutting lengths by the beginning of a cut's name: several segments, or a steady force."""

UNCERTAINTIES = {"cutting_force": 0.05, "thrust_force": 0.1}
"""Assumed relative standard uncertainties of measured forces (none is published)."""

PAPER = {"period": (90e-6, 0.1), "degree": (0.3, 0.15)}
"""Period of the paper's simulation and an assumed degree, with relative standard uncertainties."""

AXIAL = 0.7
"""Distance of the design's outer points from its middle, of the half range."""


@dataclass(frozen=True)
class Range:
    """A fitted number: its unit in SI and its range (on a log scale)."""

    name: str
    unit: str
    scale: float
    low: float
    high: float

    def at(self, place):
        return self.scale * exp(log(self.low) + 0.5 * (place + 1) * log(self.high / self.low))


RANGES = (
    Range("strength over the law's", "", 1.0, 1.0, 1.25),
    Range("onset (d1, d2 over BASE)", "", 1.0, 0.7, 1.45),
    Range("triaxiality's exponent -d3", "", 1.0, 3.0, 5.3),
    Range("loss", "", 1.0, 0.6, 0.92),
    Range("fracture energy", "kJ/m2", 1e3, 8.0, 18.0),
    Range("friction coefficient", "", 1.0, 0.38, 0.65),
    Range("edge radius of the four", "um", 1e-6, 70.0, 122.0),
)
LAW = replace(workpiece("aisi-1045/jaspers-dautzenberg-za").flow_stress, drag=2.1e3)
BASE = {"d1": 0.006, "d2": 0.08}
STRESSES = ("athermal_stress", "thermal_stress", "hardening")


def simulation(experiment, place):
    strength, onset, d3, loss, energy, friction, edge = (
        one.at(part) for one, part in zip(RANGES, place, strict=True)
    )
    length = next(value for name, value in LENGTHS.items() if experiment.name.startswith(name))
    cut = experiment.simulation(CELL, length)
    law = replace(LAW, **{name: strength * getattr(LAW, name) for name in STRESSES})
    changed = {name: onset * value for name, value in BASE.items()}
    damage = replace(AISI_1045.damage, **changed, d3=-d3, loss=loss, fracture_energy=energy)
    return replace(
        cut,
        workpiece=replace(AISI_1045, flow_stress=law, damage=damage),
        tool=cut.tool if experiment.name == "paper" else replace(cut.tool, edge_radius=edge),
        friction=replace(cut.friction, coefficient=friction),
    )


def compute(task):
    experiment, place = task
    return means_of(simulation(experiment, place), f"fit-{experiment.name}")


def design():
    """Return the design: the middle, then each number alone below and above it."""
    axes = np.eye(len(RANGES)) * AXIAL
    return [(0.0,) * len(RANGES), *(tuple(sign * axis) for axis in axes for sign in (-1, 1))]


Observation = namedtuple("Observation", "cut quantity value uncertainty")
"""A cut's quantity, its measured value and relative standard uncertainty."""


def observations(experiments):
    forces = [
        Observation(one.name, entry.quantity, entry.value, UNCERTAINTIES[entry.quantity])
        for one in experiments
        for entry in one.published
        if entry.kind == "measured" and entry.quantity in UNCERTAINTIES
    ]
    return [*forces, *(Observation("paper", name, *value) for name, value in PAPER.items())]


def terms(places):
    """Return the terms of a surface: one, each number, each squared; (n, 1 + 2 numbers)."""
    return np.column_stack([np.ones(len(places)), places, places**2])


@dataclass(frozen=True)
class Fit:
    """Quadratic surfaces through the logarithms of what is observed, without products of numbers.

    `scatter` is the standard deviation of each observation.
    """

    observed: list
    weights: np.ndarray  # (terms, observations)
    scatter: np.ndarray

    @classmethod
    def through(cls, places, values, observed):
        """Fit computed values of shape (places, observations) by least squares."""
        basis, logs = terms(places), np.log(values)
        weights, scatter = [], []
        for column in logs.T:
            known = np.isfinite(column)  # a chip that hardly segments has no period
            free = max(known.sum() - np.linalg.matrix_rank(basis[known]), 1)
            weights.append(np.linalg.lstsq(basis[known], column[known], rcond=None)[0])
            residuals = column[known] - basis[known] @ weights[-1]
            scatter.append(np.sqrt((residuals**2).sum() / free))
        return cls(observed, np.transpose(weights), np.array(scatter))

    def logs(self, place):
        return terms(place[None])[0] @ self.weights

    def differences(self, place):
        """Return differences of the logarithms over their uncertainty and the surfaces' scatter."""
        measured = np.log([one.value for one in self.observed])
        widths = np.hypot([one.uncertainty for one in self.observed], self.scatter)
        return (self.logs(place) - measured) / widths

    def best_place(self):
        squares = lambda place: float((self.differences(place) ** 2).sum())  # noqa: E731
        within = [(-1.0, 1.0)] * len(RANGES)
        results = [minimize(squares, np.array(start), bounds=within) for start in design()]
        return min(results, key=lambda result: result.fun).x

    def covariance_at(self, place):
        """Return the covariance of the numbers' logarithms, by observations and ranges.

        A range counts as a rectangular distribution: from -1 to 1 its variance is 1/3.
        """
        axes = 1e-4 * np.eye(len(RANGES))
        rises = [self.differences(place + one) - self.differences(place - one) for one in axes]
        slopes = np.array(rises) / 2e-4
        covariance = np.linalg.inv(slopes @ slopes.T + 3.0 * np.eye(len(RANGES)))
        half = np.array([0.5 * log(one.high / one.low) for one in RANGES])
        return covariance * np.outer(half, half)


def computed(experiments, places, processes):
    tasks = [
        (one, (*place[:-1], 0.0) if one.name == "paper" else place)
        for place in places
        for one in experiments
    ]
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        means = pool.map(compute, tasks)
        return [{one.name: next(means) for one in experiments} for _ in places]


def best_table(fit, place):
    rows = [["cut", "quantity", "predicted over measured / %", "scatter of the surface / %"]]
    for one, value, scatter in zip(fit.observed, fit.logs(place), fit.scatter, strict=True):
        difference = f"{100 * (exp(value) / one.value - 1):+.0f}"
        rows.append([one.cut, one.quantity, difference, f"{100 * scatter:.0f}"])
    return rows


def number_table(place, covariance):
    deviations = np.sqrt(np.diag(covariance))
    correlations = covariance / np.outer(deviations, deviations)
    numbers = [str(k + 1) for k in range(len(RANGES))]
    rows = [["number", "range", "best", "standard uncertainty / %", *numbers]]
    for k, one in enumerate(RANGES):
        name = f"{one.name} / {one.unit}" if one.unit else one.name
        best = f"{one.at(place[k]) / one.scale:.3g}"
        row = [name, f"{one.low:g} to {one.high:g}", best, f"{100 * deviations[k]:.0f}"]
        rows.append([*row, *(minus(f"{value:+.2f}") for value in correlations[k])])
    return rows


def valley_table(covariance):
    squares, axes = np.linalg.eigh(covariance)
    rows = [["axis", "standard deviation / %", *(one.name for one in RANGES)]]
    for k in range(len(squares) - 1, -1, -1):
        length = sqrt(squares[k])
        along = [minus(f"{100 * length * part:+.0f} %") for part in axes[:, k]]
        rows.append([f"{len(squares) - k}", f"{100 * length:.0f}", *along])
    return rows


def run_table(places, runs, observed):
    heads = [f"{one.cut} {one.quantity.split('_')[0]}" for one in observed]
    rows = [[*(one.name for one in RANGES), *heads, "degree of the paper's / %"]]
    for place, run in zip(places, runs, strict=True):
        numbers = [f"{r.at(p) / r.scale:.3g}" for r, p in zip(RANGES, place, strict=True)]
        here = [getattr(run[one.cut], one.quantity) / one.value - 1 for one in observed]
        texts = ["–" if isnan(value) else minus(f"{100 * value:+.0f} %") for value in here]
        rows.append([*numbers, *texts, f"{100 * run['paper'].degree:.0f}"])
    return rows


def main():
    given = arguments(__doc__, processes=2, markdown=False)
    os.environ.setdefault("NUMBA_NUM_THREADS", "1")
    experiments = [
        one
        for one in read_experiments()[1]
        if one.name == "paper" or any(entry.kind == "measured" for entry in one.published)
    ]
    observed = observations(experiments)
    places = design()
    runs = computed(experiments, places, given.processes)
    values = [[getattr(run[one.cut], one.quantity) for one in observed] for run in runs]
    fit = Fit.through(np.array(places), np.array(values, dtype=np.float64), observed)
    best = fit.best_place()
    covariance = fit.covariance_at(best)
    print(f"Cell {CELL * 1e6:g} um, solver {SOLVER_VERSION}, {len(places)} points.")
    tables = run_table(places, runs, observed), best_table(fit, best)
    tables = *tables, number_table(best, covariance), valley_table(covariance)
    print_tables(tables, given.markdown)


if __name__ == "__main__":
    main()
