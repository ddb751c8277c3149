"""Textures: a small map of normal deviates, enlarged smoothly, read as emissivities."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Annotated, Any, Final

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import correlate1d
from scipy.special import betainccinv, betaincinv, ndtr

from chipglow.quantities import Array, Parameter, Part, zero_to_one
from chipglow.scene.kernels import INNER

REACH: Final = 8.0
"""Normal deviates are limited to −8 to 8."""

STEPS: Final = 32
"""Entries of a table for each unit of the deviate."""

_NORMAL_REACH: Final = 5.0
"""Standard deviations within which emissivities of 0 to 1 must lie to be normal."""


@dataclass(frozen=True)
class Emissivity(Part):
    """Emissivity of one feature.

    Heigel and Whitenton (2010) take "samples from a normal distribution". So it is here where
    five standard deviations to either side of the mean stay within 0 to 1, as in the paper's
    Table 1. Nearer to 0 or 1 a normal distribution would be cut off, and mean and standard
    deviation with it: there it is a beta distribution, which stays within 0 to 1 by itself.
    """

    mean: Annotated[float, zero_to_one("Mean emissivity.")]
    standard_deviation: Annotated[
        float, Parameter("Standard deviation over the surface.", least=0.0)
    ] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        # Only values of 0 and 1 reach (m (1 − m))^(1/2); a beta distribution stays below it.
        most = 0.9 * sqrt(self.mean * (1.0 - self.mean))
        if self.standard_deviation > most:
            raise ValueError(
                f"standard_deviation: {self.standard_deviation:g}, expected up to {most:.3g} "
                f"about a mean of {self.mean:g}"
            )

    @property
    def is_normal(self) -> bool:
        """Whether its values are distributed normally."""
        reach = _NORMAL_REACH * self.standard_deviation
        return self.mean - reach >= 0.0 and self.mean + reach <= 1.0

    @cached_property
    def table(self) -> NDArray[np.float32]:
        """Emissivity at normal deviates from −`REACH` to `REACH`, `STEPS` to a unit."""
        deviates = np.linspace(-REACH, REACH, round(2 * REACH * STEPS) + 1)
        if self.is_normal:
            values = np.clip(self.mean + self.standard_deviation * deviates, 0.0, 1.0)
        else:
            values = _beta_values(deviates, self.mean, self.standard_deviation)
        return np.asarray(values, dtype=np.float32)

    @property
    def line(self) -> tuple[float, float]:
        """Emissivity at a deviate of 0 and its change with the deviate; NaN if it is not a line."""
        return self.mean, self.standard_deviation if self.is_normal else float("nan")


def _beta_values(deviates: Array, mean: float, standard_deviation: float) -> Array:
    """Values of a beta distribution where a normal one has these deviates."""
    size = mean * (1 - mean) / standard_deviation**2 - 1
    first, second = mean * size, (1 - mean) * size
    # The upper half by the survival function: 1 − p would be rounded away.
    lower = betaincinv(first, second, ndtr(np.minimum(deviates, 0.0)))
    upper = betainccinv(first, second, ndtr(-np.maximum(deviates, 0.0)))
    return np.asarray(np.where(deviates < 0.0, lower, upper), dtype=np.float64)


MAP_SIZE: Final = 128
"""Deviates across and down a map; with grains of 20 µm it repeats after 2.56 mm."""

PADDED_SIZE: Final = MAP_SIZE + 4
"""Columns of a map with the border that the splines need."""

WRAP: Final = MAP_SIZE - 1
# Cubic convolution (Keys, 1981; a = -1/2): weights of four nodes by powers of the way from the
# second to the third, the cube first.
_CUBIC: Final = (
    (-0.5, 1.5, -1.5, 0.5),
    (1.0, -2.5, 2.0, -0.5),
    (-0.5, 0.0, 0.5, 0.0),
    (0.0, 1.0, 0.0, 0.0),
)
_AUTOCORRELATION: Final = np.array([1, -20, 71, 456, 71, -20, 1]) / 560
"""Overlap of that kernel with itself, for lags of −3 to 3 nodes."""

_LANES: Final = tuple(ir.Constant(ir.IntType(32), lane) for lane in range(4))
"""Indices of the lanes of a vector."""

_LAST: Final = round(2 * REACH * STEPS)
_FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract"}, "forceinline": True}


@dataclass(frozen=True, eq=False)
class Texture:
    """A periodic map of emissivity: normal deviates, enlarged where it is asked for.

    Heigel and Whitenton (2010) enlarge them with MATLAB's ``imresize``: bicubic, the cubic
    convolution of Keys (1981) with a = −1/2.
    """

    nodes: NDArray[np.float32]
    """Deviates of the small map, float32, `MAP_SIZE` a side; rows go with y, columns with x."""
    grain: float
    """Distance between the nodes in m."""
    emissivity: Emissivity

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

    def at(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float32]:
        """Return the emissivity of the enlarged map at places in m."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        result = np.empty(x.size, dtype=np.float32)
        nodes, table = padded(self.nodes), self.emissivity.table
        _look_up(nodes, table, 1.0 / self.grain, x.ravel(), y.ravel(), result)
        return result.reshape(x.shape)


