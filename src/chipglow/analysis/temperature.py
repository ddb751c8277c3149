"""True temperature of an area whose emissivity is known, with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, inf, isfinite, nan, sqrt
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.emissivity import LABORATORY, Heating
from chipglow.analysis.observations import (
    AreaResult,
    Scatter,
    check_same_pixels,
    count_flags,
    flag_text,
    observed_flags,
    observed_radiance,
    told_calibration,
)
from chipglow.analysis.regions import Area
from chipglow.camera import FittedCalibration, Flag, Measurement
from chipglow.radiometry import Band

_UNEVEN: Final = 0.5
_NO_MATTER: Final = 0.01
_STEP: Final = 0.5


class DeterminedEmissivity(Protocol):
    """An area's emissivity that was determined with the same camera: a `RegionEmissivity`."""

    @property
    def mean(self) -> float:
        """Mean emissivity."""

    @property
    def heating(self) -> Heating:
        """How the object was heated."""

    @property
    def common(self) -> dict[str, float]:
        """Contributions to the standard uncertainty by the causes of `COMMON`, with signs."""

    @property
    def scatter(self) -> Scatter:
        """The contributions that are chance."""

    @property
    def drift(self) -> float:
        """Contribution of the drift between recordings; NaN if it is not known."""


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


@dataclass(frozen=True)
class Surroundings:
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
            raise ValueError(f"environment: is {self.temperature!r} K, expected over 0 K")
        if not 0 <= self.standard_uncertainty < inf:
            raise ValueError(
                f"environment: standard uncertainty is {self.standard_uncertainty!r} K, "
                "expected 0 K or more"
            )


@dataclass(frozen=True, eq=False)
class TrueTemperature(AreaResult):
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
        Mean of these temperatures in K: under `value` where the area is uneven.
    emissivity : float
        Emissivity that was taken.
    value : float
        True temperature in K.
    budget : dict
        Standard uncertainty in K by cause: ``truth`` (of the heating with which the emissivity was
        determined), ``environment``, ``calibration``, ``emissivity`` (by chance, or as it is
        known), ``drift`` between recordings, that of the emissivity included, ``repeatability`` and
        ``noise``; NaN where it is not known.
    chance : tuple of (float, float)
        Pairs of a standard uncertainty in K and its degrees of freedom.
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
    value: float
    budget: dict[str, float]
    chance: tuple[tuple[float, float], ...]
    correlation: float | None

    @property
    def standard_uncertainty(self) -> float:
        """Combined standard uncertainty in K (JCGM 100:2008, Equation 13)."""
        return float(np.linalg.norm([part for part in self.budget.values() if isfinite(part)]))

    @property
    def degrees_of_freedom(self) -> float:
        """Effective number by Welch and Satterthwaite (JCGM 100:2008, Equation G.2b)."""
        parts = sum(part**4 / freedom for part, freedom in self.chance)
        return self.standard_uncertainty**4 / parts if parts > 0 else inf

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the result may be wrong beyond its uncertainty, a sentence each."""
        left_out = self.left_out_doubt()
        doubts = [] if left_out is None else [left_out]
        uneven = abs(self.value - self.mean_of_pixels)
        if uneven > max(_UNEVEN * self.standard_uncertainty, _NO_MATTER):
            doubts.append(
                f"{self.name}: is uneven, the mean of its pixels' temperatures is "
                f"{uneven:.3g} K from the temperature of its mean radiance"
            )
        return tuple(doubts)


def true_temperature(
    measurements: Sequence[Measurement],
    area: Area,
    emissivity: DeterminedEmissivity | KnownEmissivity,
    surroundings: Surroundings | None = None,
    calibration: FittedCalibration | None = None,
    drift: float | None = None,
) -> TrueTemperature:
    """True temperature of an even area, of its mean radiance and emissivity.

    Parameters
    ----------
    measurements : sequence of Measurement
        Images of the object; several of them are repetitions.
    area : Area
        Pixels of even temperature.
    emissivity : RegionEmissivity or KnownEmissivity
        The area's emissivity, determined with the same camera, or known from elsewhere.
    surroundings : Surroundings, optional
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
    emissivity too small. The environment's is the same for both, unless other surroundings are
    given. The calibration's have the correlation that its covariance tells; without `calibration`
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
    equation = _Equation(emissivity.mean, reflecting.temperature, band)
    sensitivity = equation.sensitivity(area.name, mean)
    told = told_calibration(measurements)
    error = 0.0 if told is None else float(told[usable].mean())
    correlation = _correlation(emissivity, mean, calibration, band)
    budget, chance = _budget(
        sensitivity, emissivity, reflecting, surroundings is None, error, correlation or 0.0
    )
    scatter, seen = Scatter.of(values), sensitivity.radiance
    drifts = [seen * _drift(drift, mean, len(measurements), scatter)]
    if not isinstance(emissivity, KnownEmissivity):
        drifts.append(sensitivity.emissivity * emissivity.drift)
    known = [part for part in drifts if isfinite(part)]
    budget["drift"] = hypot(*known) if known else nan
    budget |= {"repeatability": seen * scatter.repeatability, "noise": seen * scatter.noise}
    pixels = equation.temperature(values.mean(axis=0))
    return TrueTemperature(
        name=area.name,
        pixels=count,
        left_out=int(area.mask.sum()) - count,
        flagged=flagged,
        radiance_temperature=float(band.temperature(np.array(mean))),
        deviation=float(pixels.std(ddof=1)),
        mean_of_pixels=float(pixels.mean()),
        emissivity=emissivity.mean,
        value=float(equation.temperature(np.array(mean))),
        budget=budget,
        chance=(*chance, (seen * scatter.standard_uncertainty, scatter.degrees_of_freedom)),
        correlation=correlation,
    )


