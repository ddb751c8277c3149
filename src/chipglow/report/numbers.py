"""Numbers that describe the cut, the chip and the camera in a report.

Each is one function, which returns its value in SI, and one entry of a table, which states its key
in summary.json (of a corrected place the end of it) and the unit and decimals in which it is shown.
Their titles and explanations stand in ``texts.yaml`` under the same keys.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from typing import Final, Generic, NamedTuple, TypeVar

import numpy as np

from chipglow.analysis import CorrectedPlace, CorrectedWindow, CuttingForces
from chipglow.camera import Camera, FlatFieldCalibration
from chipglow.chip import ChipMetrics, Segment, Segmentation
from chipglow.quantities import Array
from chipglow.report.shown_units import SHOWN_UNITS
from chipglow.scene import Raster

_BORDER: Final = 3
"""Samples from the border of the view within which a contact counts as truncated."""


class Value(NamedTuple):
    """A number; NaN where it, its uncertainty or the degrees of freedom are unknown."""

    number: float
    uncertainty: float = nan
    """Standard uncertainty if the degrees of freedom are known, else standard deviation."""
    freedom: float = nan
    """Degrees of freedom of a standard uncertainty."""


class CalibratedCamera(NamedTuple):
    """A camera with a detector, and the calibration of the detector."""

    camera: Camera
    calibration: FlatFieldCalibration


Source = TypeVar("Source")


def _never_truncated(source: object, raster: Raster) -> bool:
    return False


@dataclass(frozen=True)
class Entry(Generic[Source]):
    """A number of summary.json."""

    key: str
    unit: str
    """As shown; one of `SHOWN_UNITS`."""
    value: Callable[[Source], Value]
    """Returns the value in SI."""
    decimals: int = 0
    is_truncated: Callable[[Source, Raster], bool] = _never_truncated
    """Whether the border of the view truncates the value: the true one may be greater."""

    def shown(self, source: Source) -> Value:
        """Return the value in the unit in which it is shown."""
        unit, value = SHOWN_UNITS[self.unit], self.value(source)
        return Value(
            number=unit.number(float(value.number)),
            uncertainty=unit.difference(float(value.uncertainty)),
            freedom=float(value.freedom),
        )


# The cut: forces and segments over the whole cut.


def segment_period(forces: CuttingForces) -> Value:
    """Return the mean of the intervals between valleys in s."""
    found = forces.history.segmentation
    return Value(found.period, found.period_uncertainty, _freedom_of_period(found))


def segmentation_degree(forces: CuttingForces) -> Value:
    """Return the mean degree of segmentation; n - 1 degrees of freedom for n segments."""
    found = forces.history.segmentation
    return Value(found.degree, found.degree_uncertainty, found.segments - 1)


def whole_segments(forces: CuttingForces) -> Value:
    """Return the number of whole segments."""
    return Value(forces.history.segmentation.segments)


def mean_cutting_force(forces: CuttingForces) -> Value:
    """Return the mean cutting force in N/m."""
    return Value(forces.history.cutting_mean)


def cutting_force_swing(forces: CuttingForces) -> Value:
    """Return the mean peak-to-valley height of the cutting force in N/m."""
    return Value(forces.history.cutting_swing)


def mean_thrust_force(forces: CuttingForces) -> Value:
    """Return the mean thrust force in N/m."""
    return Value(forces.history.thrust_mean)


def energy_balance_error(forces: CuttingForces) -> Value:
    """Return the fraction of the drive's work that the energy balance does not explain."""
    return Value(forces.unaccounted)


def kinetic_fraction(forces: CuttingForces) -> Value:
    """Return the largest kinetic energy of the scaled mass over the work."""
    return Value(forces.inertia.kinetic_fraction)


def inertia_force_fraction(forces: CuttingForces) -> Value:
    """Return the momentum flux of the scaled mass over the cutting force."""
    return Value(forces.inertia.force_fraction)


FORCES: Final[tuple[Entry[CuttingForces], ...]] = (
    Entry("segment_period_us", "µs", segment_period),
    Entry("segmentation_degree_percent", "%", segmentation_degree, decimals=1),
    Entry("segments_count", "", whole_segments),
    Entry("cutting_force_mean_N_per_mm", "N/mm", mean_cutting_force),
    Entry("cutting_force_swing_N_per_mm", "N/mm", cutting_force_swing),
    Entry("thrust_force_mean_N_per_mm", "N/mm", mean_thrust_force),
    Entry("energy_unaccounted_percent", "%", energy_balance_error, decimals=1),
    Entry("kinetic_fraction_percent", "%", kinetic_fraction, decimals=2),
    Entry("inertia_force_fraction_percent", "%", inertia_force_fraction, decimals=2),
)


# Each segment whose errors are read.


def contact_length(segment: Segment) -> Value:
    """Return the length of contact on the rake face in m."""
    return Value(segment.contact_length)


