"""True temperature of an area whose emissivity is known, with its uncertainty."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, isnan, sqrt
from typing import TYPE_CHECKING, Any, Final
from uuid import uuid4

import numpy as np
import pandas as pd
import scipy
from numpy.typing import ArrayLike

from chipglow.camera import FittedCalibration, Measurement
from chipglow.laboratory.emissivity.emissivity import COMMON, LABORATORY, EmissivityLine
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
    uncertainty_columns,
    used_pixels,
    with_observed,
)
from chipglow.quantities import SEED, ZERO_CELSIUS, Array, Brief
from chipglow.quantities.units import HOTTEST
from chipglow.radiometry import Band, blackbody_radiance
from chipglow.scene import Area, Region, areas
from chipglow.scene.regions import named_value
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Estimate, Limits, MonteCarlo, monte_carlo, propagate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TEMPERATURE_BUDGET: Final = (*COMMON, "emissivity", "drift", UNIFORMITY, "repeatability", "noise")
"""Lines of the budget of a true temperature."""

FAR: Final = 50.0
"""Difference of temperature in K beyond which an emissivity may well differ."""

_SLOPE_STEP: Final = 0.5
"""Half the step in K over which the slope of a radiance is taken."""

_TEMPERATURES_TRIED: Final = 200
"""Temperatures at which the radiance by a line is compared with the measured one, before it is
solved."""

_ITERATIONS: Final = 4
"""Iterations of temperature and the emissivity that depends on it."""

_LIMITS: Final = (Limits("emissivity", 0.0, 1.0), Limits("radiance", 0.0), Limits("reflected", 0.0))


def reflected_temperature(
    temperature: float = LABORATORY, standard_uncertainty: float = 0.0
) -> Estimate:
    """Return the temperature in K of the reflected surroundings, the paper's by default."""
    if not 0 < temperature < inf:
        raise ValueError(f"reflected: is {temperature!r} K, expected more than 0 K")
    if not 0 <= standard_uncertainty < inf:
        raise ValueError(
            f"reflected: standard uncertainty is {standard_uncertainty!r} K, expected 0 K or more"
        )
    return Estimate(np.array(temperature)).with_component("reflected", standard_uncertainty)


@dataclass(frozen=True, eq=False, repr=False)
class TrueTemperature(Brief):
    """True temperature of an area; made by `true_temperature`."""

    name: str
    used: UsedPixels
    radiance_temperature: float
    """Radiance temperature of the area's mean radiance in K."""
    standard_deviation: float
    """Standard deviation over the temperatures of single pixels in K."""
    emissivity: float
    estimate: Estimate
    """True temperature in K, with the lines `TEMPERATURE_BUDGET`."""
    gain: float
    """Change of the true temperature with the radiance temperature, in K/K."""
    correlation: float | None
    """Correlation of the calibration's errors at the radiances of area and emissivity, if known."""
    model: Callable[..., Array]
    """True temperature in K as a function of arrays of `inputs`."""
    inputs: tuple[Estimate, ...]
    """Emissivity, mean radiance in W/(m² sr), temperature of the surroundings in K."""

    @cached_property
    def distribution(self) -> MonteCarlo:
        """Distribution of the true temperature by the model itself (JCGM 101:2008)."""
        generator = np.random.default_rng(SEED)
        return monte_carlo(self.model, *self.inputs, generator=generator, limits=_LIMITS)


