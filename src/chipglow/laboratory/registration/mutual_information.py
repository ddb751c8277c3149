"""Registration of an infrared image and a visible picture by their mutual information."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import cos, hypot, sin
from operator import itemgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, median_filter
from scipy.optimize import minimize

from chipglow.laboratory.registration.registration import (
    Model,
    NormalisedFrame,
    Registration,
    element_slopes,
    mapped_places,
    parameter_basis,
)
from chipglow.quantities import Array, Brief
from chipglow.scene import Raster
from chipglow.text import Notes

_BINS: Final = 8
_ENDS: Final = (0.5, 98.0)
_STEPS: Final = (4, 2, 1)
_BLUR: Final = 0.6
_WINDOW: Final = 5.0
_NOISES: Final = 3.0
_FAINT_INFRARED: Final = 0.02
_FAINT_VISIBLE: Final = 0.5
_NEARLY_ALL: Final = 0.95
_FADE: Final = 2.0
_LEAST_OVERLAP: Final = 0.5
_REACH: Final = 0.25
_SCALES: Final = (0.8, 0.9, 1.0, 1.1, 1.25)
_TURNS: Final = (-4.0, 0.0, 4.0)
_CANDIDATES: Final = 5
_SURVEY: Final = (-4.5, -3.0, -1.5, 0.0, 1.5, 3.0, 4.5)
_THINNED: Final = 4
_FINALS: Final = 3
_FAR: Final = 8.0
_APART: Final = 3.0
_RIVAL: Final = 0.8
_UNRELATED: Final = 19
_BLOCK: Final = 16
_UNSURE: Final = 1.0
_FLAT: Final = 1e-4
_SYSTEMATIC: Final = 0.5
_SETTLE: Final = {"xtol": 0.1, "ftol": 1e-3, "maxfev": 300}
_CLIMB: Final = {"gtol": 1e-7, "maxiter": 100}


@dataclass(frozen=True, repr=False)
class ImageFit(Brief):
    """A registration from the images themselves."""

    registration: Registration
    placement: float
    """Mutual information times common edges of the best placement, at a quarter of the pixels."""
    by_chance: Array
    """The same for infrared images that are turned over and moved round, shape (n,)."""


def fit_images(
    infrared: NDArray[np.floating],
    raster: Raster,
    visible: NDArray[np.generic],
    model: Model = "affine",
) -> ImageFit:
    """Register two images by mutual information and common edges.

    Parameters
    ----------
    infrared : ndarray
        Radiance, NaN where it is not known; shape `raster.shape`.
    raster : Raster
        The infrared pixels.
    visible : ndarray
        Brightness, shape (rows, columns).
    model : {"similarity", "affine", "homography"}
        As in `fit_points`.

    Raises
    ------
    ValueError
        If an image has no contrast, or the images do not lie on each other.

    Notes
    -----
    Mutual information (Viola and Wells, Int. J. Comput. Vision 24 (1997) 137) times common edges
    (Pluim et al., IEEE Trans. Med. Imaging 19 (2000) 809) choose among placements that are not
    mirrored: shifts of up to a quarter of the width, turns of up to 4 degrees, scales of 0.8 to
    1.25. From there the sum of (g_i . g_v)^2 climbs, the products of both images' gradients, each
    over the contrast of its surroundings (after Haber and Modersitzki, Methods Inf. Med. 46 (2007)
    292): mutual information alone is off by pixels where heat spreads beyond the visible edges.

    The covariance follows from a sum over blocks of 16 x 16 pixels (the sandwich of Huber, 1967);
    half a pixel is added for each parameter, at the image's corner: an edge of heat beside the edge
    that is seen.
    """
    coarse, middle, fine = _levels(infrared, raster, visible)
    placements = _placements(coarse)
    score, chance = _against_chance(coarse, placements[0])
    settled = [_settled(coarse, matrix)[0] for matrix in placements]
    candidates = [matrix for matrix, _ in _best_first(middle, settled)]
    starts = _surveyed(fine, candidates[0])
    starts += [other for other in candidates[1:] if fine.apart(other, starts[0]) > _FAR]
    fits = _best_first(fine, starts)
    matrix = _climb(fine, _climb(fine, fits[0][0], "similarity"), model)
    basis = fine.basis(matrix, model)
    spread, flat = _sandwich(fine, matrix, basis)
    full, covariance = fine.frame.undone(matrix, basis @ spread @ basis.T)
    found = Registration(full, covariance, model, "mutual-information")
    warnings = [
        *(() if score > chance.max() else (_BY_CHANCE,)),
        *_rivals(fits, fine),
        *((_NO_OPTIMUM,) if flat else _unsure(found, raster)),
    ]
    return ImageFit(replace(found, notes=Notes([_NOT_MIRRORED], warnings)), score, chance)


_NOT_MIRRORED: Final = (
    "The visible picture is not mirrored, and shows the infrared image's width within 25 % and "
    "its centre within a quarter of the width; otherwise give points."
)
_BY_CHANCE: Final = "The best placement is no better than that of unrelated images."
_NO_OPTIMUM: Final = "No placement is better than its neighbours in every direction."


@dataclass(frozen=True)
class _Level:
    """Infrared image and visible picture at one resolution, in bins, and their edges."""

    frame: NormalisedFrame
    step: float
    """Distance of samples of the infrared image in units of the frame."""
    scale: float
    """Visible pixels a sample."""
    known: NDArray[np.bool_]
    bin_image: NDArray[np.int64]
    edge_image: Array
    """Joint histogram of samples, with their edges along columns and rows."""
    places: Array
    """Places of the known ones in units of the frame, shape (n, 2)."""
    blocks: NDArray[np.int64]
    codes: NDArray[np.int64]
    """Bins of the visible picture."""
    lines: Array
    """Its edges, and their slopes along columns and rows, shape (rows, columns, 6)."""

    @cached_property
    def bins(self) -> NDArray[np.int64]:
        return self.bin_image[self.known]

    @cached_property
    def edges(self) -> Array:
        return self.edge_image[self.known]

    @cached_property
    def directions(self) -> Array:
        return np.ascontiguousarray(self.lines[..., :2])

    @cached_property
    def sharp(self) -> NDArray[np.bool_]:
        """Whether a sample is one of the fewest that have nearly all squares of the edges."""
        squares = (self.edges**2).sum(axis=-1)
        ordered = np.sort(squares)[::-1]
        least = ordered[np.searchsorted(ordered.cumsum(), _NEARLY_ALL * squares.sum())]
        return np.asarray(squares >= least)

    def apart(self, one: Array, other: Array) -> float:
        """Return the distance of two maps of the image in samples, at the worse of two corners."""
        corners = self.places[[0, -1]]
        apart = mapped_places(one, corners) - mapped_places(other, corners)
        return float(np.hypot(apart[:, 0], apart[:, 1]).max()) / self.step

    def basis(self, matrix: Array, model: Model) -> Array:
        """Return the basis by which a parameter of 1 moves the image's corner by one sample."""
        return parameter_basis(model, mirrored=np.linalg.det(matrix[:2, :2]) < 0) * self.step


