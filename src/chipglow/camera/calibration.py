"""Calibrations from a camera's counts to radiance, with their uncertainty."""

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.camera.recording import MeasuringRange, PlanckConversion
from chipglow.quantities import Array, Brief, Parameter
from chipglow.quantities.units import COLDEST, HOTTEST
from chipglow.radiometry import Band
from chipglow.radiometry.band import SECOND_RADIATION_CONSTANT
from chipglow.uncertainty import Cause, Component, Estimate
from chipglow.uncertainty.estimate import factor

CALIBRATION: Final = "calibration"
"""Name of the component of uncertainty due to a calibration."""

_CHECKED_TEMPERATURES: Final = 101
"""Temperatures at which a calibration is checked to rise."""

_INVERSE_NODES: Final = 513
"""Nodes of the inverse of a calibration."""

_GUESS_POINTS: Final = 501
"""Wavelengths of the mean and the variance of a band: enough for a first guess."""


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationErrors(Brief):
    """Independent errors of a calibration, and their effects on radiance: none falls in a mean."""

    radiance: Array
    """In-band radiance in W/(m² sr), rising, shape (k,)."""
    effects: Array
    """Change there by each error of one standard uncertainty, signed, shape (errors, k)."""

    def __post_init__(self) -> None:
        for name in ("radiance", "effects"):
            object.__setattr__(self, name, np.array(getattr(self, name), np.float64))
        nodes, shape = self.radiance, self.effects.shape
        if nodes.ndim != 1 or nodes.size == 0 or len(shape) != 2 or shape[1] != nodes.size:
            raise ValueError(
                f"calibration errors: radiance and effects have shapes {nodes.shape} and {shape}, "
                "expected (k,) and (errors, k)"
            )
        if not (np.isfinite(self.effects).all() and np.isfinite(nodes).all()):
            raise ValueError("calibration errors: a number is not finite")
        if not (np.diff(nodes) > 0).all():
            raise ValueError("calibration errors: the radiance must rise with the counts")

    @cached_property
    def identity(self) -> str:
        """Digest that is the same for these errors read from a file."""
        content = self.radiance.tobytes() + self.effects.tobytes()
        return hashlib.sha256(content).hexdigest()[:16]

    def at(self, radiance: ArrayLike) -> Array:
        """Return effects at radiances in W/(m² sr), (errors, ...); beyond the ends as there."""
        places = np.asarray(radiance, np.float64)
        return np.stack([np.interp(places, self.radiance, one) for one in self.effects])

    def standard_uncertainty(self, radiance: ArrayLike) -> Array:
        """Return the standard uncertainty of radiances in W/(m² sr)."""
        whole = np.sqrt((self.effects**2).sum(axis=0))
        return np.asarray(np.interp(np.asarray(radiance, np.float64), self.radiance, whole))

    def component(self, effects: ArrayLike) -> Component:
        """Return a result's component, from its change with each error, shape (errors, ...)."""
        columns = np.asarray(effects, np.float64).reshape(len(self.effects), -1).T.copy()
        return Component(Cause(CALIBRATION, self.identity, len(self.effects)), columns)

    def estimate(self, radiance: ArrayLike) -> Estimate:
        """Return radiances in W/(m² sr) with the component ``calibration``."""
        return Estimate(np.asarray(radiance), (self.component(self.at(radiance)),))


@dataclass(frozen=True, kw_only=True)
class CalibrationSettings(MeasuringRange):
    """Measuring range, warnings and other statements about a calibration."""

    warnings: Annotated[
        tuple[str, ...],
        Parameter("Warnings, as sentences; every measurement with this calibration repeats them."),
    ] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration(CalibrationSettings, ABC):
    """Meaning of a camera's counts; `description` says what it is."""

    description: ClassVar[str]
    band: Band
    lowest: float = 0.0
    """Lowest valid radiance temperature in K."""
    highest: float = inf
    """Radiance temperature in K up to which it holds."""

    @abstractmethod
    def radiance(self, counts: ArrayLike) -> Array:
        """Return the in-band radiance in W/(m² sr) of counts; NaN if unknown."""

    @property
    def errors(self) -> CalibrationErrors | None:
        """Effects of its errors on the radiance; None if they are not known."""
        return None