def true_temperature(
    measurements: Sequence[Measurement],
    area: Area,
    emissivity: EmissivityLine,
    surroundings: Estimate | None = None,
    calibration: FittedCalibration | None = None,
    drift: float | None = None,
    camera_uncertainty: float | None = None,
) -> TrueTemperature:
    """Compute the true temperature of an even area from its mean radiance and emissivity.

    Parameters
    ----------
    measurements : sequence of Measurement
        Images of the object; several of them are repetitions.
    area : Area
        Pixels of uniform temperature.
    emissivity : EmissivityLine
        The area's emissivity, determined with the same camera, or known from elsewhere
        (`EmissivityLine.constant`).
    surroundings : Estimate, optional
        Temperature in K of the surroundings (`reflected_temperature`). By default as in the
        determination of the emissivity, with the same error, or the paper's 293 K.
    calibration : FittedCalibration, optional
        The camera's calibration with which both emissivity and area were measured: it states the
        correlation of its errors at the two radiances.
    drift : float, optional
        Relative standard uncertainty of the radiance from one recording to the next, by default
        as several recordings show; of one it is unknown and not in the uncertainty.
    camera_uncertainty : float, optional
        Standard uncertainty in K of the radiance temperatures by the calibration, by default as
        the measurements state.

    Notes
    -----
    L(T) = (L_app − (1 − ε) L_env) / ε: Equation 2 of Heigel and Whitenton (2010), solved. The
    uncertainty is propagated to first order (JCGM 100:2008, Equation 13). Emissivity and area have
    errors in common, which partly cancel; without `calibration` its are taken as uncorrelated. With
    a line ε(T) sensitivities are divided by 1 + (dε/dT) (L − L_env) / (ε dL/dT).
    """
    check_same_pixels(measurements, "temperature")
    band, radiance = measurements[0].band, observed_radiance(measurements)
    used = used_pixels(area, radiance, observed_flags(measurements))
    values = radiance[:, used.mask]
    mean = float(values.mean())
    if surroundings is None:
        seen = emissivity.heatings
        surroundings = seen[0].estimate("reflected") if seen else reflected_temperature()
    room = float(surroundings.values)
    if not mean > float(band.radiance(np.array(room))):
        raise ValueError(
            f"region {area.name}: is darker than its reflection at {room - ZERO_CELSIUS:.6g} °C, "
            "expected a hotter object"
        )
    value = _emissivity_of_area(emissivity, area.name, mean, room, band)
    temperature = partial(_temperature, float(value.values), room, band)
    at = float(temperature(np.array(mean)))
    derivatives = _derivatives(area.name, emissivity, float(value.values), at, room, band)
    correlation = _correlation(emissivity, at, mean, calibration, band)
    shared = (correlation or 0.0) if emissivity.heatings else 1.0
    stated = calibration_uncertainty(measurements, radiance.mean(axis=0), camera_uncertainty)
    error = 0.0 if stated is None else float(stated[used.mask].mean())
    inputs = (
        value.renamed(RANDOM, "emissivity").renamed(UNIFORMITY, "emissivity"),
        _mean_radiance(values, used, error, shared, drift, len(measurements)),
        surroundings,
    )
    estimate = propagate(
        lambda _, seen, __: temperature(seen),
        *inputs,
        derivatives=[lambda *_, value=value: np.array(value) for value in derivatives],
    )
    pixels = temperature(values.mean(axis=0))
    warnings = used.warnings() + [f"Emissivity: {warning}" for warning in estimate.warnings]
    if used.uniformity.is_uneven:
        kelvins = derivatives[1] * used.uniformity.standard_deviation
        warnings.append(used.uneven_text(f"true temperature varies by {kelvins:.3g} K"))
    return TrueTemperature(
        name=area.name,
        used=used,
        radiance_temperature=float(band.temperature(np.array(mean))),
        standard_deviation=deviation_of(pixels),
        emissivity=float(value.values),
        estimate=replace(estimate, warnings=tuple(warnings)),
        gain=derivatives[1] * float(band.slope(band.temperature(np.array(mean)))),
        correlation=correlation,
        model=partial(
            _modelled, emissivity.slope if len(emissivity.heatings) > 1 else 0.0, at, band
        ),
        inputs=inputs,
    )


