"""Propagation of distributions by Monte Carlo, which validates the propagation to first order."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri, stdtrit

from chipglow.quantities import Array, Brief
from chipglow.uncertainty.draws import draw
from chipglow.uncertainty.estimate import Estimate, as_estimate
from chipglow.uncertainty.limits import Limits

_BLOCK: Final = 10_000
"""Trials of a block (JCGM 101:2008, 7.9.4)."""

_BLOCKS: Final = 20
"""Blocks from whose scatter the number of trials follows."""

_SUMMARIES: Final = 4
"""Results that are to be stable together: mean, standard uncertainty and both ends."""

_CONFIDENCE: Final = 0.95
"""Confidence that all results are within the tolerance."""

VALIDATED: Final = 0.05
"""Largest difference of the ends of two intervals that agree, in standard uncertainties.

Half a unit in the second significant digit is 0.5 % to 5 % of a number: the verdict would jump
between 9.9 and 10.
"""


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarlo(Brief):
    """Distribution of a function of estimates, for each element of its result.

    Parameters
    ----------
    mean, standard_uncertainty : ndarray
        Mean and standard uncertainty of all trials; not finite if they do not exist, such as with
        2 degrees of freedom or fewer.
    low, high : ndarray
        Ends of the probabilistically symmetric coverage interval.
    level : float
        Coverage probability of the interval.
    tolerance : float
        Numerical tolerance of the results, in standard uncertainties.
    trials : int
        Number of trials.
    is_stable : ndarray of bool
        Where all four results are within the tolerance, with 95 % confidence; elsewhere they are
        not finite, or the limit of the number of trials was reached.
    truncated : tuple of str
        Sentences on the inputs whose distributions reach beyond their limits.
    """

    mean: Array
    standard_uncertainty: Array
    low: Array
    high: Array
    level: float
    tolerance: float
    trials: int
    is_stable: NDArray[np.bool_]
    truncated: tuple[str, ...] = ()

    def validates(self, estimate: Estimate, within: float = VALIDATED) -> NDArray[np.bool_]:
        """Return where the interval of an estimate to first order agrees (JCGM 101:2008, 8.1).

        Both ends must agree `within` this part of the standard uncertainty.
        """
        reach = estimate.expanded_uncertainty(self.level)
        ends = (estimate.values - reach - self.low, estimate.values + reach - self.high)
        return np.asarray(np.maximum(*np.abs(ends)) <= within * estimate.standard_uncertainty)


def monte_carlo(
    function: Callable[..., Any],
    *inputs: Any,
    generator: np.random.Generator,
    level: float = 0.95,
    tolerance: float = 0.01,
    most: int = 10_000_000,
    limits: Sequence[Limits | None] = (),
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
    tolerance : float
        Largest error of the results by the draws, in standard uncertainties: a fifth of that of
        `MonteCarlo.validates` (JCGM 101:2008, 8.2).
    most : int
        Largest number of trials.
    limits : sequence of Limits or None
        Physical limits of the inputs, at which their distributions are truncated.

    Raises
    ------
    ValueError
        If more than half of the draws of an input are outside its limits.

    Notes
    -----
    From the scatter of 20 blocks of trials follows the number of trials with which mean, standard
    uncertainty and both ends of the interval are all within the tolerance, with 95 % confidence
    (Wuebbeler et al., Metrologia 47 (2010) 317: with more and more blocks, as in JCGM 101:2008,
    7.9.4, chance ends the trials too early).
    """
    estimates = [as_estimate(one) for one in inputs]
    freedoms = (part.cause.degrees_of_freedom for one in estimates for part in one.components)
    source = _Truncated(estimates, generator, limits)

    def sample(count: int) -> Array:
        return np.asarray(function(*source.draw(count)), np.float64)

    block = max(ceil(100 / (1 - level)), _BLOCK)
    has_variance = min(freedoms, default=np.inf) > 2
    found = adaptive(sample, level, tolerance, most, block, has_variance)
    return replace(found, truncated=source.stated())


