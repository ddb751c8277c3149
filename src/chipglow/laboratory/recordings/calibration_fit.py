"""Calibrations fitted to blackbodies."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Final, Generic, TypeVar

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.special import chdtrc, ndtri, stdtrit

from chipglow.camera.calibration import FittedCalibration
from chipglow.laboratory.recordings.calibration_checks import alike, drift_shift, residual_warnings
from chipglow.quantities import TINY, ZERO_CELSIUS, Array, Brief, Parameter, Part
from chipglow.quantities.units import COLDEST, HOTTEST, TEMPERATURE
from chipglow.radiometry import Band

Kind = TypeVar("Kind", bound=FittedCalibration)

_QUANTILE: Final = 0.975
"""Probability at which Student's factor replaces the normal one: both ends of 95 %."""

_MOST_ITERATIONS: Final = 50
"""Most iterations of a fit and its weights."""

_SETTLED_CHANGE: Final = 1e-9
"""Relative change of the weights at which the iterations end."""

_ROUNDING: Final = 1e-12
"""Part of the largest count below which residuals are rounding errors."""


@dataclass(frozen=True)
class Blackbody(Part):
    """The source of a calibration."""

    emissivity: Annotated[
        float, Parameter("Emissivity in the camera's band.", over=0.0, most=1.0)
    ] = 1.0
    emissivity_uncertainty: Annotated[
        float, Parameter("Its standard uncertainty, common to all points.", least=0.0, under=1.0)
    ] = 0.0
    surroundings: Annotated[float, Parameter("Reflected temperature.", TEMPERATURE)] = 293.15

    def radiance_temperatures(self, kelvins: Array, band: Band) -> Array:
        """Return the temperatures in K of the ideal blackbodies that radiate as much."""
        if self.emissivity == 1.0:
            return kelvins
        own = self.emissivity * np.asarray(band.radiance(kelvins), np.float64)
        radiance = own + (1 - self.emissivity) * self._reflected(band)
        return np.asarray(band.temperature(radiance), np.float64)

    def sensitivity(self, kelvins: Array, band: Band) -> tuple[Array, Array]:
        """Return the change of `radiance_temperatures` with temperature and with emissivity."""
        slope = band.slope(self.radiance_temperatures(kelvins, band))
        by_temperature = self.emissivity * band.slope(kelvins) / slope
        return by_temperature, np.asarray((band.radiance(kelvins) - self._reflected(band)) / slope)

    def _reflected(self, band: Band) -> float:
        return float(band.radiance(self.surroundings))


_IDEAL: Final = Blackbody()


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationFit(Generic[Kind], Brief):
    """A calibration, and how well it fits its n points."""

    calibration: Kind
    temperatures: Array
    """Radiance temperatures of the blackbody in K, shape (n,)."""
    counts: Array
    """Shape (n,)."""
    residuals: Array
    """Counts minus those of the calibration, shape (n,)."""
    standard_uncertainties: Array
    """Uncertainty of the residuals in counts, the temperatures' included, shape (n,)."""
    stated: bool
    """Whether the uncertainties were stated; otherwise they are the residuals' scatter."""

    @property
    def residuals_temperature(self) -> Array:
        """Residuals as differences of temperature in K, shape (n,)."""
        return self.residuals / self.calibration.slope(self.temperatures)

    @property
    def degrees_of_freedom(self) -> int:
        """Points minus parameters."""
        return self.counts.size - self.calibration.parameters.size

    @property
    def chi_squared(self) -> float:
        """Sum of the squares of the residuals over their uncertainties."""
        return float(np.sum((self.residuals / self.standard_uncertainties) ** 2))

    @property
    def probability(self) -> float | None:
        """Probability of a chi-squared as large or larger; None unless `stated`.

        Where it is small, the form of the calibration or the stated uncertainties are wrong.
        """
        if not self.stated or self.degrees_of_freedom == 0:
            return None
        return float(chdtrc(self.degrees_of_freedom, self.chi_squared))

    @property
    def information_criterion(self) -> float:
        """Akaike's, corrected for few points; infinite where there are too few of them.

        Only of use between fits to the same points, with the same `stated`.
        """
        points, parameters = self.counts.size, self.calibration.parameters.size
        estimated = parameters if self.stated else parameters + 1
        if points - estimated - 1 <= 0:
            return np.inf
        scatter = float(np.mean(self.residuals**2))
        misfit = self.chi_squared if self.stated else points * np.log(max(scatter, TINY))
        return misfit + 2 * estimated * points / (points - estimated - 1)

    @property
    def enlargement(self) -> float:
        """Factor on the standard uncertainties of the fit, 1 or more.

        With stated ones, the root of the reduced chi-squared if it exceeds 1 (R. T. Birge, Physical
        Review 40 (1932) 207). Where the scatter of the points is all that is known, Student's
        factor for 95 % over the normal distribution's (JCGM 100, G.3): with few points it is large,
        and twice the standard uncertainty holds the truth as often as stated.
        """
        free = self.degrees_of_freedom
        if not self.stated:
            return float(stdtrit(free, _QUANTILE) / ndtri(_QUANTILE))
        return max(float(np.sqrt(self.chi_squared / free)), 1.0) if free else 1.0


