"""The emissivity of one feature: its mean, its standard deviation, and their distribution."""

from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import Annotated, Final

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import betainccinv, betaincinv, ndtr

from chipglow.quantities import Parameter, Part
from chipglow.surface.cubic import ENLARGED_VARIANCE, cubic_convolution

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
            values = _beta_values(deviates, *self._beta_moments)
        return np.asarray(values, dtype=np.float32)

    @property
    def line(self) -> tuple[float, float]:
        """Emissivity at a deviate of 0 and its change with the deviate; NaN if it is no line."""
        return self.mean, self.standard_deviation if self.is_normal else float("nan")

    @property
    def _beta_moments(self) -> tuple[float, float]:
        """Moments of the beta distribution whose enlarged texture has those asked for.

        Between its nodes a texture's deviates vary less than at them: they are no single normal
        distribution, and what is not linear in them makes other moments than theirs.
        """
        deviates, weights = _enlarged_deviates()

        def excess(moments: NDArray[np.float64]) -> list[float]:
            mean = 1 / (1 + np.exp(-moments[0]))
            standard_deviation = sqrt(mean * (1 - mean)) / (1 + np.exp(-moments[1]))
            values = _beta_values(deviates, mean, standard_deviation)
            found = float(weights @ values)
            spread = sqrt(float(weights @ (values - found) ** 2))
            return [found - self.mean, spread - self.standard_deviation]

        fraction = self.standard_deviation / sqrt(self.mean * (1 - self.mean))
        start = np.log([self.mean / (1 - self.mean), fraction / (1 - fraction)])
        solution = scipy.optimize.root(excess, start, tol=1e-10).x
        mean = float(1 / (1 + np.exp(-solution[0])))
        return mean, float(sqrt(mean * (1 - mean)) / (1 + np.exp(-solution[1])))


def _beta_values(
    deviates: NDArray[np.float64], mean: float, standard_deviation: float
) -> NDArray[np.float64]:
    """Values of a beta distribution where a normal one has these deviates."""
    size = mean * (1 - mean) / standard_deviation**2 - 1
    first, second = mean * size, (1 - mean) * size
    # The upper half by the survival function: 1 − p would be rounded away.
    lower = betaincinv(first, second, ndtr(np.minimum(deviates, 0.0)))
    upper = betainccinv(first, second, ndtr(-np.maximum(deviates, 0.0)))
    return np.asarray(np.where(deviates < 0.0, lower, upper), dtype=np.float64)


def _enlarged_deviates() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Deviates of an enlarged map of unit standard deviation, and their weights of sum 1."""
    place, place_weight = np.polynomial.legendre.leggauss(4)
    lags = np.arange(-1, 3)[:, None]
    line = (cubic_convolution((place + 1) / 4 - lags) ** 2).sum(axis=0)
    standard_deviation = np.sqrt(np.outer(line, line) / ENLARGED_VARIANCE)
    normal, normal_weight = np.polynomial.hermite_e.hermegauss(40)
    weights = np.multiply.outer(np.outer(place_weight, place_weight) / 4, normal_weight)
    deviates = np.multiply.outer(standard_deviation, normal)
    return deviates.ravel(), weights.ravel() / sqrt(2 * np.pi)
