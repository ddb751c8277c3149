"""The posterior of a correction beside CUQIpy's, on a linear Gaussian case.

cd benchmarks; python -m peers.cuqipy_posterior [--samples 1000] [--out FILE]

A small image of a chip beside a tool is corrected by one linearised step: data, forward model and
curvatures are then linear, and all errors normal. CUQIpy (N. A. B. Riis et al. (2024), Inverse
Problems 40, 045009) gets the same matrices and samples the posterior by randomize-then-optimize. It
needs `pip install cuqipy`; `tests/reference/cuqipy_posterior.csv` is the output, for the tests.
"""

from pathlib import Path

import numpy as np

from chipglow import AnnularAperturePSF, Band, Camera, Raster
from chipglow.camera import image_formation
from chipglow.correction import ShapedObject, Zone
from chipglow.correction.cells import cut_cells
from chipglow.correction.posterior import Image, Posterior, Problem
from chipglow.scene import Polygon, Region

PITCH, PIXELS, SEED = 6e-6, 8, 5
BAND = Band(3.8e-6, 5.1e-6)
CAMERA = Camera(pitch=PITCH, psf=AnnularAperturePSF(), psf_order="optics", lower_limit=None)
NOISE = 0.5 * float(BAND.slope(600.0))
"""0.5 K at 600 K in W/(m² sr)."""

WIDE = 1e4
"""Standard deviation of all values by the weak weight that makes the posterior proper."""

TOLERANCE, MOST_ITERATIONS = 1e-8, 5000
"""Relative residual and iterations at which CUQIpy's solver ends."""


def case():
    """Return the posterior, linearised at a uniform object, and the right side of its step."""
    side = PIXELS * PITCH
    raster = Raster(0.0, side, PITCH, PIXELS, PIXELS)
    corners = (0.5 * side, 0.0), (2 * side, 0.0), (2 * side, side), (0.7 * side, side)
    tool = Region("tool", Polygon(corners), unit="m")
    parts = cut_cells(ShapedObject((Zone("chip", 0.42), Zone("tool", 0.58, tool)), raster), raster)
    formation = image_formation(CAMERA, parts.cells, pixels=raster)
    level = np.full(parts.size, np.log(BAND.radiance(850.0)))
    across, down = np.divmod(parts.cell, parts.cells.columns)
    truth = level + 0.1 * np.sin(across / 3) * np.cos(down / 4) - 0.2 * (parts.zone == 1)
    nothing = np.zeros(raster.shape, bool)
    noise = np.full(raster.shape, NOISE)
    blank = Image(np.ones(raster.shape), noise, nothing, nothing, nothing)
    problem = Problem(blank, parts, formation, np.zeros(raster.shape))
    light = Posterior(problem, truth).predicted
    light = light + np.random.default_rng(SEED).normal(0, NOISE, light.shape)
    image = Image(light, noise, nothing, nothing, nothing)
    posterior = Posterior(Problem(image, parts, formation, np.zeros(raster.shape)), level)
    posterior.preconditioner = posterior.factor()
    return posterior


def ours():
    """Return mean and standard deviation of each part by the correction's own solver."""
    posterior = case()
    mean = posterior.x + posterior.solved(posterior.gradient, 1e-9)
    covariance = posterior.solved(np.eye(mean.size), 1e-6)
    return mean, np.sqrt(np.diag(covariance))


def cuqipys(samples):
    """Return the same by CUQIpy from samples."""
    import cuqi

    np.random.seed(SEED)  # noqa: NPY002 - CUQIpy draws from it
    posterior = case()
    columns = [posterior.seen_change(one).ravel() for one in np.eye(posterior.x.size)]
    forward = np.stack(columns, axis=1)
    image = posterior.residual.ravel() + forward @ posterior.x
    curvature = posterior.problem.curvature.matrix
    x = cuqi.distribution.Gaussian(np.zeros(posterior.x.size), cov=WIDE**2)
    y = cuqi.distribution.Gaussian(cuqi.model.LinearModel(forward)(x), cov=NOISE**2)
    variances = 1 / posterior.prior_weights
    z = cuqi.distribution.Gaussian(cuqi.model.LinearModel(curvature)(x), cov=variances)
    target = cuqi.distribution.JointDistribution(x, y, z)(y=image, z=np.zeros(variances.size))
    sampler = cuqi.sampler.LinearRTO(
        target, initial_point=posterior.x, maxit=MOST_ITERATIONS, tol=TOLERANCE
    )
    sampler.sample(samples)
    drawn = sampler.get_samples().samples[:, 1:]
    return drawn.mean(axis=1), drawn.std(axis=1, ddof=1)


def main():
    from common import arguments

    args = arguments(__doc__, samples=1000, out="")
    mean, spread = ours()
    theirs, their_spread = cuqipys(args.samples)
    off, ratio = (mean - theirs) / spread, their_spread / spread
    print(f"{mean.size} values, {args.samples} samples of CUQIpy")
    print(f"difference of means in standard deviations: rms {np.sqrt((off**2).mean()):.4f}")
    print(f"largest {np.abs(off).max():.4f}; ratio of standard deviations: mean {ratio.mean():.4f}")
    print(f"smallest {ratio.min():.4f}, largest {ratio.max():.4f}")
    if args.out:
        lines = [
            f"# CUQIpy, {args.samples} samples by LinearRTO; benchmarks/peers/{Path(__file__).name}"
        ]
        lines += ["mean,standard_deviation"]
        lines += [f"{a:.8f},{b:.8f}" for a, b in zip(theirs, their_spread, strict=True)]
        Path(args.out).write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