def fit_calibration(
    kind: type[Kind],
    temperatures: ArrayLike,
    counts: ArrayLike,
    band: Band,
    count_uncertainty: ArrayLike | None = None,
    temperature_uncertainty: ArrayLike | None = None,
    common_uncertainty: float = 0.0,
    *,
    integration_time: float | None = None,
    range_name: str | None = None,
    blackbody: Blackbody = _IDEAL,
) -> CalibrationFit[Kind]:
    """Fit a `LinearCalibration` or `SakumaHattori` to blackbodies of temperatures in K.

    Uncertainties of the points are standard ones in counts and K, of each or of all. If neither is
    given, all points weigh the same, and the scatter of the residuals gives the uncertainty.

    Weights are by the effective variance u²(S) + (dS/dT)² u²(T) at the fitted slope, iterated
    (J. Orear, Am. J. Phys. 50 (1982) 912). The covariance of the parameters follows from the
    weighted fit, times the square of `CalibrationFit.enlargement`; a common error of the
    temperatures or of the blackbody's emissivity moves all points at once, and what it does to
    the parameters is added to their covariance as one more term (JCGM 100, Equation 13).
    """
    kelvins, signal = np.asarray(temperatures, np.float64), np.asarray(counts, np.float64)
    of_counts = _uncertainty("count_uncertainty", count_uncertainty, signal.shape)
    of_kelvins = _uncertainty("temperature_uncertainty", temperature_uncertainty, signal.shape)
    of_all = _uncertainty("common_uncertainty", common_uncertainty, signal.shape)
    stated = count_uncertainty is not None or temperature_uncertainty is not None
    _check_points(kelvins, signal, len(kind.NAMES), stated)
    common = [of_all]
    if blackbody != _IDEAL:
        by_temperature, by_emissivity = blackbody.sensitivity(kelvins, band)
        kelvins = blackbody.radiance_temperatures(kelvins, band)
        of_kelvins = by_temperature * of_kelvins
        common = [by_temperature * of_all, by_emissivity * blackbody.emissivity_uncertainty]
    start = kind.first_guess(kelvins, signal, band)
    _expect_rising(start[-1] > 0)
    calibration = kind(
        band=band,
        lowest=float(kelvins.min()),
        highest=float(kelvins.max()),
        integration_time=integration_time,
        range=range_name,
        parameters=start,
        covariance=np.zeros((start.size, start.size)),
    )

    def deviations(calibration: Kind) -> Array:
        """Return effective standard uncertainties in counts; 1 if none are stated."""
        if not stated:
            return np.ones_like(signal)
        return np.hypot(of_counts, calibration.slope(kelvins) * of_kelvins)

    calibration = _settled(calibration, kelvins, signal, deviations)
    residuals, spread = signal - calibration.counts(kelvins), deviations(calibration)
    if not stated:
        rounding = _ROUNDING * np.abs(signal).max()
        scatter = np.sqrt(np.sum(residuals**2) / (signal.size - start.size))
        spread = np.full_like(signal, max(scatter, rounding))
    fit = CalibrationFit(calibration, kelvins, signal, residuals, spread, stated)
    scaled, design = residuals / spread, (calibration.gradient(kelvins) / spread).T
    slope = calibration.slope(kelvins) / spread
    covariance = _covariance(design, [slope * one for one in common], fit.enlargement)
    drifts = alike(scaled, design)
    if drifts:
        shift = drift_shift(scaled, design)
        covariance = covariance + np.outer(shift, shift)
    warnings = tuple(residual_warnings(scaled, design, kelvins, stated, drifts))
    return replace(fit, calibration=replace(calibration, covariance=covariance, warnings=warnings))


