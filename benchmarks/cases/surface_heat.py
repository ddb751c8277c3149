"""Heat that enters through a surface: a half-space at rest, and one that moves under a source."""

from math import pi, sqrt

import numpy as np
from numba import njit
from scipy.integrate import quad
from scipy.special import erfc, k0e
from solver import Block

from cases import Case, Check, order
from cases.heat import CONDUCTIVITY, DIFFUSIVITY, constant_properties
from cases.motion import MICRO, convergence
from chipglow.cutting.heat import conduct, heat_surface, return_heat
from chipglow.drawing.scales import BLUE, GREEN, VERMILLION

FLUX, DURATION = 2e8, 60e-6
OFFSETS = (0.0, 0.25, 0.5, 0.77)
"""Places of the surface between two rows of nodes, in cells."""

SPEED, HALF_WIDTH, TRAVEL = 1.0, 60e-6, 420e-6
"""Of the moving half-space and of the band under which it moves: a Péclet number of 2.7."""

CELLS = (20e-6, 10e-6, 5e-6)
STABLE = 0.1


@njit
def enter(points, lowest, heat, depth, increment, nodes, grid):
    for k in range(lowest.size):
        heat_surface(points[lowest[k]], 0.0, depth, heat[k], increment, nodes, grid)


def heated(block, duration, source, speed=0.0):
    """Lowest points, after heat entered there with `source(x)` in W/m² while the block moved."""
    steps = round(duration / (STABLE * block.cell**2 / DIFFUSIVITY))
    shape = (block.grid.columns, block.grid.rows)
    nodes, increment = np.zeros((*shape, 3)), np.zeros(shape)
    points = block.points
    lowest = np.flatnonzero(points["y"] < points["y"].min() + 0.5 * block.spacing)
    for _ in range(steps):
        points["x"] += speed * duration / steps
        conduct(
            points, block.count, nodes, increment, *constant_properties(), block.step.heat_mass,
            block.grid, duration / steps, STABLE,
        )  # fmt: skip
        heat = block.spacing * duration / steps * source(points["x"][lowest])
        enter(points, lowest, heat, -0.25, increment, nodes, block.grid)
        return_heat(points, block.count, increment, block.grid)
    return lowest


def exact_rise(depth, time):
    """Rise in K under a constant flux (Carslaw and Jaeger 1959, 2.9)."""
    along = depth / sqrt(4 * DIFFUSIVITY * time)
    surface = 2 * FLUX / CONDUCTIVITY * sqrt(DIFFUSIVITY * time / pi)
    return surface * np.exp(-(along**2)) - FLUX * depth / CONDUCTIVITY * erfc(along)


def half_space(cell, offset):
    """Depth in m and rise in K of all points, and which are in the surface's row."""
    block = Block((4 * cell, 600e-6), cell=cell)
    block.points["y"] += offset * cell
    lowest = heated(block, DURATION, lambda x: np.full(x.size, FLUX))
    return block.points["y"] - offset * cell, block.points["temperature"] - 293.0, lowest


