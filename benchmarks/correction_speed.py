"""Processor time of a correction against the number of pixels, beside Richardson-Lucy.

python benchmarks/correction_speed.py [--sides 32 64 95 128] [--seed 3001]

Square scenes of ``correction_scenes.py`` are corrected with a known outline, and with one that is
stated 0.3 pixels off and found. The estimate ends where the uncertainties begin. Times are in
seconds of one core, and in multiples of 20 iterations of Richardson-Lucy (scikit-image) on the same
image. The exponent p of the last row, time ~ pixels^p, is that between smallest and largest image.
"""

from time import process_time

import numpy as np
from common import arguments, print_tables
from correction_scenes import CAMERA, DARK, EMISSIVITY, PITCH, analytic
from numba import set_num_threads
from skimage import restoration

from chipglow.correction import correct

ITERATIONS = 20
SHIFT, UNCERTAINTY = 0.3 * PITCH, 0.5 * PITCH
"""Error of the stated outline in m, and its stated uncertainty."""

HEAD = (
    "pixels",
    "Richardson-Lucy",
    "estimate",
    "with intervals",
    "outline found: estimate",
    "with intervals",
)


def corrected(one, shift, uncertainty):
    """Return the processor times in s at the end of the estimate, and at the end of all."""
    passed = {}
    begin = process_time()

    def note(fraction):
        passed.setdefault(fraction, process_time() - begin)

    correct(
        one.measurement,
        CAMERA,
        one.stated(EMISSIVITY, shift=shift),
        outline_uncertainty=uncertainty,
        surroundings=DARK,
        noise=one.netd,
        progress=note,
    )
    return passed[0.5], process_time() - begin


def restored(image):
    """Return the processor time in s of a restoration of the image."""
    kernel = CAMERA.psf.view_kernel(PITCH, *(count // 2 - 1 for count in image.shape))
    level = np.maximum(image, 0) / image.max()
    begin = process_time()
    restoration.richardson_lucy(level, kernel, ITERATIONS)
    return process_time() - begin


def times(side, seed):
    """Return the times of one scene: peer, and estimate and all with either outline."""
    one = analytic(seed, side)
    known, found = corrected(one, 0.0, 0.0), corrected(one, SHIFT, UNCERTAINTY)
    return np.array([restored(one.image), *known, *found])


def row(side, taken):
    peer, *own = taken
    ratios = (f"{time:.1f} s, {time / peer:.0f}" for time in own)
    return (f"{side} x {side}", f"{1e3 * peer:.0f} ms", *ratios)


def main():
    args = arguments(__doc__, sides=[32, 64, 95, 128], seed=3001)
    set_num_threads(1)
    times(min(args.sides), args.seed)  # compiles, and reads tables
    taken = [times(side, args.seed) for side in args.sides]
    rows = [row(*one) for one in zip(args.sides, taken, strict=True)]
    if len(taken) > 1:
        growth = np.log(taken[-1] / taken[0]) / (2 * np.log(args.sides[-1] / args.sides[0]))
        rows.append(("exponent", *(f"{value:.2f}" for value in growth)))
    print_tables([(HEAD, *rows)])


if __name__ == "__main__":
    main()
