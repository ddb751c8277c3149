"""A thick-walled cylinder that expands plastically, against Hill's limit pressure."""

from collections import namedtuple
from math import log, pi, sqrt

import numpy as np
from scipy.integrate import solve_ivp
from solver import DENSITY, Block

from cases import Case, Check
from cases.motion import MICRO, convergence
from cases.plasticity import perfectly_plastic
from chipglow.drawing.scales import BLUE, VERMILLION

INNER, OUTER = 100e-6, 200e-6
YIELD_STRESS = 100e6
SHEAR_STRENGTH = YIELD_STRESS / sqrt(3)
STEEL = perfectly_plastic(YIELD_STRESS)
START = 80.0 * INNER


def outer_radius(inner):
    """Outer radius in m of the incompressible cylinder with an inner radius."""
    return np.sqrt(inner**2 + OUTER**2 - INNER**2)


def rigid_plastic(duration=2e-6):
    """Time (s), inner radius a (m) and a da/dt (m²/s) until it stops.

    Energy: the kinetic energy π ρ (a da/dt)² ln(b/a) falls by Hill's limit pressure 2k ln(b/a)
    times the area swept.
    """

    def change(_, state):
        inner, flux = state
        outer = outer_radius(inner)
        spread = flux**2 * (inner**-2 - outer**-2) / (2 * log(outer / inner))
        return [flux / inner, spread - 2 * SHEAR_STRENGTH / DENSITY]

    stop = lambda _, state: state[1]  # noqa: E731
    stop.terminal = True
    chosen = {"t_eval": np.linspace(0.0, duration, 400), "events": stop, "rtol": 1e-9}
    solution = solve_ivp(change, (0.0, duration), [INNER, START], **chosen)
    return solution.t, *solution.y


Expansion = namedtuple("Expansion", "time swept radius strain exact_strain pressure")
"""Time (s) and swept area (m²) of an expansion; radii (m) and strains at its end; pressure.

The swept area is that of the bore, over π. The pressure (Pa) is the plastic work over the area
that the bore swept.
"""


def expand(cell, duration, samples=40):
    """Let a cylinder go with the velocity START / r and watch it."""
    block = Block((2 * OUTER, 2 * OUTER), cell=cell, material=STEEL)
    radius, _ = radii(block.points)
    block.points = block.points[(radius > INNER) & (radius < OUTER)]
    block.count = block.points.size

    def per_square(x, y):
        return START / np.maximum((x - OUTER) ** 2 + (y - OUTER) ** 2, INNER**2 / 4)

    block.set_velocity(
        lambda x, y: (x - OUTER) * per_square(x, y), lambda x, y: (y - OUTER) * per_square(x, y)
    )
    steps = round(duration / samples / block.step.time_step)
    swept = []
    for _ in range(samples):
        block.advance(steps)
        now, before = radii(block.points)
        # Of an incompressible cylinder all radii squared grow by the same.
        swept.append(float((now**2 - before**2).mean()))
    p = block.points
    work = YIELD_STRESS * float((p["strain"] * p["volume"]).sum())
    time = block.step.time_step * steps * np.arange(1, samples + 1)
    exact_strain = 2 / sqrt(3) * np.log(now / np.sqrt(now**2 - swept[-1]))
    return Expansion(time, np.array(swept), now, p["strain"], exact_strain, work / (pi * swept[-1]))


def radii(points):
    """Distances from the axis now and at the start, in m."""
    now = np.hypot(points["x"] - OUTER, points["y"] - OUTER)
    return now, np.hypot(points["material_x"] - OUTER, points["material_y"] - OUTER)


def limit_pressure(swept):
    """Hill's 2k ln(b/a) in Pa, mean over what the bore swept (m², over π)."""
    inner = np.sqrt(INNER**2 + np.linspace(0.0, swept, 200))
    return float(np.mean(2 * SHEAR_STRENGTH * np.log(outer_radius(inner) / inner)))


def thick_cylinder(cells=(20e-6, 40e-6 / 3, 10e-6, 40e-6 / 6)):
    times, inner, _ = rigid_plastic()
    results = [expand(cell, 1.1 * times[-1]) for cell in cells]
    exact = float(inner[-1])
    final = [float(np.sqrt(INNER**2 + result.swept[-1])) for result in results]
    growth = [1 - (radius - INNER) / (exact - INNER) for radius in final]
    finest = results[-1]

    def draw(figure):
        left, middle, right = figure.subplots(1, 3)
        for result, cell, colour in zip(results[::3], cells[::3], (VERMILLION, BLUE), strict=True):
            bore = np.sqrt(INNER**2 + result.swept) / MICRO
            left.plot(result.time / MICRO, bore, color=colour, label=f"cell {cell / MICRO:.1f} µm")
        left.plot(times / MICRO, inner / MICRO, "k--", linewidth=0.9, label="rigid-plastic")
        left.set(xlabel="time / µs", ylabel="inner radius / µm")
        left.legend(loc="lower right")
        middle.plot(finest.radius / MICRO, finest.strain, ".", color=BLUE, markersize=1.5)
        rank = np.argsort(finest.radius)
        middle.plot(finest.radius[rank] / MICRO, finest.exact_strain[rank], "k--", linewidth=0.9)
        middle.set(xlabel="radius / µm", ylabel="plastic strain")
        convergence(right, cells, [np.array(growth) * 100], "error of the growth / %")

    limits = (
        ("limit pressure (plastic work over swept area), cell 6.7 µm", finest, 0.01),
        ("the same, cell 20 µm: 5 cells in the wall", results[0], 0.02),
    )
    growing = "the transfer dissipates what a cell cannot resolve; elastic strain is 0.2 %"
    checks = (
        *(
            Check(what, "Hill, 2k ln(b/a), mean over the path",
                  limit_pressure(result.swept[-1]) / 1e6, result.pressure / 1e6, tolerance,
                  "the bore's edge is a stair of cells", "MPa")
            for what, result, tolerance in limits
        ),
        Check("growth of the bore until it stops", "ordinary differential equation",
              (exact - INNER) / MICRO, (final[-1] - INNER) / MICRO, 0.02, growing, "µm"),
    )  # fmt: skip
    return Case("cylinder", "A thick-walled cylinder", checks, draw)
