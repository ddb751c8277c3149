"""Emissivity from images of an object whose temperature is known, with its uncertainty."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from math import hypot, inf, isfinite, nan, sqrt
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from chipglow.camera import Flag, Measurement
from chipglow.laboratory.emissivity.observations import (
    ALL_IMAGES,
    RANDOM,
    UNIFORMITY,
    UsedPixels,
    calibration_uncertainty,
    check_same_pixels,
    deviation_of,
    observed_flags,
    observed_radiance,
    used_pixels,
    with_drift,
    with_observed,
)
from chipglow.quantities import ZERO_CELSIUS, Array, Brief, Parameter, Part
from chipglow.quantities.units import KELVINS, TEMPERATURE_DIFFERENCE
from chipglow.radiometry import Band
from chipglow.scene import Area, Raster
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Estimate, propagate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COMMON: Final = ("reference", "reflected", "calibration")
"""Causes of error common to all pixels, frames and images."""

BUDGET: Final = (*COMMON, "drift", UNIFORMITY, "repeatability", "noise")
"""Lines of the budget of an emissivity."""

LABORATORY: Final = 293.0
"""Temperature in K of the paper's laboratory, which surfaces reflect."""

_CONSTANT: Final = np.array([[1.0], [0.0]])
"""Design of a line from its constant."""

_CLEARLY: Final = 5.0
"""Standard uncertainties by which a heated object is hotter than its surroundings, at least."""


