"""The uncertainty budget of a model: to first order, by Monte Carlo, and by Sobol's indices."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
import xarray as xr

from chipglow.quantities import Array, Brief
from chipglow.uncertainty.component import Cause, Component
from chipglow.uncertainty.estimate import Estimate
from chipglow.uncertainty.inputs import Inputs
from chipglow.uncertainty.monte_carlo import MonteCarlo, adaptive

Model: TypeAlias = Callable[[Array], Array]
"""Takes values of the inputs, shape (trial, input); returns the outputs, shape (trial, output)."""

TRIALS: Final = 3000
"""Trials of the Monte Carlo, unless stated: the interval scatters by 2.5 % of its half-width."""

SAMPLES: Final = 256
"""Draws of the inputs for the indices of Sobol, unless stated."""

_DRAWS: Final = 64
"""Draws at which one input alone is changed."""

_MEAN_DRAWS: Final = 256
"""Draws of the random inputs over which the value is a mean."""

_REDRAWS: Final = 8
"""Draws of all random inputs at each of the `_DRAWS`."""

LEAST_TRIALS: Final = 100
"""Smallest number of trials of a Monte Carlo."""

_RESAMPLES: Final = 200
"""Resamples of the intervals of Sobol's indices."""

_BLOCK: Final = 100
"""Trials of a block of the Monte Carlo, if its trials are many enough."""

STABLE: Final = 0.2
"""Numerical tolerance of the Monte Carlo in standard uncertainties: 2,000 to 3,000 trials of
several outputs that are nearly normal."""

VALIDATED: Final = 0.25
"""Largest difference of ends that agree, in standard uncertainties; more than is due to draws."""


@dataclass(frozen=True, eq=False, repr=False)
class Budget(Brief):
    """Outputs of a model with their uncertainty.

    Parameters
    ----------
    inputs : Inputs
        The input quantities.
    estimate : Estimate
        To first order (JCGM 100), shape (output,); a component for each input, or for all inputs
        of a group that are correlated.
    sensitivity : ndarray
        Sensitivity coefficients, shape (input, output); NaN for random and discrete inputs.
    monte_carlo : MonteCarlo
        By propagation of distributions (JCGM 101).
    indices : xarray.Dataset
        Sobol's ``first_order`` and ``total_order`` indices over ``output`` and ``group``, with the
        ends ``_low`` and ``_high`` of their intervals of 95 % by the bootstrap.
    """

    inputs: Inputs
    estimate: Estimate
    sensitivity: Array
    monte_carlo: MonteCarlo
    indices: xr.Dataset


def budget(
    model: Model,
    inputs: Inputs,
    generator: np.random.Generator,
    trials: int = TRIALS,
    samples: int = SAMPLES,
    level: float = 0.95,
    progress: Callable[[str, float], None] = lambda step, part: None,
) -> Budget:
    """Return the uncertainty budget of a model.

    Parameters
    ----------
    model : callable
        Takes values of the inputs, shape (trial, input); returns outputs, shape (trial, output).
    inputs : Inputs
        The input quantities.
    generator : numpy.random.Generator
        Source of all draws.
    trials : int
        Largest number of trials of the Monte Carlo, 100 or more; fewer if mean, standard
        uncertainty and both ends of the interval are within 20 % of the standard uncertainty.
    samples : int
        Base samples of Sobol's indices, a power of 2: the model is computed for this many times
        the number of groups and 2 more.
    level : float
        Coverage probability.
    progress : callable, optional
        Called with the step and the fraction of it that is complete.

    Raises
    ------
    ValueError
        If `trials`, `samples` or `level` is impossible.
    """
    check_numbers(trials, samples, level)
    progress("sensitivities", 0.0)
    estimate, slopes = first_order(model, inputs, generator)
    progress("sensitivities", 1.0)

    def sample(count: int) -> Array:
        return model(inputs.at(generator.random((count, len(inputs)))))

    monte_carlo = adaptive(
        sample,
        level,
        STABLE,
        trials,
        _BLOCK,
        inputs.has_variance,
        lambda part: progress("Monte Carlo", part),
    )
    progress("variance", 0.0)
    indices = sobol_indices(model, inputs, samples, generator)
    progress("variance", 1.0)
    monte_carlo = replace(monte_carlo, truncated=tuple(inputs.truncated))
    return Budget(inputs, estimate, slopes, monte_carlo, indices)


