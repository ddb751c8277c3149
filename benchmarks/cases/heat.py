"""Conduction between two half-spaces."""

from math import sqrt

import numpy as np
from scipy.special import erfc
from solver import DENSITY, Block

from cases import Case, Check, order
from cases.motion import MICRO, convergence
from chipglow.cutting import AISI_1045
from chipglow.drawing.scales import BLUE, GREY

CONDUCTIVITY, CAPACITY = 45.0, 520.0
DIFFUSIVITY = CONDUCTIVITY / (DENSITY * CAPACITY)
START, DURATION = 40e-6, 60e-6


def constant_properties():
    """Conductivity and heat capacity that do not depend on temperature, for kernels."""
    size = AISI_1045.conductivity.sampled().size
    return np.full(size, CONDUCTIVITY), np.full(size, CAPACITY)


def exact(x, time):
    """Temperature in K at a time after half-spaces of 293 K and 893 K met at x = 0."""
    return 293.0 + 300.0 * erfc(-x / sqrt(4 * DIFFUSIVITY * time))


def half_spaces(cell):
    """Place in m and temperature in K of the points, 60 us later."""
    block = Block((600e-6, 3 * cell), cell=cell)
    x = block.points["x"] - 300e-6
    block.points["temperature"] = exact(x, START)
    block.conduct(DURATION, round(DURATION / (0.1 * cell**2 / DIFFUSIVITY)), *constant_properties())
    return x, block.points["temperature"]


def conduction(cells=(20e-6, 10e-6, 5e-6)):
    results = [half_spaces(cell) for cell in cells]
    apart = (temperature - exact(x, START + DURATION) for x, temperature in results)
    errors = [float(np.abs(one).mean()) for one in apart]

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        x, temperature = results[0]
        fine = np.linspace(-200e-6, 200e-6, 300)
        left.plot(fine / MICRO, exact(fine, START), color=GREY, label="start")
        left.plot(fine / MICRO, exact(fine, START + DURATION), "k--", linewidth=0.9, label="exact")
        left.plot(x / MICRO, temperature, ".", color=BLUE, label="cell 20 µm")
        left.set(xlim=(-200, 200), xlabel="x / µm", ylabel="temperature / K")
        left.legend()
        convergence(right, cells, [errors], "mean error / K")

    checks = (
        Check("order of convergence", "erfc", 2.0, order(cells, errors), 0.2,
              "central differences on the grid; three cells only", absolute=True),
        Check("mean error after 60 µs, cell 10 µm", "erfc", 0.0, errors[1], 1.0,
              "a step of 600 K over 90 µm: (10/90)² of a few kelvins", unit="K", absolute=True),
    )  # fmt: skip
    return Case("conduction", "Two half-spaces", checks, draw)