class _Truncated:
    """Draws of estimates within limits: those with a value outside are drawn again."""

    def __init__(
        self,
        estimates: Sequence[Estimate],
        generator: np.random.Generator,
        limits: Sequence[Limits | None],
    ) -> None:
        self.estimates, self.generator = estimates, generator
        self.limits = {number: one for number, one in enumerate(limits) if one is not None}
        self.count = 0
        self.outside = {number: np.zeros(2) for number in self.limits}

    def draw(self, count: int) -> list[Array]:
        """Return values of each estimate, shape (count, ...)."""
        parts: list[list[Array]] = []
        lacking = count
        while lacking:
            drawn = draw(self.estimates, max(lacking, _BLOCKS), self.generator, True)
            kept = self._kept(drawn)
            parts.append([one[kept][:lacking] for one in drawn])
            lacking -= len(parts[-1][0])
        return [np.concatenate(one) for one in zip(*parts, strict=True)]

    def stated(self) -> tuple[str, ...]:
        """Return sentences on the inputs that are truncated."""
        return tuple(
            text
            for number, one in self.limits.items()
            for text in one.stated(*self.outside[number] / self.count)
        )

    def _kept(self, drawn: Sequence[Array]) -> NDArray[np.bool_]:
        """Return which draws are within all limits; a ValueError if most are outside."""
        kept = np.ones(len(drawn[0]), np.bool_)
        self.count += len(kept)
        for number, one in self.limits.items():
            values = drawn[number].reshape(len(kept), -1)
            outside = np.stack([values < one.low, values > one.high]).any(axis=2)
            self.outside[number] += outside.sum(axis=1)
            if self.count >= _BLOCK:
                one.check(*self.outside[number] / self.count)
            kept &= ~outside.any(axis=0)
        return kept


def adaptive(
    sample: Callable[[int], Array],
    level: float,
    tolerance: float,
    most: int,
    block: int,
    has_variance: bool = True,
    progress: Callable[[float], None] = lambda part: None,
) -> MonteCarlo:
    """Return the distribution of samples, as `monte_carlo`; `sample` takes a number of trials."""
    block = max(min(block, most // _BLOCKS), 1)
    ends = ((1 - level) / 2, (1 + level) / 2)
    values: list[Array] = []
    blocks: list[Array] = []
    needed = np.array(_BLOCKS)
    while len(blocks) < (last := min(int(needed.max()), most // block)):
        progress(len(blocks) / last)
        values.append(sample(block))
        blocks.append(_summary(values[-1], ends, has_variance))
        if len(blocks) == _BLOCKS:
            needed = _needed(np.array(blocks), tolerance, level)
    progress(1.0)
    mean, deviation, low, high = _summary(np.concatenate(values), ends, has_variance)
    is_stable = (needed > 0) & (needed <= len(blocks))
    trials = block * len(blocks)
    return MonteCarlo(mean, deviation, low, high, level, tolerance, trials, is_stable)


def _summary(values: Array, ends: tuple[float, float], has_variance: bool) -> Array:
    """Return mean and standard deviation, NaN without a variance, and the interval's ends."""
    with np.errstate(invalid="ignore"):
        moments = np.array([values.mean(axis=0), values.std(axis=0, ddof=1)])
    moments = moments if has_variance else np.full_like(moments, np.nan)
    return np.concatenate([moments, np.quantile(values, ends, axis=0)])


def _needed(blocks: Array, tolerance: float, level: float) -> NDArray[np.int64]:
    """Return the number of blocks with which results are within a tolerance; 0 if unknown.

    The first stage of Stein's procedure; a mean and a standard deviation may be infinite.
    """
    low, high = blocks[:, 2:].mean(axis=0)
    size = tolerance * (high - low) / (2 * ndtri((1 + level) / 2))
    # Bonferroni's inequality: all results together have the confidence.
    factor = stdtrit(len(blocks) - 1, 1 - (1 - _CONFIDENCE) / (2 * _SUMMARIES))
    with np.errstate(invalid="ignore", divide="ignore"):
        scatter = blocks.std(axis=0, ddof=1)
        needed = np.where(scatter == 0, 0.0, (factor * scatter / size) ** 2)
    needed[:2] = np.where(np.isfinite(needed[:2]), needed[:2], 0.0)
    largest = np.maximum(needed.max(axis=0), len(blocks))
    return np.where(np.isfinite(largest), np.ceil(largest), 0).astype(np.int64)
