"""Planck's law, spectral bands, in-band radiance (Equation 1) and its inverse."""

# Kernels have no types: Numba finds them.
# mypy: allow-untyped-defs

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ceil, inf
from numbers import Real
from typing import Any, Final, TypeAlias

import numpy as np
import scipy
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Array
from chipglow.quantities.units import COLDEST, HOTTEST

FIRST_RADIATION_CONSTANT: Final = 1.191042972397188e-16
"""c1L = 2hc² in W m²/sr (CODATA 2018); the paper's 1.191e-4 W µm² is this, rounded."""

SECOND_RADIATION_CONSTANT: Final = 1.438776877503933e-2
"""c2 = hc/k in m K (CODATA 2018); the paper's 14387.752 µm K."""

Response: TypeAlias = Callable[[Array], Array]
"""Relative spectral response of a camera: wavelengths in m to values of 0 or more."""

PAPER_BAND: Final = (3.8e-6, 5.1e-6)
"""Limits in m of the spectral band of the paper's camera, the default of cameras and surfaces."""

_LONGEST_WAVELENGTH: Final = 1e-3
"""Longest wavelength in m; a longer one is stated in another unit."""

_PANEL_FALL: Final = 10.0
"""Largest change of the exponent in Planck's law over a panel, at the lowest temperature."""

_RESPONSE_PANELS: Final = 64
"""Fewest panels for a band with a spectral response, which may change over short distances."""

_NEWTON_STEPS: Final = 60
"""Most steps of Newton's method."""

_NODES_PER_PANEL: Final = 16
"""Gauss nodes of each panel of an integral over wavelength."""

_GAUSS: Final = np.polynomial.legendre.leggauss(_NODES_PER_PANEL)
"""These nodes and their weights, between -1 and 1."""

_SHARED_BANDS: Final = 16
"""Bands of which the tables are kept for others with the same limits: 0.6 MB each."""

_TEMPERATURE_STEP: Final = 0.25
"""Step in K of the table of radiances."""

_SHIFT: Final = 46
"""Low bits of a radiance that lie between two nodes of the inverse: 64 nodes to a power of two."""

_POWERS: Final = 128
"""Powers of two below the largest radiance that the inverse's table covers at most."""

_BLOCK_VALUES: Final = 1024
"""Temperatures computed at once, which stay in the cache."""

