"""Textures: a small map of normal deviates, enlarged smoothly."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Final

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike, NDArray

MAP_SIZE: Final = 128
"""Deviates across and down a map; with grains of 20 µm it repeats after 2.56 mm."""


@dataclass(frozen=True, eq=False)
class Texture:
    """A periodic map of emissivity, enlarged by cubic convolution.

    Parameters
    ----------
    nodes : ndarray
        Emissivity at the nodes of the small map, float32 of shape (`MAP_SIZE`, `MAP_SIZE`);
        rows go with y, columns with x.
    grain : float
        Distance between the nodes in m.

    Raises
    ------
    ValueError
        If the shape is another, or the grain is not positive.

    Notes
    -----
    Heigel and Whitenton (2010) enlarge a small map of normal deviates with MATLAB's ``imresize``:
    bicubic, the cubic convolution of Keys (1981) with a = −1/2. Here it is evaluated where it is
    asked for. Values are clipped to 0 to 1, the range of an emissivity.
    """

    nodes: NDArray[np.float32]
    grain: float

    def __post_init__(self) -> None:
        if self.nodes.shape != (MAP_SIZE, MAP_SIZE):
            raise ValueError(
                f"texture: nodes have shape {self.nodes.shape}, expected {(MAP_SIZE, MAP_SIZE)}"
            )
        if not 0 < self.grain < np.inf:
            raise ValueError(f"texture: grain must be over 0 m, got {self.grain!r} m")

    @classmethod
    def random(
        cls,
        mean: float,
        deviation: float,
        grain: float,
        generator: np.random.Generator,
        *,
        restore_deviation: bool,
    ) -> "Texture":
        """Texture of normal deviates.

        Parameters
        ----------
        mean, deviation : float
            Mean and standard deviation of the emissivity.
        grain : float
            Size of one deviate in m.
        generator : numpy.random.Generator
            Where the deviates come from.
        restore_deviation : bool
            Widen the deviates so that the enlarged map has the deviation asked for; without it
            the small map has it, and the enlarged one about a fifth less.
        """
        deviates = generator.standard_normal((MAP_SIZE, MAP_SIZE))
        if restore_deviation:
            deviates /= _enlarged_deviation(deviates)
        return cls((mean + deviation * deviates).astype(np.float32), grain)

    @property
    def period(self) -> float:
        """Distance in m after which the map repeats, along x and along y."""
        return MAP_SIZE * self.grain

    @cached_property
    def mean(self) -> float:
        """Mean over the enlarged map, before clipping: that of the nodes."""
        return float(self.nodes.mean(dtype=np.float64))

    @cached_property
    def deviation(self) -> float:
        """Standard deviation over the enlarged map, before clipping: exact, not sampled."""
        return _enlarged_deviation(self.nodes.astype(np.float64))

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float32]:
        """Emissivity of the enlarged map.

        Parameters
        ----------
        x, y : array_like
            Positions in m, broadcast against each other.
        """
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        result = np.empty(x.size, dtype=np.float32)
        _look_up(self.nodes, 1.0 / self.grain, x.ravel(), y.ravel(), result)
        return result.reshape(x.shape)


def cubic_convolution(distance: ArrayLike) -> NDArray[np.float64]:
    """Kernel of Keys (1981) with a = −1/2: weight of a node over its distance in nodes."""
    u = np.abs(np.asarray(distance, dtype=np.float64))
    near = (1.5 * u - 2.5) * u**2 + 1.0
    far = ((-0.5 * u + 2.5) * u - 4.0) * u + 2.0
    return np.where(u <= 1.0, near, np.where(u < 2.0, far, 0.0))


def _enlarged_deviation(nodes: NDArray[np.float64]) -> float:
    """Deviation over the enlarged map: its mean square is a quadratic form of the nodes.

    ∫∫ (Σ d_ij k(u−i) k(v−j))² du dv = Σ d_ij d_lm r(i−l) r(j−m) with r the autocorrelation of k.
    """
    about_mean = nodes - nodes.mean()
    smoothed = about_mean
    for axis in (0, 1):
        smoothed = sum(
            weight * np.roll(smoothed, lag, axis)
            for lag, weight in zip(range(-3, 4), _autocorrelation(), strict=True)
        )
    return sqrt(float((about_mean * smoothed).mean()))


def _autocorrelation() -> NDArray[np.float64]:
    """Overlap of the cubic-convolution kernel with itself, for lags of −3 to 3 nodes."""
    # Between nodes the product is a polynomial of degree 6: four Gauss points are exact.
    node, weight = np.polynomial.legendre.leggauss(4)
    pieces = np.arange(-2.0, 2.0)[:, None] + (node + 1.0) / 2.0
    kernel = cubic_convolution(pieces)
    return np.array(
        [(kernel * cubic_convolution(pieces + lag) * weight / 2.0).sum() for lag in range(-3, 4)]
    )


@njit(inline="always")
def texture_value(nodes, u, v):  # type: ignore[no-untyped-def]
    """Enlarged map at u nodes across and v nodes down, clipped to 0 to 1; for kernels."""
    column, row = np.floor(u), np.floor(v)
    s, t = np.float32(u - column), np.float32(v - row)
    j, i = np.int64(column), np.int64(row)
    one, half = np.float32(1.0), np.float32(0.5)
    a = half * s * (s * (np.float32(2.0) - s) - one)
    d = half * s * s * (s - one)
    b = one + half * s * s * (np.float32(3.0) * s - np.float32(5.0))
    c = one - a - b - d
    e = half * t * (t * (np.float32(2.0) - t) - one)
    h = half * t * t * (t - one)
    f = one + half * t * t * (np.float32(3.0) * t - np.float32(5.0))
    g = one - e - f - h
    wrap = MAP_SIZE - 1  # the size is a power of two, so the lower bits are the remainder
    j0, j1, j2, j3 = (j - 1) & wrap, j & wrap, (j + 1) & wrap, (j + 2) & wrap
    value = np.float32(0.0)
    for lag, weight in ((-1, e), (0, f), (1, g), (2, h)):
        n = nodes[(i + lag) & wrap]
        value += weight * (a * n[j0] + b * n[j1] + c * n[j2] + d * n[j3])
    return min(max(value, np.float32(0.0)), one)


@njit(cache=True, parallel=True)
def _look_up(nodes, scale, x, y, result):  # type: ignore[no-untyped-def]
    for i in prange(x.size):
        result[i] = texture_value(nodes, x[i] * scale, y[i] * scale)
