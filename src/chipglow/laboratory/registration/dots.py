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
from chipglow.quantities import TINY, Array, Brief
from chipglow.scene import Raster
from chipglow.text import Notes

FEWEST_DOTS: Final = 6
"""Fewest dots of a target: twice those that an affine map needs."""

_SMALLEST_SCALE: Final = 1.0
"""Smallest standard deviation in pixels of the Laplacian of Gaussian that finds dots. A disc gives
its strongest response at its radius over √2: dots of 1.4 pixels."""

_LARGEST_SCALE: Final = 1 / 12
"""Largest such standard deviation as a fraction of the image's shorter side: dots of a quarter of
it across."""

_SCALE_RATIO: Final = 1.25
"""Ratio of successive standard deviations, below the ratio of sizes that count as equal."""

_MAX_EXTREMA: Final = 600
"""Maximum number of extrema examined, strongest first; limits the time for noisy images."""

_MIN_ROUNDNESS: Final = 0.7
"""Smallest roundness of a dot: 1 for a circle, 0 for an edge; 0.7 where the curvatures are 1 to
3.4."""

_SIZE_RATIO: Final = 1.6
"""Largest ratio of the sizes of a target's dots, which differ by perspective alone."""

_STRENGTH_RATIO: Final = 2.5
"""Largest ratio of the strengths of a target's dots, for uneven heat or light."""

_WINDOW_SCALES: Final = 2.5
"""Radius of the window in which a disc is fitted, in standard deviations of its extremum: 1.8 radii
of the disc."""

_MIN_WINDOW: Final = 3.0
"""Smallest radius of the window in pixels: 29 pixels for the 8 parameters of a disc."""

_FEWEST_PIXELS: Final = 16
"""Fewest known pixels in the window of a disc: two for each of its 8 parameters."""

_MAX_UNCERTAINTY: Final = 0.2
"""Largest standard uncertainty of a middle, in standard deviations of its extremum; otherwise it is
not taken for a disc."""

_MAX_SCATTER: Final = 3.0
"""Scatter of the dots over what their uncertainty explains, from which the map is doubted."""

_COMMON_ERROR: Final = 0.02
"""Standard uncertainty in infrared pixels of the error that all dots have in common; see
`fit_dots`."""

_BORDER_RADII: Final = 2.0
"""Distance from the image's border, in radii of the dots, at which a dot is surely found: its
window, of 1.8 radii, is within the image."""

_MAX_REFITS: Final = 12
"""Most repetitions of the fits without the neighbours' brightness."""

_SETTLED_MOVE: Final = 0.2
"""Move of a middle, in its standard uncertainties, below which the fits are not repeated."""

_FIT_TOLERANCE: Final = 1e-6
"""Relative change of the sum of squares at which a fit of a disc ends."""

_CORRELATION_LENGTH: Final = 8
"""Distance in pixels from which residuals count as independent of each other."""

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
        Arrangement(dots[0].pixels, infrared.shape, _BORDER_RADII * dots[0].radius),
        Arrangement(dots[1].pixels, visible.shape, _BORDER_RADII * dots[1].radius),
    )
    columns, rows = dots[0].pixels[first].T
    positions = np.stack(
        [raster.x[0] + columns * raster.spacing, raster.y[0] - rows * raster.spacing], axis=1
    )
    fit = fit_points(positions, dots[1].pixels[second], model, picked=False)
    scale = raster.spacing * np.sqrt(abs(np.linalg.det(fit.registration.jacobian(positions))))
    variance = (scale * dots[0].uncertainty[first]) ** 2
    expected = float(np.sqrt((variance + dots[1].uncertainty[second] ** 2).mean()))
    if fit.scatter >= _MAX_SCATTER * expected:
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
    count = int(np.log(min(filled.shape) * _LARGEST_SCALE / _SMALLEST_SCALE) / np.log(_SCALE_RATIO))
    sizes = np.asarray(_SMALLEST_SCALE * _SCALE_RATIO ** np.arange(max(count, 1) + 1))
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
    strongest = np.flatnonzero(
        (room > _WINDOW_SCALES * size) & (level > 0) & (level < len(sizes) - 1)
    )
    strongest = strongest[np.argsort(found[strongest])[::-1][:_MAX_EXTREMA]]
    blobs = np.stack([column, row, size, found], axis=1)[strongest]
    return _apart(blobs[_roundness(image, blobs) > _MIN_ROUNDNESS])


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
        found[here] = (xx * yy - xy**2) / np.maximum(((xx + yy) / 2) ** 2, TINY)
    return found