def _levels(
    infrared: NDArray[np.floating], raster: Raster, visible: NDArray[np.generic]
) -> list[_Level]:
    known, seen = np.isfinite(infrared), np.asarray(visible, np.float64)
    for name, values in (("infrared image", infrared[known]), ("visible picture", seen)):
        if values.size == 0 or not np.ptp(values) > 0:
            raise ValueError(f"{name}: has no contrast")
    filled = np.where(known, infrared, np.median(infrared[known]))
    return [_level(filled, known, raster, seen, step) for step in _STEPS]


def _level(
    infrared: Array, known: NDArray[np.bool_], raster: Raster, visible: Array, step: int
) -> _Level:
    scale = min(visible.shape[0] / raster.rows, visible.shape[1] / raster.columns) * step
    picture = gaussian_filter(visible, _BLUR * scale)
    lines = _edges(picture, scale, _FAINT_VISIBLE * float(visible.std()))
    # The noise is the deviation of pixels from the median around them.
    noise = 1.4826 * float(np.median(np.abs(infrared - median_filter(infrared, 3))))
    faint = hypot(_NOISES * noise, _FAINT_INFRARED * float(infrared.std()))
    weight = gaussian_filter(known.astype(float), _BLUR * step)
    smooth = gaussian_filter(infrared * known, _BLUR * step) / np.maximum(weight, 1e-9)
    part = (slice(step // 2, None, step),) * 2
    frame = _frame(raster, visible.shape)
    rows, columns = np.indices(raster.shape)
    blocks = rows // _BLOCK * -(-raster.columns // _BLOCK) + columns // _BLOCK
    return _Level(
        frame=frame,
        step=raster.spacing * step / frame.scale,
        scale=scale,
        known=known[part],
        bin_image=_binned(smooth)[part],
        edge_image=np.moveaxis(_edges(smooth, step, faint), 0, -1)[part],
        places=frame.unit(raster.centres[part][known[part]]),
        blocks=blocks[part][known[part]],
        codes=_binned(picture),
        lines=np.concatenate([lines, *np.gradient(lines, axis=(2, 1))]).transpose(1, 2, 0).copy(),
    )


def _edges(image: Array, scale: float, faint: float) -> Array:
    """Return the gradient a sample, over the contrast around and what is faint: (2, y, x)."""
    down, right = np.gradient(image)
    mean = gaussian_filter(image, _WINDOW * scale)
    variance = gaussian_filter((image - image.mean()) ** 2, _WINDOW * scale)
    variance = np.maximum(variance - (mean - image.mean()) ** 2, 0.0)
    return np.asarray(np.stack([right, down]) * scale / np.sqrt(variance + faint**2))


def _binned(image: Array) -> NDArray[np.int64]:
    """Return bins of equal width from nearly the smallest to nearly the largest value."""
    low, high = np.percentile(image, _ENDS)
    fraction = (image - low) / max(high - low, np.finfo(float).tiny)
    return np.asarray(np.clip(fraction * _BINS, 0, _BINS - 1), np.int64)


def _frame(raster: Raster, shape: tuple[int, ...]) -> NormalisedFrame:
    left, right, bottom, top = raster.extent
    centre = np.array([(left + right) / 2, (bottom + top) / 2])
    radius = hypot(right - left, top - bottom) / 2
    middle = np.array([shape[1] - 1, shape[0] - 1]) / 2
    return NormalisedFrame(centre, radius, middle, radius * shape[1] / (right - left))


# The choice among placements


def _placements(level: _Level) -> list[Array]:
    """Return the best placements on a grid that are apart from each other, the best first."""
    found: list[tuple[float, Array]] = []
    for scale, turn in product(_SCALES, np.radians(_TURNS).tolist()):
        matrix = np.eye(3)
        matrix[:2, :2] = scale * np.array([[cos(turn), -sin(turn)], [sin(turn), cos(turn)]])
        found.extend(_shifted(level, matrix, level.bins, level.edges))
    found.sort(key=itemgetter(0), reverse=True)
    if found[0][0] == 0.0:
        raise ValueError("images: they do not lie on each other, expected views of one thing")
    kept: list[Array] = []
    for _, matrix in found:
        if all(level.apart(matrix, other) > _APART for other in kept):
            kept.append(matrix)
        if len(kept) == _CANDIDATES:
            break
    return kept


def _shifted(
    level: _Level, matrix: Array, bins: NDArray[np.int64], edges: Array
) -> Iterator[tuple[float, Array]]:
    """Return the mutual information times common edges, and the matrix, of each shift on a grid."""
    pixels = level.frame.pixels(matrix, level.places)
    reach = int(_REACH * level.bin_image.shape[1])
    for steps in product(range(-reach, reach + 1), repeat=2):
        shift = level.step * np.array(steps)
        moved = matrix.copy()
        moved[:2, 2] += shift
        yield _score(level, pixels + shift * level.frame.pixel_scale, bins, edges), moved


def _score(level: _Level, pixels: Array, bins: NDArray[np.int64], edges: Array) -> float:
    """Return mutual information times common edges at pixels; 0 if too few overlap."""
    column, row = np.rint(pixels).astype(np.int64).T
    rows, columns = level.codes.shape
    here = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
    if here.mean() < _LEAST_OVERLAP:
        return 0.0
    place = row[here], column[here]
    joint = np.bincount(bins[here] * _BINS + level.codes[place], None, _BINS**2) / here.size
    along = (edges[here] * level.directions[place]).sum(axis=1)
    return _shared(joint.reshape(_BINS, _BINS)) * float(along @ along) / float(here.size)


def _shared(joint: Array) -> float:
    """Return the mutual information in nats of a joint histogram, times its sum."""
    apart = np.outer(joint.sum(axis=1), joint.sum(axis=0))
    filled = joint > 0
    return float((joint[filled] * np.log(joint[filled] * joint.sum() / apart[filled])).sum())


def _against_chance(level: _Level, matrix: Array) -> tuple[float, Array]:
    """Return the best score over all shifts: of the image, and of unrelated images."""
    linear = matrix.copy()
    linear[:2, 2] = 0.0

    def best(bins: NDArray[np.int64], edges: Array) -> float:
        return max(score for score, _ in _shifted(level, linear, bins, edges))

    generator = np.random.default_rng(2010)
    chance = []
    for number in range(_UNRELATED):
        signs = ((-1, 1), (1, -1), (-1, -1))[number % 3]
        shift = tuple(int(generator.integers(side)) for side in level.bin_image.shape)
        flip = np.s_[:: signs[0], :: signs[1]]
        bins = np.roll(level.bin_image[flip], shift, (0, 1))[level.known]
        edges = np.roll(level.edge_image[flip], shift, (0, 1))[level.known]
        chance.append(best(bins, edges * signs[::-1]))
    return best(level.bins, level.edges), np.array(chance)


# The climb


def _moved(matrix: Array, basis: Array, parameters: Any) -> Array:
    return np.asarray(matrix + (basis @ parameters).reshape(3, 3))


def _settled(level: _Level, matrix: Array) -> tuple[Array, float]:
    """Return the similarity near a matrix with the best score, and that."""
    basis = level.basis(matrix, "similarity")

    def loss(parameters: Array) -> float:
        pixels = level.frame.pixels(_moved(matrix, basis, parameters), level.places)
        return -_score(level, pixels, level.bins, level.edges)

    found = minimize(loss, np.zeros(4), method="Powell", options=_SETTLE)
    return _moved(matrix, basis, found.x), -float(found.fun)


def _best_first(level: _Level, matrices: list[Array]) -> list[tuple[Array, float]]:
    """Return the settled matrices and their scores, the best first."""
    return sorted((_settled(level, matrix) for matrix in matrices), key=itemgetter(1))[::-1]


def _surveyed(level: _Level, matrix: Array) -> list[Array]:
    """Return the best similarities on a grid of shifts, turns and scales around a matrix."""
    basis = level.basis(matrix, "similarity")
    thin = slice(None, None, _THINNED)
    places, bins, edges = level.places[thin], level.bins[thin], level.edges[thin]
    found = []
    for parameters in product(_SURVEY, repeat=4):
        pixels = level.frame.pixels(_moved(matrix, basis, parameters), places)
        found.append((_score(level, pixels, bins, edges), parameters))
    found.sort(reverse=True)
    return [_moved(matrix, basis, best) for _, best in found[:_FINALS]]


def _climb(level: _Level, matrix: Array, model: Model) -> Array:
    """Return the matrix of the most common edges near a matrix."""
    basis = level.basis(matrix, model)

    def loss(parameters: Array) -> tuple[float, Array]:
        common, slopes, _ = _common_edges(level, _moved(matrix, basis, parameters), basis)
        return -common, -slopes.sum(axis=0)

    found = minimize(loss, np.zeros(basis.shape[1]), jac=True, method="BFGS", options=_CLIMB)
    return _moved(matrix, basis, found.x)


def _common_edges(
    level: _Level, matrix: Array, basis: Array
) -> tuple[float, Array, NDArray[np.bool_]]:
    """Return the mean of (g_i . g_v)², what each sharp sample adds to its slope, and which do."""
    places, edges = level.places[level.sharp], level.edges[level.sharp]
    pixels = level.frame.pixels(matrix, places)
    weight, fading = _window(pixels, level.codes.shape, _FADE * level.scale)
    here = weight > 0
    if weight.mean() < _LEAST_OVERLAP:
        return 0.0, np.zeros((int(here.sum()), basis.shape[1])), here
    weight, fading, edges = weight[here], fading[here], edges[here]
    lines = _between(level.lines, pixels[here]).reshape(-1, 3, 2)
    along, right, down = (lines * edges[:, None]).sum(axis=2).T
    pull = 2 * (weight * along)[:, None] * np.stack([right, down], axis=1)
    pull += (along**2)[:, None] * fading
    slopes = (
        element_slopes(matrix, places[here]) @ basis * (level.frame.pixel_scale / len(level.places))
    )
    common = float((weight * along**2).sum() / len(level.places))
    return common, np.einsum("ni,nik->nk", pull, slopes), here


def _between(fields: Array, pixels: Array) -> Array:
    """Return fields (rows, columns, k) between their pixels, bilinear, shape (n, k)."""
    first = np.floor(np.minimum(pixels, np.array(fields.shape[1::-1]) - 1.000001)).astype(np.int64)
    (right, down), (column, row) = (pixels - first).T[..., None], first.T
    upper = fields[row, column] * (1 - right) + fields[row, column + 1] * right
    lower = fields[row + 1, column] * (1 - right) + fields[row + 1, column + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)


def _window(pixels: Array, shape: tuple[int, ...], fade: float) -> tuple[Array, Array]:
    """Return weights of samples, falling to 0 at the picture's border, and their slopes."""
    last = np.array([shape[1] - 1.0, shape[0] - 1.0])
    room = np.minimum(pixels, last - pixels) / fade
    weight = np.clip(room, 0.0, 1.0)
    slope = np.where((room > 0) & (room < 1), np.where(pixels < last / 2, 1.0, -1.0) / fade, 0.0)
    return weight.prod(axis=-1), slope * weight[..., ::-1]


# The verdict


def _rivals(fits: list[tuple[Array, float]], level: _Level) -> Iterator[str]:
    """Yield a warning for the best other placement that is nearly as good."""
    best, most = fits[0]
    for matrix, common in fits[1:]:
        distance = level.apart(best, matrix)
        if distance > _FAR and common > _RIVAL * most:
            yield (
                f"Another placement, {distance:.0f} infrared pixels away, fits nearly as well, "
                "points or dots would decide."
            )
            return


def _unsure(found: Registration, raster: Raster) -> Iterator[str]:
    typical = found.uncertainty(raster)[0] / raster.spacing
    if typical >= _UNSURE:
        yield (
            f"The standard uncertainty of a position is {typical:.2g} infrared pixels in the "
            "median: the images have too little in common."
        )


def _sandwich(level: _Level, matrix: Array, basis: Array) -> tuple[Array, bool]:
    """Return the covariance of the parameters, and whether there is no optimum."""
    count, step = basis.shape[1], 0.25

    def slope(parameters: Array) -> Array:
        moved = _moved(matrix, basis, parameters)
        return np.asarray(_common_edges(level, moved, basis)[1].sum(axis=0))

    curve = np.array([(slope(step * e) - slope(-step * e)) / (2 * step) for e in np.eye(count)])
    values, vectors = np.linalg.eigh(-(curve + curve.T) / 2)
    flat = not values.min() > _FLAT * values.max()
    inverse = vectors / np.maximum(values, _FLAT * max(values.max(), 1e-12)) @ vectors.T
    _, slopes, here = _common_edges(level, matrix, basis)
    _, blocks = np.unique(level.blocks[level.sharp][here], return_inverse=True)
    used = max(int(blocks.max()) + 1, count + 1)
    sums = np.stack([np.bincount(blocks, part, used) for part in slopes.T], axis=1)
    scattered = inverse @ (sums.T @ sums) @ inverse * used / (used - count)
    return scattered + _SYSTEMATIC**2 * np.eye(count), flat
