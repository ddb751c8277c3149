"""True temperature of an area whose emissivity is known, with its uncertainty."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, sqrt
from typing import Any, Final, Protocol
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import FittedCalibration, Flag, Measurement
from chipglow.laboratory.emissivity.emissivity import LABORATORY, Heating
from chipglow.laboratory.emissivity.observations import (
    RANDOM,
    area_estimate,
    check_same_pixels,
    count_flags,
    flag_text,
    left_out_warning,
    observed_flags,
    observed_radiance,
    told_calibration,
)
from chipglow.radiometry import Band
from chipglow.scene import Area
from chipglow.uncertainty import Estimate, propagate

TEMPERATURE_BUDGET: Final = (
    *("reference", "reflected", "calibration", "emissivity"),
    *("drift", "repeatability", "noise"),
)
"""Lines of the budget of a true temperature."""

_UNEVEN: Final = 0.5
_NO_MATTER: Final = 0.01
_STEP: Final = 0.5


class DeterminedEmissivity(Protocol):
    """An area's emissivity that was determined with the same camera: a `RegionEmissivity`."""

    @property
    def heating(self) -> Heating:
        """How the object was heated."""

    @property
    def estimate(self) -> Estimate:
        """Mean emissivity, with the components of `COMMON`, ``drift`` and ``random``."""


