"""The emissivity of one feature: its mean, its standard deviation, and their distribution."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Annotated, Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainccinv, betaincinv, ndtr

from chipglow.quantities import Array, Parameter, Part

REACH: Final = 8.0
"""Normal deviates from −8 to 8 are told apart; those beyond count as these."""

STEPS: Final = 32
"""Entries of a table for each unit of the deviate."""

_NORMAL_REACH: Final = 5.0


@dataclass(frozen=True)
class Emissivity(Part):
    """Emissivity of one feature.

    Heigel and Whitenton (2010) take "samples from a normal distribution". So it is here where
    five standard deviations to either side of the mean stay within 0 to 1, as in the paper's
    Table 1. Nearer to 0 or 1 a normal distribution would be cut off, and mean and standard
    deviation with it: there it is a beta distribution, which stays within 0 to 1 by itself.
    """

    mean: Annotated[float, Parameter("Mean emissivity.", least=0.0, most=1.0)]
    standard_deviation: Annotated[
        float, Parameter("Standard deviation over the surface.", least=0.0)
    ] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        most = 0.9 * sqrt(self.mean * (1.0 - self.mean))
        if self.standard_deviation > most:
            raise ValueError(
                f"standard_deviation: {self.standard_deviation:g}, expected up to {most:.3g} "
                f"about a mean of {self.mean:g}"
            )

    @property
    def is_normal(self) -> bool:
        """Whether its values are distributed normally."""
        reach = _NORMAL_REACH * self.standard_deviation
        return self.mean - reach >= 0.0 and self.mean + reach <= 1.0

    @cached_property
    def table(self) -> NDArray[np.float32]:
        """Emissivity at normal deviates from −`REACH` to `REACH`, `STEPS` to a unit."""
        deviates = np.linspace(-REACH, REACH, round(2 * REACH * STEPS) + 1)
        if self.is_normal:
            values = np.clip(self.mean + self.standard_deviation * deviates, 0.0, 1.0)
        else:
            values = _beta_values(deviates, self.mean, self.standard_deviation)
        return np.asarray(values, dtype=np.float32)

    @property
    def line(self) -> tuple[float, float]:
        """Emissivity at a deviate of 0 and its change with the deviate; NaN if it is no line."""
        return self.mean, self.standard_deviation if self.is_normal else float("nan")


def _beta_values(deviates: Array, mean: float, standard_deviation: float) -> Array:
    """Values of a beta distribution where a normal one has these deviates."""
    size = mean * (1 - mean) / standard_deviation**2 - 1
    first, second = mean * size, (1 - mean) * size
    # The upper half by the survival function: 1 − p would be rounded away.
    lower = betaincinv(first, second, ndtr(np.minimum(deviates, 0.0)))
    upper = betainccinv(first, second, ndtr(-np.maximum(deviates, 0.0)))
    return np.asarray(np.where(deviates < 0.0, lower, upper), dtype=np.float64)
