"""The prior: the logarithm of radiance is smooth within a zone, and free across outlines."""

from dataclasses import dataclass
from math import sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import gaussian_filter

from chipglow.camera.optics.psf import FWHM_PER_SIGMA
from chipglow.correction.cells import Parts
from chipglow.quantities import Array

_NEIGHBOURHOOD: Final = 5.0
"""Full width at half maximum, in cells, of the window over which the roughness is averaged.

About two pixels: wide enough for 25 curvatures in each mean, narrow enough to tell a shear band of
a few pixels from its surroundings.
"""

_LEAST_VARIANCE: Final = 1e-12
"""Smallest variance of a curvature: 1e-6 of the radiance from cell to cell, far below noise."""


_LEAST_WEIGHT: Final = 1e-3
"""Smallest weight of a local mean: the weight of a value about six cells away."""


_FAR_ABOVE: Final = 3.0
"""Squares this many times their usual mean are large: 8 % of those of a normal distribution are."""


@dataclass(frozen=True, eq=False)
class Curvature:
    """Second differences of the parts' values within zones: along rows, columns and mixed.

    The sum of their squares is the discrete bending energy, which does not depend on the direction
    of the axes.
    """

    matrix: Any
    """Sparse array (difference, part)."""
    part: NDArray[np.intp]
    """The part in the middle of each difference."""

    @classmethod
    def of(cls, parts: Parts) -> "Curvature":
        rows: list[tuple[NDArray[np.intp], Array]] = []
        for index in parts.index:
            for lines in (index, index.T):
                rows.append(
                    _known(np.stack([lines[1:-1], lines[:-2], lines[2:]]), (-2.0, 1.0, 1.0))
                )
            corners = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
            mixed = sqrt(2.0)
            rows.append(_known(np.stack(corners), (mixed, -mixed, -mixed, mixed)))
        blocks = [_sparse(members, weights, parts.size) for members, weights in rows]
        middle = np.concatenate([members[0] for members, _ in rows])
        return cls(sparse.vstack(blocks).tocsr(), middle)

    def variances(self, squares: Array, parts: Parts, measured: NDArray[np.bool_]) -> Array:
        """Return the mean squares around each difference, within its zone.

        In the smoother half of each zone, the median of the zone counts: where there is no detail,
        the data cannot show that there is less than that. It counts too where no part around is
        `measured`: there, squares only repeat the present variances.
        """
        variance = np.empty(self.part.size)
        zones, counted = parts.zone[self.part], measured[self.part].astype(np.float64)
        for zone in range(len(parts.index)):
            own = np.flatnonzero(zones == zone)
            if own.size:
                cell, weights = parts.cell[self.part[own]], counted[own]
                if not weights.any():
                    weights = np.ones(own.size)
                around = local_mean(squares[own], cell, parts.cells.shape, weights)
                median = np.median(around[weights > 0])
                variance[own] = np.maximum(around, median)
        return np.maximum(variance, _LEAST_VARIANCE)

    def robust_variances(self, squares: Array, parts: Parts, usual: float) -> Array:
        """Return variances that are `usual`, and larger where single differences are (Cauchy).

        An outline at a wrong place bends the radiance along all of it, which must count: beside
        outlines, only squares far above the usual ones have a larger variance.
        """
        beside = parts.beside_outline[self.part]
        far = usual * np.maximum(1.0, squares / (_FAR_ABOVE * usual))
        return np.where(beside, far, usual + squares)

    def robust_loss(self, squares: Array, parts: Parts, usual: float) -> float:
        """Return the sum that solutions with `robust_variances` of their own squares minimise."""
        beside = parts.beside_outline[self.part]
        relative = squares / usual
        excess = np.maximum(relative / _FAR_ABOVE, 1.0)
        near = np.minimum(relative, _FAR_ABOVE) + _FAR_ABOVE * np.log(excess)
        return float(np.where(beside, near, np.log1p(relative)).sum()) / 2


def slopes_within(parts: Parts) -> Any:
    """Return the sparse array (difference, part) of differences of neighbours within zones."""
    pairs = [
        np.stack([lines[:-1], lines[1:]]).reshape(2, -1)
        for index in parts.index
        for lines in (index, index.T)
    ]
    members, weights = _known(np.concatenate(pairs, axis=1), (-1.0, 1.0))
    return _sparse(members, weights, parts.size)


def _known(members: NDArray[np.intp], weights: tuple[float, ...]) -> tuple[NDArray[np.intp], Array]:
    """Return the differences whose members all exist, (member, difference), and their weights."""
    members = members.reshape(len(weights), -1)
    return members[:, (members >= 0).all(axis=0)], np.array(weights)


def _sparse(members: NDArray[np.intp], weights: Array, parts: int) -> Any:
    count = members.shape[1]
    rows = np.tile(np.arange(count), len(weights))
    values = np.repeat(weights, count)
    return sparse.csr_array((values, (rows, members.ravel())), shape=(count, parts))


def local_mean(
    values: Array, cell: NDArray[np.intp], shape: tuple[int, int], weights: Array | None = None
) -> Array:
    """Return the weighted mean of values in cells over a window around each; 0 without weights."""
    size = shape[0] * shape[1]
    weights = np.ones(cell.size) if weights is None else weights
    total, count = (
        np.bincount(cell, one, size).reshape(shape) for one in (weights * values, weights)
    )
    width = _NEIGHBOURHOOD / FWHM_PER_SIGMA
    around = [gaussian_filter(one, width, mode="constant") for one in (total, count)]
    mean = np.where(around[1] > _LEAST_WEIGHT, around[0], 0.0) / np.maximum(
        around[1], _LEAST_WEIGHT
    )
    return np.asarray(mean.ravel()[cell])
