"""A strip squeezed between rough plates: confined plastic flow, which locks if anything does."""

from math import sqrt

import numpy as np
from solver import Block

from cases import Case, Check
from cases.motion import MICRO
from cases.plasticity import perfectly_plastic
from cases.taylor import wall
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION

YIELD_STRESS = 200e6
STEEL = perfectly_plastic(YIELD_STRESS)
HALF_HEIGHT, WIDTH = 100e-6, 800e-6
SPEED, WAY = 1.0, 1.6e-6
HELD_CELLS = 4
PRANDTL = 0.75 + WIDTH / (8 * HALF_HEIGHT)
"""Mean pressure over 2k by Prandtl (1923), 3/4 + w/(4h)."""


def squeeze(cell, samples=24):
    """Way of the plate (m) and mean pressure over 2k.

    Half of the strip: the driven boundary, to which it sticks, is the rough plate; the tool, free
    of friction, is the plane of symmetry. What the plate has pushed back flows in behind it.
    """
    held = HELD_CELLS * cell
    end = held + HALF_HEIGHT
    block = Block(
        (end, WIDTH), cell=cell, material=STEEL, tool=wall(end),
        inflow=held + 1e-3 * cell, ceiling=1.0, speed=SPEED,
    )  # fmt: skip
    rate = SPEED / HALF_HEIGHT
    block.set_velocity(
        lambda x, y: rate * np.clip(end - x, 0, HALF_HEIGHT) + 0 * y,
        lambda x, y: rate * (y - WIDTH / 2) * (x > held),
    )
    cycles = round(WAY / SPEED / block.step.time_step / samples / 20)
    pressures = []
    for _ in range(samples):
        force = 0.0
        for _ in range(cycles):
            block.advance(20)
            force -= block.force[0] / cycles
        pressures.append(force / WIDTH / (2 * YIELD_STRESS / sqrt(3)))
    way = SPEED * block.step.time_step * 20 * cycles * np.arange(1, samples + 1)
    return way, np.array(pressures)


def limit(pressures):
    """Mean over the second half of the way, where all is plastic and little widened."""
    return float(pressures[pressures.size // 2 :].mean())


def rough_plates(cells=(25e-6, 20e-6, 12.5e-6, 10e-6)):
    results = [squeeze(cell) for cell in cells]
    limits = [limit(pressures) for _, pressures in results]
    slope, extrapolated = (float(value) for value in np.polyfit(cells, limits, 1))

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1), sharey=True)
        colours = (GREY, VERMILLION, GREEN, BLUE)
        for (way, pressures), cell, colour in zip(results, cells, colours, strict=True):
            left.plot(way / MICRO, pressures, color=colour, label=f"cell {cell / MICRO:g} µm")
        left.axhline(PRANDTL, color="black", linestyle="--", linewidth=0.9, label="Prandtl")
        left.set(ylim=(0, 2.4), xlabel="way of the plate / µm", ylabel="mean pressure / 2k")
        left.legend()
        fine = np.linspace(0, cells[0], 2)
        line = extrapolated + slope * fine
        right.plot(fine / MICRO, line, ":", color=GREY, label="straight line")
        right.plot(np.array(cells) / MICRO, limits, "o", color=BLUE, label="solver")
        right.plot(0, PRANDTL, "s", color="black", label="Prandtl")
        right.set_xlabel("cell / µm")
        right.legend(loc="lower right")

    straight = "a straight line through four cells; the strip widens by 1 %; "
    straight += "the formula is an approximation"
    checks = (
        Check("mean pressure over 2k, extrapolated to no cell", "Prandtl, 3/4 + w/(4h)", PRANDTL,
              extrapolated, 0.03,
              straight),
        Check(f"the same, cell {cells[-1] / MICRO:g} µm: 10 cells in the half height",
              "Prandtl, 3/4 + w/(4h)", PRANDTL, limits[-1], 0.1,
              "material slips off the plate within a cell: first order in the cell"),
    )  # fmt: skip
    return Case("upsetting", "A strip between rough plates", checks, draw)
