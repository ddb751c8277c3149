"""Propagation of uncertainty through any function."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipglow.uncertainty.estimate import Estimate, as_estimate, chain

Function = Callable[..., Any]


def propagate(
    function: Function, *inputs: Any, derivatives: Sequence[Function] | None = None
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


def _partial(function: Function, estimates: Sequence[Estimate], index: int) -> NDArray[np.float64]:
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
