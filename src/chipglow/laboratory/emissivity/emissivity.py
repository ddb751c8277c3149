"""Emissivity from images of an object whose temperature is known, with its uncertainty."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot, inf, isfinite, nan, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement
from chipglow.laboratory.emissivity.observations import (
    RANDOM,
    area_estimate,
    check_same_pixels,
    count_flags,
    flag_text,
    left_out_warning,
    observed_flags,
    observed_radiance,
    stated_calibration,
)
from chipglow.quantities import ZERO_CELSIUS, Array
from chipglow.radiometry import Band
from chipglow.scene import Area, Raster
from chipglow.uncertainty import Estimate, propagate

COMMON: Final = ("reference", "reflected", "calibration")
"""Causes of error that are the same for all pixels, frames and images."""

BUDGET: Final = (*COMMON, "drift", "repeatability", "noise")
"""Lines of the budget of an emissivity."""

LABORATORY: Final = 293.0
"""Temperature in K of the paper's laboratory, which surfaces reflect."""

_CLEARLY: Final = 5.0


@dataclass(frozen=True)
class Heating:
    """How an object was heated, and how well that is known; all in K.

    Parameters
    ----------
    reference : float
        True temperature of the object, as of a thermocouple.
    reflected : float
        Temperature of the surroundings that it reflects; the paper's 293 K by default.
    reference_uncertainty, reflected_uncertainty : float
        Standard uncertainties.
    camera_uncertainty : float, optional
        Standard uncertainty of the radiance temperature from the camera's calibration, common to
        all pixels; by default that which the measurement states.
    drift : float, optional
        Relative standard uncertainty of the radiance from one recording to the next, such as 0.01
        of a camera that warms up. By default it is what several recordings show; of one it is not
        known, and not in the uncertainty.

    Raises
    ------
    ValueError
        If a temperature is not over 0 K, the reference is not over what is reflected, or an
        uncertainty is negative.
    """

    reference: float
    reflected: float = LABORATORY
    reference_uncertainty: float = 0.0
    reflected_uncertainty: float = 0.0
    camera_uncertainty: float | None = None
    drift: float | None = None

    def __post_init__(self) -> None:
        for name in ("reference", "reflected"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}: is {value!r} K, expected over 0 K")
        if self.reference <= self.reflected:
            raise ValueError(
                f"reference: {_celsius(self.reference)} is not hotter than what is reflected, "
                f"{_celsius(self.reflected)}, expected a heated object"
            )
        for name in ("reference_uncertainty", "reflected_uncertainty", "camera_uncertainty"):
            value = getattr(self, name)
            if value is not None and not 0 <= value < inf:
                raise ValueError(f"{name}: is {value!r} K, expected 0 K or more")
        if self.drift is not None and not 0 <= self.drift < 1:
            raise ValueError(f"drift: is {self.drift!r}, expected 0 to 1")
        spread = hypot(self.reference_uncertainty, self.reflected_uncertainty)
        if self.reference - self.reflected < _CLEARLY * spread:
            raise ValueError(
                f"reference: {_celsius(self.reference)} is over what is reflected by less than "
                f"{_CLEARLY:g} standard uncertainties of {spread:.3g} K, expected a hotter object"
            )


