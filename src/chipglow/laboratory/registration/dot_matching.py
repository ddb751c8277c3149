"""Which dot of one image is which of another: by their arrangement."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from chipglow.quantities import Array

_START_DOTS: Final = 4
"""Infrared dots, those in the middle, from which pairs of neighbours are formed."""

_START_NEIGHBOURS: Final = 3
"""Neighbours of each of them that form a pair with it."""

_VISIBLE_NEIGHBOURS: Final = 8
"""Neighbours of a visible dot that may be the other dot of a pair: those around a dot of a square
grid."""

_WIDTH_RATIOS: Final = (0.5, 2.0)
"""Smallest and largest width of the visible picture over that of the infrared image."""

_MAX_TURN: Final = np.pi / 6
"""Largest turn between the images in rad: a square grid matches itself after 90 degrees."""

_MATCH_DISTANCE: Final = 0.3
"""Distance of matching dots in spacings of the dots; beyond a half the next dot would be nearer."""

_MAX_REFITS: Final = 6
"""Most fits of an affine map to the matches of the map before."""

_MAX_PLACEMENTS: Final = 16
"""Distinct placements, the best ones, that are refined."""

_MAX_HYPOTHESES: Final = 400
"""Similarities, the best ones, that are compared."""

_FEWEST_MATCHES: Final = 6
"""Fewest dots that match: twice those that an affine map needs."""

_CONTRADICTION_COST: Final = 3
"""Matches that a contradiction outweighs: on a grid, a placement that is off by a column loses few
matches and gains contradictions."""

_CONTRADICTIONS_APART: Final = 2
"""Contradictions more than the best placement's from which another one is excluded."""


@dataclass(frozen=True)
class Arrangement:
    """Positions of the dots of an image."""

    pixels: Array
    """Columns and rows, shape (n, 2)."""
    shape: tuple[int, ...]
    margin: float
    """Distance from the image's border, in pixels, at which a dot is surely found."""

    def shows(self, pixels: Array) -> int:
        """Return how many of these places are within the image's margin."""
        last = np.array([self.shape[1] - 1.0, self.shape[0] - 1.0]) - self.margin
        return int(((pixels > self.margin) & (pixels < last)).all(axis=1).sum())


