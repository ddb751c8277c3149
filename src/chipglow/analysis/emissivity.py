"""Emissivity from images of an object whose temperature is known, with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot, inf, isfinite, nan, sqrt
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

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
from chipglow.camera import Flag, Measurement
from chipglow.radiometry import Band
from chipglow.scene import Raster

COMMON: Final = ("truth", "environment", "calibration")
"""Causes of error that are the same for all pixels, frames and images."""

LABORATORY: Final = 293.0
"""Temperature in K of the paper's laboratory, which surfaces reflect."""

_CLEARLY: Final = 5.0
_ZERO_CELSIUS: Final = 273.15


@dataclass(frozen=True)
class Heating:
    """How an object was heated, and how well that is known; all in K.

    Parameters
    ----------
    truth : float
        True temperature of the object, as of a thermocouple.
    environment : float
        Temperature of the surroundings that it reflects; the paper's 293 K by default.
    truth_uncertainty, environment_uncertainty : float
        Standard uncertainties.
    camera_uncertainty : float, optional
        Standard uncertainty of the radiance temperature from the camera's calibration, common to
        all pixels; by default that which the measurement tells.
    drift : float, optional
        Relative standard uncertainty of the radiance from one recording to the next, such as 0.01
        of a camera that warms up. By default it is what several recordings show; of one it is not
        known, and not in the uncertainty.

    Raises
    ------
    ValueError
        If a temperature is not over 0 K, the truth is not over the environment, or an uncertainty
        is negative.
    """

    truth: float
    environment: float = LABORATORY
    truth_uncertainty: float = 0.0
    environment_uncertainty: float = 0.0
    camera_uncertainty: float | None = None
    drift: float | None = None

    def __post_init__(self) -> None:
        for name in ("truth", "environment"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0):
                raise ValueError(f"{name}: is {value!r} K, expected over 0 K")
        if self.truth <= self.environment:
            raise ValueError(
                f"truth: {_celsius(self.truth)} is not hotter than the environment's "
                f"{_celsius(self.environment)}, expected a heated object"
            )
        for name in ("truth_uncertainty", "environment_uncertainty", "camera_uncertainty"):
            value = getattr(self, name)
            if value is not None and not 0 <= value < inf:
                raise ValueError(f"{name}: is {value!r} K, expected 0 K or more")
        if self.drift is not None and not 0 <= self.drift < 1:
            raise ValueError(f"drift: is {self.drift!r}, expected 0 to 1")
        spread = hypot(self.truth_uncertainty, self.environment_uncertainty)
        if self.truth - self.environment < _CLEARLY * spread:
            raise ValueError(
                f"truth: {_celsius(self.truth)} is over the environment by less than "
                f"{_CLEARLY:g} standard uncertainties of {spread:.3g} K, expected a hotter object"
            )


