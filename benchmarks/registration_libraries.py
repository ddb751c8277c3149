"""Registration of infrared and visible images: chipglow's `fit_images` beside scikit-image.

    python benchmarks/registration_libraries.py [--pairs 56] [--only chipglow scikit-image]

The pairs are the 56 of docs/do/registration.md, drawn by `dual_spectrum.py`. scikit-image takes the
peak of the cross-correlation of edges over turns and scales with the limits of `fit_images`. It
states no uncertainty: its result counts as doubtful if a placement over 8 pixels away is 80 % as
good.
"""

import warnings
from itertools import islice, product
from math import radians
from time import process_time

import numpy as np
from common import arguments, print_head, print_row
from dual_spectrum import PITCH, DualSpectrum
from scipy.ndimage import gaussian_gradient_magnitude
from skimage.filters import window
from skimage.registration import phase_cross_correlation
from skimage.transform import AffineTransform, SimilarityTransform, warp

from chipglow.laboratory.registration import Registration, fit_images
from chipglow.text import Notes

SEEDS = (
    (range(9000, 9012), "affine"),
    (range(9100, 9124), "affine"),
    (range(9200, 9220), "similarity"),
)
SCALES, TURNS = (0.8, 0.9, 1.0, 1.1, 1.25), (-4.0, 0.0, 4.0)
FAR, RIVAL = 8.0, 0.8


def own(pair, model):
    measured = pair.infrared
    return fit_images(measured.radiance[0], measured.raster, pair.visible, model).registration


def by_correlation(pair, model):
    """The registration by scikit-image, with a warning if another placement is nearly as good."""
    raster, (rows, columns) = pair.infrared.raster, pair.infrared.raster.shape
    pitch = columns / pair.visible.shape[1]  # of a visible pixel, were both images as wide
    hot = gaussian_gradient_magnitude(pair.infrared.radiance[0], 1.0)
    seen = gaussian_gradient_magnitude(pair.visible.astype(float), 1.0 / pitch)
    placements = [placed(pair, scale / pitch, turn) for scale, turn in product(SCALES, TURNS)]
    tried = sorted(
        (correlated(hot, seen, matrix) for matrix in placements), key=lambda one: -one[0]
    )
    good, best = tried[0]
    corners = np.array([[0, 0, 1], [columns - 1, rows - 1, 1]])
    rivals = [
        other
        for value, other in tried[1:]
        if value > RIVAL * good and pitch * np.hypot(*((best - other) @ corners.T)[:2]).max() > FAR
    ]
    step = raster.spacing
    from_m = [[1 / step, 0, -raster.x[0] / step], [0, -1 / step, raster.y[0] / step], [0, 0, 1]]
    notes = Notes(warnings=["another placement fits nearly as well"] if rivals else [])
    return Registration(best @ from_m, np.zeros((9, 9)), model, "mutual-information", notes=notes)


def placed(pair, scale, turn):
    """Matrix from pixel to visible pixel that turns and scales about the middles."""
    matrix = SimilarityTransform(scale=scale, rotation=radians(turn)).params
    middle, there = (
        np.array([shape[1] - 1, shape[0] - 1]) / 2
        for shape in (pair.infrared.raster.shape, pair.visible.shape)
    )
    matrix[:2, 2] = there - matrix[:2, :2] @ middle
    return matrix


def correlated(hot, seen, matrix):
    """Correlation at the best shift from a placement, and the shifted placement."""
    there = warp(seen, AffineTransform(matrix=matrix), output_shape=hot.shape, mode="edge")
    taper = window(("tukey", 0.3), hot.shape)
    fields = (taper * (field - field.mean()) for field in (hot, there))
    (down, right), error, _ = phase_cross_correlation(
        *fields, upsample_factor=10, normalization=None
    )
    return 1.0 - error**2, matrix @ SimilarityTransform(translation=(-right, -down)).params


METHODS = {"chipglow": own, "scikit-image": by_correlation}


def outcome_of(method, pair, model):
    """Error and stated uncertainty in pixels, infinite for no map; whether it warns; seconds."""
    begin = process_time()
    try:
        found = METHODS[method](pair, model)
    except (ValueError, RuntimeError):
        return np.inf, 0.0, True, process_time() - begin
    seconds, raster = process_time() - begin, pair.infrared.raster
    places = np.stack(np.meshgrid(raster.x, raster.y), axis=-1).reshape(-1, 2)
    off = found.pixels(places) - pair.pixels(places)
    error = np.linalg.solve(pair.matrix[:2, :2], off.T) / PITCH
    stated = np.trace(found.position_covariance(places), axis1=-2, axis2=-1) / PITCH**2
    warned = bool(found.notes.warnings)
    return np.sqrt((error**2).sum(axis=0).mean()), np.sqrt(stated.mean()), warned, seconds


def row(name, outcomes):
    error, stated, doubtful, seconds = np.array(outcomes).T
    sure = doubtful == 0
    return [
        name,
        f"{np.mean(error < 1):.0%}",
        f"{np.mean(error < 3):.0%}",
        f"{np.median(error):.2f}",
        f"{np.mean(sure):.0%}",
        f"{np.mean(sure & (error >= 3)):.0%}",
        f"{error[sure].max():.1f}" if sure.any() else "-",
        f"{np.sum((stated > 0) & (error > 2 * stated))}" if stated.any() else "none stated",
        f"{np.median(seconds):.1f}",
    ]


def main():
    given = arguments(__doc__, pairs=56, only=list(METHODS))
    warnings.simplefilter("ignore")
    drawn = ((DualSpectrum.drawn(seed), model) for seeds, model in SEEDS for seed in seeds)
    pairs = list(islice(drawn, given.pairs))
    print(f"{len(pairs)} pairs; errors are rms over the image, in infrared pixels\n")
    print_head(
        "method", "under 1", "under 3", "median", "sure", "sure, 3 or more", "greatest, sure",
        "over twice the stated", "s",
    )  # fmt: skip
    for name in given.only:
        print_row(*row(name, [outcome_of(name, *pair) for pair in pairs]))


if __name__ == "__main__":
    main()
