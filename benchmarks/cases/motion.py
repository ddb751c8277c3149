"""Elastic motion: what is conserved, speed of waves, period of a vibration."""

from math import pi, sqrt

import numpy as np
from matplotlib.ticker import FormatStrFormatter, LogLocator
from solver import DENSITY, ELASTIC, Block

from cases import Case, Check, order
from chipglow.drawing.scales import BLUE, GREEN, GREY, VERMILLION

SPIN = 2e5
PULSE = 50e-6
BAR, WIDTH = 600e-6, 40e-6
MICRO = 1e-6


def spinning_block(advance=Block.advance, steps=600, every=20):
    """Steps, and relative change of momentum (x, y) and angular momentum of a free block."""
    block = Block((100e-6, 60e-6))
    block.set_velocity(lambda x, y: 3.0 - SPIN * y, lambda x, y: -2.0 + SPIN * x)
    advance(block, 1)
    start = np.array(block.momentum())
    changes = []
    for _ in range(0, steps, every):
        advance(block, every)
        changes.append(np.array(block.momentum()) / start - 1.0)
    return np.arange(every, steps + 1, every), np.array(changes)


def momentum():
    steps, changes = spinning_block()
    _, of_the_grid = spinning_block(Block.advance_with_the_grid)

    def draw(figure):
        axes = figure.subplots()
        for k, (name, colour) in enumerate(
            (("momentum, x", BLUE), ("momentum, y", GREEN), ("angular momentum", VERMILLION))
        ):
            axes.semilogy(steps, np.maximum(abs(changes[:, k]), 1e-17), color=colour, label=name)
        last = np.maximum(abs(of_the_grid[:, 2]), 1e-17)
        axes.semilogy(steps, last, ":", color=VERMILLION, label="angular, APIC")
        axes.set(xlabel="step", ylabel="relative change")
        axes.legend(ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))

    rounding = "rounding: 10⁻¹⁶ a sum, 600 steps"
    second_order = "points move with the grid's velocity and carry their own: second order"
    rows = (
        ("largest change of momentum", changes[:, :2], 1e-12, rounding),
        ("largest change of angular momentum", changes[:, 2], 1e-5, second_order),
        ("the same with the grid's velocity (APIC)", of_the_grid, 1e-12, rounding),
    )
    checks = tuple(
        Check(what, "conservation", 0.0, float(np.abs(change).max()), *told, absolute=True)
        for what, change, *told in rows
    )  # fmt: skip
    return Case("momentum", "A free, spinning block", checks, draw)


def pulse(kind, cell):
    """Profiles along a block's middle, before and after, and the measured speed over the exact.

    A Gaussian of velocity along x, in x (kind 0, pressure wave) or y (kind 1, shear wave), parts
    into two. The one that runs to the right is watched along the middle, until the waves from the
    free sides arrive there.
    """
    block = Block((1000e-6, 900e-6), cell=cell)
    speed = exact_speed(kind)
    shape = lambda x, y: 0.2 * np.exp(-((x - 350e-6) ** 2) / (2 * PULSE**2)) + 0 * y  # noqa: E731
    rest = lambda x, y: 0 * x * y  # noqa: E731
    block.set_velocity(*((rest, shape) if kind else (shape, rest)))
    profiles, places, times = [], [], []
    time_step = block.step.time_step
    for distance in (150e-6, 80e-6 if kind else 200e-6):
        steps = round(distance / speed / time_step)
        block.advance(steps)
        times.append((times[-1] if times else 0.0) + steps * time_step)
        x, v = middle(block, "vy" if kind else "vx")
        places.append(peak(x, v, 350e-6 + speed * times[-1]))
        profiles.append((x, v, times[-1]))
    return profiles, (places[1] - places[0]) / (times[1] - times[0]) / speed


def peak(x, v, about):
    """Place of the peak of a Gaussian: the logarithm is a parabola."""
    near = np.abs(x - about) < PULSE
    bend, slope, _ = np.polyfit((x[near] - about) / PULSE, np.log(v[near]), 2)
    return about - PULSE * float(slope / (2 * bend))


def middle(block, component):
    """Mean of a component of the velocity over the rows of a cell in the middle, and its place."""
    p = block.points
    near = np.abs(p["material_y"] - 450e-6) < block.cell
    column = np.round(p["material_x"][near] / block.spacing - 0.5).astype(np.int64)
    count = np.bincount(column)
    x = np.bincount(column, p["x"][near]) / count
    return x, np.bincount(column, p[component][near]) / count


def exact_speed(kind):
    """Speed of pressure (0) and shear (1) waves in m/s."""
    shear, bulk = ELASTIC.shear_modulus_at(293.0), ELASTIC.bulk_modulus_at(293.0)
    return sqrt((shear if kind else bulk + shear * 4 / 3) / DENSITY)


