"""Propagation of distributions by Monte Carlo, which validates the propagation to first order."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from chipglow.quantities import Array, Brief
from chipglow.uncertainty.draws import draw
from chipglow.uncertainty.estimate import Estimate, as_estimate

_BLOCK: Final = 10_000
"""Smallest number of trials between two checks of stability (JCGM 101:2008, 7.9.4)."""


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarlo(Brief):
    """Distribution of a function of estimates, for each element of its result.

    Parameters
    ----------
    mean, standard_uncertainty : ndarray
        Of all trials; not finite if they do not exist, as with 2 degrees of freedom or fewer.
    low, high : ndarray
        Ends of the probabilistically symmetric coverage interval.
    level : float
        Coverage probability of the interval.
    digits : int
        Significant digits of the standard uncertainty to which the results are stable.
    trials : int
        Number of trials.
    is_stable : bool
        Whether the results are stable; if not, the limit of the number of trials was reached.
    """

    mean: Array
    standard_uncertainty: Array
    low: Array
    high: Array
    level: float
    digits: int
    trials: int
    is_stable: bool

    def validates(self, estimate: Estimate) -> NDArray[np.bool_]:
        """Return where the interval of an estimate to first order agrees (JCGM 101:2008, 8.1).

        The ends must agree to a digit less than the trials are stable (8.2), and to one at least.
        """
        reach = estimate.expanded_uncertainty(self.level)
        tolerance = numerical_tolerance(estimate.standard_uncertainty, max(self.digits - 1, 1))
        ends = (estimate.values - reach - self.low, estimate.values + reach - self.high)
        return np.asarray(np.maximum(*np.abs(ends)) <= tolerance)


def numerical_tolerance(standard_uncertainty: Array, digits: int) -> Array:
    """Return half a unit in the last of the significant digits (JCGM 101:2008, 7.9.2)."""
    size = np.maximum(np.abs(standard_uncertainty), np.finfo(float).tiny)
    return np.asarray(0.5 * 10.0 ** (np.floor(np.log10(size)) - digits + 1))


def monte_carlo(
    function: Callable[..., Any],
    *inputs: Any,
    generator: np.random.Generator,
    level: float = 0.95,
    digits: int = 2,
    most: int = 10_000_000,
) -> MonteCarlo:
    """Return the distribution of a function of estimates by an adaptive number of trials.

    Parameters
    ----------
    function : callable
        Function of arrays of shape (trials, ...), one for each input.
    *inputs : Estimate or array_like
        Input quantities, drawn with their common errors (`draw`).
    generator : numpy.random.Generator
        Source of the draws.
    level : float
        Coverage probability.
    digits : int
        Significant digits of the standard uncertainty to which the results must be stable.
    most : int
        Largest number of trials.

    Notes
    -----
    JCGM 101:2008, 7.9.4: blocks of trials are added until twice the standard deviation of the mean
    over the blocks is under the numerical tolerance for mean, standard uncertainty and both ends of
    the interval.
    """
    estimates = [as_estimate(one) for one in inputs]
    freedoms = (part.cause.degrees_of_freedom for one in estimates for part in one.components)

    def sample(count: int) -> Array:
        return np.asarray(function(*draw(estimates, count, generator, True)), np.float64)

    block = max(ceil(100 / (1 - level)), _BLOCK)
    return adaptive(sample, level, digits, most, block, min(freedoms, default=np.inf) > 2)


def adaptive(
    sample: Callable[[int], Array],
    level: float,
    digits: int,
    most: int,
    block: int,
    has_variance: bool = True,
    progress: Callable[[float], None] = lambda part: None,
) -> MonteCarlo:
    """Return the distribution of samples, as `monte_carlo`; `sample` takes a number of trials."""
    ends = ((1 - level) / 2, (1 + level) / 2)
    values: list[Array] = []
    blocks: list[Array] = []
    is_stable = False
    while not is_stable and (len(values) + 1) * block <= most:
        progress(len(values) * block / most)
        values.append(sample(block))
        blocks.append(_summary(values[-1], ends, has_variance))
        if len(blocks) > 1:
            is_stable = _is_stable(np.array(blocks), digits, level)
    progress(1.0)
    mean, deviation, low, high = _summary(np.concatenate(values), ends, has_variance)
    return MonteCarlo(mean, deviation, low, high, level, digits, block * len(values), is_stable)


def _summary(values: Array, ends: tuple[float, float], has_variance: bool) -> Array:
    """Return mean and standard deviation, NaN without a variance, and the interval's ends."""
    with np.errstate(invalid="ignore"):
        moments = np.array([values.mean(axis=0), values.std(axis=0, ddof=1)])
    moments = moments if has_variance else np.full_like(moments, np.nan)
    return np.concatenate([moments, np.quantile(values, ends, axis=0)])


def _is_stable(blocks: Array, digits: int, level: float) -> bool:
    """Return whether the summaries of the blocks, those that are finite, scatter little enough."""
    low, high = blocks[:, 2:].mean(axis=0)
    tolerance = numerical_tolerance((high - low) / (2 * ndtri((1 + level) / 2)), digits)
    with np.errstate(invalid="ignore"):
        scatter = 2 * blocks.std(axis=0, ddof=1) / np.sqrt(len(blocks))
    return bool(((scatter <= tolerance) | ~np.isfinite(scatter)).all())
