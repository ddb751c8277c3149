"""The one type of a result with its uncertainty."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from typing import Any, Final
from uuid import uuid4

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.special import stdtrit

from chipglow.quantities import ROUNDING, Array, Brief, brief
from chipglow.uncertainty.component import Cause, Component, DistributionKind

_MOST_FREEDOM: Final = 1e6
"""Above this number, Student's factor of 95 % differs from the normal one by less than 3e-6."""


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Brief):
    """Values with the components of their uncertainty.

    An estimate is created from its values alone and gets its components from `with_component`,
    `from_observations` or `from_covariance`. Sums, products and `propagate` keep the effect of
    every single error, with its sign, so what two results have in common is known: the difference
    of an estimate and itself is exact.

    Parameters
    ----------
    values : array_like
        Values of any shape; NaN if unknown.
    components : iterable of Component
        Independent of each other.
    unevaluated : iterable of str
        Causes that play a part, but of which nothing is known here: they are in the budget without
        a number and not in the uncertainty.
    warnings : iterable of str
        Doubts about the values beyond their uncertainty, as sentences. Whatever is
        computed of the estimate has them too.

    Notes
    -----
    The law of propagation of uncertainty (JCGM 100:2008, 5.1.2 and 5.2.2), written with
    independent errors of unit variance: y = f(x) + Σ cᵢ eᵢ. Covariances are then never stored:
    they are the products of effects.
    """

    values: Array
    components: tuple[Component, ...] = ()
    unevaluated: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    __array_ufunc__ = None
    """NumPy leaves arithmetic with arrays to this class."""

    def __post_init__(self) -> None:
        values = np.array(self.values, np.float64)
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "components", tuple(self.components))
        for name in ("unevaluated", "warnings"):
            object.__setattr__(self, name, tuple(dict.fromkeys(getattr(self, name))))
        keys = [component.cause.key for component in self.components]
        if len(set(keys)) < len(keys):
            raise ValueError(f"estimate: a component occurs twice: {keys}")
        known = np.isfinite(values).ravel()
        for component in self.components:
            name, effects = component.cause.name, component.effects
            if effects.shape[0] != values.size:
                raise ValueError(
                    f"component {name}: has effects on {effects.shape[0]} values, "
                    f"expected {values.size}"
                )
            numbers = effects.data if sparse.issparse(effects) else effects
            if not np.isfinite(numbers).all() and not np.isfinite(component.variance[known]).all():
                raise ValueError(f"component {name}: an effect is not finite, expected finite ones")

    def with_component(
        self,
        name: str,
        effect: ArrayLike,
        *,
        identity: str | None = None,
        per_element: bool = False,
        degrees_of_freedom: float = np.inf,
        pooled: bool = True,
        distribution: DistributionKind = "normal",
    ) -> "Estimate":
        """Return the estimate with one more component.

        `effect` is its standard uncertainty, with the sign of its effect on each value: one number
        or one for each value. The error is one for all values or, `per_element`, another for each.
        It is independent of all other components, unless they have the same name and the same
        `identity`, such as the serial number of an instrument: these are one error. The rest is as
        in `Cause`.
        """
        signed = np.broadcast_to(np.asarray(effect, np.float64), self.values.shape).flatten()
        identity = uuid4().hex if identity is None else identity
        errors = signed.size if per_element else 1
        cause = Cause(name, identity, errors, degrees_of_freedom, pooled, (), distribution)
        effects: Any = signed[:, None]
        if per_element:  # sparse, with those that are 0 too
            effects = sparse.csr_array((signed, np.arange(errors), np.arange(errors + 1)))
        return replace(self, components=(*self.components, Component(cause, effects)))

    @classmethod
    def from_observations(
        cls, observations: ArrayLike, name: str, identity: str | None = None
    ) -> "Estimate":
        """Return means of repeated observations, shape (n, ...), of quantities observed together.

        Type A evaluation, JCGM 100:2008, 4.2.3 and 5.2.3: variances and covariances of the means,
        with n − 1 degrees of freedom.
        """
        values = np.asarray(observations, np.float64)
        count = len(values)
        if count < 2:
            raise ValueError(f"component {name}: {count} observations, expected 2 or more")
        mean = values.mean(axis=0)
        effects = ((values - mean) / np.sqrt(count * (count - 1.0))).reshape(count, -1).T.copy()
        cause = Cause(name, uuid4().hex if identity is None else identity, count, count - 1.0)
        return cls(mean, (Component(cause, effects),))

    @classmethod
    def from_covariance(
        cls,
        values: ArrayLike,
        covariance: ArrayLike,
        name: str,
        identity: str | None = None,
        degrees_of_freedom: float = np.inf,
    ) -> "Estimate":
        """Return values with a known covariance matrix, such as parameters of a fit."""
        center = np.asarray(values, np.float64)
        matrix = np.asarray(covariance, np.float64)
        if matrix.shape != (center.size, center.size):
            raise ValueError(
                f"component {name}: covariance has shape {matrix.shape}, "
                f"expected {(center.size, center.size)}"
            )
        effects = factor(matrix, name)
        identity = uuid4().hex if identity is None else identity
        cause = Cause(name, identity, effects.shape[1], degrees_of_freedom)
        return cls(center, (Component(cause, effects),))

    def with_warnings(self, *warnings: str) -> "Estimate":
        """Return the estimate with more warnings."""
        return replace(self, warnings=(*self.warnings, *warnings))

    def with_unevaluated(self, *names: str) -> "Estimate":
        """Return the estimate with more causes of which nothing is known."""
        return replace(self, unevaluated=(*self.unevaluated, *names))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values."""
        return self.values.shape

    @property
    def names(self) -> tuple[str, ...]:
        """Lines of the budget, each once; those without a number last."""
        known = (name for component in self.components for name in component.cause.lines)
        return tuple(dict.fromkeys((*known, *self.unevaluated)))

    @cached_property
    def standard_uncertainty(self) -> Array:
        """Combined standard uncertainty (JCGM 100:2008, 5.1.2), of the shape of the values."""
        return np.sqrt(self._summed(component.variance for component in self.components))

    @cached_property
    def degrees_of_freedom(self) -> Array:
        """Effective number by Welch and Satterthwaite (JCGM 100:2008, G.4.1), of that shape.

        Infinite where a larger number would not change the coverage factor.
        """
        parts = self._summed(component.fourth_moment for component in self.components)
        with np.errstate(divide="ignore", invalid="ignore"):
            freedom = np.where(parts > 0, self.standard_uncertainty**4 / parts, np.inf)
        return np.where(freedom > _MOST_FREEDOM, np.inf, freedom)

    def coverage_factor(self, level: float = 0.95) -> Array:
        """Return Student's t of a level of confidence (JCGM 100:2008, G.3), of that shape."""
        if not 0 < level < 1:
            raise ValueError(f"level of confidence: is {level!r}, expected between 0 and 1")
        return np.asarray(stdtrit(self.degrees_of_freedom, (1 + level) / 2), np.float64)

    def expanded_uncertainty(self, level: float = 0.95) -> Array:
        """Return coverage factor times standard uncertainty (JCGM 100:2008, 6.2.1)."""
        return self.coverage_factor(level) * self.standard_uncertainty

    def contribution(self, name: str) -> Array:
        """Return the standard uncertainty of one line of the budget; NaN if it is unevaluated."""
        found = self.of_line(name)
        if not found.components and name in self.unevaluated:
            return np.full(self.shape, np.nan)
        return found.standard_uncertainty

    def of_line(self, name: str) -> "Estimate":
        """Return the values, uncertain by one line of the budget alone."""
        parts = (component.of_line(name) for component in self.components)
        return replace(self, components=tuple(part for part in parts if part is not None))

    def renamed(self, name: str, new: str) -> "Estimate":
        """Return the estimate with a component under another name in budgets."""
        components = tuple(
            Component(replace(one.cause, name=new, parts=()), one.effects)
            if one.cause.name == name
            else one
            for one in self.components
        )
        return replace(self, components=components)

    def only(self, name: str) -> "Estimate":
        """Return the values with the components of a name alone."""
        kept = tuple(one for one in self.components if one.cause.name == name)
        return replace(self, components=kept)

    def without(self, name: str) -> "Estimate":
        """Return the estimate without the components of a name."""
        kept = tuple(one for one in self.components if one.cause.name != name)
        return replace(self, components=kept)

    def effect(self, name: str) -> Array:
        """Return the signed effect of the systematic component of a name; 0 without one."""
        found = [one for one in self.components if one.cause.name == name]
        if len(found) == 1 and found[0].cause.errors == 1:
            return np.asarray(found[0].effects, np.float64).reshape(self.shape)
        return np.zeros(self.shape)

    def budget(self) -> xr.Dataset:
        """Return the uncertainty budget: a line for each cause, NaN where nothing is known.

        ``standard_uncertainty``, ``fraction`` of the variance and ``degrees_of_freedom`` by
        ``cause``, and by value unless there is just one. Its `to_dataframe` is a table.
        """
        shape = (len(self.names), *self.shape)
        spread = np.reshape([self.contribution(name) for name in self.names], shape)
        freedom = np.reshape([self.of_line(name).degrees_of_freedom for name in self.names], shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = np.where(spread == 0, 0.0, (spread / self.standard_uncertainty) ** 2)
        dims = ("cause", *(f"dim_{axis}" for axis in range(self.values.ndim)))
        return xr.Dataset(
            {
                "standard_uncertainty": (dims, spread),
                "fraction": (dims, fraction),
                "degrees_of_freedom": (dims, np.where(np.isnan(spread), np.nan, freedom)),
            },
            {"cause": np.array(self.names, dtype=object)},
        )

    def _repr_html_(self) -> str:
        table = self.budget().to_dataframe().to_html(float_format="{:.4g}".format, max_rows=20)
        values, uncertainty = brief(self.values), brief(self.standard_uncertainty)
        head = f"Estimate {values} ± {uncertainty} (standard uncertainty)"
        return f"<pre>{escape(head)}</pre>{table}"

    def covariance(self) -> Array:
        """Return the covariance of all values, flat: JCGM 100:2008, H.2.3."""
        total = np.zeros((self.values.size, self.values.size))
        for component in self.components:
            total = total + component.effects @ component.effects.T  # of which some are sparse
        return total

    def correlation(self) -> Array:
        """Return the correlation of all values, flat; NaN with an exact one."""
        covariance = self.covariance()
        spread = np.sqrt(np.diag(covariance))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(covariance / np.outer(spread, spread))

    def _summed(self, parts: Iterable[Array]) -> Array:
        return sum(parts, np.zeros(self.values.size)).reshape(self.shape)

    def __getitem__(self, index: Any) -> "Estimate":
        return self._rearranged(lambda values: values[index])

    def reshape(self, *shape: int) -> "Estimate":
        """Return the values in another shape."""
        return replace(self, values=self.values.reshape(shape))

    def _rearranged(self, change: Callable[[Any], Any]) -> "Estimate":
        """Return the values that an index or a broadcast selects, some of them several times."""
        rows = np.asarray(change(np.arange(self.values.size).reshape(self.shape))).ravel()
        components = tuple(one.taken(rows) for one in self.components)
        return replace(self, values=change(self.values), components=components)

    def linear(self, matrix: Any) -> "Estimate":
        """Return linear combinations of the flat values, matrix of shape (m, values)."""
        components = tuple(Component(one.cause, matrix @ one.effects) for one in self.components)
        return replace(self, values=matrix @ self.values.ravel(), components=components)

    def mean(self) -> "Estimate":
        """Return the mean of all values."""
        size = self.values.size
        return self.linear(np.full((1, size), 1 / size)).reshape()

    def sum(self) -> "Estimate":
        """Return the sum of all values."""
        return self.linear(np.ones((1, self.values.size))).reshape()

    @classmethod
    def stack(cls, estimates: Sequence["Estimate"]) -> "Estimate":
        """Return several estimates of one shape as one, along a new first axis."""
        effects = [{one.cause: one.effects for one in e.components} for e in estimates]
        causes = dict.fromkeys(cause for of in effects for cause in of)
        size = estimates[0].values.size
        components = (
            Component(cause, _stacked([of.get(cause) for of in effects], (size, cause.errors)))
            for cause in causes
        )
        values = np.stack([one.values for one in estimates])
        return cls(values, tuple(components), *remarks(estimates))

    def __neg__(self) -> "Estimate":
        return self * -1.0

    def __add__(self, other: Any) -> "Estimate":
        one, two = self, as_estimate(other)
        return chain(one.values + two.values, (one, two), (np.array(1.0), np.array(1.0)))

    def __sub__(self, other: Any) -> "Estimate":
        one, two = self, as_estimate(other)
        return chain(one.values - two.values, (one, two), (np.array(1.0), np.array(-1.0)))

    def __mul__(self, other: Any) -> "Estimate":
        one, two = self, as_estimate(other)
        return chain(one.values * two.values, (one, two), (two.values, one.values))

    def __truediv__(self, other: Any) -> "Estimate":
        one, two = self, as_estimate(other)
        values = one.values / two.values
        return chain(values, (one, two), (1 / two.values, -values / two.values))

    def __pow__(self, power: float) -> "Estimate":
        return chain(self.values**power, (self,), (power * self.values ** (power - 1),))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Any) -> "Estimate":
        return as_estimate(other) - self

    def __rtruediv__(self, other: Any) -> "Estimate":
        return as_estimate(other) / self