def _uncertainty(name: str, value: ArrayLike | None, shape: tuple[int, ...]) -> Array:
    try:
        values = np.broadcast_to(np.asarray(0.0 if value is None else value, np.float64), shape)
    except ValueError:
        raise ValueError(f"calibration: {name} is not of as many points as counts") from None
    if not (np.isfinite(values) & (values >= 0)).all():
        raise ValueError(f"calibration: {name} must be finite, 0 or more")
    return values


def _check_points(kelvins: Array, counts: Array, parameters: int, stated: bool) -> None:
    """Raise a ValueError if points are impossible, saturated or fewer than the parameters."""
    if kelvins.ndim != 1 or kelvins.shape != counts.shape:
        raise ValueError(f"calibration: {kelvins.size} temperatures but {counts.size} counts")
    if not np.isfinite(counts).all():
        raise ValueError("calibration: counts are not finite")
    impossible = kelvins[~((kelvins >= COLDEST) & (kelvins <= HOTTEST))]
    if impossible.size:
        raise ValueError(
            f"calibration: a blackbody is at {impossible[0]:g} K "
            f"({impossible[0] - ZERO_CELSIUS:g} °C), expected {COLDEST:g} to {HOTTEST:g} K"
        )
    largest = np.unique(kelvins[counts == counts.max(initial=-np.inf)])
    if largest.size > 1 and np.unique(counts).size > 1:
        places = ", ".join(f"{kelvin - ZERO_CELSIUS:.5g}" for kelvin in largest)
        raise ValueError(
            f"calibration: the counts are {counts.max():.7g} at each of {places} °C and nowhere "
            "greater: the camera is saturated there, expected points without saturation"
        )
    needed, different = parameters if stated else parameters + 1, np.unique(kelvins).size
    if different < parameters or counts.size < needed:
        raise ValueError(
            f"calibration: {counts.size} points at {different} temperatures, expected "
            f"{needed} points or more at {parameters} temperatures or more"
        )


def _expect_rising(rises: bool) -> None:
    if not rises:
        raise ValueError(
            "calibration: the counts do not rise with the temperature, expected counts that do"
        )


def _settled(
    calibration: Kind, kelvins: Array, counts: Array, deviations: Callable[[Kind], Array]
) -> Kind:
    """Fit by least squares with the effective variance, iterated until the weights stay."""
    weights = deviations(calibration)
    if not weights.all():
        raise ValueError(
            "calibration: both uncertainties of a point are 0; give a positive one, or none"
        )
    for _ in range(_MOST_ITERATIONS):
        calibration = _least_squares(calibration, kelvins, counts, weights)
        before, weights = weights, deviations(calibration)
        if np.allclose(weights, before, rtol=_SETTLED_CHANGE, atol=0.0):
            _expect_rising(calibration.rises)
            return calibration
    raise ValueError("calibration: the reweighted fit did not converge; check for outliers")


def _least_squares(calibration: Kind, kelvins: Array, counts: Array, deviations: Array) -> Kind:
    def misfit(parameters: Array) -> Array:
        model = replace(calibration, parameters=parameters).counts(kelvins)
        return np.asarray((model - counts) / deviations)

    def jacobian(parameters: Array) -> Array:
        return (replace(calibration, parameters=parameters).gradient(kelvins) / deviations).T

    # As exact as double precision allows, with a margin.
    exact = {"xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12}
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            found = scipy.optimize.least_squares(
                misfit, calibration.parameters, jacobian, method="lm", x_scale="jac", **exact
            )
    except FloatingPointError:
        found = None
    if found is None or not found.success:
        raise ValueError(
            "calibration: the fit does not converge, expected counts that rise as the band's "
            "radiance does"
        )
    return replace(calibration, parameters=np.asarray(found.x))


def _covariance(design: Array, common: list[Array], enlargement: float) -> Array:
    """Return the covariance of the fit, enlarged, and of errors that the points have in common."""
    lengths = np.linalg.norm(design, axis=0)
    # Columns of one length: parameters are of very different sizes.
    solution = np.linalg.pinv(design / lengths) / lengths[:, None]
    random = enlargement**2 * solution @ solution.T
    moved = [solution @ error for error in common]
    return np.asarray(random + sum(np.outer(one, one) for one in moved))