@dataclass(frozen=True, kw_only=True, eq=False)
class FittedCalibration(Calibration):
    """A calibration whose parameters were fitted to blackbodies; `kind` is its name in files."""

    kind = ""
    NAMES: ClassVar[tuple[str, ...]] = ()
    UNITS: ClassVar[tuple[str, ...]] = ()

    parameters: Array
    """As `NAMES` says, shape (n,)."""
    covariance: Array
    """Covariance of the fit and of errors common to the blackbodies, shape (n, n)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not COLDEST <= self.lowest < self.highest <= HOTTEST:
            raise ValueError(
                f"calibration: lowest is {self.lowest:g} K and highest {self.highest:g} K, "
                f"expected temperatures of blackbodies in order, {COLDEST:g} to "
                f"{HOTTEST:g} K"
            )
        count = len(self.NAMES)
        if self.parameters.shape != (count,) or self.covariance.shape != (count, count):
            raise ValueError(
                f"calibration: shapes {self.parameters.shape} and {self.covariance.shape} of "
                f"parameters and covariance, expected the shapes for {', '.join(self.NAMES)}"
            )
        if not (np.isfinite(self.parameters).all() and np.isfinite(self.covariance).all()):
            raise ValueError("calibration: a parameter or covariance is not finite")
        if (np.diag(self.covariance) < 0).any():
            raise ValueError("calibration: a variance is negative, expected 0 or more")

    @classmethod
    @abstractmethod
    def first_guess(cls, kelvins: Array, counts: Array, band: Band) -> Array:
        """Return parameters to start a fit from, the last of which is positive if counts rise."""

    @abstractmethod
    def counts(self, temperature: ArrayLike) -> Array:
        """Return the counts of a blackbody of this temperature in K."""

    @abstractmethod
    def slope(self, temperature: ArrayLike) -> Array:
        """Return the change of the counts with the temperature, in 1/K."""

    @abstractmethod
    def gradient(self, temperature: ArrayLike) -> Array:
        """Return the change of the counts with each parameter, shape (n, ...)."""

    @abstractmethod
    def temperature(self, counts: ArrayLike) -> Array:
        """Return the temperature in K of the blackbody that gives these counts, or NaN."""

    @property
    def rises(self) -> bool:
        """Whether the counts rise with the temperature wherever it holds."""
        kelvins = np.linspace(self.lowest, self.highest, _CHECKED_TEMPERATURES)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            return bool((self.slope(kelvins) > 0).all())

    def radiance(self, counts: ArrayLike) -> Array:
        return np.asarray(self.band.radiance(self.temperature(counts)), np.float64)

    def uncertainty(self, counts: ArrayLike) -> Array:
        """Return the standard uncertainty of `radiance` in W/(m² sr)."""
        return np.asarray(np.sqrt((self._effects(self.temperature(counts)) ** 2).sum(axis=0)))

    @cached_property
    def errors(self) -> CalibrationErrors:
        """Effects of its errors on the radiance, from the coldest to the hottest blackbody."""
        coldest, hottest = self.counts([self.lowest, self.highest]).tolist()
        kelvins = self.temperature(np.linspace(coldest, hottest, _INVERSE_NODES))
        radiance = np.asarray(self.band.radiance(kelvins), np.float64)
        return CalibrationErrors(radiance, self._effects(kelvins))

    def _effects(self, temperature: Array) -> Array:
        """Return changes of the radiance by independent errors of the parameters, shape (n, ...).

        Each is of one standard uncertainty; together they have the covariance of the parameters
        (JCGM 100, Equation 13): at given counts S a change of the parameters moves the radiance by
        dL = −(∂S/∂p) dp (dL/dT) / (∂S/∂T).
        """
        errors = factor(self.covariance, CALIBRATION)
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = self.band.slope(temperature) / self.slope(temperature)
            by_parameters = np.asarray(-self.gradient(temperature) * slope)
        return np.tensordot(errors.T, by_parameters, 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class LinearCalibration(FittedCalibration):
    """Counts that are a straight line over the in-band radiance: S = offset + gain L(T)."""

    kind = "linear"
    description: ClassVar[str] = "straight line over the in-band radiance"
    NAMES: ClassVar[tuple[str, ...]] = ("offset", "gain")
    UNITS: ClassVar[tuple[str, ...]] = ("counts", "counts m² sr/W")

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.parameters[1] > 0:
            raise ValueError(f"calibration: gain is {self.parameters[1]:g}, expected more than 0")

    @classmethod
    def first_guess(cls, kelvins: Array, counts: Array, band: Band) -> Array:
        gain, offset = np.polyfit(np.asarray(band.radiance(kelvins), np.float64), counts, 1)
        return np.array([offset, gain])

    def counts(self, temperature: ArrayLike) -> Array:
        offset, gain = self.parameters
        return np.asarray(offset + gain * self.band.radiance(_floats(temperature)))

    def slope(self, temperature: ArrayLike) -> Array:
        return np.asarray(self.parameters[1] * self.band.slope(temperature))

    def gradient(self, temperature: ArrayLike) -> Array:
        radiance = self.band.radiance(_floats(temperature))
        return np.stack([np.ones_like(radiance), radiance])

    def temperature(self, counts: ArrayLike) -> Array:
        return np.asarray(self.band.temperature(self.radiance(counts)), np.float64)

    def radiance(self, counts: ArrayLike) -> Array:
        offset, gain = self.parameters
        return np.asarray((_floats(counts) - offset) / gain)


@dataclass(frozen=True, kw_only=True, eq=False)
class SakumaHattori(FittedCalibration):
    """Counts by the Planckian form of Sakuma and Hattori: S = offset + C / (exp(c2/(A T + B)) − 1).

    F. Sakuma and S. Hattori, Temperature: Its Measurement and Control in Science and Industry 5
    (1982) 421; recommended by the CIPM's consultative committee for thermometry (CCT-WG5, 2008).
    Their signal has no offset; the counts of a camera have one.
    """

    kind = "sakuma-hattori"
    description: ClassVar[str] = "Planckian form of Sakuma and Hattori"
    NAMES: ClassVar[tuple[str, ...]] = ("offset", "A", "B", "C")
    UNITS: ClassVar[tuple[str, ...]] = ("counts", "m", "m K", "counts")

    @classmethod
    def first_guess(cls, kelvins: Array, counts: Array, band: Band) -> Array:
        """Return that of a narrow band of mean wavelength λ and standard deviation σ.

        A = λ (1 − 6 σ²/λ²) and B = c2 σ²/(2 λ²) (P. Saunders and D. R. White, Metrologia 40 (2003)
        195).
        """
        wavelengths = np.linspace(band.lower, band.upper, _GUESS_POINTS)
        weights = np.ones_like(wavelengths) if band.response is None else band.response(wavelengths)
        mean = float(np.average(wavelengths, weights=weights))
        relative = float(np.average((wavelengths / mean - 1) ** 2, weights=weights))
        a, b = mean * (1 - 6 * relative), SECOND_RADIATION_CONSTANT * relative / 2
        form = _occupation(SECOND_RADIATION_CONSTANT / (a * kelvins + b))
        scale, offset = np.polyfit(form, counts, 1)
        return np.array([offset, a, b, scale])

    def counts(self, temperature: ArrayLike) -> Array:
        offset, _, _, scale = self.parameters
        return np.asarray(offset + scale * _occupation(self._exponent(temperature)))

    def slope(self, temperature: ArrayLike) -> Array:
        return np.asarray(self.parameters[1] * self._by_stretched(temperature))

    def gradient(self, temperature: ArrayLike) -> Array:
        kelvins, stretched = _floats(temperature), self._by_stretched(temperature)
        occupation = _occupation(self._exponent(temperature))
        return np.stack([np.ones_like(kelvins), kelvins * stretched, stretched, occupation])

    def temperature(self, counts: ArrayLike) -> Array:
        offset, a, b, scale = self.parameters
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log1p(scale / (_floats(counts) - offset))
            kelvins = (SECOND_RADIATION_CONSTANT / logarithm - b) / a
        return np.where(kelvins > 0, kelvins, np.nan)

    def _exponent(self, temperature: ArrayLike) -> Array:
        _, a, b, _ = self.parameters
        return np.asarray(SECOND_RADIATION_CONSTANT / (a * _floats(temperature) + b))

    def _by_stretched(self, temperature: ArrayLike) -> Array:
        """Return the change of the counts with A T + B."""
        exponent = self._exponent(temperature)
        occupation = _occupation(exponent)
        growth = occupation * (1 + occupation) * exponent**2 / SECOND_RADIATION_CONSTANT
        return np.asarray(self.parameters[3] * growth)


@dataclass(frozen=True, kw_only=True, eq=False)
class FactoryCalibration(Calibration):
    """The conversion that a camera's maker stored in the file; its uncertainty is not known."""

    description: ClassVar[str] = "the maker's, from the file; its uncertainty is not known"
    conversion: PlanckConversion

    def radiance(self, counts: ArrayLike) -> Array:
        kelvins = self.conversion.temperature(np.asarray(counts))
        return np.asarray(self.band.radiance(kelvins), np.float64)


def _floats(values: ArrayLike) -> NDArray[Any]:
    return np.asarray(values, np.float64)


def _occupation(exponent: Array) -> Array:
    """Return 1 / (exp(x) − 1), without overflow at large x."""
    return np.asarray(np.exp(-exponent) / -np.expm1(-exponent))


MODELS: Final[Mapping[str, type[FittedCalibration]]] = {
    one.kind: one for one in (LinearCalibration, SakumaHattori)
}
"""Fitted calibrations by name."""
