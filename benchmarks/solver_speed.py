"""Million point-steps a second of the cutting solver's step, and of its peers in one run.

A block is sheared to and fro so that about half of its points flow plastically. chipglow, Taichi
and Warp start from the same points and do the same step: velocity, its change and its gradient from
the grid (quadratic B-splines), one density for the points of a cell, hypo-elastic stress with the
Jaumann rate, radial return with Johnson and Cook's law and damage, some points failing, heat,
scatter of mass, momentum and the impulse of stress, new velocities. chipglow also looks for contact
and adds up work; it sorts the points before each round, outside the time, as it does every 20 steps
or so in a cut (`sort` tells the cost). Warp runs on one CPU core whatever it is given. All are
timed in turn, each in a subprocess that sleeps while others run; the best of the rounds
counts. Taichi and Warp are optional: `pip install taichi==1.7.4 warp-lang`.
"""

import argparse
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_context
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange, set_num_threads
from solver import DENSITY, FAR, Block

from chipglow.cutting import AISI_1045
from chipglow.cutting.damage import Damage
from chipglow.cutting.momentum import NODE_VALUES, SUMS, VELOCITY_VALUES, Step, advance_with
from chipglow.cutting.points import POINT, Grid, Points, sort_by_cell

STEEL = replace(AISI_1045, young_modulus=205e9, poisson_ratio=0.29, density=DENSITY)
"""Elastic constants and density of AISI 1045 at room temperature: peers know no others."""
STEPS = 20
WARM_UP = 20
MASS_SCALING = 400.0
CELL = 10e-6
PEERS = {"Taichi": ("taichi", "peers.step_taichi"), "Warp": ("warp", "peers.step_warp")}
SINGLE_THREADED = {"Warp"}
COMPARED = ("own_vx", "dxy", "volume", "strain", "damage", "temperature")
TOLERANCE = 1e-4
"""Largest root mean square difference from chipglow over the points, over the field's own.
Peers share density among the points that are in a cell now, chipglow among those that were in it
at the last sorting. Here it is the same: points begin a quarter of a cell from its sides and drift
less. The same arithmetic thus gives the same to rounding (3e-14 when Newton's method goes on to the
end). But Newton's method stops at a change of 2 %, in peers for each point by itself, in chipglow
when the last point of a batch is there: that changes the return of stress by about 2e-5."""


class Start(NamedTuple):
    """What every implementation starts from."""

    points: Points
    velocity: np.ndarray
    grid: Grid
    step: Step
    law: Any
    damage: Damage
    elastic: np.ndarray
    capacity: np.ndarray
    heat_fractions: np.ndarray


def sheared_block(side):
    """A square of `side` x `side` points in shear that alternates every 80 µm, half plastic."""
    block = Block((side * CELL / 2, side * CELL / 2), CELL, STEEL)
    step = block.step
    block.step = step._replace(
        mass=step.mass * MASS_SCALING, time_step=step.time_step * np.sqrt(MASS_SCALING)
    )
    wave, speed = 2 * np.pi / (16 * CELL), 5.0
    block.set_velocity(lambda x, y: speed * np.sin(wave * y) + 0 * x, lambda x, y: 0 * x * y)
    points = block.points
    band = np.cos(wave * points["y"])
    points["strain"], points["damage"] = 1.5 * band**4, 1.6 * band**4
    points["temperature"] += 600.0 * band**2
    strength = 360e6 * (1 - 0.42 * band**2) * (1 - 0.5 * band**2)
    points["dxy"] = strength * np.clip(4 * band, -1, 1)
    block.advance(WARM_UP)
    return block


def start_of(block):
    points = np.zeros_like(block.points)
    sort_by_cell(block.points, block.count, block.grid, FAR, FAR, points, block.starts)
    return Start(
        points,
        block.velocity,
        block.grid,
        block.step,
        block.law,
        block.damage,
        block.elastic,
        block.capacity,
        block.heat_fractions,
    )


class Chipglow:
    """chipglow's own step behind the same face as a peer's `Stepper`."""

    # Record in and out; per node velocity in and out, sums in and out by scatter and by update.
    bytes_per_point = 2 * POINT.itemsize + 8 * (2 * VELOCITY_VALUES + 4 * NODE_VALUES) / 4

    def __init__(self, start, threads):
        self.start, self.threads = start, threads
        shape = (start.grid.columns, start.grid.rows)
        self.points = start.points.copy()
        self.nodes, self.heat = np.zeros((*shape, NODE_VALUES)), np.zeros(shape)
        self.sums = np.zeros(SUMS)
        self.starts = np.zeros(shape[0] * shape[1] + 1, np.int64)
        self.tool = Block((CELL, CELL), CELL).tool

    def reset(self):
        start = self.start
        sort_by_cell(
            start.points, start.points.size, start.grid, FAR, FAR, self.points, self.starts
        )
        self.velocity = start.velocity.copy()
        self.nodes[:] = 0.0

    def advance(self, steps):
        start = self.start
        set_num_threads(self.threads)
        begin = perf_counter()
        advance_with(start.law)(
            steps, self.points, self.starts, self.velocity, self.nodes, self.heat, self.tool,
            start.grid, start.step, start.law, start.damage, start.elastic, start.capacity,
            start.heat_fractions, self.sums, self.threads,
        )  # fmt: skip
        return perf_counter() - begin

    def result(self):
        return {name: self.points[name] for name in POINT.names}


