"""The posterior of a correction: a dense solution of its own, and calibration by simulation.

More simulations: `python benchmarks/correction_ranks.py`.
"""

from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from correction_ranks import Simulation, chi_squared
from peers.cuqipy_posterior import ours
from scipy import linalg, sparse

from chipglow import AnnularAperturePSF, Band, Camera, Raster
from chipglow.camera import image_formation
from chipglow.correction import Zone
from chipglow.correction.cells import cut_cells
from chipglow.correction.posterior import Image, Problem
from chipglow.correction.zones import ShapedObject
from chipglow.scene import Polygon, Region

PITCH = 6e-6
BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
NOISE = 0.5 * float(BAND.slope(600.0))
"""0.5 K at 600 K in W/(m² sr)."""

CHIP, TOOL = 0.42, 0.58

REFERENCE = Path(__file__).parent / "reference" / "cuqipy_posterior.csv"


def problem_of(light, pixels, zones):
    """Return the problem of an image without surroundings, and its parts."""
    parts = cut_cells(ShapedObject(zones, pixels), pixels)
    formation = image_formation(CAMERA, parts.cells, pixels=pixels)
    nothing = np.zeros(pixels.shape, bool)
    image = Image(light, np.full(pixels.shape, NOISE), nothing, nothing, nothing)
    return Problem(image, parts, formation, np.zeros(pixels.shape))


def raw_moments(mean):
    """Return the moments 0 to 4 about the middle of a cell of light with a mean place."""
    square = 1 / 12 + mean**2
    return 1, mean, square, 3 * mean / 12 + mean**3, 1 / 80 + mean**2 / 2 + mean**4


def mirrored(number, count):
    if number < 0:
        return -1 - number
    return number if number < count else 2 * count - 1 - number