@dataclass(frozen=True, eq=False)
class EmissivityMap:
    """Emissivity of every pixel; made by `determine_emissivity`.

    Parameters
    ----------
    heating : Heating
        How the object was heated.
    band : Band
        The camera's band.
    raster : Raster
        The pixels.
    radiance : ndarray
        Radiance in W/(m² sr) of every observation, shape (observation, y, x): the frames of one
        image, or the means of several images. NaN where a frame is flagged.
    flags : ndarray
        All `Flag` that a pixel has in any frame, uint8, shape (y, x).
    calibration : ndarray, optional
        Standard uncertainty of the radiance from the calibration in W/(m² sr), shape (y, x).
    floor : float
        Lowest radiance temperature in K that the camera measures; 0 if it has no floor.
    recordings : int
        From how many recordings the observations are.
    """

    heating: Heating
    band: Band
    raster: Raster
    radiance: NDArray[np.float64]
    flags: NDArray[np.uint8]
    calibration: NDArray[np.float64] | None
    floor: float = 0.0
    recordings: int = 1

    @property
    def hidden(self) -> float:
        """Emissivity under which the camera's floor hides a pixel; 0 without a floor."""
        if self.floor <= self.heating.environment:
            return 0.0
        radiance = np.asarray(self.band.radiance(np.array(self.floor)), np.float64)
        return float(emissivity_of_radiance(radiance, self.heating, self.band))

    @property
    def observations(self) -> int:
        """Number of frames of one image, or of images."""
        return len(self.radiance)

    @cached_property
    def emissivity(self) -> NDArray[np.float64]:
        """Emissivity, shape (y, x); NaN where flagged. Noise can take it out of 0 to 1."""
        return emissivity_of_radiance(self.mean_radiance, self.heating, self.band)

    @cached_property
    def mean_radiance(self) -> NDArray[np.float64]:
        """Mean radiance over the observations in W/(m² sr), shape (y, x); NaN where flagged."""
        return np.asarray(self.radiance.mean(axis=0))

    @cached_property
    def radiance_temperature(self) -> NDArray[np.float64]:
        """Radiance temperature of the mean radiance in K, shape (y, x); NaN where flagged."""
        return np.asarray(self.band.temperature(self.mean_radiance), np.float64)

    @cached_property
    def standard_uncertainty(self) -> NDArray[np.float64]:
        """Standard uncertainty of every pixel's own emissivity, shape (y, x).

        Of one observation it is without the pixel's noise, which then nothing tells.
        """
        variance = sum(
            self._contribution(cause, self.mean_radiance, self.calibration) ** 2 for cause in COMMON
        )
        if self.observations > 1:
            noise = self.radiance.var(axis=0, ddof=1) / self.observations
            variance = variance + noise / self._contrast**2
        if self.heating.drift is not None:
            variance = variance + self._drift(self.mean_radiance) ** 2
        return np.sqrt(np.asarray(variance, np.float64))

    def of(self, area: Area) -> "RegionEmissivity":
        """Mean emissivity of an area, and what makes it uncertain.

        Parameters
        ----------
        area : Area
            Pixels on this map's raster.

        Raises
        ------
        ValueError
            If fewer than two of its pixels can be used.
        """
        usable = area.mask & np.isfinite(self.mean_radiance)
        flagged = count_flags(self.flags[area.mask])
        count = int(usable.sum())
        if count < 2:
            raise ValueError(
                f"region {area.name}: {count} of its {int(area.mask.sum())} pixels can be used "
                f"({flag_text(flagged)}), expected 2 or more"
            )
        values = emissivity_of_radiance(self.radiance[:, usable], self.heating, self.band)
        scatter = Scatter.of(values)
        mean_radiance = self.mean_radiance[usable].mean()
        calibration = None if self.calibration is None else self.calibration[usable].mean()
        pixels = values.mean(axis=0)
        return RegionEmissivity(
            name=area.name,
            feature=area.feature,
            whole=area.whole,
            heating=self.heating,
            pixels=count,
            left_out=int(area.mask.sum()) - count,
            flagged=flagged,
            hidden=self.hidden,
            mean=float(pixels.mean()),
            deviation=float(pixels.std(ddof=1)),
            outside=(int((pixels < 0).sum()), int((pixels > 1).sum())),
            common={
                cause: float(self._contribution(cause, mean_radiance, calibration))
                for cause in COMMON
            },
            observed=values.mean(axis=1),
            scatter=scatter,
            drift=self._beyond(float(self._drift(mean_radiance)), scatter),
        )

    def _drift(self, radiance: Any) -> Any:
        """Standard uncertainty of the emissivity by drift between recordings; NaN if unknown."""
        if self.heating.drift is None:
            return np.full_like(radiance, nan)
        return self.heating.drift * radiance / self._contrast / sqrt(self.recordings)

    def _beyond(self, drift: float, scatter: Scatter) -> float:
        """What of the drift several recordings do not show already as their repeatability."""
        if self.recordings == 1:
            return drift
        stated = drift if isfinite(drift) else 0.0
        return sqrt(max(stated**2 - scatter.repeatability**2, 0.0))

    @property
    def _contrast(self) -> float:
        """Radiance of a black body at the true temperature over that of the surroundings."""
        radiance = self.band.radiance(np.array([self.heating.truth, self.heating.environment]))
        return float(radiance[0] - radiance[1])

    def _contribution(self, cause: str, radiance: Any, calibration: Any) -> Any:
        """Half the change of emissivity when one cause goes from −u to +u, with its sign."""
        heating, band = self.heating, self.band
        if cause == "calibration":
            return np.zeros_like(radiance) if calibration is None else calibration / self._contrast
        value, spread = getattr(heating, cause), getattr(heating, f"{cause}_uncertainty")
        ends = []
        for shifted in (value - spread, value + spread):
            truth = shifted if cause == "truth" else heating.truth
            environment = shifted if cause == "environment" else heating.environment
            ends.append(_emissivity(radiance, *band.radiance(np.array([truth, environment]))))
        return (ends[1] - ends[0]) / 2


