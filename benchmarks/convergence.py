"""How the cut depends on the cell: forces, segments, temperatures, width of the shear band.

    python benchmarks/convergence.py [20 14 10 7 5] [--local] [--length 2]

Cells in um; the finer, the longer: the time grows with the cube of their number. The paper's cut
otherwise, over a length in mm: means are of what follows 0.7 mm, frames every 1 us. With --local
the steel has no `NonlocalViscosity`: what fails is then as thin as two cells. Prints a Markdown
table.
"""

from dataclasses import replace
from math import isfinite

import numpy as np
from common import arguments, print_head, print_row, timed

from chipglow.chip import NoShearBandError, find_shear_band, segmentation
from chipglow.cutting import AISI_1045, CuttingConditions, CuttingSimulation, Numerics, OutputWindow
from chipglow.scene import Material, Raster, sample

CELLS = (20.0, 14.0, 10.0, 7.0, 5.0)
START = 0.7e-3
RASTER = Raster(-560e-6, 460e-6, 2e-6, 270, 300)

ACROSS = np.arange(-120e-6, 121e-6, 2e-6)
SIDES = 20e-6
"""Length at either end of a profile whose mean is the temperature beside the band."""

COLUMNS = (
    "cell / µm", "cutting force / (N/mm)", "thrust / (N/mm)", "period / µs", "degree / %",
    "hottest chip / °C", "band / µm", "band's rate / (10³ 1/s)", "width of its temperature / µm",
    "its temperature / °C", "unaccounted work / %", "time / s",
)  # fmt: skip


class Fields:
    """What the frames of a cut show, gathered as they come."""

    def __init__(self, tool):
        self.tool, self.hottest, self.bands = tool, [], []

    def add(self, frame):
        """Take one frame: the hottest thousandth of the chip, and the band's middle if any."""
        chip = frame.material == Material.WORKPIECE
        self.hottest.append(float(np.quantile(frame.temperature[chip], 0.999)))
        try:
            band = find_shear_band(RASTER, frame.plastic_strain_rate, chip, self.tool)
        except NoShearBandError:
            return
        profile = mean_profile(band, np.where(chip, frame.temperature, np.nan))
        self.bands.append((band.middle_rate, band.width, *rise_width(profile)))

    def active(self):
        """Medians over the tenth of the frames in which the band is at work most."""
        bands = np.array(self.bands)
        return np.nanmedian(bands[bands[:, 0] >= np.quantile(bands[:, 0], 0.9)], axis=0)


def mean_profile(band, temperature):
    """Temperature in K across a band, mean over the middle half of its length."""
    points, normals = band.ridge.points[band.middle_half], band.normals[band.middle_half]
    lines = points[:, None] + ACROSS[None, :, None] * normals[:, None]
    return np.nanmean(sample(temperature, RASTER, lines), axis=0)


def rise_width(profile):
    """Full width at half maximum (m) of the rise over a line between both sides; the top in K."""
    count = round(SIDES / (ACROSS[1] - ACROSS[0]))
    ends = np.nanmean(profile[:count]), np.nanmean(profile[-count:])
    rise = profile - np.interp(ACROSS, (ACROSS[count // 2], ACROSS[-1 - count // 2]), ends)
    top = int(np.argmax(np.where(np.abs(ACROSS) < 50e-6, rise, -np.inf)))
    below = np.flatnonzero(rise <= rise[top] / 2)
    left, right = below[below < top], below[below > top]
    if not (left.size and right.size):
        return float("nan"), float(profile[top])
    return float(ACROSS[right[0]] - ACROSS[left[-1]]), float(profile[top])


def row(cell, length, workpiece):
    conditions, numerics = CuttingConditions(cutting_length=length), Numerics(cell=cell * 1e-6)
    simulation = CuttingSimulation(conditions, workpiece=workpiece, numerics=numerics)
    fields = Fields(simulation.tool)
    window = OutputWindow(START, length, 1e-6, later_bands=0)
    history, seconds, _ = timed(lambda: simulation.run(window, RASTER, fields.add))
    later = history.time * conditions.speed > START
    segments = segmentation(history.time[later], history.thickness[later], numerics.cell)
    rate, width, temperature_width, temperature = fields.active()
    return [
        f"{cell:g}",
        f"{history.cutting[later].mean() / 1e3:.0f}",
        f"{history.thrust[later].mean() / 1e3:.0f}",
        f"{number(segments.period * 1e6)}{deviation(segments.period_uncertainty)}",
        f"{segments.degree * 100:.0f}{deviation(segments.degree_uncertainty, 100)}",
        f"{max(fields.hottest) - 273.15:.0f}",
        f"{width * 1e6:.0f}",
        f"{rate / 1e3:.0f}",
        f"{temperature_width * 1e6:.0f}",
        f"{temperature - 273.15:.0f}",
        f"{history.energy.closing_error[-1] * 100:.1f}",
        f"{seconds:.0f}",
    ]


def number(value):
    """A rounded number; a dash where a chip has none, as it has no segments."""
    return f"{value:.0f}" if isfinite(value) else "–"


def deviation(uncertainty, scale=1e6):
    return f" ± {uncertainty * scale:.0f}" if isfinite(uncertainty) else ""


def main():
    given = arguments(__doc__, cells=CELLS, local=False, length=2.0)
    workpiece = replace(AISI_1045, nonlocal_viscosity=None) if given.local else AISI_1045
    print_head(*COLUMNS)
    for cell in given.cells:
        print_row(*row(cell, given.length * 1e-3, workpiece))


if __name__ == "__main__":
    main()