def as_estimate(value: Any) -> Estimate:
    """Return an estimate as it is, and numbers as exact ones."""
    return value if isinstance(value, Estimate) else Estimate(value)


def chain(values: Array, inputs: Sequence[Estimate], partials: Sequence[Array]) -> Estimate:
    """Return the estimate of values that were computed from inputs, element by element.

    The inputs, and their partial derivatives, broadcast to the shape of the values.
    """
    shape = np.shape(values)
    found: dict[tuple[str, str], Component] = {}
    for one, partial in zip(inputs, partials, strict=True):
        factors = np.broadcast_to(partial, shape).ravel()
        if one.shape != shape:
            one = one._rearranged(lambda values: np.broadcast_to(values, shape))
        for component in one.components:
            cause, effects = component.cause, component.scaled(factors)
            before = found.get(cause.key)
            if before is not None:
                check_same(before.cause, cause)
                effects = before.effects + effects
            found[cause.key] = Component(cause, effects)
    return Estimate(values, tuple(found.values()), *remarks(inputs))


def propagate(
    function: Callable[..., Any],
    *inputs: Any,
    derivatives: Sequence[Callable[..., Any]] | None = None,
) -> Estimate:
    """Return the estimate of a function of estimates or exact arrays, to first order.

    Every element of the result depends on the same element of the inputs alone, which broadcast.
    `derivatives` are functions of all inputs; by default they are half the difference of the
    results on both sides, one standard uncertainty away. JCGM 100:2008, 5.1.2 and 5.2.2. Whether
    the first order is enough, `draw` shows (JCGM 101:2008, clause 8).
    """
    estimates = [as_estimate(value) for value in inputs]
    if derivatives is not None and len(derivatives) != len(estimates):
        raise ValueError(
            f"derivatives: {len(derivatives)} of a function of {len(estimates)} inputs, "
            "expected one for each input"
        )
    places = [one.values for one in estimates]
    values = np.asarray(function(*places), np.float64)
    if derivatives is None:
        partials = [_partial(function, estimates, index) for index in range(len(estimates))]
    else:
        partials = [np.asarray(one(*places), np.float64) for one in derivatives]
    return chain(values, estimates, partials)


