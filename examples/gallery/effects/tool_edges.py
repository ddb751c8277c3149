r"""
Edges of the tool
=================

.. image:: images/sphx_glr_tool_edges_001.png
   :alt: Edges of the tool

The edge decides how much material goes under the tool. Four preparations, by the names that a study
gives them.

What you see: a round edge of radius r, a chamfer of width b and angle γ, a hone whose arc reaches
Sγ along the rake face and Sα along the flank face, and an outline of a worn tool from points. The
square is the place from which distances up the rake face count.

Source: ISO 3002 (faces and angles); form factors of the hone after Denkena. More:
:doc:`/understand/cutting`.
"""

from math import radians

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from chipglow.drawing.drawing import new_figure, style
from chipglow.drawing.scales import BLUE, GREY, VERMILLION, VOID
from chipglow.scene import Chamfer, Hone, Tool, ToolGeometry, ToolOutline

FACE = 600e-6
VIEW = (-75.0, 135.0, -25.0, 165.0)

ROUND = ToolGeometry()
CHAMFERED = ToolGeometry(chamfer=Chamfer(100e-6, radians(20.0)), edge_radius=15e-6)
HONED = ToolGeometry(hone=Hone(80e-6, 40e-6))
WORN = ToolOutline.placed(
    1e-6
    * np.array(
        [
            *((-30, 300), (5, 120), (28, 80), (30, 55), (8, 22)),
            *((6, 6), (20, 0), (80, 0), (380, 37)),
        ]
    )
)


def _draw(axes: Axes, tool: Tool, title: str) -> None:
    outline = tool.outline(FACE) * 1e6
    axes.fill(*np.concatenate([outline, [[600.0, 600.0]]]).T, color=VOID)
    axes.plot(*outline.T, color="black", linewidth=1.2)
    axes.axhline(0.0, color=GREY, linewidth=0.6, linestyle=":")
    foot = tool.rake_foot * 1e6
    axes.plot(*foot, "s", color=VERMILLION, markersize=4)
    axes.set_aspect("equal")
    axes.axis(VIEW)
    axes.set_title(title)
    axes.set_xlabel("x / µm")


def _mark_radius(axes: Axes) -> None:
    centre = ROUND.corners[0] * 1e6
    _arrow(axes, centre, ROUND.edge_point * 1e6)
    axes.annotate("r", centre, (4, 2), textcoords="offset points", color=BLUE)


def _mark_chamfer(axes: Axes) -> None:
    upper, lower = _sharp_land()
    foot, rake = CHAMFERED.rake_foot, np.array(CHAMFERED.rake_direction)
    below = upper - 80e-6 * rake
    axes.plot(*(np.array([foot, below]) * 1e6).T, color=GREY, linewidth=0.8, linestyle="--")
    _sharp(axes, upper, lower)
    normal = np.array([-(upper - lower)[1], (upper - lower)[0]])
    beside = -9e-6 * normal / np.hypot(*normal)
    _arrow(axes, (upper + beside) * 1e6, (lower + beside) * 1e6, "<->")
    middle = ((upper + lower) / 2 + 2.6 * beside) * 1e6
    axes.annotate("b", middle, ha="center", va="center", color=BLUE)
    axes.annotate("γ", (upper - 62e-6 * rake) * 1e6, (2, 5), textcoords="offset points", color=BLUE)


def _mark_hone(axes: Axes) -> None:
    outline = HONED.outline(FACE)
    on_rake = HONED.rake_foot
    on_clearance = outline[-1] - FACE * np.array(HONED.clearance_direction)
    sharp = on_rake - 80e-6 * np.array(HONED.rake_direction)
    _sharp(axes, on_rake, sharp, on_clearance)
    left, under = 9e-6 * np.array(HONED.rake_normal), np.array([0.0, -8e-6])
    _arrow(axes, (on_rake + left) * 1e6, (sharp + left) * 1e6, "<->")
    _arrow(axes, (sharp + under) * 1e6, (on_clearance + under) * 1e6, "<->")
    axes.annotate("Sγ", ((on_rake + sharp) / 2 + 2.6 * left) * 1e6, ha="center", color=BLUE)
    axes.annotate(
        "Sα", (on_clearance + 1.5 * under) * 1e6, (3, -4), textcoords="offset points", color=BLUE
    )


def _sharp_land() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of the chamfer before they are rounded."""
    assert CHAMFERED.chamfer is not None
    land = np.diff(CHAMFERED.corners[::-1], axis=0)[0]
    land /= np.hypot(*land)
    middle = CHAMFERED.corners[1] + CHAMFERED.edge_radius * np.array([-land[1], land[0]])
    faces = np.stack([land, -np.array(CHAMFERED.rake_direction)], axis=1)
    upper = middle + np.linalg.solve(faces, CHAMFERED.rake_foot - middle)[0] * land
    return upper, upper - CHAMFERED.chamfer.width * land


def _sharp(axes: Axes, *corners: NDArray[np.float64]) -> None:
    axes.plot(*(np.array(corners) * 1e6).T, color=GREY, linewidth=0.8, linestyle="--")


def _arrow(
    axes: Axes, start: NDArray[np.float64], end: NDArray[np.float64], kind: str = "->"
) -> None:
    look = {"arrowstyle": kind, "color": BLUE, "linewidth": 0.9, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, start, arrowprops=look)


with style():
    figure = new_figure(2.35)
    panels = figure.subplots(1, 4, sharey=True)
    tools = {"edge_radius": ROUND, "chamfer": CHAMFERED, "hone": HONED, "outline": WORN}
    for axes, (title, tool) in zip(panels, tools.items(), strict=True):
        _draw(axes, tool, title)
    panels[0].set_ylabel("y / µm")
    _mark_radius(panels[0])
    _mark_chamfer(panels[1])
    _mark_hone(panels[2])
    panels[3].plot(*(WORN.corners * 1e6).T, "o", color=BLUE, markersize=3)