_KERNEL: Final[Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


def spectral_radiance(wavelength: Array, temperature: Array) -> Array:
    """Return the spectral radiance of a blackbody in W/(m² sr m): the integrand of Equation 1.

    Wavelengths in m and temperatures in K are positive and are broadcast against each other.
    """
    exponent = SECOND_RADIATION_CONSTANT / (wavelength * temperature)
    # exp(-x) / (1 - exp(-x)) is 1 / (exp(x) - 1) without overflow at large x.
    occupation = np.exp(-exponent) / -np.expm1(-exponent)
    return np.asarray(FIRST_RADIATION_CONSTANT / wavelength**5 * occupation, dtype=np.float64)


@dataclass(frozen=True)
class TabulatedResponse:
    """Relative spectral response by straight lines between the points of a table; 0 outside it."""

    wavelengths: tuple[float, ...]
    """In m, ascending."""
    values: tuple[float, ...]
    """Relative response, 0 or more."""

    def __post_init__(self) -> None:
        wavelengths, values = np.asarray(self.wavelengths), np.asarray(self.values)
        if len(wavelengths) < 2 or len(wavelengths) != len(values):
            raise ValueError(
                f"response: {len(wavelengths)} wavelengths and {len(values)} values, expected as "
                "many, 2 or more"
            )
        if not (np.diff(wavelengths) > 0).all() or not wavelengths[0] > 0:
            raise ValueError("response: wavelengths must be positive and ascend")
        if not (np.isfinite(values).all() and (values >= 0).all()):
            raise ValueError("response: values must be finite, 0 or more")

    @property
    def limits(self) -> tuple[float, float]:
        """First and last wavelength in m."""
        return self.wavelengths[0], self.wavelengths[-1]

    def __call__(self, wavelengths: Array) -> Array:
        """Return the response at these wavelengths in m."""
        return np.interp(wavelengths, self.wavelengths, self.values, left=0.0, right=0.0)


@dataclass(frozen=True)
class Band:
    """A spectral band of a camera.

    Parameters
    ----------
    lower, upper : float
        Limits of the band in m.
    response : callable, optional
        Relative spectral response R(λ), wavelengths in m to values; 1 inside the band by default.

    Raises
    ------
    ValueError
        If the limits are not positive, finite and in order, or the response is negative,
        not finite or zero everywhere.

    Notes
    -----
    In-band radiance is L(T) = ∫ R(λ) c1L λ⁻⁵ / (exp(c2/(λT)) − 1) dλ: Equation 1 of Heigel and
    Whitenton (2010). It is tabulated once by Gauss-Legendre quadrature; between 250 K and 3000 K
    the look-up is within 1e-6 of the integral. Outside the table the integral itself is evaluated.
    """

    lower: float
    upper: float
    response: Response | None = None

    def __post_init__(self) -> None:
        numbers = isinstance(self.lower, Real) and isinstance(self.upper, Real)
        if not (numbers and 0 < self.lower < self.upper < inf):
            raise ValueError(
                f"band: expected 0 < lower < upper in m, got lower={self.lower!r}, "
                f"upper={self.upper!r}"
            )
        if self.upper > _LONGEST_WAVELENGTH:
            raise ValueError(
                f"band: upper={self.upper!r} m is longer than 1 mm; "
                "wavelengths are in m (3.8 um is 3.8e-6)"
            )
        weights = self._quadrature[1]
        if not np.isfinite(weights).all() or (weights < 0).any() or not weights.any():
            raise ValueError("band: response must be finite, 0 or more, and not 0 everywhere")

    def radiance(self, temperature: ArrayLike) -> NDArray[np.floating]:
        """Return the in-band radiance of a blackbody in W/(m² sr).

        float32 for float32 temperatures in K, else float64; NaN where they are not positive.
        """
        values = _as_floats(temperature)
        result = np.empty_like(values)
        if _look_up_radiance(values.ravel(), self.radiance_table, result.ravel()):
            outside = (values > 0) & ~((values >= COLDEST) & (values <= HOTTEST))
            result[outside] = self._integrate(values[outside].astype(np.float64))
        return result

    def temperature(self, radiance: ArrayLike) -> NDArray[np.floating]:
        """Return the radiance temperature in K: that of the blackbody with this in-band radiance.

        float32 for float32 radiance in W/(m² sr), else float64; NaN where it is not positive and
        finite.

        Notes
        -----
        From 200 K to 6000 K by a table at even steps of the radiance within each power of two: the
        bits of the number itself tell the place. Between its nodes, at most h = 1/64 of the
        radiance L apart, there are cubics with the slopes of the exact inverse at both ends. Their
        error is (h L)⁴ T⁗(L) / 384 at most, and L⁴ T⁗ is T at most where T goes like a power of L
        from 0 to 1: 1.6e-10 T, which is 1 µK at 6000 K. Beyond, and more than 128 powers of two
        under the radiance of 6000 K, the integral itself is inverted.
        """
        values = _as_floats(radiance)
        result = np.empty_like(values)
        if _look_up_temperature(values.ravel(), *self._tabulated._inverse_table, result.ravel()):
            outside = np.isnan(result) & (values > 0) & np.isfinite(values)
            result[outside] = self._invert(values[outside].astype(np.float64))
        return result

    def slope(self, temperature: ArrayLike) -> Array:
        """Return the change of the in-band radiance with the temperature, dL/dT, in W/(m² sr K).

        By straight lines between values 0.25 K apart, within 1e-5 of it; NaN outside 200 K to
        6000 K.
        """
        values = np.asarray(temperature, np.float64)
        position = (values - COLDEST) / _TEMPERATURE_STEP
        slopes = self.radiance_table[:, 1]
        return np.interp(position, np.arange(slopes.size), slopes, left=np.nan, right=np.nan)

    def spectrum(self, temperature: float, count: int) -> tuple[Array, Array]:
        """Return up to 15 wavelengths that stand for a blackbody's in-band radiance.

        Ascending, in m, with their fractions of the radiance, of sum 1. The Gauss quadrature of the
        weight R(λ) L(λ, T), exact for polynomials in λ up to degree 2 `count` − 1, from the
        eigenvalues of its Jacobi matrix (Golub and Welsch, Math. Comp. 23 (1969) 221), which
        Lanczos' recurrence finds of the nodes of the band's own integral.
        """
        if not 1 <= count < _NODES_PER_PANEL:
            raise ValueError(f"band: count is {count}, expected 1 to {_NODES_PER_PANEL - 1}")
        nodes, weights = self._quadrature
        weights = weights * spectral_radiance(nodes, np.array(temperature))
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        place = (nodes - middle) / half
        basis = np.zeros((count, nodes.size))
        diagonal, beside = np.zeros(count), np.zeros(count)
        vector = np.sqrt(weights / weights.sum())
        for n in range(count):
            basis[n] = vector
            vector = place * vector
            diagonal[n] = vector @ basis[n]
            # Once is not enough: rounding would bring the first vectors back.
            for _ in range(2):
                vector = vector - basis[: n + 1].T @ (basis[: n + 1] @ vector)
            beside[n] = np.linalg.norm(vector)
            vector = vector / beside[n]
        found, vectors = scipy.linalg.eigh_tridiagonal(diagonal, beside[:-1])
        return middle + half * found, vectors[0] ** 2

    @cached_property
    def wavelengths(self) -> Array:
        """Wavelengths in m, ascending, at which the response counts: the nodes of the integral."""
        return np.sort(self._quadrature[0])

    def weights(self, temperature: ArrayLike) -> tuple[Array, Array]:
        """Return the nodes of the integral in m and their parts of the in-band radiance.

        In W/(m² sr), shape (..., wavelength) for temperatures (...) in K.
        """
        wavelength, weights = self._quadrature
        kelvins = np.asarray(temperature, np.float64)[..., None]
        return wavelength, spectral_radiance(wavelength, kelvins) * weights

    @property
    def radiance_table(self) -> Array:
        """Radiance and its derivative at every 0.25 K from 200 K to 6000 K, shape (n, 2)."""
        return self._tabulated._radiance_table

    @property
    def _tabulated(self) -> "Band":
        """The equal band that has the tables: one for all with the same limits and no response."""
        return _band_of_limits(self.lower, self.upper) if self.response is None else self

    @cached_property
    def _radiance_table(self) -> Array:
        count = round((HOTTEST - COLDEST) / _TEMPERATURE_STEP) + 1
        temperature = COLDEST + _TEMPERATURE_STEP * np.arange(count, dtype=np.float64)
        return np.stack(self._with_slope(temperature), axis=1)

    @cached_property
    def _quadrature(self) -> tuple[Array, Array]:
        """Wavelengths and weights (response included), in panels over which Planck is smooth."""
        fall = SECOND_RADIATION_CONSTANT / COLDEST * (1 / self.lower - 1 / self.upper)
        panels = max(1, ceil(fall / _PANEL_FALL))
        if self.response is not None:
            panels = max(panels, _RESPONSE_PANELS)
        # Over 1/λ the integrand is a cubic times an exponential: smooth however wide the band.
        edges = np.linspace(1 / self.upper, 1 / self.lower, panels + 1)
        node, weight = _GAUSS
        middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
        wavelength = 1.0 / (middle[:, None] + half[:, None] * node).ravel()
        weights = (half[:, None] * weight).ravel() * wavelength**2
        if self.response is not None:
            weights = weights * np.asarray(self.response(wavelength), dtype=np.float64)
        return wavelength, weights

    @cached_property
    def _inverse_table(self) -> tuple[int, Array]:
        """Place of the first node, as the high bits of its radiance, and cubics, shape (n, 4)."""
        ends = self._integrate(np.array([COLDEST, HOTTEST]))
        first, last = np.maximum(ends, ends[1] * 0.5**_POWERS).view(np.int64) >> _SHIFT
        radiance = (np.arange(first, last + 2) << _SHIFT).view(np.float64)
        temperature = self._invert(radiance)
        begin, rise, step = temperature[:-1], np.diff(temperature), np.diff(radiance)
        slope = 1.0 / self._with_slope(temperature)[1]
        left, right = step * slope[:-1], step * slope[1:]
        cubics = [begin, left, 3.0 * rise - 2.0 * left - right, left + right - 2.0 * rise]
        return int(first), np.stack(cubics, axis=1)

    def _integrate(self, temperature: Array) -> Array:
        return self._with_slope(temperature)[0]

    def _with_slope(self, temperature: Array) -> tuple[Array, Array]:
        """Return in-band radiance, and its derivative in W/(m² sr K)."""
        wavelength, weights = self._quadrature
        radiance, slope = np.empty_like(temperature), np.empty_like(temperature)
        for at in range(0, temperature.size, _BLOCK_VALUES):
            part = slice(at, at + _BLOCK_VALUES)
            kelvins = temperature[part, None]
            spectral = spectral_radiance(wavelength, kelvins)
            radiance[part] = spectral @ weights
            # 1 / (1 - exp(-x)) is one more than Planck's 1 / (exp(x) - 1), x = c2 / (wavelength T).
            growth = 1.0 + spectral * (wavelength**5 / FIRST_RADIATION_CONSTANT)
            spectral *= growth * (SECOND_RADIATION_CONSTANT / wavelength)
            slope[part] = (spectral @ weights) / temperature[part] ** 2
        return radiance, slope

    def _invert(self, radiance: Array) -> Array:
        """Invert by Newton's method on ln L over 1/T, which is nearly straight."""
        target = np.log(radiance)
        inverse = np.full_like(target, 1e-3)  # 1/K: begin at 1000 K
        for _ in range(_NEWTON_STEPS):
            temperature = 1.0 / inverse
            value, rise = self._with_slope(temperature)
            slope = -rise * temperature**2 / value
            step = (np.log(value) - target) / slope
            inverse = np.maximum(inverse - step, 0.2 * inverse)  # a step may not change the sign
            if (np.abs(step) <= 1e-14 * inverse).all():  # rounding
                break
        return 1.0 / inverse


@lru_cache(_SHARED_BANDS)
def _band_of_limits(lower: float, upper: float) -> Band:
    return Band(lower, upper)


def _as_floats(values: ArrayLike) -> NDArray[np.floating]:
    array = np.asarray(values)
    kind = np.float32 if array.dtype == np.float32 else np.float64
    return np.asarray(array, dtype=kind, order="C")


@njit(inline="always")
def table_radiance(temperature, table):
    """Look up in-band radiance by cubic Hermite interpolation; NaN outside the table."""
    position = (temperature - COLDEST) / _TEMPERATURE_STEP
    if not (0.0 <= position <= table.shape[0] - 1):
        return np.nan
    i = min(int(position), table.shape[0] - 2)
    s = position - i
    r = 1.0 - s
    value = r * r * (1.0 + 2.0 * s) * table[i, 0] + s * s * (3.0 - 2.0 * s) * table[i + 1, 0]
    bend = r * table[i, 1] - s * table[i + 1, 1]
    return value + _TEMPERATURE_STEP * s * r * bend


# These run on the caller's thread: threads that wait for work by spinning would take the processor
# from others, for what lasts a few microseconds a frame.
@njit(**_KERNEL)
def _look_up_radiance(temperature, table, radiance):
    """Fill in radiances, NaN where the table has none; return how many are NaN."""
    missing = 0
    for i in range(temperature.size):
        value = table_radiance(temperature[i], table)
        radiance[i] = value
        missing += np.isnan(value)
    return missing


@njit(**_KERNEL)
def _look_up_temperature(radiance, first, cubics, temperature):
    """Fill in temperatures, NaN where the table has none; return how many are NaN."""
    block = np.empty(_BLOCK_VALUES)
    missing = 0
    for begin in range(0, radiance.size, _BLOCK_VALUES):
        count = min(_BLOCK_VALUES, radiance.size - begin)
        # A slice that is assigned takes Numba ten times as long to compile.
        for i in range(count):
            block[i] = radiance[begin + i]
        # The bits of a positive number are in the order of the numbers.
        for i, bits in enumerate(block[:count].view(np.int64)):
            k = np.uint64((bits >> _SHIFT) - first)
            if k >= np.uint64(cubics.shape[0]):
                temperature[begin + i] = np.nan
                missing += 1
                continue
            s = np.float64(bits & ((1 << _SHIFT) - 1)) * (1.0 / (1 << _SHIFT))
            bend = cubics[k, 2] + s * cubics[k, 3]
            temperature[begin + i] = cubics[k, 0] + s * (cubics[k, 1] + s * bend)
    return missing