@dataclass(frozen=True, eq=False)
class EmissivityMap:
    """Emissivity of every pixel; made by `determine_emissivity`."""

    heating: Heating
    """How the object was heated."""
    band: Band
    """The camera's band."""
    raster: Raster
    radiance: Array
    """Radiance in W/(m² sr) of every observation, shape (observation, y, x): the frames of one
    image, or the means of several images. NaN where a frame is flagged.
    """
    flags: NDArray[np.uint8]
    """All `Flag` that a pixel has in any frame, uint8, shape (y, x)."""
    calibration: Array | None
    """Standard uncertainty of the radiance from the calibration in W/(m² sr), shape (y, x)."""
    lower_limit: float = 0.0
    """Lowest radiance temperature in K that the camera measures; 0 if it has no lower range limit.
    """
    recordings: int = 1
    """From how many recordings the observations are."""

    @property
    def hidden(self) -> float:
        """Lowest emissivity that the camera's range measures; 0 without a lower limit."""
        if self.lower_limit <= self.heating.reflected:
            return 0.0
        radiance = np.asarray(self.band.radiance(np.array(self.lower_limit)), np.float64)
        return float(emissivity_of_radiance(radiance, self.heating, self.band))

    @property
    def observations(self) -> int:
        """Number of frames of one image, or of images."""
        return len(self.radiance)

    @cached_property
    def identity(self) -> str:
        """Tells these observations from others, and is the same in another run."""
        return hashlib.sha256(self.radiance.tobytes()).hexdigest()[:16]

    @cached_property
    def emissivity(self) -> Array:
        """Emissivity, shape (y, x); NaN where flagged. Noise can take it out of 0 to 1."""
        return emissivity_of_radiance(self.mean_radiance, self.heating, self.band)

    @cached_property
    def mean_radiance(self) -> Array:
        """Mean radiance over the observations in W/(m² sr), shape (y, x); NaN where flagged."""
        return np.asarray(self.radiance.mean(axis=0))

    @cached_property
    def radiance_temperature(self) -> Array:
        """Radiance temperature of the mean radiance in K, shape (y, x); NaN where flagged."""
        return np.asarray(self.band.temperature(self.mean_radiance), np.float64)

    @cached_property
    def estimate(self) -> Estimate:
        """Emissivity with its uncertainty, shape (y, x); NaN where flagged.

        Of one observation it is without the pixel's noise, of which then nothing is known.
        """
        found = self._systematic(self.emissivity, self.mean_radiance, self.calibration)
        drift = self._drift(self.mean_radiance)
        if drift is None:
            found = found.with_unevaluated("drift")
        else:
            found = found.with_component(
                "drift", drift, independent="common", identity=self.identity
            )
        if self.observations == 1:
            return found.with_unevaluated("noise")
        noise = self.radiance.std(axis=0, ddof=1) / sqrt(self.observations) / self._contrast
        return found.with_component(
            "noise",
            noise,
            independent="per element",
            identity=self.identity,
            degrees_of_freedom=self.observations - 1.0,
            pooled=False,
        )

    def of(self, area: Area) -> "RegionEmissivity":
        """Mean emissivity of an area, and what makes it uncertain."""
        usable = area.mask & np.isfinite(self.mean_radiance)
        flagged = count_flags(self.flags[area.mask])
        count = int(usable.sum())
        if count < 2:
            raise ValueError(
                f"region {area.name}: {count} of its {int(area.mask.sum())} pixels can be used "
                f"({flag_text(flagged)}), expected 2 or more"
            )
        values = emissivity_of_radiance(self.radiance[:, usable], self.heating, self.band)
        mean_radiance = float(self.mean_radiance[usable].mean())
        calibration = None if self.calibration is None else self.calibration[usable].mean()
        pixels = values.mean(axis=0)
        mean = float(pixels.mean())
        random = area_estimate(mean, values, f"{self.identity} {area.name}")
        estimate = self._systematic(np.array(mean), mean_radiance, calibration)
        drift = self._drift(mean_radiance)
        if self.recordings > 1:
            # What of the drift the recordings do not show already as their repeatability.
            shown = float(random.contribution("repeatability"))
            drift = sqrt(max((drift or 0.0) ** 2 - shown**2, 0.0))
        if drift is None:
            estimate = estimate.with_unevaluated("drift")
        else:
            estimate = estimate.with_component(
                "drift", drift, independent="common", identity=self.identity
            )
        found = RegionEmissivity(
            name=area.name,
            feature=area.feature,
            whole=area.whole,
            heating=self.heating,
            pixels=count,
            left_out=int(area.mask.sum()) - count,
            flagged=flagged,
            hidden=self.hidden,
            standard_deviation=float(pixels.std(ddof=1)),
            outside=(int((pixels < 0).sum()), int((pixels > 1).sum())),
            observed=values.mean(axis=1),
            estimate=estimate + (random - mean),
        )
        return replace(found, estimate=found.estimate.with_warnings(*found._warnings()))

    def _systematic(self, values: Array, radiance: Any, calibration: Any) -> Estimate:
        """Emissivities with what is common to all pixels, frames and images."""

        def found(reference: Any, reflected: Any) -> Any:
            ends = (self.band.radiance(np.asarray(one)) for one in (reference, reflected))
            return _emissivity(radiance, *ends)

        heating = self.heating
        known = propagate(
            found,
            Estimate(np.array(heating.reference)).with_component(
                "reference", heating.reference_uncertainty
            ),
            Estimate(np.array(heating.reflected)).with_component(
                "reflected", heating.reflected_uncertainty
            ),
        )
        effect = 0.0 if calibration is None else calibration / self._contrast
        return replace(known.with_component("calibration", effect), values=values)

    def _drift(self, radiance: Any) -> Any:
        """Effect on the emissivity of drift between recordings; None if that is not stated."""
        if self.heating.drift is None:
            return None
        return self.heating.drift * radiance / self._contrast / sqrt(self.recordings)

    @property
    def _contrast(self) -> float:
        """Radiance of a blackbody at the true temperature over that of the surroundings."""
        radiance = self.band.radiance(np.array([self.heating.reference, self.heating.reflected]))
        return float(radiance[0] - radiance[1])


