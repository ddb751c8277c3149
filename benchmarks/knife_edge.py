"""How often the knife edge's 95 % intervals hold the truth: the table of docs/knife-edge.md.

python benchmarks/knife_edge.py [--repeats 60]
"""

import argparse
import sys
from functools import partial
from pathlib import Path

import numpy as np

from chipglow.analysis import knife_edge
from chipglow.camera import AnnularAperturePSF

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from synthetic_edge import (
    WAVELENGTH,
    annular_edge,
    edge_radiance,
    gaussian_edge,
    gaussian_transfer,
    image_of,
)

STEP = 5.0
MIRROR = (0.28, 0.35)
UP_TO_NYQUIST = np.arange(2, 33, 6)


def coverage(repeats, name, edge, fwhm, noise, saturation=None, gaussian=False):
    """Print the share of intervals of the width, and of the MTF, that hold the truth."""
    generator = np.random.default_rng(5)
    within, held, uncertainty = [], [], []
    for seed in range(repeats):
        normal = generator.uniform(3.0, 12.0) + generator.choice([0, 90, 180, 270])
        place = generator.uniform(-6e-6, 6e-6)
        radiance = edge_radiance(edge, normal, position=place, step=STEP)
        found = knife_edge([image_of(radiance, noise * STEP, seed, saturation)])
        within.append(abs(found.fwhm - fwhm) < 1.96 * found.fwhm_uncertainty)
        uncertainty.append(found.fwhm_uncertainty)
        if gaussian:
            transfer = found.edges[0].transfer
            true = gaussian_transfer(transfer.frequency, fwhm, normal)
            apart = np.abs(transfer.value - true) < 1.96 * transfer.uncertainty
            held.append(apart[UP_TO_NYQUIST])
    mtf = f", MTF {100 * np.mean(held):.0f} %" if held else ""
    width = f"u = {1e6 * np.mean(uncertainty):.2g} um"
    print(f"{name}, noise {noise}: {width}, width {100 * np.mean(within):.0f} %{mtf}", flush=True)


def main():
    """Print the table's rows."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--repeats", type=int, default=60, help="edges of each row")
    row = partial(coverage, parser.parse_args().repeats)
    gauss = gaussian_edge(10e-6)
    row("Gaussian", gauss, 10e-6, 0.01, gaussian=True)
    row("Gaussian", gauss, 10e-6, 0.1, gaussian=True)
    row("Gaussian, clipped at 90 %", gauss, 10e-6, 0.01, 6.5, gaussian=True)
    mirror, fwhm = annular_edge(WAVELENGTH, *MIRROR), AnnularAperturePSF(WAVELENGTH, *MIRROR).fwhm
    row("diffraction", mirror, fwhm, 0.01)
    row("diffraction", mirror, fwhm, 0.03)
    row("diffraction, clipped at 92 %", mirror, fwhm, 0.01, 6.6)


if __name__ == "__main__":
    main()