def contact_is_truncated(segment: Segment, raster: Raster) -> bool:
    """Return whether the contact ends at the border of the view."""
    x, y = segment.tool.rake_point(segment.contact_length)
    left, _, _, top = raster.extent
    margin = _BORDER * raster.spacing
    return bool(y > top - margin or x < left + margin)


def momentary_band_width(segment: Segment) -> Value:
    """Return the width of the shear band at one moment in m."""
    return Value(segment.band_width)


def peak_strain_rate(segment: Segment) -> Value:
    """Return the largest plastic strain rate on the shear band in 1/s."""
    return Value(segment.moment.rate.max())


def band_length(segment: Segment) -> Value:
    """Return the length of the shear band in m."""
    return Value(segment.band.length)


SEGMENT: Final[tuple[Entry[Segment], ...]] = (
    Entry("contact_length_um", "µm", contact_length, is_truncated=contact_is_truncated),
    Entry("band_width_um", "µm", momentary_band_width, decimals=1),
    Entry("band_peak_rate_per_s", "1/s", peak_strain_rate, decimals=-3),
    Entry("band_length_um", "µm", band_length),
)


# The chip: its shape, motion and shear band over the scene.


def segment_frequency(chip: ChipMetrics) -> Value:
    """Return the frequency f = 1 / T of the segments in Hz.

    By propagation from the period T, u(f) = f u(T) / T, with the degrees of freedom of u(T).
    """
    uncertainty = chip.frequency * chip.period_uncertainty / chip.period
    return Value(chip.frequency, uncertainty, _freedom_of_period(chip))


def uncut_segment_length(chip: ChipMetrics) -> Value:
    """Return the length s = T v of uncut workpiece in a segment in m.

    The cutting speed v counts as exact: u(s) = v u(T), with the degrees of freedom of u(T).
    """
    return Value(chip.spacing, chip.spacing_uncertainty, _freedom_of_period(chip))


def chip_segment_length(chip: ChipMetrics) -> Value:
    """Return the length of a segment along the chip in m."""
    return Value(chip.chip_spacing)


def uncut_chip_thickness(chip: ChipMetrics) -> Value:
    """Return the uncut chip thickness in m."""
    return Value(chip.feed)


def mean_thickness(chip: ChipMetrics) -> Value:
    """Return the mean thickness of the chip in m."""
    return Value(chip.thickness)


def peak_thickness(chip: ChipMetrics) -> Value:
    """Return the mean thickness at the peaks in m, and the standard deviation of single peaks."""
    return Value(chip.peak, chip.peak_standard_deviation)


def valley_thickness(chip: ChipMetrics) -> Value:
    """Return the mean thickness in the valleys in m, and the deviation of single valleys."""
    return Value(chip.valley, chip.valley_standard_deviation)


def chip_ratio(chip: ChipMetrics) -> Value:
    """Return the uncut chip thickness over the mean thickness."""
    return Value(chip.ratio)


def chip_speed(chip: ChipMetrics) -> Value:
    """Return the speed of the chip along the rake face in m/s, and its deviation over time."""
    return Value(chip.chip_speed, chip.chip_speed_standard_deviation)


def mean_contact_length(chip: ChipMetrics) -> Value:
    """Return the length of contact in m, and its standard deviation over time."""
    return Value(chip.contact, chip.contact_standard_deviation)


def shear_angle(chip: ChipMetrics) -> Value:
    """Return the shear angle in rad, and its standard deviation over time."""
    return Value(chip.shear_angle, chip.shear_angle_standard_deviation)


def mean_band_width(chip: ChipMetrics) -> Value:
    """Return the width of the shear band in m, and its standard deviation over time."""
    return Value(chip.band_width, chip.band_width_standard_deviation)


def band_strain_rate(chip: ChipMetrics) -> Value:
    """Return the largest median strain rate of the shear band in 1/s."""
    return Value(chip.band_rate)


def band_strain(chip: ChipMetrics) -> Value:
    """Return the plastic strain of a formed band."""
    return Value(chip.band_strain)


CHIP: Final[tuple[Entry[ChipMetrics], ...]] = (
    Entry("segment_frequency_kHz", "kHz", segment_frequency, decimals=1),
    Entry("segment_spacing_um", "µm", uncut_segment_length),
    Entry("chip_spacing_um", "µm", chip_segment_length),
    Entry("feed_um", "µm", uncut_chip_thickness),
    Entry("chip_thickness_um", "µm", mean_thickness),
    Entry("chip_peak_um", "µm", peak_thickness),
    Entry("chip_valley_um", "µm", valley_thickness),
    Entry("chip_ratio", "", chip_ratio, decimals=2),
    Entry("chip_speed_m_per_s", "m/s", chip_speed, decimals=2),
    Entry("chip_contact_um", "µm", mean_contact_length),
    Entry("shear_angle_deg", "°", shear_angle, decimals=1),
    Entry("shear_band_width_um", "µm", mean_band_width, decimals=1),
    Entry("shear_band_rate_per_s", "1/s", band_strain_rate, decimals=-3),
    Entry("shear_band_strain", "", band_strain, decimals=1),
)