@dataclass(frozen=True, eq=False)
class RegionTemperatures:
    """True temperatures of regions; made by `true_temperatures`."""

    rows: tuple[TrueTemperature, ...]
    notes: Notes = field(default_factory=Notes)

    def to_frame(self) -> pd.DataFrame:
        """Return every region; one row each."""
        return pd.DataFrame(
            {
                "region": row.name,
                "pixels": row.used.count,
                "left_out": row.used.left_out,
                "emissivity": row.emissivity,
                "radiance_temperature_K": row.radiance_temperature,
                "true_temperature_K": float(row.estimate.values),
                "standard_deviation_K": row.standard_deviation,
                "low_K": float(row.distribution.low),
                "high_K": float(row.distribution.high),
                **uncertainty_columns(row.estimate, TEMPERATURE_BUDGET, "_K"),
            }
            for row in self.rows
        )

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw true temperature with its 95 % interval, and radiance temperature, by region.

        New axes are made by default.
        """
        from chipglow.laboratory.emissivity.figure import plot_region_temperatures

        return plot_region_temperatures(self, ax)

    def _repr_html_(self) -> str:
        return result_html("RegionTemperatures", self.to_frame(), self.notes)


def true_temperatures(
    measurements: Sequence[Measurement],
    regions: Sequence[Region],
    emissivities: Mapping[str, EmissivityLine] | EmissivityLine,
    surroundings: Estimate | None = None,
    calibration: FittedCalibration | None = None,
    drift: float | None = None,
    names: Sequence[str] = (),
    camera_uncertainty: float | None = None,
) -> RegionTemperatures:
    """Compute the true temperatures of the regions of an image."""
    check_same_pixels(measurements, "temperature", names)
    places = areas(regions, measurements[0].raster)
    if isinstance(emissivities, EmissivityLine):
        emissivities = dict.fromkeys((area.name for area in places), emissivities)
    named = {area: named_value(emissivities, area) for area in places}
    known = {area: line for area, line in named.items() if line is not None}
    if not known:
        raise ValueError(
            f"emissivity: no region ({', '.join(area.name for area in places)}) has the name or "
            f"feature of a known emissivity ({', '.join(emissivities)})"
        )
    rows = tuple(
        true_temperature(
            measurements, area, line, surroundings, calibration, drift, camera_uncertainty
        )
        for area, line in known.items()
    )
    lines = list(known.values())
    warnings = [
        f"{area.name}: left out, as no known emissivity ({', '.join(emissivities)}) has the name "
        "or feature of this region."
        for area in places
        if area not in known
    ]
    warnings += [warning for row in rows for warning in row.estimate.warnings]
    warnings += [text for row, line in zip(rows, lines, strict=True) for text in _far(row, line)]
    warnings += [f"{row.name}: {text}" for row in rows for text in row.distribution.truncated]
    warnings += [text for row in rows for text in _unvalidated(row)]
    unknown_drift = drift is None and len(measurements) == 1
    unknown_drift |= any(
        np.isnan(line.at(line.middle).contribution("drift")).any() for line in lines
    )
    stated = camera_uncertainty is not None or all(
        one.calibration_uncertainty is not None for one in measurements
    )
    assumed = _assumptions(rows, lines, surroundings is None, unknown_drift, stated)
    return RegionTemperatures(rows, Notes(assumed, warnings))


def _far(row: TrueTemperature, line: EmissivityLine) -> Iterator[str]:
    """Warn if a temperature is far from those at which the emissivity was determined."""
    if not line.heatings:
        return
    low, high = min(line.temperatures), max(line.temperatures)
    temperature = float(row.estimate.values)
    difference = max(low - temperature, temperature - high)
    if difference > FAR:
        ends = [f"{end - ZERO_CELSIUS:.0f} °C" for end in dict.fromkeys((low, high))]
        yield (
            f"{row.name}: its emissivity was determined {difference:.0f} K away, at "
            f"{' to '.join(ends)}; u does not include the error of the extrapolation."
        )


def _unvalidated(row: TrueTemperature) -> Iterator[str]:
    """Warn if Monte Carlo does not validate the interval to first order."""
    found = row.distribution
    if not found.validates(row.estimate):
        low, high = found.low - ZERO_CELSIUS, found.high - ZERO_CELSIUS
        yield (
            f"{row.name}: Monte Carlo does not confirm the expanded uncertainty to first order "
            f"(JCGM 101, 8.1): the 95 % interval is {low:.4g} °C to {high:.4g} °C."
        )


def _assumptions(
    rows: Sequence[TrueTemperature],
    lines: Sequence[EmissivityLine],
    same_surroundings: bool,
    unknown_drift: bool,
    stated_calibration: bool,
) -> list[str]:
    exact = not any(row.estimate.contribution("emissivity") for row in rows)
    known = not any(line.heatings for line in lines)
    straight = any(len(line.heatings) > 1 for line in lines)
    texts = {
        "Every region is of uniform temperature and emissivity.": True,
        "The emissivity is a straight line over the temperature.": straight,
        "The emissivity is the same at all temperatures.": not straight and not known,
        "The emissivity is exact (emissivity_uncertainty).": known and exact,
        "The object reflects 293 K exactly (reflected, reflected_uncertainty).": (
            known and same_surroundings
        ),
        "The object reflects what it did when its emissivity was determined.": (
            not known and same_surroundings
        ),
        "The camera's calibration is exact, as the measurement states no uncertainty of it "
        "(camera_uncertainty).": not stated_calibration,
        "The calibration's errors in the emissivity and here are independent, which makes u too "
        "large rather than too small (calibration).": (
            stated_calibration and not known and rows[0].correlation is None
        ),
        "The camera does not drift between recordings: a single image, here or of the emissivity, "
        "does not show it, and u does not include it (drift).": unknown_drift,
        "Nothing changes between frames, as there is only one.": any(
            isnan(row.estimate.contribution("repeatability")) for row in rows
        ),
    }
    return [text for text, applies in texts.items() if applies]


def _mean_radiance(
    values: Array,
    used: UsedPixels,
    calibration: float,
    shared: float,
    drift: float | None,
    recordings: int,
) -> Estimate:
    """Return the mean radiance; `shared`: correlation of calibration errors with emissivity."""
    mean = float(values.mean())
    found, own = Estimate(np.array(mean)), sqrt(max(1 - shared**2, 0.0))
    for identity, part in ((ALL_IMAGES, shared), ("measurement", own)):
        found = found.with_component("calibration", part * calibration, identity=identity)
    return with_observed(found, values, used, 1.0, drift, mean, recordings, uuid4().hex)


def _temperature(emissivity: ArrayLike, reflected: ArrayLike, band: Band, radiance: Array) -> Array:
    """Return the true temperature in K by apparent radiance in W/(m² sr): Equation 2."""
    own = blackbody_radiance(radiance, emissivity, band.radiance(np.asarray(reflected)))
    return np.asarray(band.temperature(own), np.float64)


def _modelled(
    slope: float, at: float, band: Band, emissivity: Array, radiance: Array, reflected: Array
) -> Array:
    """Return true temperatures in K; the emissivity in 1/K has a slope, and its value at `at`."""
    found = np.full_like(radiance, at)
    for _ in range(_ITERATIONS if slope else 1):
        found = _temperature(emissivity + slope * (found - at), reflected, band, radiance)
    return np.where(np.isnan(found), inf, found)  # too little emissivity for any temperature


def _derivatives(
    name: str, line: EmissivityLine, emissivity: float, at: float, reflected: float, band: Band
) -> tuple[float, float, float]:
    """Derive the temperature by emissivity, radiance and temperature of the surroundings."""
    # `Band.slope` ends with its table.
    kelvins = np.array([reflected, at])
    low, high = (band.radiance(kelvins + step) for step in (-_SLOPE_STEP, _SLOPE_STEP))
    (room, own), (room_rise, rise) = band.radiance(kelvins), (high - low) / (2 * _SLOPE_STEP)
    whole = emissivity * rise
    if len(line.heatings) > 1:
        whole += line.slope * (own - room)
    if not whole > 0:
        raise ValueError(
            f"region {name}: by the line of its emissivity the radiance does not rise with the "
            f"temperature at {at - ZERO_CELSIUS:.6g} °C, expected an emissivity that falls less"
        )
    return -(own - room) / whole, 1 / whole, -(1 - emissivity) * room_rise / whole


def _emissivity_of_area(
    line: EmissivityLine, name: str, radiance: float, reflected: float, band: Band
) -> Estimate:
    """Return the emissivity at the temperature at which it makes an area's radiance."""
    if len(line.heatings) < 2:
        return line.at(line.middle)
    room = float(band.radiance(np.array(reflected)))

    def excess(temperature: Any) -> Array:
        black = band.radiance(np.asarray(temperature, np.float64))
        return np.asarray(line.at(temperature).values * (black - room) - (radiance - room))

    kelvins = np.geomspace(reflected, HOTTEST, _TEMPERATURES_TRIED)
    hotter = np.flatnonzero(excess(kelvins) > 0)
    if not hotter.size:
        raise ValueError(
            f"region {name}: no temperature up to {HOTTEST - ZERO_CELSIUS:.0f} °C has its radiance "
            "by the line of its emissivity, use an emissivity that falls less with the temperature"
        )
    ends = kelvins[hotter[0] - 1 : hotter[0] + 1]
    return line.at(scipy.optimize.brentq(excess, *ends, xtol=1e-6))  # in K


def _correlation(
    line: EmissivityLine,
    temperature: float,
    radiance: float,
    calibration: FittedCalibration | None,
    band: Band,
) -> float | None:
    """Return the correlation of the calibration's errors here and in the emissivity, weighted."""
    if calibration is None or not line.heatings:
        return None
    correlations = []
    for emissivity, heating in zip(line.means, line.heatings, strict=True):
        hot, cold = band.radiance(np.array([heating.reference, heating.reflected])).tolist()
        then = cold + emissivity * (hot - cold)
        correlations.append(calibration.errors.estimate([then, radiance]).correlation()[0, 1])
    return float(np.clip(line.weights(temperature) @ np.nan_to_num(correlations), -1.0, 1.0))