class DenseChip:
    """The model of a chip beside a tool as dense matrices, in plain loops.

    The outline is on the border between two columns of cells, so that no cell is cut.
    """

    def __init__(self, count, edge):
        self.count, self.edge = count, edge
        self.pixels = Raster(0.0, count * PITCH, PITCH, count, count)
        self.cells = Raster(0.0, count * PITCH, PITCH / 2, 2 * count, 2 * count)
        self.tool = np.zeros(self.cells.shape, bool)
        self.tool[:, edge:] = True
        self.shine = np.where(self.tool, TOOL, CHIP)

    @property
    def zones(self):
        right, top, x = 2 * self.count * PITCH, self.count * PITCH, self.edge * PITCH / 2
        corners = (x, -top), (right, -top), (right, 2 * top), (x, 2 * top)
        shape = Region("tool", Polygon(corners), unit="m")
        return Zone("chip", CHIP), Zone("tool", TOOL, shape)

    @cached_property
    def camera(self):
        """Return the image of each cell as a column."""
        formation, size = image_formation(CAMERA, self.cells, pixels=self.pixels), self.tool.size
        columns = np.empty((self.pixels.rows * self.pixels.columns, size))
        for number in range(size):
            one = np.zeros(size)
            one[number] = 1.0
            columns[:, number] = formation.forward(one.reshape(self.cells.shape)).ravel()
        return columns

    def spread(self, x):
        """Return where cells with the logarithms x of their radiance send their light from.

        The light of a cell with the slope s has its centroid s/12 from the middle, about it the
        variance 1/12 and the fourth moment 1/80; so have weights on the 13 cells up to two steps
        away. Beyond the border is the mirror image.
        """
        rows, columns = self.cells.shape
        entries, to = [], []
        values = x.reshape(self.cells.shape)
        steps = [at for at in np.ndindex(5, 5) if abs(at[0] - 2) + abs(at[1] - 2) <= 2]
        powers = [at for at in np.ndindex(5, 5) if sum(at) <= 3] + [(4, 0), (2, 2), (0, 4)]
        system = [[(d - 2.0) ** n * (r - 2.0) ** m for d, r in steps] for n, m in powers]
        weights_of = linalg.inv(system)
        for row, column in np.ndindex(rows, columns):
            down, right = (
                raw_moments(self.slope(values, row, column, *step) / 12)
                for step in ((1, 0), (0, 1))
            )
            entries.append(weights_of @ [down[n] * right[m] for n, m in powers])
            to += [
                mirrored(row + d - 2, rows) * columns + mirrored(column + r - 2, columns)
                for d, r in steps
            ]
        places = np.array(to), np.repeat(np.arange(x.size), len(steps))
        return sparse.coo_array((np.concatenate(entries), places), (x.size, x.size)).tocsc()

    def slope(self, values, row, column, down, right):
        """Return the slope at a cell, one-sided beside the outline and at the border."""
        ends = []
        for sign in (-1, 1):
            at = row + sign * down, column + sign * right
            inside = 0 <= at[0] < values.shape[0] and 0 <= at[1] < values.shape[1]
            same = inside and self.tool[at] == self.tool[row, column]
            ends.append(at if same else (row, column))
        distance = abs(ends[1][0] - ends[0][0]) + abs(ends[1][1] - ends[0][1])
        return (values[ends[1]] - values[ends[0]]) / max(distance, 1)

    @cached_property
    def differences(self):
        """Weights of the second differences by their cells: both axes and mixed, within a zone."""
        rows, columns = self.cells.shape
        mixed = np.sqrt(2)
        found = {}
        for row, column in np.ndindex(rows, columns):
            for steps, weights in (
                (((0, -1), (0, 0), (0, 1)), (1, -2, 1)),
                (((-1, 0), (0, 0), (1, 0)), (1, -2, 1)),
                (((0, 0), (0, 1), (1, 0), (1, 1)), (mixed, -mixed, -mixed, mixed)),
            ):
                at = [(row + down, column + right) for down, right in steps]
                inside = all(0 <= r < rows and 0 <= c < columns for r, c in at)
                if inside and len({bool(self.tool[one]) for one in at}) == 1:
                    found[tuple(r * columns + c for r, c in at)] = weights
        return found

    @property
    def neighbours(self):
        """Pairs of neighbouring cells of a zone, by their numbers."""
        numbers = np.arange(self.tool.size).reshape(self.cells.shape)
        lines = (numbers[:, :-1], numbers[:, 1:]), (numbers[:-1], numbers[1:])
        pairs = np.concatenate([np.stack(pair).reshape(2, -1).T for pair in lines])
        same = self.tool.ravel()[pairs]
        return pairs[same[:, 0] == same[:, 1]]

    def precision(self, weights):
        """Return Dᵀ w D for weights of the second differences, and slopes of 1 per cell."""
        matrix = np.zeros((self.tool.size, self.tool.size))
        for cells in self.neighbours:
            matrix[np.ix_(cells, cells)] += np.array([[1.0, -1.0], [-1.0, 1.0]])
        for (cells, own), weight in zip(self.differences.items(), weights, strict=True):
            matrix[np.ix_(cells, cells)] += weight * np.outer(own, own)
        return matrix

    def image(self, x):
        """Return the image of cells, and its change with each of them (pixel, cell)."""
        seen = self.camera @ self.spread(x) * (self.shine.ravel() * np.exp(x))
        return seen.sum(axis=1), seen

    def maximum(self, x, light, precision):
        """Return the most probable values by Newton's method, from a start."""
        for _ in range(20):
            gradient, hessian = self.linearised(x, light, precision)
            change = linalg.solve(hessian, gradient, assume_a="pos")
            x = x + change
            if np.abs(change).max() < 1e-7:
                return x
        raise AssertionError("Newton's method did not converge")

    def linearised(self, x, light, precision):
        """Return the gradient of the logarithm of the density, and minus its second derivative."""
        image, change = self.image(x)
        gradient = change.T @ (light.ravel() - image) / NOISE**2 - precision @ x
        return gradient, change.T @ change / NOISE**2 + precision


