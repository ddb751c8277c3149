"""Tests whether the residuals of a calibration agree with the stated uncertainties."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.special import chdtrc, chdtri, stdtr, stdtrit

from chipglow.quantities import TINY, ZERO_CELSIUS, Array

_OUTLIER_LEVEL: Final = 0.01
"""Significance level of a total misfit and of an outlier."""

_CORRELATION_LEVEL: Final = 0.05
"""Significance level of residuals that are not independent."""

_LEAST_FREE: Final = 1e-9
"""Smallest part of a point's residual that the fit leaves free; less is rounding."""

_FAR_WITHIN: Final = 0.1
"""Mean squared residual, in the uncertainties, below which correlated residuals do no harm."""

_DRAWS: Final = 4000
"""Draws of independent residuals from which the significance follows."""

_SEED: Final = 1950
"""Seed of the draws, so that the same files give the same numbers."""

_LEAST_FREEDOM: Final = 3
"""Fewest degrees of freedom for a test whose scatter comes from the residuals."""

_LEAST_FALL: Final = 0.5
"""Portion of chi-squared that a point must take with it to be called an outlier."""


def residual_warnings(
    residuals: Array, design: Array, kelvins: Array, stated: bool, drifts: bool
) -> Iterator[str]:
    """Yield doubts about a calibration, as sentences.

    `residuals` (n,), in the order of the measurement, and `design` (n, parameters), the change of
    the points with the parameters, are over the standard uncertainties.
    """
    free = residuals.size - design.shape[1]
    total = float(residuals @ residuals)
    if stated and free > 0 and chdtrc(free, total) < _OUTLIER_LEVEL:
        yield (
            f"The residuals are {np.sqrt(total / free):.3g} times as large as the stated "
            f"uncertainties explain (chi-squared {total:.4g} with {free} degrees of freedom): the "
            "form, the band, a point or the uncertainties are wrong. The uncertainty is enlarged "
            "by that factor."
        )
    if free >= 2 and (point := _outlier(residuals, design, stated)) is not None:
        yield (
            f"The point at {kelvins[point] - ZERO_CELSIUS:.5g} °C lies "
            f"{abs(residuals[point]):.3g} standard uncertainties from the others' curve; without "
            "it they agree far better. Check it."
        )
    if drifts:
        yield (
            "Residuals of successive points are correlated, as by drift or self-heating of the "
            "camera during the calibration, or by a wrong band. The uncertainty is enlarged by "
            "what a drift that is even from point to point would do. Take the points again, in "
            "random order."
        )


def alike(residuals: Array, design: Array) -> bool:
    """Return whether residuals of successive points are correlated beyond chance."""
    free = residuals.size - design.shape[1]
    # Residuals far within the uncertainties do no harm, even if correlated.
    if free < _LEAST_FREEDOM or float(residuals @ residuals) < _FAR_WITHIN * free:
        return False
    tests = (_serial_probability, _drift_probability)
    # Two tests, each at half of the level.
    return min(test(residuals, design) for test in tests) < _CORRELATION_LEVEL / len(tests)


def drift_shift(residuals: Array, design: Array) -> Array:
    """Return how far a drift of the counts, even from the first point on, moves the parameters."""
    lengths = np.linalg.norm(design, axis=0)
    columns = np.column_stack([design / lengths, _drift(design)])
    with_drift = np.linalg.lstsq(columns, residuals, rcond=None)[0]
    return np.asarray(with_drift[:-1] / lengths)


def _outlier(residuals: Array, design: Array, stated: bool) -> int | None:
    """Return the point without which chi-squared falls most, if it is far from the others.

    By the residual that is studentised with the others' scatter (Cook and Weisberg, Residuals and
    Influence in Regression, 1982); its square is chi-squared's fall.
    """
    orthogonal = _orthonormal(design)
    left = np.maximum(1 - np.sum(orthogonal**2, axis=1), _LEAST_FREE)
    total, fall = float(residuals @ residuals), residuals**2 / left
    point = int(np.argmax(fall))
    free = residuals.size - design.shape[1] - 1
    rest = max(total - float(fall[point]), TINY)
    scatter = max(rest / free, 1.0) if stated else rest / free
    student = float(stdtrit(free, _OUTLIER_LEVEL / (2 * (free + 2)))) ** 2
    limit = float(chdtri(1, _OUTLIER_LEVEL / residuals.size)) if stated else student
    far = fall[point] > limit * scatter and fall[point] > _LEAST_FALL * total
    return point if far and (stated or free >= _LEAST_FREEDOM) else None


def _serial_probability(residuals: Array, design: Array) -> float:
    """Return how often independent errors leave residuals as correlated from point to point.

    The statistic of J. Durbin and G. S. Watson, Biometrika 37 (1950) 409, with its distribution by
    draws of independent errors that the same fit is subtracted from.
    """
    orthogonal = _orthonormal(design)
    draws = np.random.default_rng(_SEED).standard_normal((_DRAWS, residuals.size))
    draws -= (draws @ orthogonal) @ orthogonal.T

    def ratio(values: Array) -> Array:
        squares = np.maximum(np.sum(values**2, axis=-1), TINY)
        return np.asarray(np.sum(np.diff(values, axis=-1) ** 2, axis=-1) / squares)

    return float(np.mean(ratio(draws) <= ratio(residuals)))


def _drift_probability(residuals: Array, design: Array) -> float:
    """Return how often independent errors look as much like a drift, even from point to point.

    Student's t of one more parameter, the number of the point, with the scatter that is left.
    """
    orthogonal = _orthonormal(design)
    drift = _drift(design)
    drift = drift - orthogonal @ (orthogonal.T @ drift)
    length = float(drift @ drift)
    if length <= 0:
        return 1.0
    square = float(drift @ residuals) ** 2 / length
    free = residuals.size - design.shape[1] - 1
    rest = max((float(residuals @ residuals) - square) / free, TINY)
    return float(2 * stdtr(free, -np.sqrt(square / rest)))


def _orthonormal(design: Array) -> Array:
    """Return a basis of the columns, which are of very different lengths."""
    return np.linalg.qr(design / np.linalg.norm(design, axis=0))[0]


def _drift(design: Array) -> Array:
    """Return counts that rise from point to point, over the deviations."""
    return np.asarray(np.linspace(0.0, 1.0, len(design)) * design[:, 0])
