"""Uncertainties and their parts as columns of tables."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from chipglow.uncertainty import Estimate


def budget_columns(causes: Sequence[str]) -> tuple[str, ...]:
    """Names of the columns: the standard uncertainty, and its part from each cause."""
    return (
        "standard_uncertainty_K",
        *(f"{cause.replace(' ', '_')}_uncertainty_K" for cause in causes),
    )


def budget_values(estimate: Estimate, causes: Sequence[str]) -> NDArray[np.float64]:
    """Their values, of the shape of the estimate with the columns as the last axis.

    NaN of a cause that is not in the budget, or of which nothing is known; of the whole if that is
    so for all.
    """
    unknown = np.full(estimate.shape, np.nan)
    whole = estimate.standard_uncertainty if estimate.components else unknown
    parts = [estimate.contribution(c) if c in estimate.names else unknown for c in causes]
    return np.where(np.isfinite(estimate.values)[..., None], np.stack([whole, *parts], -1), np.nan)
