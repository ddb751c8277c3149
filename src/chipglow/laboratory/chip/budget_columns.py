"""Columns that the frames of temperatures have in common."""

from collections.abc import Sequence

import numpy as np

from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.uncertainty import Estimate


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