def check_numbers(trials: int, samples: int, level: float = 0.95) -> None:
    """Raise a ValueError if a budget cannot have these numbers of trials and samples."""
    if trials < LEAST_TRIALS:
        raise ValueError(f"trials: {trials}, expected {LEAST_TRIALS} or more")
    if samples < 2 or samples & (samples - 1):
        raise ValueError(f"samples: {samples}, expected a power of 2, such as 256")
    if not 0 < level < 1:
        raise ValueError(f"level: {level!r}, expected between 0 and 1")


def first_order(
    model: Model, inputs: Inputs, generator: np.random.Generator
) -> tuple[Estimate, Array]:
    """Return the outputs of a model to first order, and its sensitivity coefficients.

    Parameters
    ----------
    model, inputs, generator
        As in `budget`.

    Returns
    -------
    estimate : Estimate
        Shape (output,), with a component for each input, or for all that are correlated.
    sensitivity : ndarray
        Shape (input, output); NaN for random and discrete inputs.

    Notes
    -----
    The contribution of an input is its standard uncertainty times the slope of the model over one
    standard uncertainty to both sides (JCGM 100:2008, 5.1.3, note 2), a mean over 64 draws of the
    random and discrete inputs.

    The variance by all random and discrete inputs is estimated from 8 draws of them at each of 64
    draws of the others: 448 degrees of freedom. Each input has the part that is due to its own
    effect, half the mean square of the change when it alone is drawn again (Jansen, 1999). If
    inputs interact, the sum of these effects is larger than their variance together.
    """
    smooth = np.array([one.has_slope for one in inputs.inputs], np.bool_)
    drawn, again = _draws(inputs, generator)
    best = np.where(smooth, [one.value for one in inputs.inputs], drawn)
    at_best = model(best)
    slopes = np.full((len(inputs), at_best.shape[-1]), np.nan)
    for i in np.flatnonzero(smooth).tolist():
        low, high = inputs.inputs[i].one_apart
        at_low, at_high = (model(_with(best[:_DRAWS], i, end)) for end in (low, high))
        slopes[i] = (at_high - at_low).mean(axis=0) / (high - low)
    scatter = np.zeros_like(slopes)
    if not smooth.all():
        scatter[~smooth] = _scatter(model, inputs, drawn[:_DRAWS], again[:_DRAWS], generator)
    is_known = np.isfinite(slopes[smooth].sum(axis=0) + scatter.sum(axis=0))
    values = np.where(is_known, at_best.mean(axis=0), np.nan)
    return _estimate(inputs, values, slopes, scatter), slopes


def _draws(inputs: Inputs, generator: np.random.Generator) -> tuple[Array, Array]:
    """Return two draws of all inputs, each of shape (draw, input)."""
    from scipy.stats import qmc  # slow to import, and most users of this package need none of it

    count = len(inputs)
    numbers = qmc.Sobol(2 * count, seed=generator).random(_MEAN_DRAWS)
    return inputs.at(numbers[:, :count]), inputs.at(numbers[:, count:])


def _with(rows: Array, column: int, values: Array | float) -> Array:
    """Return rows with other values in a column."""
    changed = rows.copy()
    changed[:, column] = values
    return changed


