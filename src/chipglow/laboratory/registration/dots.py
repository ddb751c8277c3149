"""Dots of a target that both cameras see, and the registration that they give."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve, gaussian_filter, gaussian_laplace, maximum_filter
from scipy.optimize import least_squares
from scipy.special import erfc

from chipglow.laboratory.registration.dot_matching import Arrangement, match_dots
from chipglow.laboratory.registration.registration import Model, PointFit, Registration, fit_points
from chipglow.quantities import Array, Brief
from chipglow.scene import Raster
from chipglow.text import Notes

FEWEST_DOTS: Final = 6

_LEAST_SIZE: Final = 1.0
_GREATEST_SIZE: Final = 1 / 12
_NEXT_SIZE: Final = 1.25
_MOST: Final = 600
_ROUND: Final = 0.7
_ALIKE_SIZE: Final = 1.6
_ALIKE_STRENGTH: Final = 2.5
_WINDOW: Final = 2.5
_LEAST_WINDOW: Final = 3.0
_FEWEST_PIXELS: Final = 16
_WORST: Final = 0.2
_SCATTER: Final = 3.0
_SYSTEMATIC: Final = 0.02
_ROOM: Final = 2.0
_AGAIN: Final = 12
_SETTLED: Final = 0.2
_ENOUGH: Final = 1e-6
_ALIKE_PIXELS: Final = 8
_NOT_MIRRORED: Final = (
    "The visible picture is not mirrored, is turned by up to 30 degrees, and shows half to twice "
    "the infrared image's width; otherwise give points."
)


@dataclass(frozen=True, repr=False)
class Dots(Brief):
    """Dots of one size in an image."""

    pixels: Array
    """Column and row of their middles, 0 in the middle of the upper left pixel, shape (n, 2)."""
    uncertainty: Array
    """Standard uncertainty of a column or a row in pixels, shape (n,)."""
    radius: float
    """Radius of most of them, in pixels."""
    bright: bool
    """Whether they are brighter than their surroundings."""


@dataclass(frozen=True)
class DotFit:
    """A registration from dots that both cameras saw."""

    points: PointFit
    """The registration, with the dots that were seen in both and their residuals."""
    infrared: Dots
    visible: Dots

    @property
    def registration(self) -> Registration:
        """The map."""
        return self.points.registration


def fit_dots(
    infrared: NDArray[np.floating],
    raster: Raster,
    visible: NDArray[np.generic],
    model: Model = "affine",
) -> DotFit:
    """Register two images by a target with dots, such as a heated plate with holes.

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
        If an image has fewer than six dots, or the arrangements do not match.

    Notes
    -----
    The middles of the dots that match by their arrangement are the points of `fit_points`. It is a
    warning if they scatter more than three times what their uncertainty explains. A fiftieth of a
    pixel is added for the shift, and for each slope at the image's corner, for what all dots have
    in common.
    """
    dots = find_dots(infrared, "infrared image"), find_dots(visible, "visible picture")
    (first, second), warnings = match_dots(
        Arrangement(dots[0].pixels, infrared.shape, _ROOM * dots[0].radius),
        Arrangement(dots[1].pixels, visible.shape, _ROOM * dots[1].radius),
    )
    columns, rows = dots[0].pixels[first].T
    positions = np.stack(
        [raster.x[0] + columns * raster.spacing, raster.y[0] - rows * raster.spacing], axis=1
    )
    fit = fit_points(positions, dots[1].pixels[second], model, picked=False)
    scale = raster.spacing * np.sqrt(abs(np.linalg.det(fit.registration.jacobian(positions))))
    variance = (scale * dots[0].uncertainty[first]) ** 2
    expected = float(np.sqrt((variance + dots[1].uncertainty[second] ** 2).mean()))
    if fit.scatter >= _SCATTER * expected:
        warnings += (
            f"The dots scatter by {fit.scatter:.2g} visible pixels where their own uncertainty "
            f"explains {expected:.2g}: the map is of another kind than the model.",
        )
    notes = fit.registration.notes + Notes([_NOT_MIRRORED], list(warnings))
    covariance = fit.registration.covariance + _systematic(fit.registration, raster)
    found = replace(fit.registration, covariance=covariance, method="dots", notes=notes)
    return DotFit(replace(fit, registration=found), *dots)


def find_dots(image: NDArray[np.generic], name: str = "image") -> Dots:
    """Find the dots of a target, brighter or darker than their surroundings.

    Round extrema of the normalised Laplacian (Lindeberg, Int. J. Comput. Vision 30 (1998) 79) of
    like size, contrast and sign; each is fitted by a disc with a soft edge.
    """
    known = np.isfinite(np.asarray(image, np.float64))
    values = np.asarray(image, np.float64)
    if not known.any() or not np.ptp(values[known]) > 0:
        raise ValueError(f"{name}: has no contrast, expected a target with dots")
    filled = np.where(known, values, np.median(values[known]))
    count = int(np.log(min(filled.shape) * _GREATEST_SIZE / _LEAST_SIZE) / np.log(_NEXT_SIZE))
    sizes = np.asarray(_LEAST_SIZE * _NEXT_SIZE ** np.arange(max(count, 1) + 1))
    strength = np.stack([size**2 * gaussian_laplace(filled, size) for size in sizes])
    groups = [_alike(_blobs(filled, sizes, sign * strength)) for sign in (-1.0, 1.0)]
    bright = _weight(groups[0]) >= _weight(groups[1])
    discs = _discs(filled, known, groups[0 if bright else 1], bright)
    if len(discs) < FEWEST_DOTS:
        raise ValueError(
            f"{name}: {len(discs)} dots are found, expected a target with {FEWEST_DOTS} or more"
        )
    middles = np.array([(disc.column, disc.row) for disc in discs])
    uncertainty = np.array([disc.unsure for disc in discs]) * _correlation(discs)
    return Dots(middles, uncertainty, float(np.median([disc.radius for disc in discs])), bright)


def _blobs(image: Array, sizes: Array, strength: Array) -> Array:
    """Return column, row, size and strength of the strongest round extrema, shape (n, 4)."""
    level, row, column = np.nonzero((strength == maximum_filter(strength, 3)) & (strength > 0))
    size, found = sizes[level], strength[level, row, column]
    room = np.minimum.reduce(
        [column, row, image.shape[1] - 1 - column, image.shape[0] - 1 - row], axis=0
    )
    strongest = np.flatnonzero((room > _WINDOW * size) & (level > 0) & (level < len(sizes) - 1))
    strongest = strongest[np.argsort(found[strongest])[::-1][:_MOST]]
    blobs = np.stack([column, row, size, found], axis=1)[strongest]
    return _apart(blobs[_roundness(image, blobs) > _ROUND])


def _apart(blobs: Array) -> Array:
    """Return the blobs in order of strength, without those that lie on a stronger one."""
    left, kept = blobs, []
    while len(left):
        kept.append(left[0])
        left = left[np.hypot(*(left[:, :2] - left[0, :2]).T) > left[0, 2]]
    return np.array(kept).reshape(-1, 4)


def _roundness(image: Array, blobs: Array) -> Array:
    """Return the determinant of the Hessian over that of a circle of the same trace."""
    found = np.zeros(len(blobs))
    for size in np.unique(blobs[:, 2]):
        here = blobs[:, 2] == size
        place = tuple(blobs[here, :2].astype(int).T[::-1])
        xx, yy, xy = (
            gaussian_filter(image, size, order=order)[place] for order in ((0, 2), (2, 0), (1, 1))
        )
        found[here] = (xx * yy - xy**2) / np.maximum(((xx + yy) / 2) ** 2, 1e-300)
    return found


def _weight(blobs: Array) -> float:
    """Return the weight of blobs: many small ones of noise have less than some of dots."""
    return float((blobs[:, 3] ** 2 * blobs[:, 2]).sum())


def _alike(blobs: Array) -> Array:
    """Return the group of like size and strength with the largest weight."""
    best = blobs[:0]
    for size, strength in blobs[:, 2:].tolist():
        alike = np.abs(np.log(blobs[:, 2] / size)) < np.log(_ALIKE_SIZE)
        alike &= np.abs(np.log(blobs[:, 3] / strength)) < np.log(_ALIKE_STRENGTH)
        if alike.sum() >= FEWEST_DOTS and _weight(blobs[alike]) > _weight(best):
            best = blobs[alike]
    return best


@dataclass(frozen=True)
class _Disc:
    """A disc with a soft edge, and its residuals."""

    column: float
    row: float
    unsure: float
    radius: float
    softness: float
    contrast: float
    size: float
    residual: Array

    def brightness(self, columns: Array, rows: Array) -> Array:
        """Return the brightness over that of the ground."""
        distance = np.hypot(columns - self.column, rows - self.row)
        return np.asarray(self.contrast * erfc((distance - self.radius) / self.softness) / 2)


def _discs(image: Array, known: NDArray[np.bool_], blobs: Array, bright: bool) -> list[_Disc]:
    """Return discs of like radius at blobs, fitted again without their neighbours' skirts."""
    discs = _like([_disc(image, known, blob) for blob in blobs[:, :3].tolist()], bright)
    for _ in range(_AGAIN):
        rest = image.copy()
        for disc in discs:
            reach = disc.radius + 3 * disc.softness
            part, columns, rows = _window(image.shape, disc.column, disc.row, reach)
            rest[part] -= disc.brightness(columns, rows)
        again = [_disc(rest, known, (d.column, d.row, d.size), d) for d in discs]
        before, discs = discs, _like(again, bright)
        if _settled(before, discs):
            break
    return discs