def test_a_linear_gaussian_case_is_that_of_cuqipy():
    """CUQIpy samples the same posterior; `benchmarks/peers/cuqipy_posterior.py` stored it."""
    theirs, their_spread = np.loadtxt(REFERENCE, delimiter=",", skiprows=2).T
    mean, spread = ours()
    # A mean of 1000 samples scatters by 1/32 of a standard deviation, a standard deviation by 1/45
    # of itself; four of these hold for all 272 values, which are correlated.
    assert np.abs((mean - theirs) / spread).max() < 4 / np.sqrt(1000)
    assert np.abs(their_spread / spread - 1).max() < 4 / np.sqrt(2 * 1000)


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform():
    """Truths from the prior have uniform ranks among draws of the posterior, at each place."""
    simulation, draws, bins = Simulation(6), 9, 5
    seen = [simulation.drawn(seed, draws) for seed in range(60)]
    ranks = np.array([(drawn < truth).sum(axis=0) for truth, drawn in seen])
    found = [chi_squared(own, draws, bins)[1] for own in ranks.T]
    # Of six places, by chance one in 170 draws of all seeds has a probability below 1e-3.
    assert min(found) > 1e-3
    # Draws that scatter a third as much are noticed at every place.
    narrow = [(truth, (drawn + 2 * drawn.mean(axis=0)) / 3) for truth, drawn in seen]
    ranks = np.array([(drawn < truth).sum(axis=0) for truth, drawn in narrow])
    assert max(chi_squared(own, draws, bins)[1] for own in ranks.T) < 1e-3  # one in 1000, as above


def dense_case():
    """Return a chip with a band, a noisy image of it, and its problem, with the order of parts."""
    chip = DenseChip(24, 28)
    row, column = np.divmod(np.arange(chip.tool.size), chip.cells.columns)
    band = 150 * np.exp(-(((row + column - 40) / 4) ** 2))
    kelvins = np.where(chip.tool.ravel(), 800 - 2 * row, 900 + 2 * column + band)
    image = chip.image(np.log(BAND.radiance(kelvins)))[0].reshape(chip.pixels.shape)
    light = image + np.random.default_rng(3).normal(0, NOISE, image.shape)
    problem = problem_of(light, chip.pixels, chip.zones)
    return chip, light, problem, np.argsort(problem.parts.cell)


def test_the_posterior_is_that_of_dense_matrices():
    chip, light, problem, order = dense_case()
    found = problem.solve(np.random.default_rng(1), lambda: None)
    rows = problem.curvature.matrix[:, order].tolil()
    stated = {tuple(cells): number for number, cells in enumerate(rows.rows)}
    same = [stated[cells] for cells in chip.differences]
    assert len(same) == len(stated)
    for number, weights in zip(same, chip.differences.values(), strict=True):
        assert rows.data[number] == list(weights)

    precision = chip.precision(found.prior_weights[same])
    best = chip.maximum(found.x[order], light, precision)
    covariance = linalg.inv(chip.linearised(best, light, precision)[1])
    spread = np.sqrt(np.diag(covariance))
    # Steps end at an error of 2e-3 per pixel, whose root sum of squares bounds that of each value.
    # Outlines are located to 1/4096 of a cell, so that the parts beside it send 2.4e-4 less light.
    last_step = 2e-3 * np.sqrt(light.size) * spread
    assert (np.abs(found.x[order] - best) < last_step + 2.4e-4).all()
    assert spread.min() > 2e-3  # so that the latter is an eighth of the least standard uncertainty

    _, hessian = chip.linearised(found.x[order], light, precision)
    covariance = linalg.inv(hessian)
    spread = np.sqrt(np.diag(covariance))
    for cell in (0, 500, 1111, 1400, 2303):
        right = np.zeros(order.size)
        right[order[cell]] = 1.0
        column = found.solved(right, 1e-9)[order]
        # The light of 2.4e-4 changes no quadratic form of the data by more than twice as much.
        assert (np.abs(column - covariance[cell]) < 5e-4 * spread[cell] * spread).all()

    draws = found.draws(np.random.default_rng(3), 12)[:, order]
    # Draws of the covariance have a chi-square distribution of so many degrees of freedom.
    squares = ((draws @ linalg.cholesky(hessian, lower=True)) ** 2).sum()
    assert abs(squares / draws.size - 1) < 3 * np.sqrt(2 / draws.size)