@dataclass(frozen=True, eq=False)
class RegionEmissivity(AreaResult):
    """Emissivity of an area: a row of the table; made by `EmissivityMap.of`.

    Parameters
    ----------
    name, feature : str
        The area's name, and the feature that it belongs to.
    whole : bool
        Whether the area is all that there is of the feature.
    heating : Heating
        How the object was heated.
    pixels : int
        Number of pixels that count.
    left_out : int
        How many more there are that do not count, because they are flagged.
    flagged : dict
        How many have each `Flag`.
    hidden : float
        Emissivity under which the camera's floor hides a pixel; 0 without a floor.
    mean : float
        Mean emissivity.
    deviation : float
        Standard deviation over the pixels: how much the surface varies from place to place, with
        the pixels' noise. It is no uncertainty of the mean.
    outside : tuple of int
        How many pixels have an emissivity under 0, and over 1.
    common : dict
        Contributions to the standard uncertainty of the mean by the causes of `COMMON`, each with
        the sign of its effect: between areas and images they are fully correlated.
    observed : ndarray
        Mean emissivity of each observation, shape (observation,).
    scatter : Scatter
        The contributions that are chance.
    drift : float
        Contribution of the drift from recording to recording over the repeatability: the same in
        all areas of a recording. NaN if one recording is all there is and none is stated.
    """

    name: str
    feature: str
    whole: bool
    heating: Heating
    pixels: int
    left_out: int
    flagged: dict[Flag, int]
    hidden: float
    mean: float
    deviation: float
    outside: tuple[int, int]
    common: dict[str, float]
    observed: NDArray[np.float64]
    scatter: Scatter
    drift: float = nan

    @property
    def budget(self) -> dict[str, float]:
        """Standard uncertainty of the mean by cause; NaN where it is not known."""
        parts = {cause: abs(part) for cause, part in self.common.items()}
        chance = {"repeatability": self.scatter.repeatability, "noise": self.scatter.noise}
        return {**parts, "drift": self.drift, **chance}

    @property
    def standard_uncertainty(self) -> float:
        """Combined standard uncertainty of the mean (JCGM 100:2008, Equation 10)."""
        return hypot(_root_sum(self.common), _known(self.drift), self.scatter.standard_uncertainty)

    @property
    def degrees_of_freedom(self) -> float:
        """Effective number by Welch and Satterthwaite (JCGM 100:2008, Equation G.2b)."""
        chance = self.scatter.standard_uncertainty
        if chance == 0.0:
            return inf
        ratio = self.standard_uncertainty / chance
        return float(self.scatter.degrees_of_freedom * ratio**4)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the result may be wrong beyond its uncertainty, a sentence each."""
        return tuple(self._doubts())

    def _doubts(self) -> list[str]:
        doubts = []
        text = self.left_out_doubt()
        if text is not None:
            if self.flagged[Flag.BELOW_FLOOR]:
                text += (
                    "; what is left is brighter than the region, as the camera's floor hides "
                    f"emissivities under {self.hidden:.3g}"
                )
            elif self.flagged[Flag.SATURATED]:
                text += "; what is left is darker than the region"
            doubts.append(text)
        under, over = self.outside
        if under:
            doubts.append(
                f"{self.name}: {under} of {self.pixels} pixels have an emissivity under 0: they "
                "are darker than the environment is said to be"
            )
        if over:
            doubts.append(
                f"{self.name}: {over} of {self.pixels} pixels have an emissivity over 1: they "
                "are brighter than a black body of the true temperature"
            )
        if not 0 <= self.mean <= 1:
            doubts.append(f"{self.name}: the mean emissivity is not within 0 to 1")
        return doubts


@dataclass(frozen=True)
class EmissivityLine:
    """Emissivity of an area over the temperature, as a straight line; by `emissivity_line`.

    Parameters
    ----------
    name, feature : str
        The area's name, and the feature that it belongs to.
    temperatures, means, uncertainties : tuple of float
        True temperatures in K, mean emissivities, and their standard uncertainties.
    middle : float
        Mean of the temperatures in K.
    at_middle : float
        Emissivity of the line there.
    slope : float
        Change of emissivity with temperature in 1/K.
    covariance : ndarray
        Of `at_middle` and `slope`, shape (2, 2).
    residual : float
        Standard deviation about the line; NaN of two temperatures.
    """

    name: str
    feature: str
    temperatures: tuple[float, ...]
    means: tuple[float, ...]
    uncertainties: tuple[float, ...]
    middle: float
    at_middle: float
    slope: float
    covariance: NDArray[np.float64]
    residual: float

    @property
    def slope_uncertainty(self) -> float:
        """Standard uncertainty of the slope in 1/K."""
        return sqrt(self.covariance[1, 1])

    @property
    def middle_uncertainty(self) -> float:
        """Standard uncertainty of the emissivity in the middle."""
        return sqrt(self.covariance[0, 0])

    def at(self, temperature: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Emissivity of the line and its standard uncertainty at temperatures in K."""
        away = np.asarray(temperature, np.float64) - self.middle
        value = self.at_middle + self.slope * away
        (a, b), (_, c) = self.covariance
        return value, np.sqrt(a + 2 * b * away + c * away**2)


