"""Ratio (two-colour) thermometry: a temperature from the radiances of two bands."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import COLDEST, HOTTEST
from chipglow.radiometry.band import Band


@dataclass(frozen=True)
class RatioThermometer(Part):
    """The temperature at which two bands send radiances of a given ratio.

    Parameters
    ----------
    first, second : Band
        The bands, that of the shorter wavelengths first.

    Raises
    ------
    ValueError
        If a number is impossible, or the ratio of the radiances rises at no temperature.

    Notes
    -----
    The ratio is r(T) = ε₁ L₁(T) / (ε₂ L₂(T)) with the in-band radiances of a blackbody. An
    emissivity that is the same in both bands cancels, whatever it is. In `range` the ratio rises
    with the temperature: there 1/T is tabulated over ln r, which is nearly straight, as cubics with
    the slopes of the exact inverse. Bands apart have one temperature for each ratio from 200 K to
    6000 K; of bands that overlap the longest such range is taken.
    """

    first: Band
    second: Band
    emissivity_ratio: Annotated[
        float,
        Parameter(
            "Emissivity in the first band over that in the second; 1 for a grey body.", over=0.0
        ),
    ] = 1.0
    emissivity_ratio_uncertainty: Annotated[
        float, Parameter("Its standard uncertainty.", least=0.0)
    ] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self._rising.stop - self._rising.start < 2:
            raise ValueError(
                "bands: the ratio of their radiances does not rise with the temperature, expected "
                "the band of the shorter wavelengths first"
            )

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest temperature in K that can be measured."""
        known = self._temperatures[self._rising]
        return float(known[0]), float(known[-1])

    def ratio(self, temperature: ArrayLike) -> Array:
        """Return the radiance of the first band over that of the second."""
        kelvins = np.asarray(temperature, np.float64)
        black = self.first.radiance(kelvins) / self.second.radiance(kelvins)
        return np.asarray(self.emissivity_ratio * black, np.float64)

    def temperature(self, first: ArrayLike, second: ArrayLike) -> Array:
        """Return the ratio temperature in K of radiances in W/(m² sr) in either band.

        NaN where a radiance is not positive and finite, and where no temperature of `range` has
        their ratio.
        """
        upper, lower = np.asarray(first, np.float64), np.asarray(second, np.float64)
        possible = (upper > 0) & (lower > 0) & np.isfinite(upper) & np.isfinite(lower)
        logarithm = np.log(np.where(possible, upper, 1.0)) - np.log(
            np.where(possible, lower, 1.0) * self.emissivity_ratio
        )
        inverse = self._inverse(logarithm)
        return np.asarray(np.where(possible, 1.0 / inverse, np.nan), np.float64)

    def sensitivity(self, temperature: ArrayLike) -> Array:
        """Return the relative change of the ratio with the temperature, d ln r / dT, in 1/K."""
        kelvins = np.asarray(temperature, np.float64)
        upper = self.first.slope(kelvins) / self.first.radiance(kelvins)
        lower = self.second.slope(kelvins) / self.second.radiance(kelvins)
        return np.asarray(upper - lower, np.float64)

    def emissivity_error(self, temperature: ArrayLike, ratio: ArrayLike) -> Array:
        """Return the error in K where the emissivities have another ratio than assumed.

        In Wien's limit and narrow bands 1/T_r − 1/T = Λ ln(x) / c2 with x the assumed over the true
        ratio of the emissivities and 1/Λ = 1/λ₁ − 1/λ₂.
        """
        kelvins = np.asarray(temperature, np.float64)
        seen = self.first.radiance(kelvins) * np.asarray(ratio, np.float64)
        return self.temperature(seen, self.second.radiance(kelvins)) - kelvins

    def uncertainty(self, temperature: ArrayLike) -> Array:
        """Return the standard uncertainty in K by that of the emissivities' ratio."""
        relative = self.emissivity_ratio_uncertainty / self.emissivity_ratio
        return relative / self.sensitivity(temperature)

    @property
    def _temperatures(self) -> Array:
        """Nodes of the bands' tables in K."""
        return np.linspace(COLDEST, HOTTEST, len(self.first.radiance_table))

    @cached_property
    def _slopes(self) -> Array:
        """Relative change of the ratio with the temperature at the nodes, in 1/K."""
        with np.errstate(invalid="ignore", divide="ignore"):
            upper, lower = (
                band.radiance_table[:, 1] / band.radiance_table[:, 0]
                for band in (self.first, self.second)
            )
        return np.asarray(upper - lower)

    @cached_property
    def _rising(self) -> slice:
        """Nodes of the longest range in which the ratio rises."""
        rises = np.concatenate([[False], self._slopes > 0, [False]])
        starts, stops = (np.flatnonzero(np.diff(rises.astype(int)) == s) for s in (1, -1))
        if not starts.size:
            return slice(0, 0)
        longest = int(np.argmax(stops - starts))
        return slice(int(starts[longest]), int(stops[longest]))

    @cached_property
    def _inverse(self) -> Any:
        """1/T over the logarithm of the blackbodies' ratio; NaN beyond."""
        kelvins, slopes = self._temperatures[self._rising], self._slopes[self._rising]
        upper, lower = (
            np.log(band.radiance_table[self._rising, 0]) for band in (self.first, self.second)
        )
        return scipy.interpolate.CubicHermiteSpline(
            upper - lower, 1.0 / kelvins, -1.0 / (kelvins**2 * slopes), extrapolate=False
        )
