"""Estimates with the components of their uncertainty, and what is computed of them.

Numerics only: nothing here knows of cameras, files or screens.
"""

from chipglow.uncertainty.budget import Budget, budget
from chipglow.uncertainty.component import Cause, Component
from chipglow.uncertainty.dataset import from_xarray, to_xarray
from chipglow.uncertainty.draws import draw
from chipglow.uncertainty.estimate import Estimate, propagate
from chipglow.uncertainty.inputs import Input, Inputs
from chipglow.uncertainty.monte_carlo import MonteCarlo, monte_carlo

__all__ = [
    "Budget",
    "Cause",
    "Component",
    "Estimate",
    "Input",
    "Inputs",
    "MonteCarlo",
    "budget",
    "draw",
    "from_xarray",
    "monte_carlo",
    "propagate",
    "to_xarray",
]
