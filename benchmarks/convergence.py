"""How the cut depends on the cell: forces, segments, temperatures, width of the shear band.

    python benchmarks/convergence.py [20 14 10 7 5]

Cells in um; the finer, the longer: the time grows with the cube of their number. The paper's cut
otherwise, frames every 1 us in the paper's window. Prints a Markdown table.
"""

import sys
from dataclasses import dataclass, field
from math import isfinite
from time import perf_counter

import numpy as np

from chipglow.cutting import CuttingSimulation, Numerics, OutputWindow
from chipglow.laboratory.chip import NoShearBandError, find_shear_band, segmentation
from chipglow.scene import Material, Raster, ToolGeometry

CELLS = (20.0, 14.0, 10.0, 7.0, 5.0)
WINDOW = OutputWindow(interval=1e-6, later_bands=0)
RASTER = Raster(-560e-6, 460e-6, 2e-6, 270, 300)


@dataclass
class Fields:
    """What the frames of a cut show, gathered as they come."""

    tool: ToolGeometry
    hottest: list[float] = field(default_factory=list)
    widths: list[float] = field(default_factory=list)
    rates: list[float] = field(default_factory=list)

    def add(self, frame):
        """Take one frame: the hottest thousandth of the chip, and the band's middle if any."""
        chip = frame.material == Material.WORKPIECE
        self.hottest.append(float(np.quantile(frame.temperature[chip], 0.999)))
        try:
            band = find_shear_band(RASTER, frame.plastic_strain_rate, chip, self.tool)
        except NoShearBandError:
            return
        self.rates.append(float(band.middle_rate))
        self.widths.append(float(band.width))


def row(cell):
    """Run one cut and return its row of the table."""
    simulation = CuttingSimulation(numerics=Numerics(cell=cell * 1e-6))
    fields = Fields(simulation.tool)
    start = perf_counter()
    history = simulation.run(WINDOW, RASTER, fields.add)
    seconds = perf_counter() - start
    segments = segmentation(history.time, history.cutting, history.thrust)
    # The band is judged where it is at work: the frames with the highest tenth of its rate.
    active = np.array(fields.rates) >= np.quantile(fields.rates, 0.9)
    return [
        f"{cell:g}",
        f"{segments.cutting_mean / 1e3:.0f}",
        f"{segments.cutting_swing / 1e3:.0f}",
        f"{segments.thrust_mean / 1e3:.0f}",
        f"{segments.period * 1e6:.0f}{deviation(segments.period_uncertainty)}",
        f"{max(fields.hottest) - 273.15:.0f}",
        f"{np.median(np.array(fields.widths)[active]) * 1e6:.0f}",
        f"{np.median(np.array(fields.rates)[active]) / 1e3:.0f}",
        f"{history.energy.closing_error[-1] * 100:.1f}",
        f"{seconds:.0f}",
    ]


def deviation(seconds: float) -> str:
    """Uncertainty in us after a mean; nothing for a single period."""
    return f" ± {seconds * 1e6:.0f}" if isfinite(seconds) else ""


def main():
    cells = [float(text) for text in sys.argv[1:]] or CELLS
    print(
        "| cell / um | cutting force / (N/mm) | swing / (N/mm) | thrust / (N/mm) | period / us "
        "| hottest chip / °C | band / um | band's rate / (10³ 1/s) | unaccounted work / % "
        "| time / s |"
    )
    print("|---" * 10 + "|")
    for cell in cells:
        print("| " + " | ".join(row(cell)) + " |", flush=True)


if __name__ == "__main__":
    main()
