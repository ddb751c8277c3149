"""How much hotter the rake face is when the tool has been cutting for long.

    python benchmarks/warm_tool.py [--cell 20] [--length 2] [cold] [steady]

Cuts the paper's chip with a cold tool and with a steady one, and prints the mean temperature within
15 um of the rake face along the contact, in the chip and in the tool, over the frames of the last
three fifths of the cut, and the forces. Cell in um, length of cut in mm. Minutes.
"""

import argparse
from dataclasses import replace

import numpy as np
from experiments import BUILD_UP, aligned, view

from chipglow.cutting import CuttingConditions, CuttingSimulation, Numerics, OutputWindow, ToolBody
from chipglow.laboratory.chip import contact_length, contact_temperatures
from chipglow.scene import Frame, Material

TOUCHING = 5e-6
INTERVAL = 5e-6


class RakeFace:
    """Gathers the temperatures beside the contact, frame by frame."""

    def __init__(self, simulation: CuttingSimulation) -> None:
        self.raster, self.tool = view(simulation), simulation.tool
        self.means: list[tuple[float, float, float]] = []

    def add(self, frame: Frame) -> None:
        """Mean temperature in K of chip and tool beside the contact, and its length in m."""
        workpiece = frame.material == Material.WORKPIECE
        contact = contact_length(self.raster, workpiece, self.tool, TOUCHING)
        beside = contact_temperatures(frame, self.raster, self.tool, contact)
        self.means.append((*beside, contact))


def row(name: str, simulation: CuttingSimulation) -> list[str]:
    """Cut once and return a row of the table."""
    length = simulation.conditions.cutting_length
    face = RakeFace(simulation)
    window = OutputWindow(BUILD_UP * length, length, INTERVAL, later_bands=0)
    history = simulation.run(window, face.raster, face.add)
    late = history.time > BUILD_UP * history.time[-1]
    chip, inside, contact = np.mean(face.means, axis=0)
    scatter = np.std([one[0] for one in face.means])
    forces = (history.cutting[late].mean() / 1e3, history.thrust[late].mean() / 1e3)
    return [
        name,
        f"{chip - 273.15:.0f} ± {scatter:.0f}",
        f"{inside - 273.15:.0f}",
        f"{contact * 1e6:.0f}",
        *(f"{force:.0f}" for force in forces),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--cell", type=float, default=20.0, help="side of a cell in um")
    parser.add_argument("--length", type=float, default=2.0, help="cutting length in mm")
    parser.add_argument("tools", nargs="*", metavar="TOOL", help="cold or steady; both by default")
    given = parser.parse_args()
    cold = CuttingSimulation(
        conditions=CuttingConditions(cutting_length=given.length * 1e-3),
        numerics=Numerics(given.cell * 1e-6),
    )
    head = ["tool", "chip / °C", "tool / °C", "contact / um", "Fc / (N/mm)", "Ft / (N/mm)"]
    tools = {"cold": cold, "steady": replace(cold, tool_temperature=ToolBody())}
    print(aligned([head, *(row(name, tools[name]) for name in given.tools or tools)]))


if __name__ == "__main__":
    main()
