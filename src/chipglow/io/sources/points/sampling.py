"""Fields of scattered points, for example from SPH or the material point method, on a raster.

A sample is the mean of the first-order expansions of the points around it, so linear fields are
exact, on the free surface too. Weights are quadratic B-splines: values reach 1.1 spacings from a
point, gradients 2, and the filled fraction, whose half is the surface, is smoothed twice as wide.
Where points lie at random all widths are twice as large, or the area would have holes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy
from numba import njit
from numpy.typing import NDArray

from chipglow.quantities import TINY, Brief
from chipglow.scene.frame import Material
from chipglow.scene.raster import Raster

_SMOOTHING: Final = 1.4
"""Width of the smooth kernel in spacings of the points."""

_SHARPNESS: Final = 0.75
"""Width of the sharp kernel, which weights values, in spacings of the points."""

_REACH: Final = 2.0
"""Distance in spacings up to which neighbours determine a gradient."""

_NEIGHBOURS: Final = 12
"""Neighbours of a point that are searched, for each layer of points."""

_MOST_NEIGHBOURS: Final = 48
"""Most neighbours of a point, of four layers: limits time and memory."""

_BLOCK_POINTS: Final = 100_000
"""Points that are searched at once."""

_FLAT: Final = 0.02
"""Ratio of the second moments of neighbours across and along a line below which they lie on it."""

_FAINT: Final = 1e-9
"""Weight of the smooth kernel relative to the sharp one: it counts only where that is zero."""

_FILLED: Final = 0.5
"""Filled fraction of a sample at the surface."""

_ORDER, _DISORDER, _COARSEST = 0.38, 0.46, 2.2
"""Disorder from which and up to which kernels widen (see `_coarseness`), and the largest factor."""

_SHELLS: Final[Mapping[int, tuple[int, float]]] = {2: (12, 2.0), 3: (26, 3.0**0.5)}
"""By dimension: neighbours of a point of a lattice up to a radius, and the radius in spacings."""


@dataclass(frozen=True, repr=False)
class Cloud(Brief):
    """Points at one time."""

    places: NDArray[np.float64]
    """Where they are in m, shape (points, 2)."""
    values: NDArray[np.float64]
    """Fields at the points, shape (points, fields)."""
    material: NDArray[np.uint8]
    """`Material` of each point, shape (points,)."""
    spacing: NDArray[np.float64]
    """Distance of each point from its neighbours in the undeformed state in m, shape (points,)."""
    area: NDArray[np.float64]
    """Area of each point in m^2: the square of the spacing, or less if several points lie behind
    one another, shape (points,)."""

    def __post_init__(self) -> None:
        if not np.isfinite(self.places).all():
            raise ValueError("places: expected finite numbers")
        for name in ("spacing", "area"):
            numbers = getattr(self, name)
            if not (np.isfinite(numbers) & (numbers > 0)).all():
                raise ValueError(f"{name}: expected more than 0")


def neighbour_distance(places: NDArray[np.float64]) -> float:
    """Return the typical distance of neighbours among places in m, shape (points, 2 or 3).

    The median distance of the nearest 4 (6) neighbours, or of the 12th (26th) over its value on a
    lattice where points are in disorder; NaN for fewer than 2 points.
    """
    nearest = 2 * places.shape[1]
    shell, radius = _SHELLS[places.shape[1]]
    count = min(shell, len(places) - 1)
    if count < 1:
        return float("nan")
    distances, _ = scipy.spatial.KDTree(places).query(places, count + 1)
    next_ones = float(np.median(distances[:, 1 : nearest + 1]))
    if count < shell:
        return next_ones
    return max(next_ones, float(np.median(distances[:, shell])) / radius)


def sample_cloud(cloud: Cloud, raster: Raster) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return fields (fields, rows, columns), NaN in voids, and the material of most of each sample.

    Samples coarser than the points are means. Values stay within the range of the points' own.
    """
    fields = cloud.values.shape[1]
    values = np.full((fields, *raster.shape), np.nan, np.float32)
    filled, most = np.zeros(raster.shape), np.zeros(raster.shape)
    material = np.zeros(raster.shape, np.uint8)
    for kind in (Material.WORKPIECE, Material.TOOL):
        own = _near(cloud, raster) & (cloud.material == kind)
        if not own.any():
            continue
        fraction, found = _scatter_kind(cloud, own, raster)
        filled += fraction
        more = fraction > most
        most[more] = fraction[more]
        material[more] = kind
        values[:, more] = found[:, more]
    void = filled <= _FILLED
    material[void] = Material.VOID
    values[:, void] = np.nan
    return values, material


def _near(cloud: Cloud, raster: Raster) -> NDArray[np.bool_]:
    """Points that can have a part in a sample, and their neighbours."""
    # The widest weights reach 1.5 × 1.4 × 2.2 = 4.6 spacings.
    margin = 5.0 * np.maximum(cloud.spacing, raster.spacing)
    left, right, bottom, top = raster.extent
    x, y = cloud.places.T
    near: NDArray[np.bool_] = (x > left - margin) & (x < right + margin)
    near &= (y > bottom - margin) & (y < top + margin)
    return near


