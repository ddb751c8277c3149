"""Comparison of measurement and simulation within their uncertainties."""

from chipglow.laboratory.comparison.comparison import (
    Comparison,
    Fit,
    PlaceResult,
    Readings,
    StatedUncertainties,
    compare,
    normalised_error,
)
from chipglow.laboratory.comparison.file import labelled_simulations, write_comparison

__all__ = [
    "Comparison",
    "Fit",
    "PlaceResult",
    "Readings",
    "StatedUncertainties",
    "compare",
    "labelled_simulations",
    "normalised_error",
    "write_comparison",
]