def _weight(blobs: Array) -> float:
    """Return the weight of blobs: many small ones of noise have less than some of dots."""
    return float((blobs[:, 3] ** 2 * blobs[:, 2]).sum())


def _alike(blobs: Array) -> Array:
    """Return the group of like size and strength with the largest weight."""
    best = blobs[:0]
    for size, strength in blobs[:, 2:].tolist():
        alike = np.abs(np.log(blobs[:, 2] / size)) < np.log(_SIZE_RATIO)
        alike &= np.abs(np.log(blobs[:, 3] / strength)) < np.log(_STRENGTH_RATIO)
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
    for _ in range(_MAX_REFITS):
        rest = image.copy()
        for disc in discs:
            reach = disc.radius + 3 * disc.softness  # erfc(3) = 2e-5 of the contrast is left
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
    return len(before) == len(discs) and max(moves, default=0.0) < _SETTLED_MOVE


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
    return [d for d in discs if likely / _SIZE_RATIO < d.radius < _SIZE_RATIO * likely]


def _disc(
    image: Array, known: NDArray[np.bool_], blob: Sequence[float], own: _Disc | None = None
) -> _Disc | None:
    """Fit the disc near a blob; its own brightness, if given, was taken from the image."""
    column, row, size = blob
    reach = max(_WINDOW_SCALES * size, _MIN_WINDOW)
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
    # A disc gives its extremum at a radius of √2 sizes; its softness starts at half of this.
    begin = [0.0, 0.0, 1.4 * size, 0.7 * size, contrast, ground, 0.0, 0.0]
    if own is not None:
        begin[2:5] = own.radius, own.softness, own.contrast / scale
    # Brightness is in units of its range in the window: no disc has a contrast of 20.
    upper = [reach / 2, reach / 2, 2 * reach, 2 * reach, 20.0, np.inf, 1 / reach, 1 / reach]
    lower = [-b for b in upper]
    lower[2] = lower[3] = 0.05 * size  # a positive radius and softness
    begin = np.clip(begin, lower, upper).tolist()
    fit = least_squares(residual, begin, bounds=(lower, upper), x_scale="jac", ftol=_FIT_TOLERANCE)
    variance = float(fit.fun @ fit.fun) / (target.size - len(begin))
    spread = np.linalg.pinv(fit.jac.T @ fit.jac)[:2, :2]
    unsure = float(np.sqrt(variance * np.trace(spread) / 2))
    if not 0 < unsure < _MAX_UNCERTAINTY * size:
        return None
    rest = np.zeros(used.shape)
    rest[used] = fit.fun
    right, down, radius, softness, height = fit.x[:5].tolist()
    return _Disc(column + right, row + down, unsure, radius, softness, scale * height, size, rest)


def _correlation(discs: list[_Disc]) -> float:
    """Return the factor on the uncertainty by correlated residuals (Newey and West)."""
    weights = np.bartlett(2 * _CORRELATION_LENGTH + 1)
    kernel = np.outer(weights, weights)
    sums = sum(
        float((d.residual * convolve(d.residual, kernel, mode="constant")).sum()) for d in discs
    )
    squares = sum(float((d.residual**2).sum()) for d in discs)
    return float(np.sqrt(max(sums / max(squares, TINY), 1.0)))


def _systematic(found: Registration, raster: Raster) -> Array:
    """Return the covariance of shift, turn and scale that all dots have wrong in common."""
    left, right, bottom, top = raster.extent
    middle = np.array([(left + right) / 2, (bottom + top) / 2])
    pixels = _COMMON_ERROR * raster.spacing * np.sqrt(abs(np.linalg.det(found.jacobian(middle))))
    elements = np.eye(3)
    elements[:2] /= np.hypot(right - left, top - bottom) / 2
    elements[2, :2] = -elements[[0, 1], [0, 1]] * middle
    covariance = np.zeros((9, 9))
    for row in (slice(0, 3), slice(3, 6)):
        covariance[row, row] = pixels**2 * elements @ elements.T
    return covariance
