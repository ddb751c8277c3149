"""A figure of merit over its draws: its scatter, and the causes of the scatter."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite, nan, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import expit, logit, stdtr, stdtrit

from chipglow.quantities import Brief

PIXEL_PHASE: Final = "pixel phase"
"""Position of the pixels on the scene: a known population, of which every value is as likely."""

TOGETHER: Final = "causes together"
"""Interactions: the scatter that no single cause explains."""

COVERAGE: Final = 0.95
"""Probability of `Distribution.interval` and `Distribution.expanded_uncertainty`."""

FEWEST: Final = 3
"""Values of each random cause from which an interval is stated: two do not show their scatter."""


def student_factor(freedom: float) -> float:
    """Return the coverage factor for a number of degrees of freedom; infinite below two."""
    return _factor(freedom) if freedom >= FEWEST - 1 else inf


def _factor(freedom: float) -> float:
    return float(stdtrit(freedom, (1 + COVERAGE) / 2))


class VarianceComponent(NamedTuple):
    """Scatter by one cause: its number of values, deviation of its means, part of the variance."""

    draws: int
    standard_deviation: float
    fraction: float


@dataclass(frozen=True, eq=False, repr=False)
class Distribution(Brief):
    """One finite number for each combination of its causes, which are the axes of the values.

    `missing` are causes of scatter of which only one value was drawn; `limits` are those between
    which the number lies by its nature, such as 0 and infinity for a length. Uncertainty and
    interval are infinite if a random cause has fewer than three values, see `too_few`.
    """

    values: NDArray[np.float64]
    causes: tuple[str, ...]
    missing: tuple[str, ...] = ()
    limits: tuple[float, float] = (-inf, inf)

    def __post_init__(self) -> None:
        if self.values.ndim != len(self.causes) or self.values.size == 0:
            raise ValueError(
                f"distribution: values have shape {self.values.shape}, expected at least one "
                f"draw of each of {', '.join(self.causes)}"
            )
        if not np.isfinite(self.values).all():
            raise ValueError("distribution: a value is not finite, expected numbers alone")

    def having(self, values: NDArray[np.float64]) -> "Distribution":
        """Return other values of the same draws, without limits."""
        return replace(self, values=values, limits=(-inf, inf))

    @property
    def draws(self) -> int:
        return int(self.values.size)

    @property
    def mean(self) -> float:
        return float(self.values.mean())

    @property
    def standard_deviation(self) -> float:
        """Sample standard deviation of the draws; NaN for a single one."""
        return float(self.values.std(ddof=1)) if self.draws > 1 else nan

    @property
    def too_few(self) -> Mapping[str, int]:
        """Causes with too few values for an interval, and how many of them were drawn."""
        counts = zip(self.causes, self.values.shape, strict=True)
        few = {name: n for name, n in counts if 1 < n < FEWEST and name != PIXEL_PHASE}
        return dict.fromkeys(self.missing, 1) | few

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest draw."""
        return float(self.values.min()), float(self.values.max())

    @cached_property
    def parts(self) -> Mapping[str, VarianceComponent]:
        """Analysis of variance of the complete design; last the combinations of causes."""
        total = float(((self.values - self.mean) ** 2).sum())
        parts, axes = {}, range(self.values.ndim)
        for axis, name in enumerate(self.causes):
            means = self.values.mean(axis=tuple(other for other in axes if other != axis))
            squares = self.draws / means.size * float(((means - self.mean) ** 2).sum())
            deviation = float(means.std(ddof=1)) if means.size > 1 else nan
            fraction = squares / total if total else 0.0
            parts[name] = VarianceComponent(means.size, deviation, fraction)
        rest = max(1.0 - sum(part.fraction for part in parts.values()), 0.0) if total else 0.0
        freedom = self._freedoms[-1]
        deviation = sqrt(rest * total / freedom) if freedom else nan
        parts[TOGETHER] = VarianceComponent(self.draws, deviation, rest)
        return parts

    @property
    def interval(self) -> tuple[float, float]:
        """Prediction interval for one further draw; infinite if that is not known.

        The phases are a known population, the other causes random: t distributions around the mean
        of each phase, with the sum of their variances (JCGM 100, G.4). With finite limits the
        interval is computed for the logarithm or the logit.
        """
        low, high = self.limits
        if not isfinite(low) or not low < self.range[0] <= self.range[1] < high:
            return self._interval
        above = self.values - low
        transformed = logit(above / (high - low)) if isfinite(high) else np.log(above)
        ends = np.array(self.having(transformed)._interval)
        if not np.isfinite(ends).all():
            return -inf, inf
        ends = low + ((high - low) * expit(ends) if isfinite(high) else np.exp(ends))
        return float(ends[0]), float(ends[1])

    @property
    def expanded_uncertainty(self) -> float:
        """Expanded uncertainty of the mean at a coverage of 95 %; infinite if unknown."""
        if self.too_few or self.draws == 1:
            return inf
        variance, freedom = self._random(of_next=False)
        return _factor(freedom) * sqrt(variance) if variance else 0.0

    def differs_from(self, value: float, half_width: float = 0.0) -> bool:
        """Return whether a value ± its half-width lies outside the interval."""
        low, high = self.interval
        return value + half_width < low or high < value - half_width

    @property
    def _interval(self) -> tuple[float, float]:
        if self.too_few or self.draws == 1:
            return -inf, inf
        variance, freedom = self._random(of_next=True)
        known = PIXEL_PHASE in self.causes
        others = tuple(i for i, name in enumerate(self.causes) if name != PIXEL_PHASE)
        means = self.values.mean(axis=others).ravel() if known else np.array([self.mean])
        tail = (1 - COVERAGE) / 2
        if not variance:
            return float(np.quantile(means, tail)), float(np.quantile(means, 1 - tail))
        scale = sqrt(variance)

        def quantile(probability: float) -> float:
            reach = scale * float(stdtrit(freedom, probability))
            low, high = means.min() + reach, means.max() + reach
            if low == high:
                return float(low)
            excess = lambda x: float(stdtr(freedom, (x - means) / scale).mean()) - probability  # noqa: E731
            return float(brentq(excess, low, high))

        return quantile(tail), quantile(1 - tail)

    def _random(self, of_next: bool) -> tuple[float, float]:
        """Return variance and degrees of freedom by the random causes: of a draw or of the mean."""
        terms = [
            (part.standard_deviation**2 * (of_next + 1 / part.draws), freedom)
            for (name, part), freedom in zip(self.parts.items(), self._freedoms, strict=True)
            if freedom > 0 and name != PIXEL_PHASE
        ]
        variance = sum(term for term, _ in terms)
        if not variance:
            return 0.0, inf
        return variance, variance**2 / sum(term**2 / degrees for term, degrees in terms)

    @property
    def _freedoms(self) -> list[int]:
        """Degrees of freedom of the causes, and of their combinations."""
        alone = [count - 1 for count in self.values.shape]
        return [*alone, self.draws - 1 - sum(alone)]
