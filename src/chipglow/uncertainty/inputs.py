"""Input quantities of a model: their distributions, correlations and groups."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, sqrt
from typing import Final, Literal, TypeAlias

import numpy as np
from scipy.special import ndtr, ndtri, stdtrit

from chipglow.quantities import Array
from chipglow.uncertainty.component import HALF_WIDTHS, Distribution

InputDistribution: TypeAlias = Distribution | Literal["discrete", "random"]
"""Distribution of an input; ``random`` is uniform from 0 to 1: an effect without a set value."""

_EDGE: Final = 1e-12
"""Smallest distance from 0 and 1 of the number from which a value is computed."""


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
    """

    name: str
    value: float = 0.5
    standard_uncertainty: float = sqrt(1 / 12)
    distribution: InputDistribution = "random"
    degrees_of_freedom: float = inf
    values: tuple[float, ...] = ()
    group: str = ""

    @property
    def has_slope(self) -> bool:
        """Whether a sensitivity coefficient describes its effect."""
        return self.distribution not in ("discrete", "random")

    def at(self, numbers: Array) -> Array:
        """Return the quantiles at numbers from 0 to 1."""
        inside = np.clip(numbers, _EDGE, 1 - _EDGE)
        if self.distribution == "random":
            return np.asarray(inside)
        if self.distribution == "discrete":
            numbers = (inside * len(self.values)).astype(int)
            return np.asarray(np.array(self.values)[numbers], np.float64)
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
        return np.asarray(self.value + self.standard_uncertainty * errors, np.float64)


@dataclass(frozen=True, eq=False)
class Inputs:
    """Input quantities with the correlations of some of them.

    Parameters
    ----------
    inputs : sequence of Input
        Their names differ.
    correlations : mapping
        Correlation coefficients by pairs of names; the two must be in one group.

    Raises
    ------
    ValueError
        If a correlation is of an input that is unknown or discrete, of two groups, or impossible.

    Notes
    -----
    Correlated inputs have a Gaussian copula, whose coefficients are the stated ones: for normal
    inputs they are the correlations, for others nearly.
    """

    inputs: Sequence[Input]
    correlations: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for pair in self.correlations:
            for name in pair:
                if name not in self.names or not self[name].has_slope:
                    raise ValueError(f"correlations: {name!r} is not a continuous input")
            groups = [self[name].group for name in pair]
            if groups[0] != groups[1]:
                raise ValueError(
                    f"correlations: {pair[0]} is in the group {groups[0]!r}, {pair[1]} in "
                    f"{groups[1]!r}, expected the same group"
                )
        if np.linalg.eigvalsh(self.correlation).min(initial=1.0) <= 0.0:
            raise ValueError("correlations: must form a positive definite matrix")

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
        for pair, value in self.correlations.items():
            i, j = map(self.names.index, pair)
            matrix[i, j] = matrix[j, i] = value
        return matrix

    @property
    def groups(self) -> dict[str, list[int]]:
        """Indices of the inputs by group."""
        found: dict[str, list[int]] = {}
        for number, one in enumerate(self.inputs):
            found.setdefault(one.group or one.name, []).append(number)
        return found

    def at(self, numbers: Array) -> Array:
        """Return the values of the inputs at independent numbers from 0 to 1, (trial, input)."""
        if self.correlations:
            normal = ndtri(np.clip(numbers, _EDGE, 1 - _EDGE))
            numbers = ndtr(normal @ np.linalg.cholesky(self.correlation).T)
        columns = [one.at(column) for one, column in zip(self.inputs, numbers.T, strict=True)]
        return np.stack(columns, axis=1)
