"""A plate that strikes a wall (Taylor's test), against finite elements.

The solver is plane strain, published bars are round. So the peer in `peers/elements.py` first
repeats a published round bar, then computes the plane one that the solver is compared with.
"""

from collections import namedtuple
from dataclasses import replace

import numpy as np
from peers.elements import Steel, struck_bar
from solver import UNBROKEN, Block

from cases import Case, Check
from cases.motion import convergence
from chipglow.cutting import JohnsonCook, TemperatureTable
from chipglow.drawing.scales import BLUE, GREEN, VERMILLION
from chipglow.scene import ToolGeometry

HALF, LENGTH, DURATION = 3.2e-3, 32.4e-3, 80e-6
ROUND_SPEED, SPEED = 287.0, 180.0
MILLI = 1e-3
PUBLISHED = {"length": 26.56, "diameter": 11.16, "strain": 1.81, "rise": 590.96 - 20.0}
"""In mm and K: round bar at 287 m/s, 5 × 50 elements, foot held axially; strain and rise of the
temperature of the element at the foot's centre. Pantalé (2020), DynELA's manual, table of the
axisymmetric Taylor impact: Abaqus; DynELA has 26.52 mm, 11.15 mm, 1.78 and 582.34 °C."""
STEEL = replace(
    UNBROKEN,
    name="42CrMo4, Pantalé (2020)",
    density=7830.0,
    young_modulus=206.9e9,
    poisson_ratio=0.3,
    flow_stress=JohnsonCook(806e6, 614e6, 0.168, 0.0089, 1.1, 1813.15, 293.15, 1.0),
    heat_capacity=TemperatureTable((293.15,), (460.0,)),
)


def wall(x):
    """A tool whose rake face is the plane at x (m), far above the edge."""
    upright = ToolGeometry(rake_angle=0.0)
    return upright.surface._replace(x=x + upright.edge_radius, y=-1.0)


Shape = namedtuple("Shape", "length foot side")
"""A struck plate, in m from the foot: length, largest half width, and its side.

The side is distance from the foot and half width, shape (n, 2), from the foot on.
"""


def strike(cell):
    block = Block(
        (LENGTH, 2 * HALF), cell=cell, material=STEEL, tool=wall(LENGTH), margin=round(4e-3 / cell)
    )
    block.points["temperature"] = STEEL.flow_stress.reference_temperature
    block.set_velocity(lambda x, y: SPEED + 0 * x * y, lambda x, y: 0 * x * y)
    block.advance(round(DURATION / block.step.time_step))
    return block


def shape_of_points(block):
    """Shape of the solver's plate: its surface is half a spacing beyond the outermost points."""
    p = np.sort(block.points[: block.count], order=("material_x", "material_y"))
    p = p.reshape(-1, round(2 * HALF / block.spacing))
    place = np.stack([p["x"], p["y"]], axis=-1)
    beyond = lambda last, next_: 1.5 * last - 0.5 * next_  # noqa: E731
    foot = beyond(place[-1], place[-2])[:, 0].max()
    back = beyond(place[0], place[1])[:, 0].mean()
    sides = [beyond(place[:, 0], place[:, 1]), beyond(place[:, -1], place[:, -2])]
    half = 0.5 * (sides[1] - sides[0])[:, 1]
    along = foot - 0.5 * (sides[0] + sides[1])[:, 0]
    return Shape(foot - back, float(half.max()), np.stack([along, half], axis=1)[::-1])


def shape_of_nodes(struck):
    nodes = struck.nodes
    foot = nodes[:, 0, 1].min()
    side = np.stack([nodes[-1, :, 1] - foot, nodes[-1, :, 0]], axis=1)
    return Shape(nodes[:, -1, 1].mean() - foot, float(side[:, 1].max()), side)


def peer(columns, rows, speed, axisymmetric):
    """The bar by finite elements: as published if axisymmetric, free to leave the wall if not."""
    moduli = float(STEEL.shear_modulus_at(300.0)), float(STEEL.bulk_modulus_at(300.0))
    heat = STEEL.density, float(STEEL.heat_capacity.at(300.0)), STEEL.taylor_quinney
    law = [getattr(STEEL.flow_stress, name) for name in Steel._fields[len(moduli) + len(heat) :]]
    steel = Steel(*moduli, *heat, *law)
    return struck_bar(
        HALF, LENGTH, columns, rows, speed, DURATION, steel, axisymmetric, axisymmetric
    )


