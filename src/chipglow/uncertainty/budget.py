"""The uncertainty budget of a model: to first order, by Monte Carlo, and by Sobol's indices."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import xarray as xr

from chipglow.quantities import Array, Brief
from chipglow.uncertainty.component import Cause, Component
from chipglow.uncertainty.estimate import Estimate
from chipglow.uncertainty.inputs import Inputs
from chipglow.uncertainty.monte_carlo import MonteCarlo, adaptive

Model: TypeAlias = Callable[[Array], Array]
"""Takes values of the inputs, shape (trial, input); returns the outputs, shape (trial, output)."""

_DRAWS: Final = 64
"""Draws of the random inputs over which a sensitivity is a mean."""

LEAST_TRIALS: Final = 100
"""Smallest number of trials of a Monte Carlo."""

_RESAMPLES: Final = 200
"""Resamples of the intervals of Sobol's indices."""

_BLOCK: Final = 500
"""Trials between two checks of stability."""


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
    trials: int = 3000,
    samples: int = 256,
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
        Largest number of trials of the Monte Carlo, 100 or more; fewer if the results are stable
        to one digit.
    samples : int
        Base samples of Sobol's indices, a power of 2: the model is computed for this many times
        the number of groups and 2 more.
    level : float
        Coverage probability.
    progress : callable, optional
        Called with the step and the fraction of it that is complete.

    Notes
    -----
    The contribution of an input is its standard uncertainty times the slope of the model over one
    standard uncertainty to both sides (JCGM 100:2008, 5.1.3, note 2), a mean over 64 draws of the
    random inputs from a Sobol sequence. The contribution of a random or discrete input is the root
    of half the mean square of the change when it alone is drawn again (Jansen, 1999).
    """
    check_trials(trials)
    progress("sensitivities", 0.0)
    values, slopes, scatter = _first_order(model, inputs, generator)
    progress("sensitivities", 1.0)
    freedoms = [one.degrees_of_freedom for one in inputs.inputs if one.has_slope]

    def sample(count: int) -> Array:
        return model(inputs.at(generator.random((count, len(inputs)))))

    monte_carlo = adaptive(
        sample,
        level=level,
        digits=1,
        most=trials,
        block=min(_BLOCK, trials // 2),
        has_variance=min(freedoms, default=np.inf) > 2,
        progress=lambda part: progress("Monte Carlo", part),
    )
    progress("variance", 0.0)
    indices = _indices(model, inputs, samples, generator)
    progress("variance", 1.0)
    estimate = _estimate(inputs, values, slopes, scatter)
    return Budget(inputs, estimate, slopes, monte_carlo, indices)


def check_trials(trials: int) -> None:
    """Raise a ValueError if a Monte Carlo has too few trials."""
    if trials < LEAST_TRIALS:
        raise ValueError(f"trials: {trials}, expected {LEAST_TRIALS} or more")


def _first_order(
    model: Model, inputs: Inputs, generator: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Return the outputs, the slopes by continuous inputs, and the scatter by the others."""
    from scipy.stats import qmc  # slow to import, and most users of this room need none of it

    count = len(inputs)
    numbers = qmc.Sobol(2 * count, seed=generator).random(_DRAWS)
    drawn, again = inputs.at(numbers[:, :count]), inputs.at(numbers[:, count:])
    smooth = np.array([one.has_slope for one in inputs.inputs])
    base = np.where(smooth, [one.value for one in inputs.inputs], drawn)
    rows = [base, drawn]
    for i, one in enumerate(inputs.inputs):
        step = one.standard_uncertainty
        ends = (base[:, i] - step, base[:, i] + step) if smooth[i] else (again[:, i],)
        for end in ends:
            rows.append((base if smooth[i] else drawn).copy())
            rows[-1][:, i] = end
    results = model(np.concatenate(rows)).reshape(len(rows), _DRAWS, -1)
    at_base, at_drawn, *moved = results
    rest = iter(moved)
    slopes = np.full((count, results.shape[-1]), np.nan)
    scatter = np.zeros_like(slopes)
    for i, one in enumerate(inputs.inputs):
        if smooth[i]:
            low, high = next(rest), next(rest)
            slopes[i] = (high - low).mean(axis=0) / (2 * one.standard_uncertainty)
        else:
            scatter[i] = np.sqrt(((next(rest) - at_drawn) ** 2).mean(axis=0) / 2)
    return at_base.mean(axis=0), slopes, scatter


def _estimate(inputs: Inputs, values: Array, slopes: Array, scatter: Array) -> Estimate:
    """Return the outputs with a component for each input or correlated set of inputs."""
    components = []
    for numbers in _dependent(inputs):
        parts = [inputs.inputs[i] for i in numbers]
        effects = scatter[numbers].T
        if parts[0].has_slope:
            signed = (
                np.array([one.standard_uncertainty for one in parts])[:, None] * slopes[numbers]
            )
            effects = signed.T @ np.linalg.cholesky(inputs.correlation[np.ix_(numbers, numbers)])
        freedom = min(one.degrees_of_freedom for one in parts)
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


def _indices(
    model: Model, inputs: Inputs, samples: int, generator: np.random.Generator
) -> xr.Dataset:
    """Return Sobol's indices of the groups of inputs, with bootstrap intervals."""
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
    first, second, *others = np.moveaxis(results - results[0].mean(axis=0), 2, 1)
    every = np.stack([first, second, *others])  # (function, output, sample)
    chosen = generator.integers(samples, size=(_RESAMPLES, samples))
    spread = np.quantile([_sobol(every[..., one]) for one in chosen], [0.025, 0.975], axis=0)
    variables = {
        name + end: (("output", "group"), one[order])
        for end, one in (("", _sobol(every)), ("_low", spread[0]), ("_high", spread[1]))
        for order, name in enumerate(("first_order", "total_order"))
    }
    return xr.Dataset(variables, coords={"group": list(groups)})


def _sobol(results: Array) -> Array:
    """Return first and total indices of results for A, B and each mixture, (2, output, group)."""
    from scipy.stats import sobol_indices

    functions: Any = {"f_A": results[0], "f_B": results[1], "f_AB": results[2:]}
    with np.errstate(divide="ignore", invalid="ignore"):
        found = sobol_indices(func=functions, n=results.shape[-1])
    shape = 2, results.shape[1], len(results) - 2
    return np.reshape([found.first_order, found.total_order], shape)