def _enlarged_standard_deviation(nodes: NDArray[np.float64]) -> float:
    """Deviation over the enlarged map: its mean square is a quadratic form of the nodes.

    ∫∫ (Σ d_ij k(u−i) k(v−j))² du dv = Σ d_ij d_lm r(i−l) r(j−m) with r the autocorrelation of k.
    """
    about_mean = nodes - nodes.mean()
    smoothed = about_mean
    for axis in (0, 1):
        smoothed = correlate1d(smoothed, _AUTOCORRELATION, axis, mode="wrap")
    return sqrt(float((about_mean * smoothed).mean()))


def padded(nodes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a periodic map with the nodes about its border, so that no index wraps, flat."""
    around = np.arange(-1, PADDED_SIZE - 1) & WRAP
    return np.ascontiguousarray(nodes[around[:, None], around]).ravel()


@intrinsic
def patch(typing, nodes, corner, across, down):  # type: ignore[no-untyped-def]
    """Deviate between four by four `padded` nodes, `across` and `down` past the inner corner.

    In vectors of four: left to itself the compiler takes the sixteen nodes one by one.
    """

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        four, fast = ir.VectorType(ir.FloatType(), 4), {"flags": ("contract",)}
        nothing = ir.Constant(four, ir.Undefined)

        def splat(vector: Any, lane: int) -> Any:
            mask = ir.Constant(ir.VectorType(ir.IntType(32), 4), [lane] * 4)
            return builder.shuffle_vector(vector, nothing, mask)

        def weights(past: Any) -> Any:
            all_past = splat(builder.insert_element(nothing, past, _LANES[0]), 0)
            result = ir.Constant(four, list(_CUBIC[0]))
            for coefficients in _CUBIC[1:]:
                product = builder.fmul(result, all_past, **fast)
                result = builder.fadd(product, ir.Constant(four, list(coefficients)), **fast)
            return result

        array, corner, across, down = arguments
        base = context.make_array(signature.args[0])(context, builder, array).data
        rows, total = weights(down), None
        for row in range(4):
            start = builder.add(corner, ir.Constant(ir.IntType(64), row * PADDED_SIZE))
            place = builder.bitcast(builder.gep(base, [start]), four.as_pointer())
            product = builder.fmul(builder.load(place, align=4), splat(rows, row), **fast)
            total = product if total is None else builder.fadd(total, product, **fast)
        total = builder.fmul(total, weights(across), **fast)
        low, high, left, right = (builder.extract_element(total, lane) for lane in _LANES)
        return builder.fadd(builder.fadd(low, left), builder.fadd(high, right))

    return types.float32(nodes, types.int64, types.float32, types.float32), generate


@njit(**_FAST, **INNER)
def emissivity_at(deviate, table):  # type: ignore[no-untyped-def]
    """Return the emissivity at a normal deviate, linear between the entries of its table."""
    position = (deviate + np.float32(REACH)) * np.float32(STEPS)
    inside = min(max(position, np.float32(0.0)), np.float32(_LAST))
    i = min(np.int32(inside), np.int32(_LAST - 1))
    return table[i] + (inside - np.float32(i)) * (table[i + 1] - table[i])


@njit(cache=True, nogil=True)
def _look_up(nodes, table, scale, x, y, result):  # type: ignore[no-untyped-def]
    for i in range(x.size):
        u, v = x[i] * scale, y[i] * scale
        left, above = np.floor(u), np.floor(v)
        corner = (np.int64(above) & WRAP) * PADDED_SIZE + (np.int64(left) & WRAP)
        deviate = patch(nodes, corner, np.float32(u - left), np.float32(v - above))
        result[i] = emissivity_at(deviate, table)
