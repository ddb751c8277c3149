"""Textures: a small map of normal deviates, enlarged smoothly, read as emissivities."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.surface.cubic import autocorrelation
from chipglow.surface.emissivity import REACH, STEPS, Emissivity

MAP_SIZE: Final = 128
"""Deviates across and down a map; with grains of 20 µm it repeats after 2.56 mm."""

_LAST: Final = round(2 * REACH * STEPS)
_PER_NODE: Final = 10
_FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract"}, "forceinline": True}


@dataclass(frozen=True, eq=False)
class Texture:
    """A periodic map of emissivity: deviates, enlarged by cubic convolution.

    Notes
    -----
    Heigel and Whitenton (2010) enlarge a small map of normal deviates with MATLAB's ``imresize``:
    bicubic, the cubic convolution of Keys (1981) with a = −1/2. Here it is evaluated where it is
    asked for.
    """

    nodes: NDArray[np.float32]
    """Deviates of the small map, float32, `MAP_SIZE` a side; rows go with y, columns with x."""
    grain: float
    """Distance between the nodes in m."""
    emissivity: Emissivity

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
        emissivity: Emissivity,
        grain: float,
        generator: np.random.Generator,
        *,
        restore_standard_deviation: bool,
    ) -> "Texture":
        """Return a texture of normal deviates, widened or not for what enlarging takes away."""
        deviates = generator.standard_normal((MAP_SIZE, MAP_SIZE))
        if restore_standard_deviation:
            deviates /= _enlarged_standard_deviation(deviates)
        return cls(deviates.astype(np.float32), grain, emissivity)

    @property
    def period(self) -> float:
        """Distance in m after which the map repeats, along x and along y."""
        return MAP_SIZE * self.grain

    @cached_property
    def mean(self) -> float:
        """Mean over the enlarged map."""
        return float(self._samples.mean())

    @cached_property
    def standard_deviation(self) -> float:
        """Standard deviation over the enlarged map."""
        return float(self._samples.std())

    @cached_property
    def _samples(self) -> NDArray[np.float64]:
        """Values at even steps over one period: sums of cubics, good to 1e-4 of their scatter."""
        along = np.arange(_PER_NODE * MAP_SIZE) * self.grain / _PER_NODE
        return self.at(along[None, :], along[:, None]).astype(np.float64)

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float32]:
        """Return the emissivity of the enlarged map at places in m."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        result = np.empty(x.size, dtype=np.float32)
        _look_up(
            self.nodes,
            self.emissivity.table,
            1.0 / self.grain,
            x.ravel(),
            y.ravel(),
            result,
        )
        return result.reshape(x.shape)


def _enlarged_standard_deviation(nodes: NDArray[np.float64]) -> float:
    """Deviation over the enlarged map: its mean square is a quadratic form of the nodes.

    ∫∫ (Σ d_ij k(u−i) k(v−j))² du dv = Σ d_ij d_lm r(i−l) r(j−m) with r the autocorrelation of k.
    """
    about_mean = nodes - nodes.mean()
    smoothed = about_mean
    for axis in (0, 1):
        smoothed = sum(
            weight * np.roll(smoothed, lag, axis)
            for lag, weight in zip(range(-3, 4), autocorrelation(), strict=True)
        )
    return sqrt(float((about_mean * smoothed).mean()))


@njit(**_FAST)
def cubic_taps(position):  # type: ignore[no-untyped-def]
    """Return the node before a position and the weights, float32, of the four around it."""
    before = np.floor(position)
    s = np.float32(position - before)
    one, half = np.float32(1.0), np.float32(0.5)
    a = half * s * (s * (np.float32(2.0) - s) - one)
    d = half * s * s * (s - one)
    b = one + half * s * s * (np.float32(3.0) * s - np.float32(5.0))
    return np.int32(before), a, b, one - a - b - d, d


@njit(**_FAST)
def enlarged(nodes, down, across):  # type: ignore[no-untyped-def]
    """Return the deviate of the enlarged map between the nodes of two `cubic_taps`."""
    i, e, f, g, h = down
    j, a, b, c, d = across
    wrap = MAP_SIZE - 1  # the size is a power of two, so the lower bits are the remainder
    j0, j1, j2, j3 = (j - 1) & wrap, j & wrap, (j + 1) & wrap, (j + 2) & wrap
    i0, i1, i2, i3 = (i - 1) & wrap, i & wrap, (i + 1) & wrap, (i + 2) & wrap
    n0 = a * nodes[i0, j0] + b * nodes[i0, j1] + c * nodes[i0, j2] + d * nodes[i0, j3]
    n1 = a * nodes[i1, j0] + b * nodes[i1, j1] + c * nodes[i1, j2] + d * nodes[i1, j3]
    n2 = a * nodes[i2, j0] + b * nodes[i2, j1] + c * nodes[i2, j2] + d * nodes[i2, j3]
    n3 = a * nodes[i3, j0] + b * nodes[i3, j1] + c * nodes[i3, j2] + d * nodes[i3, j3]
    return e * n0 + f * n1 + g * n2 + h * n3


@njit(**_FAST)
def emissivity_at(deviate, table):  # type: ignore[no-untyped-def]
    """Return the emissivity at a normal deviate, linear between the entries of its table."""
    position = (deviate + np.float32(REACH)) * np.float32(STEPS)
    inside = min(max(position, np.float32(0.0)), np.float32(_LAST))
    i = min(np.int32(inside), np.int32(_LAST - 1))
    return table[i] + (inside - np.float32(i)) * (table[i + 1] - table[i])


@njit(cache=True, nogil=True)
def _look_up(nodes, table, scale, x, y, result):  # type: ignore[no-untyped-def]
    for i in range(x.size):
        down, across = cubic_taps(y[i] * scale), cubic_taps(x[i] * scale)
        result[i] = emissivity_at(enlarged(nodes, down, across), table)