def match_dots(
    first: Arrangement, second: Arrangement
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Return the numbers of dots that are the same, shape (2, n), and why that may be wrong.

    Pairs of neighbours give similarities, which are refined to affine maps. A dot that the other
    image should show, and does not, speaks against a placement as three that match speak for it.
    """
    tree = KDTree(second.pixels)
    spacing = float(np.median(tree.query(second.pixels, 2)[0][:, 1]))
    nominal = second.shape[1] / first.shape[1]
    starts: list[Array] = []
    for matrix in _hypotheses(first.pixels, second.pixels, nominal, tree, spacing):
        if (_distances(matrix, starts, first.pixels) > spacing / 2).all():
            starts.append(matrix)
    fits = [_fitted(start, first, second, tree, spacing) for start in starts[:_MAX_PLACEMENTS]]
    judged = [fit for fit in fits if fit is not None]
    best = max(judged, key=_Placement.worth, default=None)
    if best is None or best.count < max(_FEWEST_MATCHES, best.contradictions):
        raise ValueError(
            f"dots: {0 if best is None else best.count} of {len(first.pixels)} in the infrared "
            f"image and {len(second.pixels)} in the visible picture match; both must show the "
            "same target, not mirrored, turned by at most 30 degrees"
        )
    return best.pairs, tuple(_rivals(best, judged, first.pixels, spacing))


@dataclass(frozen=True)
class _Placement:
    """An affine map (2, 3), the pairs that match (2, n), and the dots that speak against it."""

    matrix: Array
    pairs: NDArray[np.int64]
    contradictions: int

    @property
    def count(self) -> int:
        return int(self.pairs.shape[1])

    def worth(self) -> int:
        return self.count - _CONTRADICTION_COST * self.contradictions


def _rivals(
    best: _Placement, judged: list[_Placement], first: Array, spacing: float
) -> Iterator[str]:
    """Yield a warning for the best other placement that hardly more speaks against."""
    others = [
        other
        for other in judged
        if _distance(other.matrix, best.matrix, first) > spacing / 2
        and 2 * other.count >= best.count
        and other.contradictions < best.contradictions + _CONTRADICTIONS_APART
    ]
    if others:
        away = _distance(max(others, key=_Placement.worth).matrix, best.matrix, first)
        yield (
            f"The dots match {away:.0f} visible pixels further on as well; a target that both "
            "cameras see whole, or whose grid has a gap, would decide."
        )


def _hypotheses(
    first: Array, second: Array, nominal: float, tree: KDTree, spacing: float
) -> list[Array]:
    """Return similarities (2, 3) that put a pair of neighbours on another, the best first."""
    middle = np.argsort(np.hypot(*(first - np.median(first, axis=0)).T))[:_START_DOTS]
    near = KDTree(first).query(first[middle], min(_START_NEIGHBOURS + 1, len(first)))[1][:, 1:]
    a = np.repeat(middle, near.shape[1])
    b = near.ravel()
    around = tree.query(second, min(_VISIBLE_NEIGHBOURS + 1, len(second)))[1][:, 1:]
    c = np.repeat(np.arange(len(second)), around.shape[1])
    d = around.ravel()
    z, w = first @ [1, 1j], second @ [1, 1j]
    ratio = ((w[d] - w[c]) / (z[b] - z[a])[:, None]).ravel()
    shift = (w[c] - ratio.reshape(len(a), -1) * z[a][:, None]).ravel()
    likely = np.abs(np.angle(ratio)) < _MAX_TURN
    likely &= (np.abs(ratio) > _WIDTH_RATIOS[0] * nominal) & (
        np.abs(ratio) < _WIDTH_RATIOS[1] * nominal
    )
    found = []
    for turned, moved in zip(ratio[likely], shift[likely], strict=True):
        placed = turned * z + moved
        distance, which = tree.query(np.stack([placed.real, placed.imag], axis=1))
        count = np.unique(which[distance < _MATCH_DISTANCE * spacing]).size
        linear = np.array([[turned.real, -turned.imag], [turned.imag, turned.real]])
        found.append((count, np.column_stack([linear, [moved.real, moved.imag]])))
    found.sort(key=lambda entry: entry[0], reverse=True)
    return [matrix for _, matrix in found[:_MAX_HYPOTHESES]]


def _fitted(
    matrix: Array, first: Arrangement, second: Arrangement, tree: KDTree, spacing: float
) -> _Placement | None:
    """Return the affine map of the matches near a placement; None if they are too few."""
    whole = np.column_stack([first.pixels, np.ones(len(first.pixels))])
    pairs = _pairs(whole @ matrix.T, tree, spacing)
    for _ in range(_MAX_REFITS):
        if pairs.shape[1] < _FEWEST_MATCHES:
            return None
        matrix = np.linalg.lstsq(whole[pairs[0]], tree.data[pairs[1]])[0].T
        before, pairs = pairs, _pairs(whole @ matrix.T, tree, spacing)
        if np.array_equal(before, pairs):
            break
    linear, shift = matrix[:, :2], matrix[:, 2]
    there = np.delete(first.pixels, pairs[0], axis=0) @ linear.T + shift
    back = np.linalg.solve(linear, (np.delete(second.pixels, pairs[1], axis=0) - shift).T).T
    return _Placement(matrix, pairs, second.shows(there) + first.shows(np.asarray(back)))


def _pairs(placed: Array, tree: KDTree, spacing: float) -> NDArray[np.int64]:
    """Return dots that are each other's nearest and near, shape (2, n)."""
    distance, which = tree.query(placed)
    back = KDTree(placed).query(tree.data)[1]
    mutual = (distance < _MATCH_DISTANCE * spacing) & (back[which] == np.arange(len(placed)))
    return np.stack([np.flatnonzero(mutual), which[mutual]])


def _distance(one: Array, other: Array, places: Array) -> float:
    """Return the median distance of where two maps put places."""
    return float(_distances(one, [other], places)[0])


def _distances(one: Array, others: Sequence[Array], places: Array) -> Array:
    """Return the median distances of where a map and each of others put places."""
    apart = one - np.reshape(others, (-1, 2, 3))
    put = places @ apart[:, :, :2].swapaxes(1, 2) + apart[:, None, :, 2]
    return np.asarray(np.median(np.hypot(put[..., 0], put[..., 1]), axis=1))