@dataclass(frozen=True)
class KnownEmissivity:
    """An emissivity from elsewhere, whose errors have nothing to do with the measurement's.

    Parameters
    ----------
    mean : float
        Emissivity, over 0 to 1.
    standard_uncertainty : float
        Its standard uncertainty.

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    mean: float
    standard_uncertainty: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.mean <= 1:
            raise ValueError(f"emissivity: is {self.mean!r}, expected over 0 to 1")
        if not 0 <= self.standard_uncertainty < inf:
            raise ValueError(
                f"emissivity: standard uncertainty is {self.standard_uncertainty!r}, "
                "expected 0 or more"
            )

    @property
    def estimate(self) -> Estimate:
        """The emissivity with the component ``emissivity``."""
        return Estimate(np.array(self.mean)).with_component("emissivity", self.standard_uncertainty)


@dataclass(frozen=True)
class ReflectedTemperature:
    """What an object reflects.

    Parameters
    ----------
    temperature : float
        In K; the paper's 293 K by default.
    standard_uncertainty : float
        In K.

    Raises
    ------
    ValueError
        If the temperature is not over 0 K or the uncertainty is negative.
    """

    temperature: float = LABORATORY
    standard_uncertainty: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.temperature < inf:
            raise ValueError(f"reflected: is {self.temperature!r} K, expected over 0 K")
        if not 0 <= self.standard_uncertainty < inf:
            raise ValueError(
                f"reflected: standard uncertainty is {self.standard_uncertainty!r} K, "
                "expected 0 K or more"
            )

    @cached_property
    def estimate(self) -> Estimate:
        """The temperature, with the component ``reflected``: the same wherever these are."""
        return Estimate(np.array(self.temperature)).with_component(
            "reflected", self.standard_uncertainty, independent="common"
        )


@dataclass(frozen=True, eq=False)
class TrueTemperature:
    """True temperature of an area; made by `true_temperature`.

    Parameters
    ----------
    name : str
        The area's name.
    pixels, left_out : int
        Number of pixels that count, and of those that do not, because they are flagged.
    flagged : dict
        How many have each `Flag`.
    radiance_temperature : float
        That of the area's mean radiance in K.
    deviation : float
        Standard deviation over the pixels of the temperatures in K that each would have by
        itself: how uneven the area is in temperature and emissivity, with the pixels' noise.
    mean_of_pixels : float
        Mean of these temperatures in K: under the estimate where the area is uneven.
    emissivity : float
        Emissivity that was taken.
    estimate : Estimate
        True temperature in K, with the components ``reference`` (of the heating with which the
        emissivity was determined), ``reflected``, ``calibration``, ``emissivity`` (by chance, or
        as it is known), ``drift`` between recordings, that of the emissivity included, and
        ``random``, of which ``repeatability`` and ``noise`` are parts.
    correlation : float or None
        Correlation of the calibration's errors at the radiances of area and emissivity; None if it
        plays no part or is not known.
    """

    name: str
    pixels: int
    left_out: int
    flagged: dict[Flag, int]
    radiance_temperature: float
    deviation: float
    mean_of_pixels: float
    emissivity: float
    estimate: Estimate
    correlation: float | None


def true_temperature(
    measurements: Sequence[Measurement],
    area: Area,
    emissivity: DeterminedEmissivity | KnownEmissivity,
    surroundings: ReflectedTemperature | None = None,
    calibration: FittedCalibration | None = None,
    drift: float | None = None,
) -> TrueTemperature:
    """True temperature of an even area, of its mean radiance and emissivity.

    Parameters
    ----------
    measurements : sequence of Measurement
        Images of the object; several of them are repetitions.
    area : Area
        Pixels of uniform temperature.
    emissivity : RegionEmissivity or KnownEmissivity
        The area's emissivity, determined with the same camera, or known from elsewhere.
    surroundings : ReflectedTemperature, optional
        What the area reflects. By default those in which the emissivity was determined, with the
        same error; of a `KnownEmissivity` the paper's 293 K.
    calibration : FittedCalibration, optional
        The camera's calibration with which both emissivity and area were measured: it tells how
        far its errors at the two radiances are the same.
    drift : float, optional
        Relative standard uncertainty of the radiance from one recording to the next; by default
        what several recordings show. Of one it is not known, and not in the uncertainty.

    Raises
    ------
    ValueError
        If there is no image, the images are of different pixels, fewer than two pixels can be
        used, or the area is darker than what it reflects.

    Notes
    -----
    L(T) = (L_app − (1 − ε) L_env) / ε: Equation 2 of Heigel and Whitenton (2010), solved. The
    uncertainty is propagated to first order (JCGM 100:2008, Equation 13). Emissivity and area have
    errors in common, which partly cancel: a camera that shows too little radiance makes the
    emissivity too small. What is reflected is the same for both, unless another is given. The
    calibration's have the correlation that its covariance tells; without `calibration`
    none is taken, which is too much rather than too little as long as they are of one sign.
    """
    check_same_pixels(measurements, "temperature")
    band, radiance = measurements[0].band, observed_radiance(measurements)
    usable = area.mask & np.isfinite(radiance.mean(axis=0))
    flagged = count_flags(observed_flags(measurements)[area.mask])
    count = int(usable.sum())
    if count < 2:
        raise ValueError(
            f"region {area.name}: {count} of its {int(area.mask.sum())} pixels can be used "
            f"({flag_text(flagged)}), expected 2 or more"
        )
    values = radiance[:, usable]
    mean = float(values.mean())
    reflecting = _surroundings(emissivity, surroundings)
    room = float(reflecting.values)
    equation = _Equation(float(emissivity.estimate.values), room, band)
    sensitivity = equation.sensitivity(area.name, mean)
    correlation = _correlation(emissivity, mean, calibration, band)
    determined = not isinstance(emissivity, KnownEmissivity)
    shared = (correlation or 0.0) if determined else 1.0
    told = told_calibration(measurements)
    error = 0.0 if told is None else float(told[usable].mean())
    seen = _seen(values, error, shared, drift, len(measurements))
    found = propagate(
        lambda _, seen, __: equation.temperature(seen),
        emissivity.estimate.renamed(RANDOM, "emissivity"),
        seen,
        reflecting,
        derivatives=sensitivity.partials,
    )
    pixels = equation.temperature(values.mean(axis=0))
    count_out, mean_of_pixels = int(area.mask.sum()) - count, float(pixels.mean())
    warnings = [f"emissivity of {warning}" for warning in found.warnings]
    warnings += _warnings(area.name, found, mean_of_pixels)
    left_out = left_out_warning(area.name, count, count_out, flagged)
    if left_out is not None:
        warnings = [f"{left_out}.", *warnings]
    return TrueTemperature(
        name=area.name,
        pixels=count,
        left_out=count_out,
        flagged=flagged,
        radiance_temperature=float(band.temperature(np.array(mean))),
        deviation=float(pixels.std(ddof=1)),
        mean_of_pixels=mean_of_pixels,
        emissivity=float(emissivity.estimate.values),
        estimate=replace(found, warnings=tuple(warnings)),
        correlation=correlation,
    )


def _seen(
    values: NDArray[np.float64],
    calibration: float,
    shared: float,
    drift: float | None,
    recordings: int,
) -> Estimate:
    """Mean radiance of observations of shape (observation, pixel) in W/(m² sr).

    Its calibration's errors have a correlation with those of the emissivity: they are the sum of
    the same error and of another.
    """
    mean = float(values.mean())
    # That which an image shows of chance has nothing to do with any other image.
    random = area_estimate(mean, values, uuid4().hex)
    spread = _drift(drift, mean, recordings, float(random.contribution("repeatability")))
    found = Estimate(np.array(mean)).with_component("calibration", shared * calibration)
    found = found.with_component(
        "calibration",
        sqrt(max(1 - shared**2, 0.0)) * calibration,
        independent="common",
        identity="measurement",
    )
    if spread is None:
        found = found.with_unevaluated("drift")
    else:
        found = found.with_component("drift", spread, independent="common")
    return found + (random - mean)


def _warnings(name: str, found: Estimate, mean_of_pixels: float) -> list[str]:
    uneven = abs(float(found.values) - mean_of_pixels)
    if uneven <= max(_UNEVEN * float(found.standard_uncertainty), _NO_MATTER):
        return []
    return [
        f"{name}: is uneven, the mean of its pixels' temperatures is {uneven:.3g} K from the "
        "temperature of its mean radiance."
    ]


def _drift(
    drift: float | None, radiance: float, recordings: int, repeatability: float
) -> float | None:
    """Standard uncertainty of the radiance by the drift over the repeatability, if known."""
    if recordings == 1:
        return None if drift is None else drift * radiance
    stated = (drift or 0.0) * radiance / sqrt(recordings)
    return sqrt(max(stated**2 - repeatability**2, 0.0))


@dataclass(frozen=True)
class _Sensitivity:
    """Change of the true temperature with what it is computed of.

    With the radiance in K m² sr/W, with the emissivity in K, and with the surroundings'
    temperature.
    """

    radiance: float
    emissivity: float
    reflected: float

    @property
    def partials(self) -> tuple[Callable[..., Any], ...]:
        """By emissivity, radiance and surroundings, as `propagate` takes them."""
        return tuple(
            lambda *_, value=value: np.array(value)
            for value in (self.emissivity, self.radiance, self.reflected)
        )


@dataclass(frozen=True)
class _Equation:
    """Equation 2 for an emissivity and the temperature in K of what is reflected."""

    emissivity: float
    reflected: float
    band: Band

    @property
    def reflected_radiance(self) -> float:
        """Radiance of a blackbody at the surroundings' temperature in W/(m² sr)."""
        return float(self.band.radiance(np.array(self.reflected)))

    def own(self, radiance: Any) -> Any:
        """Radiance in W/(m² sr) of a blackbody at the object's temperature."""
        return (radiance - (1 - self.emissivity) * self.reflected_radiance) / self.emissivity

    def temperature(self, radiance: NDArray[np.float64]) -> NDArray[np.float64]:
        """True temperature in K of apparent radiance in W/(m² sr), of the same shape."""
        return np.asarray(self.band.temperature(self.own(radiance)), np.float64)

    def sensitivity(self, name: str, radiance: float) -> _Sensitivity:
        """How the temperature of a radiance in W/(m² sr) of an area depends on all that."""
        own = float(self.own(radiance))
        if not own > self.reflected_radiance:
            raise ValueError(
                f"region {name}: is darker than what it reflects at "
                f"{self.reflected - 273.15:.6g} °C, expected a hotter object"
            )
        value = float(self.band.temperature(np.array(own)))
        by_radiance = 1 / (self.emissivity * self._slope(value))
        by_environment = -(1 - self.emissivity) * self._slope(self.reflected) * by_radiance
        return _Sensitivity(
            by_radiance, -(own - self.reflected_radiance) * by_radiance, by_environment
        )

    def _slope(self, temperature: float) -> float:
        """dL/dT in W/(m² sr K), at any temperature: `Band.slope` ends with its table."""
        ends = self.band.radiance(np.array([temperature - _STEP, temperature + _STEP]))
        return float(ends[1] - ends[0]) / (2 * _STEP)


def _surroundings(
    emissivity: DeterminedEmissivity | KnownEmissivity, given: ReflectedTemperature | None
) -> Estimate:
    """Temperature in K of what is reflected; by default with the error that the emissivity has."""
    if given is not None:
        return given.estimate
    if isinstance(emissivity, KnownEmissivity):
        return ReflectedTemperature().estimate
    heating = emissivity.heating
    return Estimate(np.array(heating.reflected)).with_component(
        "reflected", heating.reflected_uncertainty
    )


def _correlation(
    emissivity: DeterminedEmissivity | KnownEmissivity,
    radiance: float,
    calibration: FittedCalibration | None,
    band: Band,
) -> float | None:
    """Correlation of the calibration's errors at the emissivity's radiance and at this one."""
    if calibration is None or isinstance(emissivity, KnownEmissivity):
        return None
    heating = emissivity.heating
    hot, cold = band.radiance(np.array([heating.reference, heating.reflected])).tolist()
    then = cold + float(emissivity.estimate.values) * (hot - cold)
    found = calibration.errors.estimate([then, radiance]).correlation()[0, 1]
    return float(np.nan_to_num(found))
