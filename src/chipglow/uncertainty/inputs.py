"""Input quantities of a model: their distributions, correlations and groups."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite, sqrt
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from chipglow.quantities import Array
from chipglow.uncertainty.component import HALF_WIDTHS, DistributionKind
from chipglow.uncertainty.limits import Limits

InputDistributionKind: TypeAlias = DistributionKind | Literal["discrete", "random"]
"""Distribution of an input; ``random`` is uniform from 0 to 1: an effect without a set value."""

_DISTRIBUTIONS: Final = (*get_args(DistributionKind), "discrete", "random")

_EDGE: Final = 1e-12
"""Smallest distance from 0 and 1 of the number from which a value is computed."""

_ONE_BELOW: Final = float(ndtr(-1.0))
"""Probability of a normal value more than one standard uncertainty below its mean."""

_NO_VARIANCE: Final = 2.0
"""Degrees of freedom up to which Student's distribution has no finite variance."""


@dataclass(frozen=True)
class Input:
    """One input quantity of a model.

    Parameters
    ----------
    name : str
        Its name in budgets.
    value : float
        Best estimate.
    standard_uncertainty : float
        Standard uncertainty, in the unit of the value.
    distribution : str
        normal (Student's with finite `degrees_of_freedom`), rectangular, triangular, arcsine;
        discrete, one of `values` with equal probabilities; or random, uniform from 0 to 1.
    degrees_of_freedom : float
        Degrees of freedom of the standard uncertainty.
    values : tuple of float
        Values of a discrete input.
    group : str
        Group whose contribution to the variance is stated as one.
    low, high : float
        Smallest and largest possible value, at which the distribution is truncated (`Limits`).
    unit : str
        Unit of the value.

    Raises
    ------
    ValueError
        If the distribution is unknown, a number is impossible, or more than half of the
        distribution is outside the limits.
    """

    name: str
    value: float = 0.5
    standard_uncertainty: float = sqrt(1 / 12)  # of evenly distributed numbers from 0 to 1
    distribution: InputDistributionKind = "random"
    degrees_of_freedom: float = inf
    values: tuple[float, ...] = ()
    group: str = ""
    low: float = -inf
    high: float = inf
    unit: str = "1"

    def __post_init__(self) -> None:
        if self.distribution not in _DISTRIBUTIONS:
            raise ValueError(
                f"{self.name}: distribution: {self.distribution!r}, expected one of "
                f"{', '.join(_DISTRIBUTIONS)}"
            )
        rules = {
            f"degrees_of_freedom: {self.degrees_of_freedom!r}, expected more than 0": (
                self.degrees_of_freedom > 0
            ),
            f"degrees_of_freedom: {self.degrees_of_freedom:g} of a {self.distribution} "
            "distribution, expected a normal one": (
                self.distribution == "normal" or self.degrees_of_freedom == inf
            ),
            f"values: {list(self.values)}, expected 2 or more finite numbers": (
                self.distribution != "discrete"
                or (len(self.values) > 1 and np.isfinite(self.values).all())
            ),
            f"standard_uncertainty: {self.standard_uncertainty!r}, expected more than 0": (
                not self.has_slope or 0 < self.standard_uncertainty < inf
            ),
            f"value: {self.value!r}, expected a number from {self.low:g} to {self.high:g}": (
                not self.has_slope or (isfinite(self.value) and self.low <= self.value <= self.high)
            ),
        }
        if wrong := [text for text, holds in rules.items() if not holds]:
            raise ValueError(f"{self.name}: {wrong[0]}")
        self.limits.check(*self.outside)

    @property
    def has_slope(self) -> bool:
        """Whether a sensitivity coefficient describes its effect."""
        return self.distribution not in ("discrete", "random")

    @property
    def has_variance(self) -> bool:
        """Whether its variance is finite."""
        return self.distribution != "normal" or self.degrees_of_freedom > _NO_VARIANCE

    @property
    def limits(self) -> Limits:
        """Limits of its values."""
        return Limits(self.name, self.low, self.high, "" if self.unit == "1" else self.unit)

    @property
    def outside(self) -> tuple[float, float]:
        """Parts of the stated distribution that are below and above the limits."""
        low, high = self._inside
        return low, 1.0 - high

    @property
    def one_apart(self) -> tuple[float, float]:
        """Possible values one standard uncertainty below and above the best estimate.

        If the distribution is truncated, they are not beyond its quantiles of 16 % and 84 %.
        """
        low, high = self.at(np.array([_ONE_BELOW, 1 - _ONE_BELOW])).tolist()
        step = self.standard_uncertainty
        return max(self.value - step, low), min(self.value + step, high)

    def at(self, numbers: Array) -> Array:
        """Return the quantiles at numbers from 0 to 1."""
        inside = np.clip(numbers, _EDGE, 1 - _EDGE)
        if self.distribution == "random":
            return np.asarray(inside)
        if self.distribution == "discrete":
            numbers = (inside * len(self.values)).astype(int)
            return np.asarray(np.array(self.values)[numbers], np.float64)
        first, last = self._inside
        inside = first + inside * (last - first)
        width = HALF_WIDTHS.get(self.distribution, 0.0)
        if self.distribution == "rectangular":
            errors = width * (2 * inside - 1)
        elif self.distribution == "triangular":
            reach = 1 - np.sqrt(2 * np.minimum(inside, 1 - inside))
            errors = width * np.copysign(reach, inside - 0.5)
        elif self.distribution == "arcsine":
            errors = width * np.sin(np.pi * (inside - 0.5))
        elif isfinite(self.degrees_of_freedom):
            errors = stdtrit(self.degrees_of_freedom, inside)
        else:
            errors = ndtri(inside)
        # Rounding may move a value at a limit beyond it.
        return np.clip(self.value + self.standard_uncertainty * errors, self.low, self.high)

    @cached_property
    def _inside(self) -> tuple[float, float]:
        """Return the probabilities of the stated distribution below its two limits."""
        if not self.has_slope:
            return 0.0, 1.0
        low = self._below(self.low) if self.low > -inf else 0.0
        high = self._below(self.high) if self.high < inf else 1.0
        return low, high

    def _below(self, value: float) -> float:
        """Return the probability of the stated distribution below a value."""
        error = (value - self.value) / self.standard_uncertainty
        part = float(np.clip(error / HALF_WIDTHS.get(self.distribution, 1.0), -1.0, 1.0))
        if self.distribution == "rectangular":
            return (1 + part) / 2
        if self.distribution == "triangular":
            tail = (1 - abs(part)) ** 2 / 2
            return tail if part < 0 else 1 - tail
        if self.distribution == "arcsine":
            return float(0.5 + np.arcsin(part) / np.pi)
        if isfinite(self.degrees_of_freedom):
            return float(stdtr(self.degrees_of_freedom, error))
        return float(ndtr(error))