def waves(cells=(20e-6, 14e-6, 10e-6, 7e-6)):
    results = [[pulse(kind, cell) for cell in cells] for kind in (0, 1)]
    errors = np.abs([[speed - 1.0 for _, speed in of_kind] for of_kind in results])
    names, colours = ("pressure wave", "shear wave"), (BLUE, VERMILLION)
    formulas = ("√((K + 4G/3)/ρ)", "√(G/ρ)")

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        fine = np.linspace(0, 1000e-6, 400)
        for kind in (0, 1):
            for x, v, time in results[kind][-1][0]:
                far = 350e-6 + exact_speed(kind) * time
                exact = 0.1 * np.exp(-((fine - far) ** 2) / (2 * PULSE**2))
                left.plot(x / MICRO, v, color=colours[kind])
                left.plot(fine / MICRO, exact, "--", color="black", linewidth=0.9)
            left.plot([], color=colours[kind], label=names[kind])
        left.plot([], "--", color="black", linewidth=0.9, label="exact")
        left.set(xlim=(360, 850), xlabel="x / µm", ylabel="velocity / (m/s)", ylim=(0, 0.15))
        left.legend(ncols=3, loc="upper center")
        convergence(right, cells, errors * 100, "error of the speed / %", names, colours)

    dispersion = "dispersion of a Gaussian of standard deviation 7 cells, "
    dispersion += "which falls with second order"
    checks = []
    for kind in (0, 1):
        speed = exact_speed(kind)
        checks += [
            Check(f"speed of the {names[kind]}, cell {cells[-1] / MICRO:g} µm", formulas[kind],
                  speed, speed * results[kind][-1][1], 0.01, dispersion, unit="m/s"),
            Check(f"order of the {names[kind]}'s speed", "quadratic B-splines", 2.0,
                  order(cells, errors[kind]), 0.3, "four cells only", absolute=True),
        ]  # fmt: skip
    return Case("waves", "Elastic waves", tuple(checks), draw)


def vibration(cell):
    """Time and amplitude of a free strip's first mode over four half periods, and its period."""
    block = Block((BAR, WIDTH), cell=cell)
    block.set_velocity(
        lambda x, y: -0.5 * np.sin(pi * (x / BAR - 0.5)) + 0 * y, lambda x, y: 0 * x * y
    )
    mode_of = lambda p: np.sin(pi * (p["material_x"] / BAR - 0.5))  # noqa: E731
    times, modes, crossings = [], [], []
    stride = 4 * block.step.time_step
    while len(crossings) < 4:
        block.advance(4, cycle=4)
        mode = mode_of(block.points)
        times.append(stride * (len(times) + 1))
        modes.append(-float((mode * block.points["vx"]).sum() / (mode**2).sum()) / 0.5)
        if len(modes) > 1 and modes[-1] * modes[-2] < 0:
            crossings.append(times[-1] - stride * modes[-1] / (modes[-1] - modes[-2]))
        assert times[-1] < 4 * exact_period()
    return np.array(times), np.array(modes), 2 * float(np.mean(np.diff(crossings)))


def exact_period():
    """2L/c in s; plane strain with free sides: c² = E / (ρ (1 − ν²)).

    With Rayleigh's correction for the inertia of the motion across: 0.03 % here.
    """
    modulus = ELASTIC.young_modulus / (1 - ELASTIC.poisson_ratio**2)
    across = ELASTIC.poisson_ratio / (1 - ELASTIC.poisson_ratio)
    correction = 1 + (across * pi * WIDTH / BAR) ** 2 / 24
    return 2 * BAR / sqrt(modulus / DENSITY) * correction


def vibrations(cells=(20e-6, 40e-6 / 3, 10e-6, 40e-6 / 6)):
    results = [vibration(cell) for cell in cells]
    period = exact_period()
    errors = [result[2] / period - 1.0 for result in results]

    def draw(figure):
        left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
        times, modes, _ = results[0]
        left.plot(times / 1e-9, modes, color=BLUE, label="cell 20 µm")
        exact = np.cos(2 * pi * times / period)
        left.plot(times / 1e-9, exact, "--", color="black", linewidth=0.9, label="exact")
        left.set(xlabel="time / ns", ylabel="velocity of the mode / start")
        left.legend(ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))
        convergence(right, cells, [np.array(errors) * 100], "error of the period / %")

    checks = (
        Check(f"period, cell {cells[2] / MICRO:g} µm",
              "2L √(ρ (1 − ν²)/E), corrected for the motion across", period / 1e-9,
              results[2][2] / 1e-9, 0.01,
              "free ends are blurred over a cell, a sixtieth of the length", unit="ns"),
        Check("order of the period", "quadratic B-splines", 2.0, order(cells, errors), 0.7,
              "errors under 0.2 %, of which the reading of the crossings is a part",
              absolute=True),
    )  # fmt: skip
    return Case("vibration", "A vibrating strip", checks, draw)


def convergence(
    axes, sizes, errors, label, names=(None,), colours=(BLUE,), unit=MICRO, order=2,
    size="cell / µm",
):  # fmt: skip
    """Errors over the cell, or another size, on logarithmic axes, and the slope of an order."""
    sizes, errors = np.array(sizes) / unit, np.abs(errors)
    for line, name, colour in zip(errors, names, colours, strict=True):
        axes.loglog(sizes, line, "o-", color=colour, label=name, markersize=4)
    slope = np.max(errors) * (sizes / sizes.max()) ** order
    axes.loglog(sizes, slope, ":", color=GREY, label=f"{('first', 'second')[order - 1]} order")
    axes.legend(loc="upper left")
    axes.set(ylim=(None, 2.5 * np.max(errors)), xlabel=size, ylabel=label)
    axes.set_xticks(sizes, [f"{each:.3g}" for each in sizes])
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.minorticks_off()