@dataclass(frozen=True, eq=False)
class RegionEmissivity:
    """Emissivity of an area: a row of the table; made by `EmissivityMap.of`."""

    name: str
    feature: str
    """The area's name, and the feature that it belongs to."""
    whole: bool
    """Whether the area is all that there is of the feature."""
    heating: Heating
    """How the object was heated."""
    pixels: int
    left_out: int
    """How many more there are that do not count, because they are flagged."""
    flagged: dict[Flag, int]
    """How many have each `Flag`."""
    hidden: float
    """Lowest emissivity that the camera's range measures; 0 without a lower limit."""
    standard_deviation: float
    """Standard deviation over the pixels: how much the surface varies from place to place, with
    the pixels' noise. It is no uncertainty of the mean.
    """
    outside: tuple[int, int]
    """How many pixels have an emissivity under 0, and over 1."""
    observed: Array
    """Mean emissivity of each observation, shape (observation,)."""
    estimate: Estimate
    """Mean emissivity, with the components of `COMMON`, the same in all areas and images;
    ``drift`` from recording to recording over the repeatability, the same in all areas of a
    map; and ``random``, of which ``repeatability`` and ``noise`` are parts.
    """

    @property
    def mean(self) -> float:
        """Mean emissivity."""
        return float(self.estimate.values)

    def _warnings(self) -> Iterator[str]:
        text = left_out_warning(self.name, self.pixels, self.left_out, self.flagged)
        if text is not None:
            if self.flagged[Flag.UNDER_RANGE]:
                text += (
                    " The remaining pixels are brighter than the region, as the camera's range "
                    f"hides emissivities below {self.hidden:.3g}."
                )
            elif self.flagged[Flag.SATURATED]:
                text += " The remaining pixels are darker than the region."
            yield text
        under, over = self.outside
        if under:
            yield (
                f"{self.name}: {under} of {self.pixels} pixels have an emissivity under 0: they "
                "are darker than what is said to be reflected."
            )
        if over:
            yield (
                f"{self.name}: {over} of {self.pixels} pixels have an emissivity over 1: they "
                "are brighter than a blackbody of the true temperature."
            )
        if not 0 <= self.mean <= 1:
            yield f"{self.name}: the mean emissivity is not within 0 to 1."


@dataclass(frozen=True)
class AreaEmissivity:
    """An area's emissivity at one true temperature: of a file, or of a line."""

    name: str
    feature: str
    """The area's name, and the feature that it belongs to."""
    heating: Heating
    """How the object was heated; of a line, with the temperature at which it is taken."""
    estimate: Estimate
    """Mean emissivity, as `RegionEmissivity` has it."""