def _settled(before: list[_Disc], discs: list[_Disc]) -> bool:
    """Return whether no middle moved by much of its uncertainty."""
    moves = [
        max(abs(new.column - old.column), abs(new.row - old.row)) / new.unsure
        for old, new in zip(before, discs, strict=False)
    ]
    return len(before) == len(discs) and max(moves, default=0.0) < _SETTLED


def _window(
    shape: tuple[int, ...], column: float, row: float, reach: float
) -> tuple[tuple[slice, slice], Array, Array]:
    """Return the part of an image round a place, and its columns and rows."""
    part = (
        slice(max(round(row - reach), 0), min(round(row + reach) + 1, shape[0])),
        slice(max(round(column - reach), 0), min(round(column + reach) + 1, shape[1])),
    )
    rows, columns = np.mgrid[part].astype(np.float64)
    return part, columns, rows


def _like(found: list[_Disc | None], bright: bool) -> list[_Disc]:
    """Return the discs whose radius is like the others' and whose contrast has the right sign."""
    discs = [disc for disc in found if disc is not None and (disc.contrast > 0) == bright]
    likely = float(np.median([disc.radius for disc in discs])) if discs else 0.0
    return [d for d in discs if likely / _ALIKE_SIZE < d.radius < _ALIKE_SIZE * likely]


