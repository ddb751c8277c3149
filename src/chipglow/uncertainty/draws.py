"""Monte Carlo: errors drawn from the components of estimates."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import isfinite, pi, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from chipglow.quantities import Array
from chipglow.uncertainty.component import Cause
from chipglow.uncertainty.estimate import Estimate, check_same

_Sampler = Callable[[np.random.Generator, tuple[int, int]], Array]

_UNIT: Final[Mapping[str, _Sampler]] = {
    "normal": lambda generator, shape: generator.standard_normal(shape),
    "rectangular": lambda generator, shape: generator.uniform(-sqrt(3), sqrt(3), shape),
    "triangular": lambda generator, shape: generator.triangular(-sqrt(6), 0.0, sqrt(6), shape),
    "arcsine": lambda generator, shape: sqrt(2) * np.sin(generator.uniform(-pi, pi, shape)),
}
"""Numbers of mean 0 and standard deviation 1."""


def draw(
    estimates: Sequence[Estimate], count: int, generator: np.random.Generator
) -> tuple[Array, ...]:
    """Draw values of several estimates together: errors that they have in common are the same.

    Returns an array of shape (count, ...) for each estimate; a function of them has the
    distribution of the output (JCGM 101:2008, clause 7; 7.2.2 advises 10⁶ draws for a coverage
    interval). A normal cause with finite degrees of freedom is drawn from Student's distribution
    (6.4.9); pooled errors have one χ² together.
    """
    causes: dict[tuple[str, str], Cause] = {}
    used: dict[tuple[str, str], list[NDArray[np.intp]]] = {}
    for one in estimates:
        for component in one.components:
            cause = component.cause
            check_same(causes.setdefault(cause.key, cause), cause)
            used.setdefault(cause.key, []).append(_used(component.effects))
    # Of an image's noise, only that of the pixels which are there is drawn.
    numbers = {key: np.unique(np.concatenate(parts)) for key, parts in used.items()}
    errors = {
        key: _errors(replace(cause, errors=numbers[key].size, parts=()), count, generator)
        for key, cause in causes.items()
        if numbers[key].size
    }
    drawn = []
    for one in estimates:
        values = np.broadcast_to(one.values.ravel(), (count, one.values.size)).copy()
        for component in one.components:
            key = component.cause.key
            if key in errors:
                values += (component.effects[:, numbers[key]] @ errors[key].T).T
        drawn.append(values.reshape(count, *one.shape))
    return tuple(drawn)


def _used(effects: Any) -> NDArray[np.intp]:
    """Return the numbers of the errors that have an effect."""
    if sparse.issparse(effects):
        return np.unique(effects.indices).astype(np.intp)
    return np.arange(effects.shape[1])


def coverage_interval(
    draws: ArrayLike, level: float = 0.95, shortest: bool = False
) -> tuple[Array, Array]:
    """Return lower and upper end of the interval that holds a value with a probability.

    Of draws of shape (count, ...); with as much beyond one end as beyond the other, or the shortest
    interval (JCGM 101:2008, 7.7).
    """
    values = np.sort(np.asarray(draws, np.float64), axis=0)
    if not 0 < level < 1:
        raise ValueError(f"level of confidence: is {level!r}, expected between 0 and 1")
    count, inside = len(values), round(level * len(values))
    if not 0 < inside < count:
        raise ValueError(f"coverage interval: {count} draws, expected more for {level:g}")
    if shortest:
        first = (values[inside:] - values[: count - inside]).argmin(axis=0)
    else:
        first = np.full(values.shape[1:], (count - inside) // 2)
    low, high = (np.take_along_axis(values, n[None], axis=0)[0] for n in (first, first + inside))
    return low, high


def _errors(cause: Cause, count: int, generator: np.random.Generator) -> Array:
    """Draw errors in standard uncertainties, shape (count, errors)."""
    found = _UNIT[cause.distribution](generator, (count, cause.errors))
    freedom = cause.degrees_of_freedom
    if cause.distribution == "normal" and isfinite(freedom):
        number = 1 if cause.pooled else cause.errors
        found /= np.sqrt(generator.chisquare(freedom, (count, number)) / freedom)
    return found
