"""Readings of several frames: which frames, their mean and scatter, and columns of their tables."""

from collections.abc import Callable, Mapping, Sequence
from math import inf
from typing import Final
from uuid import uuid4

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from chipglow.quantities import ZERO_CELSIUS, Array, quotient
from chipglow.uncertainty import Cause, Component, Estimate

FRAMES: Final = "frames"
"""Name of the component of uncertainty that the scatter of frames makes."""
_LEAST: Final = 8
"""Frames at or above which the correlation of successive frames is estimated."""
_MICRO: Final = ("_um", "_us")
"""Ends of the names of columns in millionths."""


def frame_numbers(frames: Sequence[int] | None, count: int) -> NDArray[np.int64]:
    """Return the numbers of the chosen frames, shape (n,); of all for None."""
    numbers = np.arange(count) if frames is None else np.asarray(frames, dtype=np.int64)
    wrong = numbers[(numbers < 0) | (numbers >= count)]
    if wrong.size or numbers.size == 0:
        shown = int(wrong[0]) if wrong.size else "none"
        raise ValueError(f"measurement: frame {shown}, expected 0 to {count - 1}")
    return numbers


def linearly_changed(estimate: Estimate, change: Callable[[Array], Array]) -> Estimate:
    """Return an estimate of which a linear change is made to the values and to every effect."""
    components = []
    for one in estimate.components:
        columns = [change(part.reshape(estimate.shape)).ravel() for part in one.effects.T]
        components.append(Component(one.cause, np.stack(columns, -1)))
    return Estimate(change(estimate.values), tuple(components), estimate.unevaluated)


def frame_mean(estimate: Estimate) -> Estimate:
    """Return the mean of known values over the first axis; NaN without one."""
    known = np.isfinite(estimate.values)
    count = known.sum(axis=0)

    def mean(values: Array) -> Array:
        return quotient(np.where(known, values, 0.0).sum(axis=0), count)

    return linearly_changed(estimate, mean)


def frame_scatter(frames: Array) -> Component:
    """Return the errors of a mean over frames of shape (frames, ...), as the frames show them.

    Correlated successive frames count as fewer (C. J. Geyer, Statistical Science 7 (1992) 473);
    fewer than 8 frames do not show their correlation and count as one.
    """
    known = np.isfinite(frames)
    count = known.sum(axis=0)
    mean = quotient(np.where(known, frames, 0.0).sum(axis=0), count)
    away = np.where(known, frames - mean, 0.0)
    longer = _longer(away)
    patterns = away * np.sqrt(longer / np.maximum(count * (count - 1), 1))
    freedom = max((len(frames) - 1) / longer, 1.0) if len(frames) > 1 else inf
    cause = Cause(FRAMES, uuid4().hex, len(frames), freedom)
    return Component(cause, patterns.reshape(len(frames), -1).T.copy())


def _longer(away: Array) -> float:
    """Return by how much the variance of the mean is larger than of independent frames."""
    frames = away.reshape(len(away), -1)
    count, square = len(frames), float(np.sum(frames**2))
    if square <= 0:
        return 1.0
    if count < _LEAST:
        return float(count)
    total, weight = 0.0, 0.0
    for lag in range(1, count // 2 + 1):
        fraction = float(np.sum(frames[lag:] * frames[:-lag])) / square * count / (count - lag)
        # That the mean is taken off makes all correlations smaller by about 1 / count.
        if fraction + 1 / count <= 0:
            break
        total += (1 - lag / count) * fraction
        weight += (1 - lag / count) / count
    return float(np.clip((1 + 2 * total) / max(1 - 2 * weight, 1 / count), 1.0, count))


def unit_table(data: xr.Dataset, names: Mapping[str, str]) -> pd.DataFrame:
    """Return variables in SI units as columns, in the units at the end of the columns' names."""
    order = list(data[[*names][-1]].dims)
    table = data[[*names]].to_dataframe(dim_order=order).reset_index().rename(columns=names)
    for name in names.values():
        if name.endswith(_MICRO):
            table[name] *= 1e6
        elif name.endswith("_degC"):
            table[name] -= ZERO_CELSIUS
    return table[[*names.values()]]


def budget_table(
    data: xr.Dataset, names: Mapping[str, str], estimate: Estimate, causes: Sequence[str]
) -> pd.DataFrame:
    """Return `unit_table` with the standard uncertainty in K and its parts; NaN if unknown."""
    known, dims = np.isfinite(estimate.values), data[[*names][-1]].dims
    budget = {"standard_uncertainty_K": known_uncertainty(estimate)}
    for cause in causes:
        part = estimate.contribution(cause) if cause in estimate.names else np.nan
        budget[f"{cause.replace(' ', '_')}_uncertainty_K"] = np.where(known, part, np.nan)
    data = data.assign({name: (dims, part) for name, part in budget.items()})
    return unit_table(data, {**names, **{name: name for name in budget}})


def known_uncertainty(estimate: Estimate) -> Array:
    """Return the standard uncertainty of the values; NaN without any component."""
    whole = estimate.standard_uncertainty if estimate.components else np.nan
    return np.where(np.isfinite(estimate.values), whole, np.nan)