def _partial(function: Callable[..., Any], estimates: Sequence[Estimate], index: int) -> Array:
    """Return the slope over one standard uncertainty to both sides; 0 where an input is exact."""
    places = [one.values for one in estimates]
    step = estimates[index].standard_uncertainty
    if not step.any():
        return np.zeros(())
    ends = []
    for sign in (-1.0, 1.0):
        moved = [*places[:index], places[index] + sign * step, *places[index + 1 :]]
        ends.append(np.asarray(function(*moved), np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(step > 0, (ends[1] - ends[0]) / (2 * step), 0.0)


def remarks(estimates: Iterable[Estimate]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the unevaluated causes and warnings of several estimates."""
    several = list(estimates)
    return (
        tuple(name for one in several for name in one.unevaluated),
        tuple(warning for one in several for warning in one.warnings),
    )


def factor(covariance: Array, name: str) -> Array:
    """Return effects of independent errors that have a covariance, shape (values, errors)."""
    scale = np.sqrt(np.abs(np.diag(covariance)))
    scale[scale == 0.0] = 1.0
    # Correlations, since the variance of a value in metres is lost in rounding next to kelvins.
    matrix = covariance / np.outer(scale, scale)
    if not np.allclose(matrix, matrix.T, rtol=0.0, atol=ROUNDING):
        raise ValueError(f"component {name}: covariance is not symmetric")
    variances, directions = np.linalg.eigh(matrix)
    if variances.min(initial=0.0) < -ROUNDING:
        raise ValueError(
            f"component {name}: covariance has a variance of {variances.min():.3g} in one "
            "direction, relative to the values' own, expected 0 or more"
        )
    effects = scale[:, None] * directions * np.sqrt(np.maximum(variances, 0.0))
    return np.asarray(effects, np.float64)


def check_same(one: Cause, other: Cause) -> None:
    """Raise ValueError if two causes of one name and identity are not the same."""
    if one != other:
        raise ValueError(
            f"component {one.name}: is {one} and {other}, they must be the same errors wherever "
            "its name appears; name it otherwise, or make it independent"
        )


def _stacked(parts: Sequence[Any], shape: tuple[int, int]) -> Any:
    if any(sparse.issparse(part) for part in parts):
        empty = sparse.csr_array(shape)
        return sparse.vstack([empty if part is None else part for part in parts], format="csr")
    return np.concatenate([np.zeros(shape) if part is None else part for part in parts])
