"""A free block that bends because one side of it is warmer."""

from dataclasses import replace

import numpy as np
from solver import DENSITY, ELASTIC, Block

from cases import Case, Check
from cases.motion import MICRO
from chipglow.cutting import TemperatureTable
from chipglow.cutting.momentum import EXPANSION_WORK
from chipglow.drawing.scales import BLUE, GREY, VERMILLION

COLD, HOT = 293.15, 693.15
MIDDLE = 0.5 * (COLD + HOT)
GROWTH = 1.02
"""Volume without stress at `HOT` over that at `COLD`."""
GROWTH_AT_MIDDLE = 2.0 / (1.0 + 1.0 / GROWTH)
"""The density is linear over the temperature: half way its fall is half as well."""
EXPANSION = (GROWTH - 1.0) / 3 / (HOT - COLD)
"""Linear expansion in 1/K."""
STEEL = replace(ELASTIC, density=TemperatureTable((COLD, HOT), (DENSITY, DENSITY / GROWTH)))
YOUNG, POISSON = STEEL.young_modulus, STEEL.poisson_ratio
BULK = YOUNG / (3 * (1 - 2 * POISSON))
LENGTH, HEIGHT, SPAN = 160e-6, 80e-6, 200.0
EXAGGERATED = 50
ACROSS = YOUNG * EXPANSION * SPAN
"""Stress across the plane, from one side of the block to the other, in Pa."""


def tension(block):
    """Mean stress of the points in Pa."""
    p = block.points
    return BULK * (p["volume"] / p["free_volume"] - 1.0)


def warm(block, rise, cycles=150, settling=50):
    """Warm a block so slowly that waves die down; the energy taken from heat in J/m.

    `rise` gives the rise of the points' temperatures in K.
    """
    taken = 0.0
    for cycle in range(cycles + settling):
        if cycle < cycles:
            block.points["temperature"] += rise(block.points) / cycles
        # Points that take the grid's velocity lose what the warming sets in motion.
        block.advance_with_the_grid(20)
        taken += block.sums[EXPANSION_WORK]
    return taken


def bent_block(cell):
    """A free block whose temperature has become linear over its height."""
    block = Block((LENGTH, HEIGHT), cell=cell, material=STEEL)
    block.points["temperature"] = MIDDLE
    block.points["volume"] = block.points["free_volume"] = block.spacing**2 * GROWTH_AT_MIDDLE
    cycles = round(1.5e-3 / cell)
    warm(block, lambda points: SPAN * (points["material_y"] / HEIGHT - 0.5), cycles, cycles // 3)
    return block


def places(block):
    """Places before the warming, from the middle, in m; and which are far from the surface."""
    x = block.points["material_x"] - LENGTH / 2
    y = block.points["material_y"] - HEIGHT / 2
    return x, y, (np.abs(x) < 0.3 * LENGTH) & (np.abs(y) < 0.35 * HEIGHT)


def curvature(block):
    """Curvature in 1/m: the part x y of the displacement along x."""
    x, y, _ = places(block)
    parts = np.stack([np.ones_like(x), x, y, x * y], axis=-1)
    moved = block.points["x"] - block.points["material_x"]
    return float(np.linalg.lstsq(parts, moved, rcond=None)[0][3])


def stress_in_plane(block):
    """Largest stress in the plane in Pa, far from the surface."""
    xx, yy, _ = block.deviator()
    inside = places(block)[2]
    return float(max(np.abs(part + tension(block))[inside].max() for part in (xx, yy)))


def unevenness(block):
    """Largest difference of the mean stress from a third of that across, in Pa, far inside.

    The points of a cell share one dilation, so that is taken at the middle of their cell.
    """
    cells = np.floor(block.points["material_y"] / block.cell) + 0.5
    expected = -ACROSS / 3 * (cells * block.cell / HEIGHT - 0.5)
    return float(np.abs(tension(block) - expected)[places(block)[2]].max())


def bent(cells=(10e-6, 5e-6)):
    blocks = [bent_block(cell) for cell in cells]
    expected = (1 + POISSON) * EXPANSION * SPAN / HEIGHT

    def draw(figure):
        left, right = figure.subplots(1, 2)
        p = blocks[-1].points
        starts = p["material_x"], p["material_y"]
        x, y = (at + EXAGGERATED * (p[axis] - at) for axis, at in zip("xy", starts, strict=True))
        shown = left.scatter(x / MICRO, y / MICRO, 2, p["temperature"], cmap="viridis")
        figure.colorbar(shown, ax=left, label="temperature / K", shrink=0.7)
        left.set_title(f"displacements drawn {EXAGGERATED} times")
        left.set(aspect="equal", xlabel="x / µm", ylabel="y / µm")
        for block, colour in zip(blocks, (VERMILLION, BLUE), strict=True):
            inside = np.abs(places(block)[0]) < 0.3 * LENGTH
            height = block.points["material_y"][inside] / MICRO
            label = f"cell {block.cell / MICRO:g} µm"
            right.plot(height, 3 * tension(block)[inside] / 1e6, ".", color=colour, label=label)
        fine = np.array([0.0, HEIGHT])
        exact = -ACROSS * (fine / HEIGHT - 0.5)
        right.plot(fine / MICRO, exact / 1e6, color=GREY, linewidth=0.9, label="exact")
        right.set(xlabel="height / µm", ylabel="stress across the plane / MPa")
        right.legend()

    shared = "{} % if the points of a cell shared one volume"
    checks = (
        *(
            Check(f"curvature, cell {cell} µm", "(1 + ν) α dT/dy", expected, curvature(block),
                  tolerance, f"{count} cells in the height", "1/m")
            for block, cell, tolerance, count in (
                (blocks[0], 10, 0.03, "eight"), (blocks[1], 5, 0.015, "sixteen")
            )
        ),
        Check("stress in the plane, cell 10 µm, fraction of that across", "none", 0.0,
              stress_in_plane(blocks[0]) / ACROSS, 0.03, shared.format(8), absolute=True),
        Check("mean stress from point to point, cell 10 µm, likewise", "linear over the height",
              0.0, unevenness(blocks[0]) / ACROSS, 0.01, shared.format(7), absolute=True),
    )  # fmt: skip
    return Case("expansion", "A block warmed on one side", checks, draw)