@dataclass(frozen=True, eq=False)
class Inputs:
    """Input quantities with the correlations of some of them.

    Parameters
    ----------
    inputs : sequence of Input
        Their names differ.
    correlations : sequence of (str, str, float)
        Correlation coefficients, from -1 to 1, of pairs of inputs by their names; the two must be
        in one group.

    Raises
    ------
    ValueError
        If a name occurs twice, or a correlation is of an input that is unknown, discrete or itself,
        of two groups, stated twice, or impossible.

    Notes
    -----
    Correlated inputs have a Gaussian copula, whose coefficients are the stated ones: for normal
    inputs they are the correlations, for others nearly.
    """

    inputs: Sequence[Input]
    correlations: Sequence[tuple[str, str, float]] = ()

    def __post_init__(self) -> None:
        if len(set(self.names)) < len(self.names):
            raise ValueError(f"inputs: {', '.join(self.names)}: a name occurs twice")
        stated = set[frozenset[str]]()
        for *pair, value in self.correlations:
            for name in pair:
                if name not in self.names or not self[name].has_slope:
                    raise ValueError(f"correlations: {name!r} is not a continuous input")
            one, two = pair
            if one == two:
                raise ValueError(f"correlations: {one} with itself, expected two inputs")
            if frozenset(pair) in stated:
                raise ValueError(f"correlations: {one} and {two} are stated twice, expected once")
            stated.add(frozenset(pair))
            if not -1.0 <= value <= 1.0:
                raise ValueError(
                    f"correlations: {value!r} of {one} and {two}, expected a number from -1 to 1"
                )
            groups = [self[name].group for name in pair]
            if groups[0] != groups[1]:
                raise ValueError(
                    f"correlations: {one} is in the group {groups[0]!r}, {two} in "
                    f"{groups[1]!r}; both must be in the same group"
                )
        # The variance of a sum is 0 if it is exactly known: rounding may make that less.
        if np.linalg.eigvalsh(self.correlation).min(initial=1.0) < -1e-9:
            raise ValueError(
                "correlations: they contradict each other, expected a positive semidefinite matrix"
            )

    def __getitem__(self, name: str) -> Input:
        return self.inputs[self.names.index(name)]

    def __len__(self) -> int:
        return len(self.inputs)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(one.name for one in self.inputs)

    @cached_property
    def correlation(self) -> Array:
        """Correlation matrix."""
        matrix = np.eye(len(self))
        for one, two, value in self.correlations:
            i, j = self.names.index(one), self.names.index(two)
            matrix[i, j] = matrix[j, i] = value
        return matrix

    @property
    def groups(self) -> dict[str, list[int]]:
        """Indices of the inputs by group."""
        found: dict[str, list[int]] = {}
        for number, one in enumerate(self.inputs):
            found.setdefault(one.group or one.name, []).append(number)
        return found

    @property
    def has_variance(self) -> bool:
        """Whether the variances of all inputs are finite."""
        return all(one.has_variance for one in self.inputs)

    @property
    def truncated(self) -> list[str]:
        """Sentences on the inputs whose distributions reach beyond their limits."""
        return [text for one in self.inputs for text in one.limits.stated(*one.outside)]

    def at(self, numbers: Array) -> Array:
        """Return the values of the inputs at independent numbers from 0 to 1, (trial, input)."""
        if self.correlations:
            normal = ndtri(np.clip(numbers, _EDGE, 1 - _EDGE))
            numbers = ndtr(normal @ self.root)
        columns = [one.at(column) for one, column in zip(self.inputs, numbers.T, strict=True)]
        return np.stack(columns, axis=1)

    @cached_property
    def root(self) -> Array:
        """Symmetric square root of the correlation matrix.

        Unlike Cholesky's it exists for a singular matrix, and it does not mix independent inputs.
        """
        values, directions = np.linalg.eigh(self.correlation)
        return np.asarray(directions * np.sqrt(np.maximum(values, 0.0)) @ directions.T)
