"""Components of uncertainty: the independent errors of a cause, and their effects."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chipglow.quantities import Array, Brief

DistributionKind: TypeAlias = Literal["normal", "rectangular", "triangular", "arcsine"]
"""Distribution of an error; a normal one with degrees of freedom is Student's."""

HALF_WIDTHS: Final[Mapping[str, float]] = {
    "rectangular": sqrt(3.0), "triangular": sqrt(6.0), "arcsine": sqrt(2.0),
}  # fmt: skip
"""Half-widths of the bounded distributions of unit variance."""

MAD_FACTOR: Final = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

_MOST: Final = 200_000_000
"""Numbers that the effects of one component may take: 1.6 GB."""

_DISTRIBUTIONS: Final = get_args(DistributionKind)


@dataclass(frozen=True)
class Cause:
    """A cause of errors: an input quantity of the GUM, with one or several independent errors.

    Two causes are the same, and their errors fully correlated, if they have the same name and the
    same identity.
    """

    name: str
    """Its name, such as ``"calibration"``. Budgets have a line for each name."""
    identity: str = ""
    """Tells causes of one name apart whose errors are independent."""
    errors: int = 1
    """Number of independent errors: 1 for a systematic one, the number of pixels for noise."""
    degrees_of_freedom: float = inf
    """Degrees of freedom of the standard uncertainty; infinite if it is exactly known."""
    pooled: bool = True
    """Whether one estimate with these degrees of freedom serves all errors (JCGM 100:2008, H.3)."""
    parts: tuple[str, ...] = ()
    """Names of the errors in budgets, if each has a separate line."""
    distribution: DistributionKind = "normal"
    """Distribution of each error."""

    def __post_init__(self) -> None:
        rules = {
            f"its name is {self.name!r}, expected a name": self.name.strip(),
            f"has {self.errors} errors, expected 1 or more": self.errors >= 1,
            f"degrees of freedom are {self.degrees_of_freedom!r}, expected more than 0": (
                self.degrees_of_freedom > 0
            ),
            f"has {len(self.parts)} parts, expected {self.errors}": (
                len(self.parts) in (0, self.errors)
            ),
            f"distribution: {self.distribution!r}, expected one of {', '.join(_DISTRIBUTIONS)}": (
                self.distribution in _DISTRIBUTIONS
            ),
        }
        if wrong := [text for text, holds in rules.items() if not holds]:
            raise ValueError(f"component {self.name}: {wrong[0]}")

    @property
    def lines(self) -> tuple[str, ...]:
        """Names of its lines in a budget, each once."""
        return tuple(dict.fromkeys(self.parts or (self.name,)))

    @property
    def key(self) -> tuple[str, str]:
        """Name and identity of the cause."""
        return self.name, self.identity


@dataclass(frozen=True, eq=False, repr=False)
class Component(Brief):
    """Effects of the errors of one cause on an estimate."""

    cause: Cause
    effects: Any
    """Change of each value by an error of one standard uncertainty, with its sign.

    Array or sparse array of shape (values, errors): the sensitivity coefficient times the standard
    uncertainty of JCGM 100:2008, 5.1.3.
    """

    def __post_init__(self) -> None:
        if self.effects.ndim != 2 or self.effects.shape[1] != self.cause.errors:
            raise ValueError(
                f"component {self.cause.name}: effects have shape {self.effects.shape}, "
                f"expected (values, {self.cause.errors})"
            )
        if not sparse.issparse(self.effects):
            self.effects.setflags(write=False)

    @property
    def variance(self) -> Array:
        """Contribution to the variance of each value, shape (values,)."""
        return np.asarray(_squared(self.effects).sum(axis=1), np.float64).ravel()

    @property
    def fourth_moment(self) -> Array:
        """Sum of u⁴/ν in the formula of Welch and Satterthwaite, shape (values,)."""
        if self.cause.pooled or self.cause.errors == 1:
            return self.variance**2 / self.cause.degrees_of_freedom
        fourth = _squared(_squared(self.effects)).sum(axis=1)
        return np.asarray(fourth, np.float64).ravel() / self.cause.degrees_of_freedom

    @property
    def per_element(self) -> bool:
        """Whether every value has one separate error."""
        size, errors = self.effects.shape
        if not sparse.issparse(self.effects) or size != errors or self.effects.nnz != size:
            return False
        return bool((self.effects.indices == np.arange(size)).all())

    def of_line(self, name: str) -> "Component | None":
        """Return what of it counts in a line of a budget; None if nothing does."""
        if name not in self.cause.lines:
            return None
        if not self.cause.parts:
            return self
        errors = [index for index, part in enumerate(self.cause.parts) if part == name]
        cause = replace(self.cause, errors=len(errors), parts=())
        return Component(cause, self.effects[:, errors])

    def scaled(self, factors: Array) -> Any:
        """Return the effects on values that are multiplied by factors of shape (values,)."""
        if sparse.issparse(self.effects):
            found = self.effects.copy()
            found.data *= np.repeat(factors, np.diff(found.indptr))
            return found
        return self.effects * factors[:, None]

    def taken(self, rows: NDArray[np.intp]) -> "Component":
        """Return the component of some of the values, some of them several times."""
        if sparse.issparse(self.effects):
            count = int(np.diff(self.effects.indptr)[rows].sum())
        else:
            count = rows.size * self.cause.errors
        if count > _MOST:
            raise ValueError(
                f"component {self.cause.name}: {count:.1e} effects of single errors on single "
                f"values, expected {_MOST:.0e} at most: use chipglow.uncertainty.draw"
            )
        return Component(self.cause, self.effects[rows])


def _squared(effects: Any) -> Any:
    return effects.power(2) if sparse.issparse(effects) else np.square(effects)
