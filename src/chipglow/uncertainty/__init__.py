"""Estimates with the components of their uncertainty, and what is computed of them.

Numerics only: nothing here knows of cameras, files or screens.
"""

from chipglow.uncertainty.budget import (
    Budget as Budget,
    budget as budget,
    first_order as first_order,
    sobol_indices as sobol_indices,
)
from chipglow.uncertainty.component import Cause as Cause, Component as Component
from chipglow.uncertainty.dataset import from_xarray as from_xarray, to_xarray as to_xarray
from chipglow.uncertainty.draws import draw as draw
from chipglow.uncertainty.estimate import Estimate as Estimate, propagate as propagate
from chipglow.uncertainty.inputs import Input as Input, Inputs as Inputs
from chipglow.uncertainty.limits import Limits as Limits
from chipglow.uncertainty.monte_carlo import MonteCarlo as MonteCarlo, monte_carlo as monte_carlo