def surface_flux():
    mean, worst, shown = [], [], []
    for cell in CELLS:
        results = [half_space(cell, offset) for offset in OFFSETS]
        errors = [rise - exact_rise(depth, DURATION) for depth, rise, _ in results]
        mean.append(max(float(np.abs(error).mean()) for error in errors))
        rows = [error[row] for error, (_, _, row) in zip(errors, results, strict=True)]
        worst.append(max(float(np.abs(row).mean()) for row in rows))
        shown.append(results[0])
    hottest = float(exact_rise(0.0, DURATION))

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        fine = np.linspace(0, 150e-6, 300)
        left.plot(fine / MICRO, exact_rise(fine, DURATION), "k--", linewidth=0.9, label="exact")
        depth, rise, _ = shown[0]
        left.plot(depth / MICRO, rise, ".", color=BLUE, label="cell 20 µm")
        left.set(xlim=(0, 150), xlabel="depth / µm", ylabel="rise / K")
        left.legend()
        names, colours = ("all points", "surface's row"), (BLUE, VERMILLION)
        convergence(right, CELLS, [mean, worst], "mean error / K", names, colours)

    why = "flux at the points, to the nodes by the slopes of their weights; three cells only"
    return Case(
        "surface-flux",
        "Constant flux into a half-space, at four places between the nodes",
        (
            Check("order of convergence", "Carslaw-Jaeger", 2.0, order(CELLS, mean), 0.3, why,
                  absolute=True),
            Check("mean error, cell 10 µm", "Carslaw-Jaeger", 0.0, mean[1] / hottest, 0.001,
                  "of the surface's rise; (10/50)² of a few per cent", absolute=True),
            Check("error of the surface's row, cell 10 µm", "Carslaw-Jaeger", 0.0,
                  worst[1] / hottest, 0.01, "of the surface's rise, the worst of four places",
                  absolute=True),
        ),
        draw,
    )  # fmt: skip


def jaeger_rise(x, depth):
    """Rise in K at places after the middle of a band source, in a half-space that moves along x.

    Jaeger (1942): q/(πk) ∫ exp(V(x − x')/2α) K₀(V r/2α) dx' over the band.
    """
    scale = SPEED / (2 * DIFFUSIVITY)

    def line(there):
        distance = np.hypot(x - there, depth)
        return np.exp(scale * (x - there - distance)) * k0e(scale * distance)

    inside = [x] if abs(x) < HALF_WIDTH else None
    total, _ = quad(line, -HALF_WIDTH, HALF_WIDTH, points=inside, limit=200)
    return FLUX / (pi * CONDUCTIVITY) * total


def moved(cell):
    """Places from the band's middle and rise in K of the surface's row, under the band."""
    block = Block((1000e-6, 260e-6), cell=cell, margin=12 + round(TRAVEL / cell))
    middle = 700e-6
    lowest = heated(
        block, TRAVEL / SPEED, lambda x: FLUX * (np.abs(x - middle) < HALF_WIDTH), SPEED
    )
    place = block.points["x"][lowest] - middle
    seen = np.abs(place) < 1.5 * HALF_WIDTH
    return place[seen], block.points["temperature"][lowest][seen] - 293.0


def moving_source():
    results = [moved(cell) for cell in CELLS]
    errors = []
    for cell, (place, rise) in zip(CELLS, results, strict=True):
        exact = np.array([jaeger_rise(x, cell / 4) for x in place])
        errors.append(float(np.abs(rise - exact).mean() / exact.max()))

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        fine = np.linspace(-1.5, 1.5, 121) * HALF_WIDTH
        rises = [jaeger_rise(x, CELLS[1] / 4) for x in fine]
        left.plot(fine / MICRO, rises, "k--", linewidth=0.9, label="Jaeger")
        left.plot(results[1][0] / MICRO, results[1][1], ".", color=GREEN, label="cell 10 µm")
        left.axvspan(-HALF_WIDTH / MICRO, HALF_WIDTH / MICRO, color="0.93", zorder=0)
        left.set_xlabel("place from the middle of the source / µm")
        left.set_ylabel("rise of the surface's row / K")
        left.legend()
        convergence(right, CELLS, [errors], "mean error / highest rise", colours=(GREEN,))

    return Case(
        "moving-source",
        "A half-space that moves under a band source",
        (
            Check("mean error under the source, cell 10 µm", "Jaeger 1942", 0.0, errors[1], 0.01,
                  "of the highest rise; the band's ends lie between points", absolute=True),
            Check("order of convergence", "Jaeger 1942", 1.5, order(CELLS, errors), 0.6,
                  "2 for the flux, 1 for the band's ends; three cells only", absolute=True),
        ),
        draw,
    )  # fmt: skip