def _disc(
    image: Array, known: NDArray[np.bool_], blob: Sequence[float], own: _Disc | None = None
) -> _Disc | None:
    """Fit the disc near a blob; its own brightness, if given, was taken from the image."""
    column, row, size = blob
    reach = max(_WINDOW * size, _LEAST_WINDOW)
    part, columns, rows = _window(image.shape, column, row, reach)
    used = (np.hypot(columns - column, rows - row) <= reach) & known[part]
    values = image[part] if own is None else image[part] + own.brightness(columns, rows)
    x, y = columns[used] - column, rows[used] - row
    middle = np.hypot(x, y) < size
    if used.sum() < _FEWEST_PIXELS or not middle.any() or not np.ptp(values[used]) > 0:
        return None
    scale = float(np.ptp(values[used]))
    target = values[used] / scale

    def residual(p: Array) -> Array:
        edge = (np.hypot(x - p[0], y - p[1]) - p[2]) / p[3]
        light = 1.0 + p[6] * x + p[7] * y
        return np.asarray((p[4] * erfc(edge) / 2 + p[5]) * light - target)

    ground = float(target[~middle].mean())
    contrast = float(target[middle].mean()) - ground
    begin = [0.0, 0.0, 1.4 * size, 0.7 * size, contrast, ground, 0.0, 0.0]
    if own is not None:
        begin[2:5] = own.radius, own.softness, own.contrast / scale
    upper = [reach / 2, reach / 2, 2 * reach, 2 * reach, 20.0, np.inf, 1 / reach, 1 / reach]
    lower = [-b for b in upper]
    lower[2] = lower[3] = 0.05 * size
    begin = np.clip(begin, lower, upper).tolist()
    fit = least_squares(residual, begin, bounds=(lower, upper), x_scale="jac", ftol=_ENOUGH)
    variance = float(fit.fun @ fit.fun) / (target.size - len(begin))
    spread = np.linalg.pinv(fit.jac.T @ fit.jac)[:2, :2]
    unsure = float(np.sqrt(variance * np.trace(spread) / 2))
    if not 0 < unsure < _WORST * size:
        return None
    rest = np.zeros(used.shape)
    rest[used] = fit.fun
    right, down, radius, softness, height = fit.x[:5].tolist()
    return _Disc(column + right, row + down, unsure, radius, softness, scale * height, size, rest)


def _correlation(discs: list[_Disc]) -> float:
    """Return the factor on the uncertainty by correlated residuals (Newey and West)."""
    weights = np.bartlett(2 * _ALIKE_PIXELS + 1)
    kernel = np.outer(weights, weights)
    sums = sum(
        float((d.residual * convolve(d.residual, kernel, mode="constant")).sum()) for d in discs
    )
    squares = sum(float((d.residual**2).sum()) for d in discs)
    return float(np.sqrt(max(sums / max(squares, 1e-300), 1.0)))


def _systematic(found: Registration, raster: Raster) -> Array:
    """Return the covariance of shift, turn and scale that all dots have wrong in common."""
    left, right, bottom, top = raster.extent
    middle = np.array([(left + right) / 2, (bottom + top) / 2])
    pixels = _SYSTEMATIC * raster.spacing * np.sqrt(abs(np.linalg.det(found.jacobian(middle))))
    elements = np.eye(3)
    elements[:2] /= np.hypot(right - left, top - bottom) / 2
    elements[2, :2] = -elements[[0, 1], [0, 1]] * middle
    covariance = np.zeros((9, 9))
    for row in (slice(0, 3), slice(3, 6)):
        covariance[row, row] = pixels**2 * elements @ elements.T
    return covariance