@dataclass(frozen=True)
class EmissivityLine:
    """Emissivity of an area over the temperature, as a straight line; by `emissivity_line`."""

    name: str
    feature: str
    """The area's name, and the feature that it belongs to."""
    heatings: tuple[Heating, ...]
    """How the object was heated, one for each true temperature."""
    means: tuple[float, ...]
    uncertainties: tuple[float, ...]
    """Mean emissivities, and their standard uncertainties."""
    estimate: Estimate
    """Emissivity of the line at its `middle`, and its change with temperature in 1/K; shape (2,).
    """
    residual: float
    """Standard deviation about the line; NaN of two temperatures."""

    @property
    def temperatures(self) -> tuple[float, ...]:
        """True temperatures in K."""
        return tuple(heating.reference for heating in self.heatings)

    @property
    def middle(self) -> float:
        """Mean of the temperatures in K."""
        return float(np.mean(self.temperatures))

    @property
    def slope(self) -> float:
        """Change of the emissivity with the temperature in 1/K."""
        return float(self.estimate.values[1])

    def at(self, temperature: Any) -> Estimate:
        """Emissivity of the line at temperatures in K, of any shape."""
        away = np.asarray(temperature, np.float64) - self.middle
        design = np.stack([np.ones(away.size), away.ravel()], axis=1)
        return self.estimate.linear(design).reshape(*away.shape)

    def weights(self, temperature: float) -> Array:
        """Weight of every mean in the emissivity at a temperature in K; their sum is 1."""
        away = np.array([1.0, temperature - self.middle])
        found: Array = away @ np.linalg.pinv(_design(self.temperatures))
        return found

    def area(self, temperature: float) -> AreaEmissivity:
        """Emissivity of the area at a temperature in K."""
        heating = replace(self.heatings[0], reference=temperature)
        return AreaEmissivity(self.name, self.feature, heating, self.at(temperature))


def _design(temperatures: Sequence[float]) -> Array:
    """Design matrix of a line about the middle of the temperatures, shape (n, 2)."""
    kelvins = np.array(temperatures)
    return np.stack([np.ones_like(kelvins), kelvins - kelvins.mean()], axis=1)


def emissivity_of_radiance(radiance: Array, heating: Heating, band: Band) -> Array:
    """Emissivity from in-band radiance in W/(m² sr), of any shape.

    ε = (L_app − L_env) / (L_true − L_env): Equation 2 of Heigel and Whitenton (2010), solved.
    """
    ends = band.radiance(np.array([heating.reference, heating.reflected]))
    return np.asarray(_emissivity(radiance, *ends), np.float64)


def determine_emissivity(measurements: Sequence[Measurement], heating: Heating) -> EmissivityMap:
    """Determine the emissivity of a heated object pixel by pixel.

    Parameters
    ----------
    measurements : sequence of Measurement
        Images of the object at one true temperature; several of them are repetitions.
    heating : Heating
        Its temperature and that of its surroundings.

    Raises
    ------
    ValueError
        If there is no image, the images are of different pixels or bands, or the true temperature
        is under the camera's lower range limit.
    """
    check_same_pixels(measurements, "emissivity")
    for measurement in measurements:
        lower_limit = _floor(measurement)
        if heating.reference < lower_limit:
            raise ValueError(
                f"reference: {_celsius(heating.reference)} is under the camera's lower range limit "
                f"of {_celsius(lower_limit)}, expected a hotter object"
            )
    first, radiance = measurements[0], observed_radiance(measurements)
    return EmissivityMap(
        heating=heating,
        band=first.band,
        raster=first.raster,
        radiance=radiance,
        flags=observed_flags(measurements),
        calibration=_calibration(measurements, radiance.mean(axis=0), heating),
        lower_limit=max(map(_floor, measurements)),
        recordings=len(measurements),
    )