def emissivity_of_radiance(
    radiance: NDArray[np.float64], heating: Heating, band: Band
) -> NDArray[np.float64]:
    """Emissivity from in-band radiance in W/(m² sr), of any shape.

    Notes
    -----
    ε = (L_app − L_env) / (L_true − L_env): Equation 2 of Heigel and Whitenton (2010), solved.
    """
    ends = band.radiance(np.array([heating.truth, heating.environment]))
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
        is under the camera's floor.
    """
    check_same_pixels(measurements, "emissivity")
    for measurement in measurements:
        floor = _floor(measurement)
        if heating.truth < floor:
            raise ValueError(
                f"truth: {_celsius(heating.truth)} is under the camera's floor of "
                f"{_celsius(floor)}, expected a hotter object"
            )
    first, radiance = measurements[0], observed_radiance(measurements)
    return EmissivityMap(
        heating=heating,
        band=first.band,
        raster=first.raster,
        radiance=radiance,
        flags=observed_flags(measurements),
        calibration=_calibration(measurements, radiance.mean(axis=0), heating),
        floor=max(map(_floor, measurements)),
        recordings=len(measurements),
    )


def emissivity_covariance(rows: Sequence[RegionEmissivity]) -> NDArray[np.float64]:
    """Covariance of the mean emissivities of several areas of one map.

    Parameters
    ----------
    rows : sequence of RegionEmissivity
        Areas of one map.

    Returns
    -------
    ndarray
        Shape (areas, areas). The errors of `COMMON` are the same in all areas, so a difference or
        a ratio of two areas is known better than either.
    """
    observed = np.stack([row.observed for row in rows])
    chance = np.zeros((len(rows), len(rows)))
    if observed.shape[1] > 1:
        chance = np.atleast_2d(np.cov(observed)) / observed.shape[1]
    np.fill_diagonal(chance, [row.scatter.standard_uncertainty**2 for row in rows])
    for cause in COMMON:
        effect = [row.common[cause] for row in rows]
        chance += np.outer(effect, effect)
    drift = [_known(row.drift) for row in rows]
    return chance + np.outer(drift, drift)


def emissivity_line(rows: Sequence[RegionEmissivity]) -> EmissivityLine:
    """Straight line through an area's emissivity at several temperatures, by least squares.

    Parameters
    ----------
    rows : sequence of RegionEmissivity
        The same area at two temperatures or more.

    Raises
    ------
    ValueError
        If there are fewer than two temperatures.

    Notes
    -----
    The line is that of ordinary least squares, a linear function of the means, through which
    their covariance is propagated (JCGM 100:2008, Equation 13). The errors of `COMMON` are the
    same at all temperatures. Chance is that of the rows, or the scatter about the line where that
    is more.
    """
    temperature = np.array([row.heating.truth for row in rows])
    if len(set(temperature.tolist())) < 2:
        raise ValueError("emissivity over temperature: expected 2 temperatures or more")
    means = np.array([row.mean for row in rows])
    middle = float(temperature.mean())
    design = np.stack([np.ones_like(temperature), temperature - middle], axis=1)
    solve = np.linalg.pinv(design)
    at_middle, slope = (solve @ means).tolist()
    residual = _residual(means - design @ (at_middle, slope))
    chance = np.array([hypot(row.scatter.standard_uncertainty, _known(row.drift)) for row in rows])
    if isfinite(residual):
        chance = np.maximum(chance, residual)
    covariance = (solve * chance**2) @ solve.T
    for cause in COMMON:
        shift = np.array([row.common[cause] for row in rows])
        if cause == "truth":
            # An error of the temperature moves the points along the line too.
            shift = shift - slope * np.array([row.heating.truth_uncertainty for row in rows])
        effect = solve @ shift
        covariance = covariance + np.outer(effect, effect)
    return EmissivityLine(
        name=rows[0].name,
        feature=rows[0].feature,
        temperatures=tuple(temperature.tolist()),
        means=tuple(means.tolist()),
        uncertainties=tuple(row.standard_uncertainty for row in rows),
        middle=middle,
        at_middle=at_middle,
        slope=slope,
        covariance=covariance,
        residual=residual,
    )


def _emissivity(radiance: Any, truth: Any, environment: Any) -> Any:
    return (radiance - environment) / (truth - environment)


def _floor(measurement: Measurement) -> float:
    return float(measurement.data.attrs.get("floor", 0.0))


def _calibration(
    measurements: Sequence[Measurement], radiance: NDArray[np.float64], heating: Heating
) -> NDArray[np.float64] | None:
    """Standard uncertainty of the mean radiance from the calibration, shape (y, x)."""
    if heating.camera_uncertainty is not None:
        band, spread = measurements[0].band, heating.camera_uncertainty
        temperature = np.asarray(band.temperature(radiance), np.float64)
        ends = [band.radiance(temperature + sign * spread) for sign in (-1.0, 1.0)]
        return np.asarray((ends[1] - ends[0]) / 2, np.float64)
    return told_calibration(measurements)


def _residual(about_line: NDArray[np.float64]) -> float:
    freedom = about_line.size - 2
    return sqrt(float((about_line**2).sum()) / freedom) if freedom else nan


def _known(part: float) -> float:
    """A contribution, or 0 where it is not known."""
    return part if isfinite(part) else 0.0


def _root_sum(parts: dict[str, float]) -> float:
    return float(np.linalg.norm(list(parts.values())))


def _celsius(temperature: float) -> str:
    return f"{temperature - _ZERO_CELSIUS:.6g} °C"
