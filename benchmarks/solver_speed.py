"""Million point-steps a second of the cutting solver's step.

A block is sheared so that about half of its points flow plastically and some fail. The points are
sorted before each round, outside the time, as a cut does every 20 steps or so (`sort` gives the
cost). Numbers of threads are timed in turn and have to agree; the best of the rounds counts.
"""

from copy import deepcopy
from dataclasses import replace

import numpy as np
from common import arguments, timed
from numba import njit, prange, set_num_threads
from solver import DENSITY, FAR, Block

from chipglow.cutting import AISI_1045
from chipglow.cutting.momentum import NODE_VALUES, VELOCITY_VALUES
from chipglow.cutting.points import POINT, sort_by_cell

STEEL = replace(AISI_1045, young_modulus=205e9, poisson_ratio=0.29, density=DENSITY)
STEPS = 20
MASS_SCALING = 400.0
CELL = 10e-6
# Record in and out; per node velocity in and out, sums in and out by scatter and by update.
BYTES = 2 * POINT.itemsize + 8 * (2 * VELOCITY_VALUES + 4 * NODE_VALUES) / 4
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
    block.advance(STEPS)
    return block


def step_on(start, threads):
    """Sort a copy of a block, and time the steps on some threads; its points and the seconds."""
    block = deepcopy(start)
    block.sort()
    set_num_threads(threads)
    seconds = timed(lambda: block.step_on(STEPS, threads))[1]
    return block.points, seconds


@njit(parallel=True, cache=True)
def copy(source, target):
    for k in prange(source.size):
        target[k] = source[k]


def copy_bandwidth(threads):
    """Bytes read and written a second by a copy larger than the caches."""
    source, target = np.ones(1 << 25), np.empty(1 << 25)
    set_num_threads(threads)
    return 2 * source.nbytes / min(timed(lambda: copy(source, target))[1] for _ in range(8))


def measure(side, threads, rounds, bandwidth):
    start = sheared_block(side)
    points, failing = start.points.size, np.mean(start.points["damage"] >= 1)
    plastic = np.mean(start.points["increment"] > 0)
    target = np.zeros_like(start.points)
    order = start.points, points, start.grid, FAR, FAR, target, start.starts
    sorting = min(timed(lambda: sort_by_cell(*order))[1] for _ in range(3)) / STEPS / points
    print(f"\n{points} points, {plastic:.0%} plastic, {failing:.0%} failing; ", end="")
    print(f"sort {sorting * 1e9:.1f} ns a point-step")
    seconds = {count: [] for count in threads}
    for _ in range(rounds + 1):  # the first may compile
        results = {count: step_on(start, count) for count in threads}
        for count, (found, taken) in results.items():
            seconds[count].append(taken)
            for name in COMPARED:
                np.testing.assert_array_equal(found[name], results[threads[0]][0][name])
    print(f"{'':12}{'threads':>8}{'M/s':>8}{'M/s/core':>10}{'ns':>8}{'bound M/s':>11}")
    for count, taken in seconds.items():
        rate, bound = STEPS * points / min(taken[1:]) / 1e6, bandwidth[count] / BYTES / 1e6
        print(f"{'chipglow':12}{count:8}{rate:8.2f}{rate / count:10.2f}", end="")
        print(f"{1e3 / rate:8.1f}{bound:11.0f}")


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