def _scatter(
    model: Model, inputs: Inputs, drawn: Array, again: Array, generator: np.random.Generator
) -> Array:
    """Return the standard uncertainties by the random and discrete inputs, (input, output)."""
    smooth = np.array([one.has_slope for one in inputs.inputs], np.bool_)
    at_drawn = model(drawn)
    redrawn = [at_drawn]
    for _ in range(_REDRAWS - 1):
        # Points of a Sobol sequence that meet here would be neighbours.
        others = inputs.at(generator.random(drawn.shape))
        redrawn.append(model(np.where(smooth, drawn, others)))
    variance = np.var(redrawn, axis=0, ddof=1).mean(axis=0)
    changes = [
        model(_with(drawn, i, again[:, i])) - at_drawn for i in np.flatnonzero(~smooth).tolist()
    ]
    effects = np.mean(np.square(changes), axis=1) / 2
    total = effects.sum(axis=0)
    parts = np.divide(effects, total, where=total != 0, out=np.zeros_like(effects))
    return np.asarray(np.sqrt(parts * variance))


def _estimate(inputs: Inputs, values: Array, slopes: Array, scatter: Array) -> Estimate:
    """Return the outputs with a component for each input or correlated set of inputs."""
    components = []
    for numbers in _dependent(inputs):
        parts = [inputs.inputs[i] for i in numbers]
        if parts[0].has_slope:
            steps = np.array([one.standard_uncertainty for one in parts])
            effects = (steps[:, None] * slopes[numbers]).T @ inputs.root[np.ix_(numbers, numbers)]
            freedom = min(one.degrees_of_freedom for one in parts)
        else:
            effects, freedom = scatter[numbers].T, float(_DRAWS * (_REDRAWS - 1))
        name = ", ".join(one.name for one in parts)
        components.append(
            Component(Cause(name, errors=len(parts), degrees_of_freedom=freedom), effects)
        )
    return Estimate(values, tuple(components))


def _dependent(inputs: Inputs) -> list[list[int]]:
    """Return the sets of inputs that are correlated, directly or by others."""
    reach = np.linalg.matrix_power(inputs.correlation != 0, max(len(inputs), 1))
    rows = {tuple(np.flatnonzero(row).tolist()) for row in reach}
    return [list(row) for row in sorted(rows)]


def sobol_indices(
    model: Model, inputs: Inputs, samples: int, generator: np.random.Generator
) -> xr.Dataset:
    """Return Sobol's indices of the groups of inputs, as `Budget.indices`; NaN without variance."""
    from scipy.stats import qmc

    size, groups = len(inputs), inputs.groups
    numbers = qmc.Sobol(2 * size, seed=generator).random(samples)
    one, two = numbers[:, :size], numbers[:, size:]
    mixed = []
    for columns in groups.values():
        changed = one.copy()
        changed[:, columns] = two[:, columns]
        mixed.append(changed)
    results = model(inputs.at(np.concatenate([one, two, *mixed])))
    results = results.reshape(2 + len(groups), samples, -1)
    if not inputs.has_variance:
        results = np.full_like(results, np.nan)
    every = np.moveaxis(results, 2, 1)  # (function, output, sample)
    chosen = generator.integers(samples, size=(_RESAMPLES, samples))
    # Ends of the 95 % interval.
    spread = np.quantile([_sobol(every[..., one]) for one in chosen], [0.025, 0.975], axis=0)
    variables = {
        name + end: (("output", "group"), one[order])
        for end, one in (("", _sobol(every)), ("_low", spread[0]), ("_high", spread[1]))
        for order, name in enumerate(("first_order", "total_order"))
    }
    return xr.Dataset(variables, coords={"group": list(groups)})


def _sobol(results: Array) -> Array:
    """Return first and total indices of results for A, B and each mixture, (2, output, group).

    Equations (b) and (f) of Table 2 of Saltelli et al., Comput. Phys. Commun. 181 (2010) 259.
    """
    one, two, *mixed = results - results[:2].mean(axis=(0, 2))[:, None]
    variance = np.concatenate([one, two], axis=-1).var(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = [(two * (other - one)).mean(axis=-1) / variance for other in mixed]
        total = [((one - other) ** 2).mean(axis=-1) / 2 / variance for other in mixed]
    return np.moveaxis(np.array([first, total]), 1, 2)