# The camera: noise and range of its detector.


def half_netd(source: CalibratedCamera) -> Value:
    """Return the NETD in K where a blackbody fills half of the range."""
    return Value(source.calibration.half_netd)


def half_temperature(source: CalibratedCamera) -> Value:
    """Return the temperature in K of a blackbody that fills half of the range."""
    return Value(source.calibration.half_temperature)


def lower_limit_netd(source: CalibratedCamera) -> Value:
    """Return the NETD in K at the lower range limit."""
    limit = source.camera.lower_limit
    return Value(nan if limit is None else source.calibration.netd(limit))


def lower_limit(source: CalibratedCamera) -> Value:
    """Return the lower limit of the range in K."""
    limit = source.camera.lower_limit
    return Value(nan if limit is None else limit)


def saturation_temperature(source: CalibratedCamera) -> Value:
    """Return the temperature in K of a blackbody that fills the range."""
    return Value(source.calibration.full_temperature)


CAMERA: Final[tuple[Entry[CalibratedCamera], ...]] = (
    Entry("netd_half_K", "K", half_netd, decimals=3),
    Entry("netd_half_temperature_degC", "°C", half_temperature),
    Entry("netd_lower_K", "K", lower_limit_netd, decimals=3),
    Entry("lower_limit_degC", "°C", lower_limit),
    Entry("saturated_degC", "°C", saturation_temperature),
)


# A corrected place, and the part of the image around it.


def measured_temperature(place: CorrectedPlace) -> Value:
    """Return the mean radiance temperature of the pixels in K."""
    return Value(place.measured)


def corrected_temperature(place: CorrectedPlace) -> Value:
    """Return the mean corrected temperature in K, with its standard uncertainty."""
    one = place.estimate
    freedom = float(one.degrees_of_freedom)
    return Value(float(one.values), float(one.standard_uncertainty), freedom)


def interval_low(place: CorrectedPlace) -> Value:
    """Return the lower end of the 95 % interval of the corrected temperature in K."""
    return Value(float(place.estimate.values - place.estimate.expanded_uncertainty()))


def interval_high(place: CorrectedPlace) -> Value:
    """Return the upper end of the 95 % interval of the corrected temperature in K."""
    return Value(float(place.estimate.values + place.estimate.expanded_uncertainty()))


def true_temperature(place: CorrectedPlace) -> Value:
    """Return the mean true temperature in K, each pixel's of the mean radiance."""
    return Value(place.true)


PLACE: Final[tuple[Entry[CorrectedPlace], ...]] = (
    Entry("measured_degC", "°C", measured_temperature),
    Entry("corrected_degC", "°C", corrected_temperature),
    Entry("corrected_low_degC", "°C", interval_low),
    Entry("corrected_high_degC", "°C", interval_high),
    Entry("true_degC", "°C", true_temperature),
)


def held_fraction(window: CorrectedWindow) -> Value:
    """Return the fraction of the pixels whose 95 % interval contains the true temperature."""
    pixels = np.count_nonzero(window.judged)
    return Value(np.count_nonzero(window.held) / pixels if pixels else nan)


def measured_deviation(window: CorrectedWindow) -> Value:
    """Return the root mean square of measured minus true temperature over the pixels in K."""
    return Value(_deviation(window, window.measurement.radiance_temperature()[0]))


def corrected_deviation(window: CorrectedWindow) -> Value:
    """Return the root mean square of corrected minus true temperature over the pixels in K."""
    return Value(_deviation(window, window.correction.data["temperature"][0].values))


def emissivity_uncertainty(window: CorrectedWindow) -> Value:
    """Return the standard uncertainty of the mean emissivity in the correction."""
    return Value(window.emissivity_uncertainty)


WINDOW: Final[tuple[Entry[CorrectedWindow], ...]] = (
    Entry("measured_rms_K", "K", measured_deviation),
    Entry("corrected_rms_K", "K", corrected_deviation),
    Entry("held_percent", "%", held_fraction),
    Entry("emissivity_uncertainty", "", emissivity_uncertainty, decimals=3),
)


def _deviation(window: CorrectedWindow, temperature: Array) -> float:
    if not window.judged.any():
        return nan
    return float(np.sqrt(np.mean((temperature - window.true)[window.judged] ** 2)))


def _freedom_of_period(found: Segmentation) -> int:
    """Return the degrees of freedom of `period_uncertainty`.

    The period is a mean of n - 1 intervals between n valleys: n - 2.
    """
    return found.segments - 2
