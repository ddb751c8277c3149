"""Million point-steps a second of the cutting solver's step.

A block is sheared to and fro so that about half of its points flow plastically and some fail. The
points are sorted before each round, outside the time, as a cut does every 20 steps or so (`sort`
gives the cost). Numbers of threads are timed in turn and have to agree; the best of the rounds
counts.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np
from common import arguments, timed
from numba import njit, prange, set_num_threads
from solver import DENSITY, FAR, Block

from chipglow.cutting import AISI_1045
from chipglow.cutting.momentum import NODE_VALUES, SUMS, VELOCITY_VALUES, advance_with
from chipglow.cutting.points import POINT, sort_by_cell

STEEL = replace(AISI_1045, young_modulus=205e9, poisson_ratio=0.29, density=DENSITY)
STEPS = 20
WARM_UP = 20
MASS_SCALING = 400.0
CELL = 10e-6
COMPARED = ("own_vx", "dxy", "volume", "strain", "damage", "temperature")


def sheared_block(side):
    """Return `side` x `side` points in shear that alternates every 80 µm, half plastic."""
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
    points = np.zeros_like(block.points)
    sort_points(block, points)
    block.points = points
    return block


def sort_points(block, target):
    """Sort the points of a block by cell into `target`; return where each cell begins."""
    starts = np.zeros_like(block.starts)
    sort_by_cell(block.points, block.count, block.grid, FAR, FAR, target, starts)
    return starts


class Stepper:
    """The step on a number of threads."""

    # Record in and out; per node velocity in and out, sums in and out by scatter and by update.
    bytes_per_point = 2 * POINT.itemsize + 8 * (2 * VELOCITY_VALUES + 4 * NODE_VALUES) / 4

    def __init__(self, start, threads):
        self.start, self.threads = start, threads
        shape = (start.grid.columns, start.grid.rows)
        self.points = start.points.copy()
        self.nodes, self.heat = np.zeros((*shape, NODE_VALUES)), np.zeros(shape)
        self.sums = np.zeros(SUMS)
        self.tool = Block((CELL, CELL), CELL).tool

    def reset(self):
        self.starts = sort_points(self.start, self.points)
        self.velocity = self.start.velocity.copy()
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
        return {name: self.points[name] for name in COMPARED}


@njit(parallel=True, cache=True)
def copy(source, target):  # type: ignore[no-untyped-def]
    for k in prange(source.size):
        target[k] = source[k]


def copy_bandwidth(threads):
    """Return bytes read and written a second by a copy larger than the caches."""
    source, target = np.ones(1 << 25), np.empty(1 << 25)
    set_num_threads(threads)
    return 2 * source.nbytes / min(timed(lambda: copy(source, target))[1] for _ in range(8))


def sort_seconds(start):
    """Return the seconds to sort the points by cell once."""
    target = np.empty_like(start.points)
    return min(timed(lambda: sort_points(start, target))[1] for _ in range(3))


def check(stepper, ours):
    """End the program if a number of threads computes something else than `ours`."""
    result = stepper.result()
    wrong = [field for field in COMPARED if not np.array_equal(result[field], ours[field])]
    if wrong:
        raise SystemExit(f"{stepper.threads} threads differ in {', '.join(wrong)}")


def measure(side, threads, rounds, bandwidth):
    """Time one number of points and print its rows."""
    start = sheared_block(side)
    points, plastic = start.points.size, np.mean(start.points["increment"] > 0)
    failing = np.mean(start.points["damage"] >= 1)
    fraction = sort_seconds(start) / STEPS / points
    print(f"\n{points} points, {plastic:.0%} plastic, {failing:.0%} failing; ", end="")
    print(f"sort {fraction * 1e9:.1f} ns a point-step")
    steppers = [Stepper(start, count) for count in threads]
    seconds = {stepper: [] for stepper in steppers}
    for stepper in steppers:
        stepper.reset()
        stepper.advance(2)
    for _ in range(rounds):
        for stepper in steppers:
            stepper.reset()
            seconds[stepper].append(stepper.advance(STEPS))
    ours = steppers[0].result()
    for stepper in steppers[1:]:
        check(stepper, ours)
    print(f"{'':12}{'threads':>8}{'M/s':>8}{'M/s/core':>10}{'ns':>8}{'bound M/s':>11}")
    rates = {stepper: STEPS * points / min(seconds[stepper]) / 1e6 for stepper in steppers}
    for stepper, rate in rates.items():
        count = stepper.threads
        bound = bandwidth[count] / stepper.bytes_per_point / 1e6
        print(
            f"{'chipglow':12}{count:8}{rate:8.2f}{rate / count:10.2f}{1e3 / rate:8.1f}{bound:11.0f}"
        )


def main():
    given = arguments(__doc__, rounds=10, sides=[100, 200, 400, 800], threads=[1, 2])
    bandwidth = {count: copy_bandwidth(count) for count in given.threads}
    print("copy, read and written: ", end="")
    print(", ".join(f"{value / 1e9:.1f} GB/s on {n}" for n, value in bandwidth.items()), "threads")
    print(f"{STEPS} steps a round, best of {given.rounds} rounds in turn")
    print("bound: rate at that bandwidth, points and grid read and written once a pass")
    for side in given.sides:
        measure(side, given.threads, given.rounds, bandwidth)


if __name__ == "__main__":
    main()
