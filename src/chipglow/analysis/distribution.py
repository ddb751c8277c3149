"""A figure of merit over its draws: its scatter, and the causes of the scatter."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf, nan, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

TOGETHER: Final = "causes together"
"""What no cause makes by itself: it needs two or three of them."""

COVERAGE: Final = 0.95
"""Probability with which one more draw lies within `Distribution.interval`."""


class VarianceComponent(NamedTuple):
    """Scatter by one cause: its number of values, deviation of its means, part of the variance."""

    draws: int
    standard_deviation: float
    fraction: float


@dataclass(frozen=True, eq=False)
class Distribution:
    """One finite number for each combination of its causes, which are the axes of the values."""

    values: NDArray[np.float64]
    causes: tuple[str, ...]

    def __post_init__(self) -> None:
        if self.values.ndim != len(self.causes) or self.values.size == 0:
            raise ValueError(
                f"distribution: values have shape {self.values.shape}, expected one or more draws "
                f"of each of {', '.join(self.causes)}"
            )
        if not np.isfinite(self.values).all():
            raise ValueError("distribution: a value is not finite, expected numbers alone")

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
    def range(self) -> tuple[float, float]:
        """Least and greatest draw."""
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
        """Prediction interval for one more draw (JCGM 100, G.4); infinite for a single draw."""
        terms = [
            (part.standard_deviation**2 * (1 + 1 / part.draws), freedom)
            for part, freedom in zip(self.parts.values(), self._freedoms, strict=True)
            if freedom > 0
        ]
        variance = sum(term for term, _ in terms)
        if not terms:
            return -inf, inf
        if variance == 0.0:
            return self.mean, self.mean
        freedom = variance**2 / sum(term**2 / degrees for term, degrees in terms)
        half = float(stdtrit(freedom, (1 + COVERAGE) / 2)) * sqrt(variance)
        return self.mean - half, self.mean + half

    def differs_from(self, value: float) -> bool:
        low, high = self.interval
        return not low <= value <= high

    def fraction_below(self, value: float) -> float:
        """Return the part of the draws under a value, 0 to 1; equal draws count half."""
        return float(((self.values < value) + 0.5 * (self.values == value)).mean())

    @property
    def _freedoms(self) -> list[int]:
        """Degrees of freedom of the causes, and of their combinations."""
        alone = [count - 1 for count in self.values.shape]
        return [*alone, self.draws - 1 - sum(alone)]
