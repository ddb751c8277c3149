"""Mean of the plastic strain rate around each point, for `NonlocalViscosity`."""

from math import ceil

import numpy as np
from numba import njit

from chipglow.cutting.heat import nodes_around

GRID_VARIANCE = 0.5
"""Variance, in squares of a cell, of the way from points to nodes and back: a quarter for each."""


@njit(cache=True)
def average_rates(points, count, grid, duration, length):  # type: ignore[no-untyped-def]
    """Give points the Gaussian mean of the plastic strain rate around them, `mean_rate` in 1/s.

    The rate is averaged over the last `duration` (s), weighted by volume: where there is no
    material, nothing counts. The Gaussian of the standard deviation `length` (m) consists of
    three-point weights; its variance is right to rounding on every grid whose cell is less than √2
    lengths, and that of the grid itself on a coarser one.
    """
    nodes = np.zeros((2, grid.columns, grid.rows))
    for k in range(count):
        p = points[k]
        i, j, _, _, wx, wy = nodes_around(p, grid)
        flow = p.volume * (p.strain - p.averaged_strain) / duration
        p.averaged_strain = p.strain
        for a in range(3):
            for b in range(3):
                nodes[0, i + a, j + b] += wx[a] * wy[b] * p.volume
                nodes[1, i + a, j + b] += wx[a] * wy[b] * flow
    _blur(nodes, max((length / grid.cell) ** 2 - GRID_VARIANCE, 0.0))
    for k in range(count):
        p = points[k]
        i, j, _, _, wx, wy = nodes_around(p, grid)
        volume = flow = 0.0
        for a in range(3):
            for b in range(3):
                volume += wx[a] * wy[b] * nodes[0, i + a, j + b]
                flow += wx[a] * wy[b] * nodes[1, i + a, j + b]
        p.mean_rate = flow / volume


@njit
def _blur(nodes, variance):  # type: ignore[no-untyped-def]
    """Blur two fields on nodes by a variance in squares of a cell."""
    passes = ceil(2.0 * variance)
    if passes == 0:
        return
    side = 0.5 * variance / passes
    middle = 1.0 - 2.0 * side
    _, columns, rows = nodes.shape
    spare = np.zeros_like(nodes)  # its border stays so: no pass writes there
    for _ in range(passes):
        for c in range(2):
            for i in range(1, columns - 1):
                for j in range(rows):
                    beside = nodes[c, i - 1, j] + nodes[c, i + 1, j]
                    spare[c, i, j] = middle * nodes[c, i, j] + side * beside
        for c in range(2):
            for i in range(columns):
                for j in range(1, rows - 1):
                    beside = spare[c, i, j - 1] + spare[c, i, j + 1]
                    nodes[c, i, j] = middle * spare[c, i, j] + side * beside
