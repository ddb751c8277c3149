"""Measured temperatures, corrected by the errors of a study of the same measurement."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from chipglow.analysis.single import MEASURED, NOISE
from chipglow.camera import (
    Measurement,
    OpticalElement,
    alike,
    check_camera,
    check_value,
    difference_text,
)
from chipglow.laboratory.emissivity import RegionTemperatures, TrueTemperature
from chipglow.laboratory.emissivity.observations import UNIFORMITY
from chipglow.quantities import SEED, ZERO_CELSIUS, Array, changed
from chipglow.quantities.units import FREQUENCY, TEMPERATURE, TIME, Quantity
from chipglow.radiometry import Band
from chipglow.study.budgets import first_order_errors, reader, readings_of
from chipglow.study.running import Progress, fitted_study, silent
from chipglow.study.schema import Study
from chipglow.study.surface_section import FeaturesSection
from chipglow.surface import UniformSurface
from chipglow.text import Notes
from chipglow.uncertainty import Estimate, Input, Inputs, MonteCarlo, monte_carlo, propagate

_ALIKE: Final = 0.01
"""Relative difference of the radiance that is accepted, and of an emissivity without uncertainty.
"""

_COVERAGE: Final = 2.0
"""Standard uncertainties within which two values agree."""

_DRAWS: Final = 64
"""Draws of a study's inputs for its image of a place; their standard deviation is known to 9 %."""

_MUST_AGREE: Final[dict[str, Quantity]] = {
    "integration_time": TIME,
    "line_time": TIME,
    "time_constant": TIME,
}
"""Attributes of a measurement that change the errors of a study, and their quantities."""

_MAY_DIFFER: Final[dict[str, Quantity]] = {"frame_rate": FREQUENCY, "lower_limit": TEMPERATURE}
"""Attributes whose difference need not change the errors."""

_TRANSMITTANCE: Final = re.compile(r"\btransmittance ([-+.\deE]+)")


@dataclass(frozen=True, eq=False)
class CorrectedTemperature:
    """Temperature of a region's mean radiance, corrected; made by `corrected_temperatures`."""

    measured: TrueTemperature
    error: Estimate
    """Error of the radiance temperature in K by the study, without its noise."""
    simulated: float
    """Radiance temperature of the place in the study's images in K, mean of draws."""
    simulated_deviation: float
    """Standard deviation of the draws in K."""
    band: Band

    @cached_property
    def estimate(self) -> Estimate:
        """Corrected temperature in K to first order, with the components of both budgets."""
        return propagate(self._model, *self._inputs)

    @cached_property
    def distribution(self) -> MonteCarlo:
        """Distribution of the corrected temperature by the model itself (JCGM 101:2008)."""
        return monte_carlo(self._model, *self._inputs, generator=np.random.default_rng(SEED))

    @property
    def residual(self) -> float:
        """Measured minus simulated radiance temperature in K."""
        return self.measured.radiance_temperature - self.simulated

    @property
    def residual_uncertainty(self) -> float:
        """Standard uncertainty of `residual` in K: of the measurement, and of the draws."""
        own = float(self.measured.estimate.standard_uncertainty) / self.measured.gain
        return float(np.hypot(own, self.simulated_deviation))

    @property
    def warnings(self) -> Iterator[str]:
        """Warnings, as sentences."""
        name, low, high = self.measured.name, self.distribution.low, self.distribution.high
        if abs(self.residual) > _COVERAGE * self.residual_uncertainty:
            yield (
                f"{name}: the study does not fit the measurement: the radiance temperature is "
                f"{TEMPERATURE.text(round(self.measured.radiance_temperature, 1))} in the image "
                f"and {TEMPERATURE.text(round(self.simulated, 1))} in the study's, a difference of "
                f"{self.residual:+.3g} K with a standard uncertainty of "
                f"{self.residual_uncertainty:.2g} K. The correction may be wrong."
            )
        if not np.isfinite(self.simulated):
            yield f"{name}: the study's image has no temperature at this place."
        if not self.distribution.validates(self.estimate):
            yield (
                f"{name}: Monte Carlo does not confirm the expanded uncertainty of the corrected "
                f"temperature to first order (JCGM 101, 8.1): the 95 % interval is "
                f"{low - ZERO_CELSIUS:.4g} °C to {high - ZERO_CELSIUS:.4g} °C."
            )

    @property
    def _inputs(self) -> tuple[Estimate, ...]:
        """Emissivity, mean radiance and reflected temperature, and the study's error.

        An uneven region has a mean, which the study has too.
        """
        emissivity, radiance, reflected = self.measured.inputs
        return emissivity, radiance.without(UNIFORMITY), reflected, self.error

    def _model(self, emissivity: Any, radiance: Any, reflected: Any, error: Any) -> Array:
        corrected = self.band.radiance(self.band.temperature(radiance) - error)
        return self.measured.model(emissivity, np.asarray(corrected, np.float64), reflected)