@dataclass(frozen=True)
class Heating(Part):
    """Temperatures of a heated object and of the surroundings that it reflects."""

    reference: Annotated[
        float, Parameter("True temperature of the object, as by a thermocouple.", KELVINS, over=0.0)
    ]
    reflected: Annotated[
        float, Parameter("Temperature of the surroundings.", KELVINS, over=0.0)
    ] = LABORATORY
    reference_uncertainty: Annotated[
        float, Parameter("Standard uncertainty of `reference`.", TEMPERATURE_DIFFERENCE, least=0.0)
    ] = 0.0
    reflected_uncertainty: Annotated[
        float, Parameter("Standard uncertainty of `reflected`.", TEMPERATURE_DIFFERENCE, least=0.0)
    ] = 0.0
    camera_uncertainty: Annotated[
        float | None,
        Parameter(
            "Standard uncertainty of the radiance temperature by the camera's calibration, common "
            "to all pixels; by default as the measurement states.",
            TEMPERATURE_DIFFERENCE,
            least=0.0,
        ),
    ] = None
    drift: Annotated[
        float | None,
        Parameter(
            "Relative standard uncertainty of the radiance from one recording to the next, by "
            "default as several recordings show; of one it is not in the uncertainty.",
            least=0.0,
            under=1.0,
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        spread = hypot(self.reference_uncertainty, self.reflected_uncertainty)
        hotter = self.reference - self.reflected
        if hotter <= 0 or hotter < _CLEARLY * spread:
            raise ValueError(
                f"reference: {_celsius(self.reference)} must be over what is reflected, "
                f"{_celsius(self.reflected)}, by {_CLEARLY:g} standard uncertainties of "
                f"{spread:.3g} K or more"
            )

    def estimate(self, name: str) -> Estimate:
        """Return ``reference`` or ``reflected`` in K; its error is one for all images."""
        exact = Estimate(np.array(getattr(self, name)))
        spread = getattr(self, f"{name}_uncertainty")
        return exact.with_component(name, spread, identity=ALL_IMAGES)


@dataclass(frozen=True, eq=False, repr=False)
class EmissivityMap(Brief):
    """Emissivity of every pixel; made by `determine_emissivity`."""

    heating: Heating
    band: Band
    raster: Raster
    radiance: Array
    """Radiance in W/(m² sr) of every observation, (observation, y, x); NaN where flagged."""
    flags: NDArray[np.uint8]
    """All `Flag` that a pixel has in any frame, uint8, shape (y, x)."""
    calibration: Array | None
    """Standard uncertainty of the radiance from the calibration in W/(m² sr), shape (y, x)."""
    lower_limit: float = 0.0
    """Lower range limit of the camera in K; 0 without one."""
    recordings: int = 1
    """Number of recordings that the observations are from."""

    @cached_property
    def identity(self) -> str:
        """Hash that tells these observations from others."""
        return hashlib.sha256(self.radiance.tobytes()).hexdigest()[:16]

    @cached_property
    def emissivity(self) -> Array:
        """Emissivity, shape (y, x), not limited to 0 to 1; NaN where flagged."""
        return emissivity_of_radiance(self.mean_radiance, self.heating, self.band)

    @cached_property
    def mean_radiance(self) -> Array:
        """Mean radiance over the observations in W/(m² sr), shape (y, x); NaN where flagged."""
        return np.asarray(self.radiance.mean(axis=0))

    @property
    def radiance_temperature(self) -> Array:
        """Radiance temperature of the mean radiance in K, shape (y, x); NaN where flagged."""
        return np.asarray(self.band.temperature(self.mean_radiance), np.float64)

    @cached_property
    def estimate(self) -> Estimate:
        """Emissivity, shape (y, x); its uncertainty omits the noise of a single observation."""
        relative = self.heating.drift
        effect = self.mean_radiance / self._contrast / sqrt(self.recordings)
        drift = None if relative is None else relative * effect
        systematic = self._systematic(self.emissivity, self.mean_radiance, self.calibration)
        found = with_drift(systematic, drift, self.identity)
        count = len(self.radiance)
        if count == 1:
            return found.with_unevaluated("noise")
        return found.with_component(
            "noise",
            self.radiance.std(axis=0, ddof=1) / sqrt(count) / self._contrast,
            per_element=True,
            identity=self.identity,
            degrees_of_freedom=count - 1.0,
            pooled=False,
        )

    def to_frame(self) -> pd.DataFrame:
        """Return every pixel, row by row from the top left; NaN where flagged."""
        x, y = np.moveaxis(self.raster.centres, -1, 0)
        columns = {
            "x_um": 1e6 * x,
            "y_um": 1e6 * y,
            "emissivity": self.emissivity,
            "standard_uncertainty": self.estimate.standard_uncertainty,
            "radiance_temperature_degC": self.radiance_temperature - ZERO_CELSIUS,
        }
        return pd.DataFrame({name: values.ravel() for name, values in columns.items()})

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the emissivity over x and y; flagged pixels are grey. New axes by default."""
        from chipglow.laboratory.emissivity.figure import plot_emissivity_map

        return plot_emissivity_map(self, ax)

    def _repr_html_(self) -> str:
        notes = Notes(warnings=list(self.estimate.warnings))
        return result_html("EmissivityMap", self.to_frame(), notes)

    def of(self, area: Area) -> "RegionEmissivity":
        """Compute the mean emissivity of an area."""
        used = used_pixels(area, self.radiance, self.flags)
        values = emissivity_of_radiance(self.radiance[:, used.mask], self.heating, self.band)
        mean_radiance = float(self.mean_radiance[used.mask].mean())
        calibration = None if self.calibration is None else self.calibration[used.mask].mean()
        pixels = values.mean(axis=0)
        mean = float(pixels.mean())
        known = self._systematic(np.array(mean), mean_radiance, calibration)
        drift, of = self.heating.drift, f"{self.identity} {area.name}"
        per_radiance = 1 / self._contrast
        by_drift = mean_radiance * per_radiance
        estimate = with_observed(
            known, values, used, per_radiance, drift, by_drift, self.recordings, of
        )
        outside = (int((pixels < 0).sum()), int((pixels > 1).sum()))
        return RegionEmissivity(
            name=area.name,
            feature=area.feature,
            whole=area.whole,
            heating=self.heating,
            used=used,
            standard_deviation=deviation_of(pixels),
            outside=outside,
            observed=values.mean(axis=1),
            estimate=estimate.with_warnings(*self._warnings(used, outside, mean)),
        )

    def _warnings(self, used: UsedPixels, outside: tuple[int, int], mean: float) -> Iterator[str]:
        for text in used.warnings():
            if used.flagged[Flag.UNDER_RANGE]:
                radiance = np.asarray(self.band.radiance(np.array(self.lower_limit)), np.float64)
                hidden = float(emissivity_of_radiance(radiance, self.heating, self.band))
                text += (
                    " The remaining pixels are brighter than the region, as the camera's range "
                    f"hides emissivities below {max(0.0, hidden):.3g}."
                )
            elif used.flagged[Flag.SATURATED]:
                text += " The remaining pixels are darker than the region."
            yield text
        if used.uniformity.is_uneven:
            deviation = used.uniformity.standard_deviation / self._contrast
            yield used.uneven_text(f"emissivity varies by {deviation:.2g}")
        darker = "below 0: they are darker than the stated surroundings."
        brighter = "over 1: they are brighter than a blackbody of the true temperature."
        for count, text in zip(outside, (darker, brighter), strict=True):
            if count:
                yield f"{used.name}: {count} of {used.count} pixels have an emissivity {text}"
        if not 0 <= mean <= 1:
            yield f"{used.name}: the mean emissivity is not within 0 to 1."

    def _systematic(self, values: Array, radiance: Any, calibration: Any) -> Estimate:
        """Return emissivities with the components of `COMMON`."""
        ends = [self.heating.estimate(name) for name in ("reference", "reflected")]
        known = propagate(partial(_solved, radiance, self.band), *ends)
        effect = 0.0 if calibration is None else calibration / self._contrast
        known = known.with_component("calibration", effect, identity=ALL_IMAGES)
        return replace(known, values=values)

    @property
    def _contrast(self) -> float:
        """Difference of blackbody radiance between object and surroundings."""
        radiance = self.band.radiance(np.array([self.heating.reference, self.heating.reflected]))
        return float(radiance[0] - radiance[1])


@dataclass(frozen=True, eq=False, repr=False)
class RegionEmissivity(Brief):
    """Emissivity of an area: a row of the table; made by `EmissivityMap.of`."""

    name: str
    feature: str
    whole: bool
    """Whether the area is all that there is of the feature."""
    heating: Heating
    used: UsedPixels
    standard_deviation: float
    """Standard deviation over the pixels, with their noise; no uncertainty of the mean."""
    outside: tuple[int, int]
    """Numbers of pixels with a negative emissivity, and with one above 1."""
    observed: Array
    """Mean emissivity of each observation, shape (observation,)."""
    estimate: Estimate
    """Mean emissivity, with the components of `COMMON`, ``drift``, and ``random`` by its parts."""

    @property
    def mean(self) -> float:
        """Mean emissivity."""
        return float(self.estimate.values)

    @property
    def line(self) -> "EmissivityLine":
        """The emissivity as a constant line over the temperature."""
        spread = self.standard_deviation
        return EmissivityLine.measured(self.name, self.feature, self.heating, self.estimate, spread)


@dataclass(frozen=True, repr=False)
class EmissivityLine(Brief):
    """Emissivity of an area as a straight line over the temperature, the simplest a constant."""

    name: str
    feature: str
    estimate: Estimate
    """Emissivity at `middle`, and its change with temperature in 1/K; shape (2,)."""
    heatings: tuple[Heating, ...] = ()
    """Heating for each true temperature; empty if the emissivity is known from elsewhere."""
    means: tuple[float, ...] = ()
    uncertainties: tuple[float, ...] = ()
    """Mean emissivity at each temperature, and its standard uncertainty."""
    residual: float = nan
    """Standard deviation about the line; NaN of fewer than three temperatures."""
    standard_deviation: float = 0.0
    """Standard deviation over the pixels, mean over the temperatures."""

    @classmethod
    def constant(cls, mean: float, standard_uncertainty: float = 0.0) -> "EmissivityLine":
        """Return an emissivity from elsewhere, whose error is independent of the measurement's."""
        if not 0 < mean <= 1:
            raise ValueError(f"emissivity: is {mean!r}, expected more than 0 to 1")
        if not 0 <= standard_uncertainty < inf:
            raise ValueError(
                f"emissivity: standard uncertainty is {standard_uncertainty!r}, expected 0 or more"
            )
        value = Estimate(np.array(mean)).with_component("emissivity", standard_uncertainty)
        return cls("", "", value.linear(_CONSTANT))

    @classmethod
    def measured(
        cls, name: str, feature: str, heating: Heating, mean: Estimate, standard_deviation: float
    ) -> "EmissivityLine":
        """Return the emissivity of an area at one temperature as a constant line."""
        line = mean.linear(_CONSTANT)
        value, spread = float(mean.values), float(mean.standard_uncertainty)
        return cls(name, feature, line, (heating,), (value,), (spread,), nan, standard_deviation)

    @property
    def temperatures(self) -> tuple[float, ...]:
        """True temperatures in K."""
        return tuple(heating.reference for heating in self.heatings)

    @property
    def middle(self) -> float:
        """Mean of the temperatures in K."""
        return float(np.mean(self.temperatures or 0.0))

    @property
    def slope(self) -> float:
        """Change of the emissivity with the temperature in 1/K."""
        return float(self.estimate.values[1])

    def at(self, temperature: Any) -> Estimate:
        """Return the emissivity at temperatures in K of any shape."""
        away = np.asarray(temperature, np.float64) - self.middle
        design = np.stack([np.ones(away.size), away.ravel()], axis=1)
        return self.estimate.linear(design).reshape(*away.shape)

    def weights(self, temperature: float) -> Array:
        """Return the weight of every mean in the emissivity at a temperature in K."""
        away = np.array([1.0, temperature - self.middle])
        weights: Array = away @ np.linalg.pinv(_design(self.temperatures))
        return weights


def _design(temperatures: Sequence[float]) -> Array:
    """Return the design matrix of a line about the middle of the temperatures, shape (n, 2)."""
    kelvins = np.array(temperatures)
    return np.stack([np.ones_like(kelvins), kelvins - kelvins.mean()], axis=1)


def emissivity_of_radiance(radiance: Array, heating: Heating, band: Band) -> Array:
    """Compute the emissivity from W/(m² sr): Equation 2 of Heigel and Whitenton (2010), solved."""
    return _solved(radiance, band, heating.reference, heating.reflected)


def _solved(radiance: Array, band: Band, reference: ArrayLike, reflected: ArrayLike) -> Array:
    hot, cold = (band.radiance(np.asarray(one)) for one in (reference, reflected))
    return np.asarray((radiance - cold) / (hot - cold), np.float64)


def determine_emissivity(measurements: Sequence[Measurement], heating: Heating) -> EmissivityMap:
    """Determine the emissivity of a heated object pixel by pixel.

    Parameters
    ----------
    measurements : sequence of Measurement
        Images of the object at one true temperature; several of them are repetitions.
    heating : Heating
        Temperatures of the object and its surroundings.
    """
    check_same_pixels(measurements, "emissivity")
    for measurement in measurements:
        lower_limit = _floor(measurement)
        if heating.reference < lower_limit:
            raise ValueError(
                f"reference: {_celsius(heating.reference)} is below the camera's lower range limit "
                f"of {_celsius(lower_limit)}, expected a hotter object"
            )
    first, radiance = measurements[0], observed_radiance(measurements)
    return EmissivityMap(
        heating=heating,
        band=first.band,
        raster=first.raster,
        radiance=radiance,
        flags=observed_flags(measurements),
        calibration=calibration_uncertainty(
            measurements, radiance.mean(axis=0), heating.camera_uncertainty
        ),
        lower_limit=max(map(_floor, measurements)),
        recordings=len(measurements),
    )


def emissivity_covariance(rows: Sequence[RegionEmissivity]) -> Array:
    """Compute the covariance of the mean emissivities of several areas of one map."""
    observed = np.stack([row.observed for row in rows])
    chance = np.zeros((len(rows), len(rows)))
    if observed.shape[1] > 1:
        chance = np.atleast_2d(np.cov(observed)) / observed.shape[1]
    own = [row.estimate.only(RANDOM).standard_uncertainty for row in rows]
    np.fill_diagonal(chance, np.square(own))
    return chance + Estimate.stack([row.estimate.without(RANDOM) for row in rows]).covariance()


def emissivity_line(areas: Sequence[EmissivityLine]) -> EmissivityLine:
    """Fit a line to an area's emissivity at several temperatures by ordinary least squares.

    Covariances are propagated (JCGM 100:2008, Equation 13); the random error is the error of the
    means, or the scatter about the line if that is larger.
    """
    if len(areas) == 1:
        return areas[0]
    heatings = tuple(area.heatings[0] for area in areas)
    temperatures = [heating.reference for heating in heatings]
    if len(set(temperatures)) < 2:
        raise ValueError("emissivity over temperature: the temperatures are all the same")
    estimates = [area.at(area.middle) for area in areas]
    means = np.array([float(one.values) for one in estimates])
    design = _design(temperatures)
    solve = np.linalg.pinv(design)
    line = solve @ means
    freedom = means.size - 2
    residual = sqrt(float(((means - design @ line) ** 2).sum()) / freedom) if freedom else nan
    # The region is the same at all temperatures, and so is its unevenness.
    shared = (*COMMON, UNIFORMITY)
    own = [reduce(Estimate.without, shared, one) for one in estimates]
    random = np.array([one.standard_uncertainty for one in own])
    if isfinite(residual):
        random = np.maximum(random, residual)
    identity = " ".join(
        part.cause.identity for one in estimates for part in one.only(RANDOM).components
    )
    observed = Estimate(means).with_component(RANDOM, random, per_element=True, identity=identity)
    for cause in shared:
        shift = np.array([one.effect(cause) for one in estimates])
        if cause == "reference":
            # An error of the temperature moves the points along the line too.
            shift = shift - line[1] * np.array([one.reference_uncertainty for one in heatings])
        of = f"{areas[0].name} {cause}" if cause == UNIFORMITY else ALL_IMAGES
        observed = observed.with_component(cause, shift, identity=of)
    if not isfinite(residual) and any("drift" in one.unevaluated for one in estimates):
        observed = observed.with_unevaluated("drift")
    warnings = (warning for one in estimates for warning in one.warnings)
    return EmissivityLine(
        name=areas[0].name,
        feature=areas[0].feature,
        heatings=heatings,
        means=tuple(means.tolist()),
        uncertainties=tuple(float(one.standard_uncertainty) for one in estimates),
        estimate=observed.with_warnings(*warnings).linear(solve),
        residual=residual,
        standard_deviation=float(np.mean([area.standard_deviation for area in areas])),
    )


def _floor(measurement: Measurement) -> float:
    return float(measurement.data.attrs.get("lower_limit", 0.0))


def _celsius(temperature: float) -> str:
    return f"{temperature - ZERO_CELSIUS:.6g} °C"
