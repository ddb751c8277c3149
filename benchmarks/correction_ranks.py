"""Calibration of the correction's posterior by simulation: ranks of the truth among draws.

python benchmarks/correction_ranks.py [--simulations 1000] [--pixels 16] [--draws 19] [--first 0]

The radiance of a chip beside a tool is drawn from the prior with fixed weights, imaged with noise
and corrected. If the posterior is right, the rank of the true value among draws of the posterior is
uniform (Talts et al. (2018), arXiv:1804.06788). Planes in each zone have no prior weight: any one
serves as truth, and the posterior includes their uncertainty. Rows: chi-squared of the ranks, its
probability, and mean rank and variance relative to those of a uniform distribution.
"""

from dataclasses import replace

import numpy as np
from common import arguments, print_head, print_row
from numba import set_num_threads
from scipy.stats import chi2

from chipglow import AnnularAperturePSF, Band, Camera, Raster
from chipglow.camera import image_formation
from chipglow.correction import ShapedObject, Zone
from chipglow.correction.cells import cut_cells
from chipglow.correction.posterior import Image, Posterior, Problem
from chipglow.scene import Polygon, Region

PITCH = 6e-6
BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
NOISE = 0.5 * float(BAND.slope(600.0))
"""0.5 K at 600 K in W/(m² sr)."""

CURVATURE = 0.005
"""Standard deviation of the curvatures: with this, the radiance of a small image varies twofold."""

CHIP, TOOL = 850.0, 750.0
"""Temperatures in K of chip and tool before the draw."""


class Simulation:
    """A chip beside a tool with a leaning outline, whose radiance is drawn from the prior."""

    def __init__(self, pixels):
        raster, side = Raster(0.0, pixels * PITCH, PITCH, pixels, pixels), pixels * PITCH
        corners = (0.55 * side, 0.0), (2 * side, 0.0), (2 * side, side), (0.7 * side, side)
        tool = Region("tool", Polygon(corners), unit="m")
        zones = Zone("chip", 0.42), Zone("tool", 0.58, tool)
        self.parts = cut_cells(ShapedObject(zones, raster), raster)
        formation = image_formation(CAMERA, self.parts.cells, pixels=raster)
        nothing = np.zeros(raster.shape, bool)
        noise = np.full(raster.shape, NOISE)
        image = Image(np.ones(raster.shape), noise, nothing, nothing, nothing)
        self.problem = Problem(image, self.parts, formation, np.zeros(raster.shape))
        # The weights of the problem are those of its prior until the data have changed them.
        self.problem._weigh(np.full(self.problem.weights.size, CURVATURE**2))
        precision, vectors = np.linalg.eigh(self.problem.bending.toarray())
        # Planes in each zone do not bend.
        bends = precision > 1e-9 * precision[-1]
        self.root = vectors[:, bends] / np.sqrt(precision[bends])
        self.level = np.log(BAND.radiance(np.where(self.parts.zone == 0, CHIP, TOOL)))

    def places(self):
        """Return weights of the values whose ranks count, (place, part)."""
        parts, last = self.parts, self.parts.size - 1
        chip = np.flatnonzero(parts.zone == 0)
        single = np.eye(parts.size)[[chip[chip.size // 2], 0, last]]
        contact = np.bincount(parts.cell, minlength=last)[parts.cell] > 1
        beside = contact & (parts.zone == 0), contact & (parts.zone == 1), parts.zone == 0
        means = [one / one.sum() for one in beside]
        names = "middle of the chip", "corner of the chip", "corner of the tool"
        names += "rake face", "tool beside it", "mean of the chip"
        return dict(zip(names, [*single, *means], strict=True))

    def drawn(self, seed, draws):
        """Return the truth at each place, and draws of the posterior, (draw, place)."""
        generator, problem = np.random.default_rng([60, seed]), self.problem
        x = self.level + self.root @ generator.normal(size=self.root.shape[1])
        seen = Posterior(problem, x).predicted
        light = seen + generator.normal(0, NOISE, seen.shape)
        problem.image = replace(problem.image, radiance=light)
        found = problem.smooth(lambda: None)
        found = problem.smooth(lambda: None, found)
        weights = np.array(list(self.places().values()))
        return weights @ x, (found.x + found.draws(generator, draws)) @ weights.T

    def ranks(self, seed, draws):
        """Return the rank of the truth among draws of the posterior, for each place."""
        truth, drawn = self.drawn(seed, draws)
        return (drawn < truth).sum(axis=0)


def chi_squared(ranks, draws, bins):
    """Return chi-squared of ranks in equal bins, and its probability if they are uniform."""
    counts = np.histogram(ranks, bins, (-0.5, draws + 0.5))[0]
    expected = ranks.size / bins
    value = ((counts - expected) ** 2 / expected).sum()
    return value, chi2.sf(value, bins - 1)


def main():
    args = arguments(__doc__, simulations=1000, pixels=16, draws=19, first=0)
    set_num_threads(1)
    simulation = Simulation(args.pixels)
    seeds = range(args.first, args.first + args.simulations)
    ranks = np.array([simulation.ranks(seed, args.draws) for seed in seeds])
    bins = min(args.draws + 1, 10)
    print(f"{len(seeds)} simulations of {args.pixels} x {args.pixels} pixels, {args.draws} draws")
    print_head("place", f"chi-squared of {bins} bins", "probability", "mean rank", "variance")
    uniform = args.draws / 2, ((args.draws + 1) ** 2 - 1) / 12
    for name, own in zip(simulation.places(), ranks.T, strict=True):
        value, probability = chi_squared(own, args.draws, bins)
        moments = own.mean() / uniform[0], own.var() / uniform[1]
        print_row(name, f"{value:.1f}", f"{probability:.3f}", *(f"{one:.3f}" for one in moments))


if __name__ == "__main__":
    main()
