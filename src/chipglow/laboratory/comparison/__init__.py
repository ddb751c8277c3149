"""Comparison of measurement and simulation within their uncertainties."""

from chipglow.laboratory.comparison.comparison import (
    Comparison as Comparison,
    Readings as Readings,
    StatedUncertainties as StatedUncertainties,
    compare as compare,
    normalised_error as normalised_error,
)
from chipglow.laboratory.comparison.file import (
    labelled_simulations as labelled_simulations,
    write_comparison as write_comparison,
)