def profile_difference(shape, other):
    """Mean difference of the half widths in m over the length."""
    along = np.linspace(0.3e-3, 30e-3, 300)
    widths = [np.interp(along, each.side[:, 0], each.side[:, 1]) for each in (shape, other)]
    return float(np.abs(widths[0] - widths[1]).mean())


def published_checks():
    bar = peer(5, 50, ROUND_SPEED, True)
    shape = shape_of_nodes(bar)
    rows = (
        ("final length", PUBLISHED["length"], shape.length / MILLI, 0.005, 0.15, "mm"),
        ("diameter of the foot", PUBLISHED["diameter"], 2 * shape.foot / MILLI, 0.005, 0.1, "mm"),
        ("plastic strain at the foot's centre", PUBLISHED["strain"], float(bar.strain[0].mean()),
         0.02, 1.7, ""),
        ("temperature rise at the foot's centre", PUBLISHED["rise"],
         float(bar.temperature[0].mean()) - 293.15, 0.02, 1.5, "K"),
    )  # fmt: skip
    return tuple(
        Check(f"peer, round bar: {what}", "Abaqus, in Pantalé (2020)", known, computed, tolerance,
              f"the two published codes differ by {apart:g} %", unit)
        for what, known, computed, tolerance, apart, unit in rows
    )  # fmt: skip


def taylor_impact(cells=(0.8e-3, 0.4e-3, 0.8e-3 / 3)):
    elements = peer(10, 100, SPEED, False)
    known = shape_of_nodes(elements)
    blocks = [strike(cell) for cell in cells]
    shapes = [shape_of_points(block) for block in blocks]
    shortening = [LENGTH - shape.length for shape in shapes]
    errors = (
        [abs(value / (LENGTH - known.length) - 1) * 100 for value in shortening],
        [abs(shape.foot / known.foot - 1) * 100 for shape in shapes],
        [profile_difference(shape, known) / HALF * 100 for shape in shapes],
    )

    def draw(figure):
        upper, left, right = figure.subplot_mosaic(
            [["upper"] * 2, ["left", "right"]], height_ratios=(1, 1.5)
        ).values()
        picture(upper, blocks[-1], known)
        for shape, cell, colour in zip(shapes, cells, (VERMILLION, GREEN, BLUE), strict=True):
            left.plot(*(shape.side / MILLI).T, color=colour, label=f"cell {cell / MILLI:.2f} mm")
        left.plot(*(known.side / MILLI).T, "k--", linewidth=0.9, label="finite elements")
        left.set(xlim=(0, 12), xlabel="distance from the foot / mm")
        left.set(ylim=(3, None), ylabel="half width / mm")
        left.legend()
        names, colours = ("shortening", "width of the foot", "profile"), (BLUE, VERMILLION, GREEN)
        looks = {"unit": MILLI, "order": 1, "size": "cell / mm"}
        convergence(right, cells, errors, "difference / %", names, colours, **looks)

    profile = profile_difference(shapes[-1], known)
    rows = (
        ("shortening", LENGTH - known.length, shortening[-1], 0.03,
         "12 cells in the half width; falls with the cell"),
        ("half width of the foot", known.foot, shapes[-1].foot, 0.05,
         "a sharp corner, drawn by 12 cells; falls with the cell"),
        ("half width, mean difference over the length", 0.0, profile, 0.032,
         "1 % of the half width"),
    )  # fmt: skip
    checks = tuple(
        Check(f"plate at 180 m/s: {what}, cell {cells[-1] / MILLI:.2f} mm", "finite elements",
              expected / MILLI, computed / MILLI, tolerance, reason, "mm",
              absolute=expected == 0.0)
        for what, expected, computed, tolerance, reason in rows
    )  # fmt: skip
    return Case("taylor", "Taylor's impact", published_checks() + checks, draw, 5.0)


def picture(axes, block, known):
    p = block.points
    foot = p["x"].max() + block.spacing / 2
    x, y = (foot - p["x"]) / MILLI, (p["y"] - HALF) / MILLI
    looks = {"cmap": "cividis", "vmin": 0, "vmax": 1, "linewidths": 0}
    shown = axes.scatter(x, y, 2.5, p["strain"], **looks)
    along, half = (known.side / MILLI).T
    outline = np.concatenate([along, along[::-1]]), np.concatenate([half, -half[::-1]])
    axes.plot(*outline, "--", color=VERMILLION, linewidth=1.0)
    axes.set(aspect="equal", ylabel="y / mm")
    axes.figure.colorbar(shown, ax=axes, label="plastic strain")
