"""Statistics of a measurement."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from chipglow.camera import Flag, Measurement
from chipglow.drawing.scales import shown_frame
from chipglow.laboratory.measurement.radiometric_calibration import flag_fractions
from chipglow.quantities import Array


@dataclass(frozen=True)
class MeasurementSummary:
    """Statistics of a measurement."""

    index: int
    usable: float
    """Fraction of the pixels of all frames with a radiance temperature."""
    fractions: Mapping[Flag, float]
    """Fraction of the pixels of all frames that has each flag."""
    now: tuple[float, float, float] | None
    overall: tuple[float, float, float] | None
    """Least, median and largest radiance temperature in K of that frame and of all, if any."""
    uncertainty: tuple[float, float] | None
    """Least and largest standard uncertainty in K by the calibration, if known."""


def measurement_summary(measurement: Measurement, time: float | None = None) -> MeasurementSummary:
    """Summarise a measurement and its frame nearest to a time in s."""
    index = shown_frame(measurement.times, time, "measurement")
    kelvins = measurement.radiance_temperature()
    return MeasurementSummary(
        index,
        float(np.mean(measurement.usable)),
        flag_fractions(measurement),
        _spread(kelvins[index]),
        _spread(kelvins),
        _uncertainty(measurement, kelvins),
    )


def _spread(kelvins: Array) -> tuple[float, float, float] | None:
    known = kelvins[np.isfinite(kelvins)]
    if known.size == 0:
        return None
    return float(known.min()), float(np.median(known)), float(known.max())


def _uncertainty(measurement: Measurement, kelvins: Array) -> tuple[float, float] | None:
    radiance_uncertainty = measurement.calibration_uncertainty
    if radiance_uncertainty is None or not np.isfinite(kelvins).any():
        return None
    uncertainty = radiance_uncertainty / measurement.band.slope(kelvins)
    return float(np.nanmin(uncertainty)), float(np.nanmax(uncertainty))
