"""Measured beside simulated: whether they agree within their uncertainty."""

from chipglow.laboratory.comparison.comparison import (
    BandComparison,
    Comparison,
    Fit,
    GridComparison,
    PlaceResult,
    StatedUncertainties,
    compare,
    normalised_error,
)
from chipglow.laboratory.comparison.file import labelled_simulations, write_comparison

__all__ = [
    "BandComparison",
    "Comparison",
    "Fit",
    "GridComparison",
    "PlaceResult",
    "StatedUncertainties",
    "compare",
    "labelled_simulations",
    "normalised_error",
    "write_comparison",
]
