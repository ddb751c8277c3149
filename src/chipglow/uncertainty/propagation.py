"""Propagation of uncertainty through any function."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chipglow.uncertainty.component import Cause, Component
from chipglow.uncertainty.estimate import Estimate, as_estimate, chain, check_same, remarks

Function = Callable[..., Any]


def propagate(
    function: Function,
    *inputs: Any,
    derivatives: Sequence[Function] | None = None,
    elementwise: bool = True,
) -> Estimate:
    """The estimate of a function of estimates, to first order.

    Parameters
    ----------
    function : callable
        Of as many arrays as there are inputs.
    *inputs : Estimate or array_like
        What it is a function of; arrays are exact.
    derivatives : sequence of callable, optional
        Partial derivatives by each input, each a function of all. By default they are half the
        difference of the results on both sides, one standard uncertainty away.
    elementwise : bool
        Whether every element of the result depends on the same element of the inputs alone, which
        broadcast. Otherwise every single error is tried by itself, which takes two evaluations
        each.

    Returns
    -------
    Estimate
        Its components are those of the inputs, added up with their signs where they are the same.

    Raises
    ------
    ValueError
        If two inputs have components of one name that cannot be the same, if there is another
        number of derivatives than inputs, or if derivatives are given of a function that is not
        elementwise.

    Notes
    -----
    JCGM 100:2008, 5.1.2 and 5.2.2; derivatives as in 5.1.3, note 2, or 5.1.4. Whether the first
    order is enough, `draw` tells (JCGM 101:2008, clause 8).
    """
    estimates = [as_estimate(value) for value in inputs]
    if derivatives is not None and (not elementwise or len(derivatives) != len(estimates)):
        raise ValueError(
            f"derivatives: {len(derivatives)} of a function of {len(estimates)} inputs, "
            "expected one for each input of an elementwise function"
        )
    if not elementwise:
        return _error_by_error(function, estimates)
    places = [one.values for one in estimates]
    values = np.asarray(function(*places), np.float64)
    if derivatives is None:
        partials = [_partial(function, estimates, index) for index in range(len(estimates))]
    else:
        partials = [np.asarray(one(*places), np.float64) for one in derivatives]
    return chain(values, estimates, partials)


def _partial(function: Function, estimates: Sequence[Estimate], index: int) -> NDArray[np.float64]:
    """Slope over one standard uncertainty to both sides; 0 where an input is exact."""
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


def _error_by_error(function: Function, estimates: Sequence[Estimate]) -> Estimate:
    places = [one.values for one in estimates]
    values = np.asarray(function(*places), np.float64)
    causes: dict[tuple[str, str], Cause] = {}
    for one in estimates:
        for component in one.components:
            check_same(causes.setdefault(component.cause.key, component.cause), component.cause)
    components = []
    for cause in causes.values():
        effects = np.empty((values.size, cause.errors))
        for error in range(cause.errors):
            shifts = [_shift(one, cause, error) for one in estimates]
            ends = [
                np.asarray(function(*(p + sign * s for p, s in zip(places, shifts, strict=True))))
                for sign in (-1.0, 1.0)
            ]
            effects[:, error] = ((ends[1] - ends[0]) / 2).ravel()
        components.append(Component(cause, effects))
    return Estimate(values, tuple(components), *remarks(estimates))


def _shift(estimate: Estimate, cause: Cause, error: int) -> NDArray[np.float64]:
    """What one error of a cause changes in an estimate."""
    for component in estimate.components:
        if component.cause == cause:
            column = component.effects[:, [error]]
            dense = column.toarray() if sparse.issparse(column) else column
            return np.asarray(dense, np.float64).reshape(estimate.shape)
    return np.zeros(estimate.shape)