def corrected_temperatures(
    measured: RegionTemperatures, image: Measurement, study: Study, progress: Progress | None = None
) -> tuple[dict[str, CorrectedTemperature], Notes]:
    """Correct measured temperatures by the errors of a study of the same measurement.

    The error is that against the mean radiance of a place (``reference: mean``).

    Parameters
    ----------
    measured : RegionTemperatures
        True temperatures by `true_temperatures`; the camera's resolution is not in them.
    image : Measurement
        The image. All that it and the study state must agree within 1 %: band, pitch, integration
        time, fill factor, line time, time constant, transmittance, emissivity and reflected
        temperature.
    study : Study
        The study; a region is corrected by the first reading of the place of its name.
    progress : callable, optional
        Called with the current step and its completed fraction, 0 to 1.

    Returns
    -------
    corrected : dict
        Temperature of each region. The study's noise is left out: the measurement states its own.
    notes : Notes
        Assumptions and warnings of the errors, and of a study whose image of a place differs from
        the measured one.

    Raises
    ------
    ValueError
        If a region has not the name of a place, or the study is of another measurement.
    """
    notes = _compared(measured, image, study)
    study = changed(study, {"analysis.reference": "mean"})
    rows = {row.name: row for row in measured.rows}
    errors, found = first_order_errors(study, tuple(rows), progress)
    seen = _simulated(study, tuple(rows), progress or silent)
    corrected = {}
    for number, (name, row) in enumerate(rows.items()):
        mean, deviation = (float(part(seen[:, number])) for part in (np.mean, np.std))
        error = errors[name].without(NOISE)
        corrected[name] = CorrectedTemperature(row, error, mean, deviation, image.band)
    warnings = [text for one in corrected.values() for text in one.warnings]
    return corrected, found + notes + Notes(warnings=warnings)


def _simulated(study: Study, at: tuple[str, ...], tell: Progress) -> Array:
    """Return radiance temperatures in K of places in a study's images, (draw, place)."""
    stated = study.uncertainty.build(study).inputs
    with fitted_study(study, tell, False) as fitted:
        readings = readings_of(study, fitted.scene, at, tell)
        inputs = [one for one in stated if not one.name.startswith("cutting.")]
        inputs += [Input(name) for name in readings.random]
        numbers = np.random.default_rng(study.seed).random((_DRAWS, len(inputs)))
        known = Inputs(inputs)
        read = reader(study, fitted.scene, readings, known.names)
        temperatures = np.asarray(read(known.at(numbers))[..., MEASURED])
    names = list(zip(readings.names, readings.places, strict=True))
    columns = [next(n for n, one in enumerate(names) if name in one) for name in at]
    return temperatures[:, columns]


def _compared(measured: RegionTemperatures, image: Measurement, study: Study) -> Notes:
    """Compare what measurement and study both state; raise ValueError if they differ."""
    camera, attributes = study.camera.build(study.seed), image.data.attrs
    check_camera(image, camera)
    for name, quantity in _MUST_AGREE.items():
        ours = getattr(camera, name)
        if name in attributes and ours is not None:
            check_value(name, float(attributes[name]), ours, quantity)
    elements = [one for one in camera.optics if isinstance(one, OpticalElement)]
    stated = _TRANSMITTANCE.search(str(attributes.get("object_parameters", "")))
    if elements and stated is not None:
        ours = float(np.prod([one.transmittance for one in elements]))
        check_value("transmittance", float(stated[1]), ours)
    for row in measured.rows:
        _check_emissivity(row, study)
        _check_reflected(row, image.band, camera.reflected)
    warnings = []
    for name, quantity in _MAY_DIFFER.items():
        theirs, ours = _stated(image, name), getattr(camera, name)
        if theirs is not None and ours is not None and not alike(theirs, ours):
            warnings.append(f"{difference_text(name, theirs, ours, quantity)}.")
    return Notes(warnings=warnings)


def _stated(image: Measurement, name: str) -> float | None:
    """Return an attribute of an image; a frame rate also by the times of its frames."""
    if name in image.data.attrs:
        return float(image.data.attrs[name])
    if name == "frame_rate" and len(image.times) > 1:
        return float(1 / np.median(np.diff(image.times)))
    return None


def _check_emissivity(row: TrueTemperature, study: Study) -> None:
    """Raise ValueError if the study's surface has not the emissivity of a region."""
    value, spread = float(row.inputs[0].values), float(row.inputs[0].standard_uncertainty)
    stated = _emissivities(study)
    accepted = (max(_COVERAGE * spread, _ALIKE * value, own) for _, own in stated)
    apart = (abs(value - mean) for mean, _ in stated)
    if stated and not any(one <= most for one, most in zip(apart, accepted, strict=True)):
        texts = ", ".join(f"{mean:.4g}" for mean, _ in stated)
        raise ValueError(
            f"emissivity: {value:.4g} of {row.name} in the measurement, {texts} in the study"
        )


def _emissivities(study: Study) -> list[tuple[float, float]]:
    """Return the emissivities that a study's surface states, with standard deviations."""
    surface = study.surface
    if isinstance(surface, UniformSurface):
        return [(surface.emissivity, 0.0)]
    if not isinstance(surface, FeaturesSection) or surface.maps or surface.measured:
        return []
    chips = [one for chip in surface.chips.values() for one in (chip.body, chip.shear_band)]
    features = [*chips, surface.workpiece, surface.tool]
    return [(one.mean, one.standard_deviation) for one in features]


def _check_reflected(row: TrueTemperature, band: Band, study: float | None) -> None:
    """Raise ValueError if other surroundings change the radiance of a region by too much.

    Reflections of surroundings at room temperature are negligible for a hot object.
    """
    surroundings = row.inputs[2]
    kelvins, spread = float(surroundings.values), float(surroundings.standard_uncertainty)
    ends = kelvins, kelvins + spread, study or 0.0
    measured, within, theirs = (float(band.radiance(np.array(one))) for one in ends)
    most = _COVERAGE * (within - measured)
    radiance = float(row.inputs[1].values)
    change = (1 - float(row.inputs[0].values)) * (abs(theirs - measured) - most)
    if change > _ALIKE * radiance:
        text = "none" if study is None else TEMPERATURE.text(study)
        raise ValueError(
            f"reflected: {TEMPERATURE.text(kelvins)} in the measurement, {text} in the study"
        )