def serve(pipe, module, start, threads):
    """A worker: times what it is asked to, and tells where the points are in the end."""
    stepper = (Chipglow if module is None else import_module(module).Stepper)(start, threads)
    stepper.reset()
    stepper.advance(2)
    pipe.send(stepper.bytes_per_point)
    while (asked := pipe.recv()) is not None:
        if asked == "result":
            pipe.send({name: stepper.result()[name] for name in COMPARED})
        else:
            stepper.reset()
            pipe.send(stepper.advance(asked))


class Worker:
    """A stepper in a subprocess."""

    def __init__(self, name, start, threads):
        self.name, self.threads, self.seconds = name, threads, []
        context = get_context("spawn")
        self.pipe, other = context.Pipe()
        module = PEERS[name][1] if name in PEERS else None
        self.process = context.Process(target=serve, args=(other, module, start, threads))
        self.process.start()
        other.close()
        self.bytes_per_point = self.pipe.recv()

    def ask(self, what):
        self.pipe.send(what)
        return self.pipe.recv()

    def close(self):
        self.pipe.send(None)
        self.process.join()


@njit(parallel=True, cache=True)
def copy(source, target):  # type: ignore[no-untyped-def]
    for k in prange(source.size):
        target[k] = source[k]


def copy_bandwidth(threads):
    """Bytes read and written a second by a plain copy that fits in no cache."""
    source, target = np.ones(1 << 25), np.empty(1 << 25)
    set_num_threads(threads)
    best = np.inf
    for _ in range(8):
        begin = perf_counter()
        copy(source, target)
        best = min(best, perf_counter() - begin)
    return 2 * source.nbytes / best


def sort_seconds(start):
    """Seconds of one sorting by cell."""
    starts = np.zeros(start.grid.columns * start.grid.rows + 1, np.int64)
    target = np.empty_like(start.points)
    best = np.inf
    for _ in range(3):
        begin = perf_counter()
        sort_by_cell(start.points, start.points.size, start.grid, FAR, FAR, target, starts)
        best = min(best, perf_counter() - begin)
    return best


def differences(ours, theirs):
    """Root mean square difference over the points, over the field's own."""
    return {
        name: np.sqrt(np.mean((theirs[name] - ours[name]) ** 2) / np.mean(ours[name] ** 2))
        for name in COMPARED
    }


def check(name, result, ours):
    """Complain if a peer computes something else."""
    found = differences(ours, result)
    momentum = abs(result["own_vx"].sum() - ours["own_vx"].sum())
    momentum /= np.abs(ours["own_vx"]).sum()
    print(f"  {name} against chipglow: momentum {momentum:.0e}, " + ", ".join(
        f"{field} {value:.0e}" for field, value in found.items()
    ))  # fmt: skip
    wrong = [field for field, value in found.items() if not value < TOLERANCE]
    if wrong or not momentum < 1e-12:
        raise SystemExit(f"{name} differs in {', '.join(wrong) or 'momentum'}")


def measure(side, threads, names, rounds, bandwidth):
    """Time one number of points and print its rows."""
    start = start_of(sheared_block(side))
    points, plastic = start.points.size, np.mean(start.points["increment"] > 0)
    failing = np.mean(start.points["damage"] >= 1)
    fraction = sort_seconds(start) / STEPS / points
    print(f"\n{points} points, {plastic:.0%} plastic, {failing:.0%} failing; ", end="")
    print(f"sort {fraction * 1e9:.1f} ns a point-step")
    workers = [
        Worker(name, start, count)
        for count in threads
        for name in names
        if count == 1 or name not in SINGLE_THREADED
    ]
    for _ in range(rounds):
        for worker in workers:
            worker.seconds.append(worker.ask(STEPS))
    ours = workers[0].ask("result")
    for worker in workers[1:]:
        check(f"{worker.name}, {worker.threads} threads", worker.ask("result"), ours)
    print(f"{'':12}{'threads':>8}{'M/s':>8}{'M/s/core':>10}{'ns':>8}{'bound M/s':>11}{'ratio':>7}")
    rates = {(w.name, w.threads): STEPS * points / min(w.seconds) / 1e6 for w in workers}
    for worker in workers:
        worker.close()
        rate, count = rates[worker.name, worker.threads], worker.threads
        bound = bandwidth[count] / worker.bytes_per_point / 1e6
        ratio = rates["chipglow", count] / rate
        print(
            f"{worker.name:12}{count:8}{rate:8.2f}{rate / count:10.2f}{1e3 / rate:8.1f}"
            f"{bound:11.0f}{ratio:7.2f}"
        )
    best = {name: max(rates[key] for key in rates if key[0] == name) for name in names}
    for name in names[1:]:
        print(f"chipglow at its best: {best['chipglow'] / best[name]:.2f} times {name} at its best")


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--sides", type=int, nargs="+", default=[100, 200, 400, 800])
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    given = parser.parse_args()
    names = ["chipglow"]
    for name, (package, _) in PEERS.items():
        if find_spec(package) is None:
            print(f"{name} is not installed: left out (pip install taichi==1.7.4 warp-lang)")
        else:
            names.append(name)
    bandwidth = {count: copy_bandwidth(count) for count in given.threads}
    print("copy, read and written: ", end="")
    print(", ".join(f"{value / 1e9:.1f} GB/s on {n}" for n, value in bandwidth.items()), "threads")
    print(f"{STEPS} steps a round, best of {given.rounds} rounds in turn")
    print("bound: rate at that bandwidth, points and grid read and written once a pass")
    print("ratio: chipglow's rate over this one's on as many threads")
    for side in given.sides:
        measure(side, given.threads, names, given.rounds, bandwidth)


if __name__ == "__main__":
    main()
