"""Readings of several frames: which frames, their scatter, and columns of their tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.uncertainty import Cause, Component, Estimate

FRAMES: Final = "frames"
"""Name of the component of uncertainty that the scatter of frames makes."""
_LEAST: Final = 8
"""Frames at or above which the correlation of successive frames is estimated."""


def frame_numbers(frames: Sequence[int] | None, count: int) -> NDArray[np.int64]:
    """Numbers of the chosen frames, shape (n,); of all for None."""
    numbers = np.arange(count) if frames is None else np.asarray(frames, dtype=np.int64)
    wrong = numbers[(numbers < 0) | (numbers >= count)]
    if wrong.size or numbers.size == 0:
        shown = int(wrong[0]) if wrong.size else "none"
        raise ValueError(f"measurement: frame {shown}, expected 0 to {count - 1}")
    return numbers


@dataclass(frozen=True, eq=False)
class FrameScatter:
    """Errors of a mean over frames, as the frames themselves show them."""

    patterns: Array
    """Independent errors of the mean, each of one standard deviation, shape (frames, ...): how
    each frame is away from the mean. Places that change together do so in them.
    """
    freedom: float = inf
    """Degrees of freedom; infinite without frames."""

    @classmethod
    def of(cls, frames: Array) -> "FrameScatter":
        """What frames of shape (frames, ...), NaN where there is nothing, show.

        Successive frames that are alike count as fewer: the variance of the mean grows by
        1 + 2 Σ (1 − k/n) ρ_k of the correlations ρ_k of all places together, up to the first that
        is not positive (C. J. Geyer, Statistical Science 7 (1992) 473).
        """
        known = np.isfinite(frames)
        count = known.sum(axis=0)
        total = np.where(known, frames, 0.0).sum(axis=0)
        mean = np.divide(total, count, out=np.zeros(total.shape), where=count > 0)
        away = np.where(known, frames - mean, 0.0)
        longer = _longer(away)
        pairs = np.maximum(count * (count - 1), 1)
        freedom = max((len(frames) - 1) / longer, 1.0)
        return cls(away * np.sqrt(longer / pairs), freedom if len(frames) > 1 else inf)

    @property
    def standard_deviation(self) -> Array:
        """Standard uncertainty of the mean, shape (...)."""
        return np.asarray(np.sqrt(np.sum(self.patterns**2, axis=0)))

    def component(self) -> Component:
        """The errors as a component ``frames``, independent of that of other frames."""
        cause = Cause(FRAMES, uuid4().hex, len(self.patterns), self.freedom)
        return Component(cause, self.patterns.reshape(len(self.patterns), -1).T.copy())


def _longer(away: Array) -> float:
    """By how much the variance of the mean is larger than of independent frames, 1 or more."""
    frames = away.reshape(len(away), -1)
    count, square = len(frames), float(np.sum(frames**2))
    if count < _LEAST or square <= 0:
        return 1.0
    total, weight = 0.0, 0.0
    for lag in range(1, count // 2 + 1):
        fraction = float(np.sum(frames[lag:] * frames[:-lag])) / square * count / (count - lag)
        # That the mean is taken off makes all correlations smaller by about 1 / count.
        if fraction + 1 / count <= 0:
            break
        total += (1 - lag / count) * fraction
        weight += (1 - lag / count) / count
    return float(np.clip((1 + 2 * total) / max(1 - 2 * weight, 1 / count), 1.0, count))


def celsius(kelvins: Array) -> Array:
    """Temperatures in K in degrees Celsius."""
    return kelvins - ZERO_CELSIUS


def budget_columns(estimate: Estimate, causes: Sequence[str]) -> dict[str, Array]:
    """Standard uncertainty of temperatures in K and its part from each cause, by their names.

    Each of shape (values,). NaN of a cause that is not in the budget, or of which nothing is known;
    of the whole if that is so for all.
    """
    known = np.isfinite(estimate.values)
    columns = {"standard_uncertainty_K": known_uncertainty(estimate).ravel()}
    for cause in causes:
        part = estimate.contribution(cause) if cause in estimate.names else np.nan
        name = f"{cause.replace(' ', '_')}_uncertainty_K"
        columns[name] = np.where(known, part, np.nan).ravel()
    return columns


def known_uncertainty(estimate: Estimate) -> Array:
    """Standard uncertainty of the values; NaN without any component."""
    whole = estimate.standard_uncertainty if estimate.components else np.nan
    return np.where(np.isfinite(estimate.values), whole, np.nan)