def _scatter_kind(
    cloud: Cloud, own: NDArray[np.bool_], raster: Raster
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    places, values = cloud.places[own], cloud.values[own]
    spacing, area = cloud.spacing[own], cloud.area[own]
    layers = max(1, round(float(np.median(spacing**2 / area))))
    neighbours, nearest = _neighbours(places, layers)
    gradients = np.zeros((*values.shape, 2))
    _gradients(neighbours, places, values, spacing, gradients)
    rows, columns = raster.index(places)
    gradients *= raster.spacing
    totals = np.zeros((*raster.shape, values.shape[1]))
    fraction, weight = np.zeros(raster.shape), np.zeros(raster.shape)
    width = spacing / raster.spacing
    if layers == 1 and neighbours.shape[1] > 0:
        width *= _coarseness(neighbours, nearest)
    _scatter(
        columns, rows, width, area / raster.spacing**2, values, gradients, totals, weight, fraction
    )
    limits = values.min(axis=0)[:, None, None], values.max(axis=0)[:, None, None]
    with np.errstate(invalid="ignore"):
        means = (totals / weight[..., None]).transpose(2, 0, 1)
    return fraction, np.clip(means, *limits).astype(np.float32)


def _neighbours(
    places: NDArray[np.float64], layers: int
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return indices of the nearest points, (points, neighbours), and the smallest distance."""
    # Where points lie behind one another, more of the nearest are in one place.
    count = min(_NEIGHBOURS * layers, _MOST_NEIGHBOURS, len(places) - 1)
    neighbours = np.empty((len(places), count), np.int32)
    nearest = np.zeros(len(places))
    if count < 1:
        return neighbours, nearest
    tree = scipy.spatial.KDTree(places)
    for first in range(0, len(places), _BLOCK_POINTS):
        part = slice(first, first + _BLOCK_POINTS)
        distances, found = tree.query(places[part], count + 1)
        neighbours[part], nearest[part] = found[:, 1:], distances[:, 1]
    return neighbours, nearest


def _coarseness(neighbours: NDArray[np.int32], nearest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the factor on the width of the weights by the disorder around each point.

    It is how much the distance of the nearest point varies among the neighbours, by its mean: 0 on
    a lattice, 0.52 for points at random.
    """
    around = nearest[neighbours]
    mean = np.maximum(around.mean(axis=1), TINY)
    disorder = (around.std(axis=1) / mean)[neighbours].mean(axis=1)
    wider: NDArray[np.float64] = np.interp(disorder, (_ORDER, _DISORDER), (1.0, _COARSEST))
    return wider


@njit(cache=True)
def _gradients(neighbours, places, values, spacing, result):  # type: ignore[no-untyped-def]
    """Least squares over the neighbours; nothing along a direction in which there are none."""
    fields = values.shape[1]
    slope = np.empty((fields, 2))
    for p in range(neighbours.shape[0]):
        xx, xy, yy = 0.0, 0.0, 0.0
        slope[:] = 0.0
        for q in neighbours[p]:
            dx = (places[q, 0] - places[p, 0]) / spacing[p]
            dy = (places[q, 1] - places[p, 1]) / spacing[p]
            distance = np.sqrt(dx * dx + dy * dy)
            if distance >= _REACH:
                continue
            w = (1.0 - distance / _REACH) ** 2
            xx += w * dx * dx
            xy += w * dx * dy
            yy += w * dy * dy
            for f in range(fields):
                difference = w * (values[q, f] - values[p, f])
                slope[f, 0] += difference * dx
                slope[f, 1] += difference * dy
        middle, half = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
        large, small = middle + half, middle - half
        if large <= 0.0:
            continue
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
        ex, ey = np.cos(angle), np.sin(angle)
        for f in range(fields):
            along = (slope[f, 0] * ex + slope[f, 1] * ey) / large
            across = 0.0
            if small > _FLAT * large:
                across = (slope[f, 1] * ex - slope[f, 0] * ey) / small
            result[p, f, 0] = (along * ex - across * ey) / spacing[p]
            result[p, f, 1] = (along * ey + across * ex) / spacing[p]


@njit(cache=True)
def _bell(distance):  # type: ignore[no-untyped-def]
    """Return the quadratic B-spline at a distance in its widths; it is zero beyond 1.5."""
    u = abs(distance)
    if u < 0.5:
        return 0.75 - u * u
    return 0.5 * (1.5 - u) ** 2 if u < 1.5 else 0.0


@njit(cache=True)
def _scatter(columns, rows, width, area, values, gradients, totals, weight, fraction):  # type: ignore[no-untyped-def]
    """Add the expansions of points to the samples around; lengths in samples, rows downward."""
    fields = values.shape[1]
    for p in range(columns.size):
        narrow, wide = max(_SHARPNESS * width[p], 1.0), max(_SMOOTHING * width[p], 1.0)
        reach = 1.5 * wide  # the support of `_bell`
        first_row = max(int(np.ceil(rows[p] - reach)), 0)
        last_row = min(int(np.floor(rows[p] + reach)), fraction.shape[0] - 1)
        first_column = max(int(np.ceil(columns[p] - reach)), 0)
        last_column = min(int(np.floor(columns[p] + reach)), fraction.shape[1] - 1)
        for row in range(first_row, last_row + 1):
            down = row - rows[p]
            wide_y, narrow_y = _bell(down / wide), _bell(down / narrow)
            for column in range(first_column, last_column + 1):
                right = column - columns[p]
                smooth = wide_y * _bell(right / wide)
                fraction[row, column] += area[p] / (wide * wide) * smooth
                # Where no point is near but the area is filled, farther points determine the value.
                w = area[p] * (narrow_y * _bell(right / narrow) + _FAINT * smooth)
                weight[row, column] += w
                for f in range(fields):
                    slope = gradients[p, f, 0] * right - gradients[p, f, 1] * down
                    totals[row, column, f] += w * (values[p, f] + slope)