def emissivity_covariance(rows: Sequence[RegionEmissivity]) -> Array:
    """Covariance of the mean emissivities of several areas of one map."""
    observed = np.stack([row.observed for row in rows])
    chance = np.zeros((len(rows), len(rows)))
    if observed.shape[1] > 1:
        chance = np.atleast_2d(np.cov(observed)) / observed.shape[1]
    own = [row.estimate.only(RANDOM).standard_uncertainty for row in rows]
    np.fill_diagonal(chance, np.square(own))
    return chance + Estimate.stack([row.estimate.without(RANDOM) for row in rows]).covariance()


def emissivity_line(rows: Sequence[RegionEmissivity | AreaEmissivity]) -> EmissivityLine:
    """Straight line through an area's emissivity at several temperatures, by least squares.

    The line is that of ordinary least squares, a linear function of the means, through which
    their covariance is propagated (JCGM 100:2008, Equation 13). The errors of `COMMON` are the
    same at all temperatures. Chance is that of the rows, or the scatter about the line where that
    is more.
    """
    heatings = tuple(row.heating for row in rows)
    temperatures = [heating.reference for heating in heatings]
    if len(set(temperatures)) < 2:
        raise ValueError("emissivity over temperature: expected 2 temperatures or more")
    means = np.array([float(row.estimate.values) for row in rows])
    design = _design(temperatures)
    solve = np.linalg.pinv(design)
    line = solve @ means
    residual = _residual(means - design @ line)
    chance = np.array([_of_one_image(row.estimate) for row in rows])
    if isfinite(residual):
        chance = np.maximum(chance, residual)
    identity = " ".join(
        one.cause.identity for row in rows for one in row.estimate.only(RANDOM).components
    )
    observed = Estimate(means).with_component(
        RANDOM, chance, independent="per element", identity=identity
    )
    for cause in COMMON:
        shift = np.array([row.estimate.effect(cause) for row in rows])
        if cause == "reference":
            # An error of the temperature moves the points along the line too.
            shift = shift - line[1] * np.array([one.reference_uncertainty for one in heatings])
        observed = observed.with_component(cause, shift)
    if not isfinite(residual) and any("drift" in row.estimate.unevaluated for row in rows):
        observed = observed.with_unevaluated("drift")
    warnings = (warning for row in rows for warning in row.estimate.warnings)
    return EmissivityLine(
        name=rows[0].name,
        feature=rows[0].feature,
        heatings=heatings,
        means=tuple(means.tolist()),
        uncertainties=tuple(float(row.estimate.standard_uncertainty) for row in rows),
        estimate=observed.with_warnings(*warnings).linear(solve),
        residual=residual,
    )


def _of_one_image(estimate: Estimate) -> float:
    """Standard uncertainty by what is not the same at another temperature."""
    for cause in COMMON:
        estimate = estimate.without(cause)
    return float(estimate.standard_uncertainty)


def _emissivity(radiance: Any, reference: Any, reflected: Any) -> Any:
    return (radiance - reflected) / (reference - reflected)


def _floor(measurement: Measurement) -> float:
    return float(measurement.data.attrs.get("lower_limit", 0.0))


def _calibration(
    measurements: Sequence[Measurement], radiance: Array, heating: Heating
) -> Array | None:
    """Standard uncertainty of the mean radiance from the calibration, shape (y, x)."""
    if heating.camera_uncertainty is not None:
        band, spread = measurements[0].band, heating.camera_uncertainty
        temperature = np.asarray(band.temperature(radiance), np.float64)
        ends = [band.radiance(temperature + sign * spread) for sign in (-1.0, 1.0)]
        return np.asarray((ends[1] - ends[0]) / 2, np.float64)
    return stated_calibration(measurements)


def _residual(about_line: Array) -> float:
    freedom = about_line.size - 2
    return sqrt(float((about_line**2).sum()) / freedom) if freedom else nan


def _celsius(temperature: float) -> str:
    return f"{temperature - ZERO_CELSIUS:.6g} °C"
