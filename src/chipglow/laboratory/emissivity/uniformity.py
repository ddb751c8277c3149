"""Whether an area of an image is uniform but for the noise and the texture of its pixels."""

from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter
from scipy.special import fdtrc

from chipglow.quantities import Array

_LEAST: Final = 25
"""Pixels for a surface of 6 parameters, such as 5 x 5: with fewer, texture hides an edge."""

_LEAST_AROUND: Final = 6
"""Pixels for a plane of 3 parameters, which leave as many pixels."""

_CORRELATED: Final = 3
"""Pixels, along rows and columns, over which texture and blur correlate."""

_WINDOWS: Final = 8
"""Windows of such a reach that an area holds at least, for a sum of its autocorrelation."""

_AROUND: Final = 2
"""Pixels on each side of a single one that show its noise."""

_COUNTED: Final = 0.01
"""Probability of counting the variation of a uniform area as uneven."""

_WARNED: Final = 1e-3
"""Probability of a warning of a uniform area."""

_NO_MATTER: Final = 1e-4
"""Relative standard deviation of the radiance that does not matter; 0.01 K at 600 K."""

_NEGLIGIBLE: Final = 1e-9
"""Relative singular value of a shape that an area does not have."""


@dataclass(frozen=True)
class Uniformity:
    """Variation of the radiance over an area beyond the noise and the texture of its pixels."""

    standard_deviation: float
    """In W/(m² sr); 0 if noise and texture explain all variation (at 1 %)."""
    is_uneven: bool
    """Whether noise and texture do not explain the variation, and it matters."""
    degrees_of_freedom: float = inf
    """Degrees of freedom of the standard deviation."""


def uniformity(mask: NDArray[np.bool_], values: Array) -> Uniformity:
    """Return the uniformity of the pixels of an area.

    Parameters
    ----------
    mask : ndarray of bool
        The area's pixels, shape (y, x).
    values : ndarray
        Their radiance in W/(m² sr), shape (frame, pixel).

    Notes
    -----
    A surface of second order is fitted to the mean of the frames. Its variance over the area,
    minus the part that random residuals cause, is the variance of the uneven radiance. If a
    fraction f up to a half of the area is off by D, as over an edge, the mean is off by f D, and
    the standard deviation is about (f (1 − f))^(1/2) D, which is more.

    Residuals of neighbours correlate, by texture and blur: their variance counts as often as the
    sum of their autocorrelation says. Texture that is coarse for the area counts as uneven. Of
    fewer than 25 pixels all variation counts beyond the noise that the frames show; a single frame
    shows none.
    """
    image = values.mean(axis=0)
    apart, least = image - image.mean(), _NO_MATTER * abs(float(image.mean()))
    if image.size < _LEAST:
        return _of_few(apart, values, least)
    basis = _surfaces(mask, curved=True)
    size = basis.shape[1]
    fitted = basis @ (basis.T @ apart)
    residual = apart - fitted
    alike = _pixels_alike(mask, residual)
    freedom = image.size - 1.0 - size
    by_chance = alike * float(residual @ residual) / freedom
    found = float(fitted @ fitted) / size
    chance = _chance(found, by_chance, (size, freedom))
    if chance > _COUNTED:
        return Uniformity(0.0, False)
    deviation = sqrt(max(found - by_chance, 0.0) * size / image.size)
    return Uniformity(deviation, chance < _WARNED and deviation > least)


def _of_few(apart: Array, values: Array, least: float) -> Uniformity:
    """Return the uniformity of so few pixels that no surface can be fitted to them."""
    frames, pixels = values.shape
    if pixels == 1:
        return Uniformity(0.0, False)
    found, freedom = float(apart.var(ddof=1)), pixels - 1.0
    if frames == 1:
        return Uniformity(sqrt(found), False, freedom)
    noise = float(values.var(axis=0, ddof=1).mean()) / frames
    chance = _chance(found, noise, (freedom, pixels * (frames - 1.0)))
    deviation = sqrt(max(found - noise, 0.0))
    return Uniformity(deviation, chance < _WARNED and deviation > least, freedom)


def _chance(found: float, by_chance: float, freedom: tuple[float, float]) -> float:
    """Return the probability of a larger ratio of two variances."""
    if found == 0:
        return 1.0
    return float(fdtrc(*freedom, found / by_chance)) if by_chance > 0 else 0.0


def _surfaces(mask: NDArray[np.bool_], curved: bool) -> Array:
    """Return orthonormal surfaces over an area, planes and `curved` ones, (pixel, surface)."""
    y, x = (place - place.mean() for place in np.nonzero(mask))
    shapes = [x, y, *((x * x, x * y, y * y) if curved else ())]
    design = np.stack([(one - one.mean()) / max(np.ptp(one), 1.0) for one in shapes], axis=1)
    basis, sizes, _ = np.linalg.svd(design, full_matrices=False)
    # An area of one row has no slope down, and one of two rows no curvature.
    return np.asarray(basis[:, sizes > _NEGLIGIBLE * sizes[0]])


def _pixels_alike(mask: NDArray[np.bool_], residual: Array) -> float:
    """Return the number of pixels that vary as one by texture and blur, 1 or more."""
    square = float(residual @ residual)
    if square == 0:
        return 1.0
    image = np.zeros(mask.shape)
    image[mask] = residual
    reach = min(_CORRELATED, int((sqrt(residual.size / _WINDOWS) - 1) / 2))
    side = 2 * max(reach, 1) + 1
    sums = side**2 * uniform_filter(image, side, mode="constant")
    return max(1.0, float(residual @ sums[mask]) / square)


def noise_around(mask: NDArray[np.bool_], radiance: Array) -> float:
    """Return the noise of a single pixel in W/(m² sr) by the pixels around it, NaN without any.

    It is their standard deviation about a plane, over an edge that of the edge.
    """
    (row,), (column,) = np.nonzero(mask)
    near = np.zeros_like(mask)
    rows, columns = (slice(max(at - _AROUND, 0), at + _AROUND + 1) for at in (row, column))
    near[rows, columns] = np.isfinite(radiance[rows, columns])
    values = radiance[near]
    if values.size < _LEAST_AROUND:
        return nan
    basis = _surfaces(near, curved=False)
    apart = values - values.mean()
    residual = apart - basis @ (basis.T @ apart)
    return sqrt(float(residual @ residual) / (values.size - 1 - basis.shape[1]))
