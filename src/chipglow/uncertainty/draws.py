"""Monte Carlo: errors drawn from the components of estimates."""

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from chipglow.quantities import Array
from chipglow.uncertainty.component import HALF_WIDTHS, Cause
from chipglow.uncertainty.estimate import Estimate, check_same

_NO_VARIANCE: Final = 2.0
"""Degrees of freedom up to which Student's distribution has no finite variance."""


def draw(
    estimates: Sequence[Estimate],
    count: int,
    generator: np.random.Generator,
    heavy_tails: bool = False,
) -> tuple[Array, ...]:
    """Draw values of several estimates together: errors that they have in common are the same.

    Returns an array of shape (count, ...) for each estimate; a function of them has the
    distribution of the output (JCGM 101:2008, clause 7; 7.2.2 advises 10⁶ draws for a coverage
    interval). A normal cause with finite degrees of freedom has Student's distribution (6.4.9);
    pooled errors have one χ² together. With 2 degrees of freedom or fewer their standard deviation
    is infinite, whatever that of the draws: these are refused, unless `heavy_tails` states that
    only quantiles are used.
    """
    causes: dict[tuple[str, str], Cause] = {}
    used: dict[tuple[str, str], list[NDArray[np.intp]]] = {}
    for one in estimates:
        for component in one.components:
            cause = component.cause
            if cause.degrees_of_freedom <= _NO_VARIANCE and not heavy_tails:
                raise ValueError(
                    f"component {cause.name}: draws with {cause.degrees_of_freedom:g} degrees of "
                    "freedom have no finite standard deviation; pass heavy_tails=True and use "
                    "only their quantiles"
                )
            check_same(causes.setdefault(cause.key, cause), cause)
            used.setdefault(cause.key, []).append(_used(component.effects))
    # Only the noise of the given pixels of an image is drawn.
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


def _errors(cause: Cause, count: int, generator: np.random.Generator) -> Array:
    """Draw errors in standard uncertainties, shape (count, errors)."""
    shape = (count, cause.errors)
    width = HALF_WIDTHS.get(cause.distribution, 0.0)
    if cause.distribution == "rectangular":
        return generator.uniform(-width, width, shape)
    if cause.distribution == "triangular":
        return generator.triangular(-width, 0.0, width, shape)
    if cause.distribution == "arcsine":
        return np.asarray(width * np.cos(np.pi * generator.uniform(size=shape)))
    found = generator.standard_normal(shape)
    freedom = cause.degrees_of_freedom
    if isfinite(freedom):
        number = 1 if cause.pooled else cause.errors
        found /= np.sqrt(generator.chisquare(freedom, (count, number)) / freedom)
    return found