def _drift(drift: float | None, radiance: float, recordings: int, scatter: Scatter) -> float:
    """Standard uncertainty of the radiance by the drift over the repeatability; NaN if unknown."""
    if recordings == 1:
        return nan if drift is None else drift * radiance
    stated = (drift or 0.0) * radiance / sqrt(recordings)
    return sqrt(max(stated**2 - scatter.repeatability**2, 0.0))


@dataclass(frozen=True)
class _Sensitivity:
    """Change of the true temperature with what it is computed of.

    With the radiance in K m² sr/W, with the emissivity in K, and with the surroundings'
    temperature.
    """

    radiance: float
    emissivity: float
    environment: float


@dataclass(frozen=True)
class _Equation:
    """Equation 2 for an emissivity and the temperature in K of what is reflected."""

    emissivity: float
    environment: float
    band: Band

    @property
    def reflected(self) -> float:
        """Radiance of a black body at the surroundings' temperature in W/(m² sr)."""
        return float(self.band.radiance(np.array(self.environment)))

    def own(self, radiance: Any) -> Any:
        """Radiance in W/(m² sr) of a black body at the object's temperature."""
        return (radiance - (1 - self.emissivity) * self.reflected) / self.emissivity

    def temperature(self, radiance: NDArray[np.float64]) -> NDArray[np.float64]:
        """True temperature in K of apparent radiance in W/(m² sr), of the same shape."""
        return np.asarray(self.band.temperature(self.own(radiance)), np.float64)

    def sensitivity(self, name: str, radiance: float) -> _Sensitivity:
        """How the temperature of a radiance in W/(m² sr) of an area depends on all that."""
        own = float(self.own(radiance))
        if not own > self.reflected:
            raise ValueError(
                f"region {name}: is darker than what it reflects at "
                f"{self.environment - 273.15:.6g} °C, expected a hotter object"
            )
        value = float(self.band.temperature(np.array(own)))
        by_radiance = 1 / (self.emissivity * self._slope(value))
        by_environment = -(1 - self.emissivity) * self._slope(self.environment) * by_radiance
        return _Sensitivity(by_radiance, -(own - self.reflected) * by_radiance, by_environment)

    def _slope(self, temperature: float) -> float:
        """dL/dT in W/(m² sr K), at any temperature: `Band.slope` ends with its table."""
        ends = self.band.radiance(np.array([temperature - _STEP, temperature + _STEP]))
        return float(ends[1] - ends[0]) / (2 * _STEP)


def _surroundings(
    emissivity: DeterminedEmissivity | KnownEmissivity, given: Surroundings | None
) -> Surroundings:
    if given is not None:
        return given
    if isinstance(emissivity, KnownEmissivity):
        return Surroundings()
    heating = emissivity.heating
    return Surroundings(heating.environment, heating.environment_uncertainty)


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
    hot, cold = band.radiance(np.array([heating.truth, heating.environment])).tolist()
    then = cold + emissivity.mean * (hot - cold)
    covariance = calibration.radiance_covariance(band.temperature(np.array([then, radiance])))
    scale = float(np.sqrt(covariance[0, 0] * covariance[1, 1]))
    return float(covariance[0, 1]) / scale if scale > 0 else 0.0


def _budget(
    sensitivity: _Sensitivity,
    emissivity: DeterminedEmissivity | KnownEmissivity,
    reflecting: Surroundings,
    same_room: bool,
    error: float,
    correlation: float,
) -> tuple[dict[str, float], tuple[tuple[float, float], ...]]:
    """Parts of the uncertainty but for this image's chance, and those that are chance."""
    own = {
        "truth": 0.0,
        "environment": sensitivity.environment * reflecting.standard_uncertainty,
        "calibration": sensitivity.radiance * error,
    }
    if isinstance(emissivity, KnownEmissivity):
        known = abs(sensitivity.emissivity) * emissivity.standard_uncertainty
        return {**{cause: abs(part) for cause, part in own.items()}, "emissivity": known}, ()
    together = {"truth": 0.0, "environment": float(same_room), "calibration": correlation}
    through = {cause: sensitivity.emissivity * part for cause, part in emissivity.common.items()}
    budget = {cause: _joined(own[cause], through[cause], together[cause]) for cause in own}
    scatter = emissivity.scatter
    budget["emissivity"] = abs(sensitivity.emissivity) * scatter.standard_uncertainty
    return budget, ((budget["emissivity"], scatter.degrees_of_freedom),)


def _joined(one: float, other: float, correlation: float) -> float:
    """Standard uncertainty of the sum of two errors."""
    return float(np.sqrt(max(one**2 + other**2 + 2 * correlation * one * other, 0.0)))
