"""The command ``chipglow show`` for measurements."""

from collections.abc import Iterator
from math import degrees
from pathlib import Path
from typing import Final

import numpy as np

from chipglow.camera import Flag, Measurement
from chipglow.cli.finish import figure, finish
from chipglow.cli.screen import current
from chipglow.cli.showing import microseconds, raster_values, show_attributes, where_and_when
from chipglow.cli.times import parse_instant
from chipglow.io import read_measurement
from chipglow.laboratory.measurement import (
    MeasurementSummary,
    measurement_summary,
)
from chipglow.laboratory.measurement.figures import draw_measurement
from chipglow.radiometry import Band

_FLAG_NAMES: Final = {
    Flag.UNDER_RANGE: "below the lower range limit or the calibration",
    Flag.SATURATED: "saturated or above the calibration",
    Flag.DEAD: "dead",
    Flag.REPLACED: "replaced by neighbours",
}
_SAID_APART: Final = ("assumed", "warnings", "band_lower", "band_upper", "pitch", "tool_")
_IN_FACTS: Final = ("integration_time", "lower_limit", "netd", "netd_temperature")


def show_measurement(path: Path, at: str | None, plot: Path | None) -> None:
    """Print the contents of a measurement and optionally draw it."""
    measurement = read_measurement(path)
    time = None if at is None else parse_instant("--at", at)
    say_measurement(measurement, time)
    finish(measurement.notes, (plot, figure(draw_measurement, measurement, time)))


def say_measurement(measurement: Measurement, time: float | None = None) -> None:
    """Print the contents of a measurement."""
    try:
        summary = measurement_summary(measurement, time)
    except ValueError as error:
        raise ValueError(f"--at: {error}") from None
    screen = current()
    screen.facts("measurement", _facts(measurement, summary))
    screen.values(raster_values(measurement.raster, measurement.times))
    attributes = {
        str(name): value
        for name, value in measurement.data.attrs.items()
        if not str(name).startswith(_SAID_APART) and name not in _IN_FACTS
    }
    show_attributes(attributes)


def _facts(measurement: Measurement, summary: MeasurementSummary) -> Iterator[tuple[str, str]]:
    data = measurement.data
    yield from where_and_when("pixels", measurement.raster, measurement.times)
    if "integration_time" in data.attrs:
        yield "integration time", microseconds(float(data.attrs["integration_time"]))
    if "lower_limit" in data.attrs:
        yield "lower range limit", f"{float(data.attrs['lower_limit']) - 273.15:.4g} °C"
    if {"netd", "netd_temperature"} <= set(data.attrs):
        netd, kelvins = (float(data.attrs[name]) for name in ("netd", "netd_temperature"))
        yield "NETD", f"{1e3 * netd:.3g} mK at {kelvins - 273.15:.4g} °C, half of the range filled"
    if {"band_lower", "band_upper"} <= set(data.attrs):
        band = measurement.band
        shape = "" if band.response is None else f", {_response_text(band)}"
        yield "band", f"{1e6 * band.lower:.4g} µm to {1e6 * band.upper:.4g} µm{shape}"
    if measurement.tool is not None:
        angles = measurement.tool.rake_angle, measurement.tool.clearance_angle
        rake, clearance = (f"{degrees(angle):.4g}°" for angle in angles)
        yield "tool", f"rake {rake}, clearance {clearance}"
    yield "radiance temperature", _celsius(summary.overall)
    yield f"at {microseconds(measurement.times[summary.index])}", _celsius(summary.now)
    if summary.uncertainty is None:
        yield "its calibration", "uncertainty not known"
    else:
        least, greatest = summary.uncertainty
        yield "its calibration", f"standard uncertainty {least:.2g} K to {greatest:.2g} K"
    yield "usable pixels", f"{100 * summary.usable:.4g} %"
    for flag, name in _FLAG_NAMES.items():
        if summary.fractions[flag]:
            yield name, f"{100 * summary.fractions[flag]:.3g} %"


def _response_text(band: Band) -> str:
    """Describe a response curve."""
    wavelengths = 1e6 * band.wavelengths
    values = np.asarray(band.response(band.wavelengths) if band.response else 1.0)
    mean, peak = np.average(wavelengths, weights=values), wavelengths[values.argmax()]
    return f"response with its mean at {mean:.4g} µm and its peak at {peak:.4g} µm"


def _celsius(kelvins: tuple[float, float, float] | None) -> str:
    if kelvins is None:
        return "none: no pixel is usable"
    least, median, greatest = (f"{value - 273.15:.1f} °C" for value in kelvins)
    return f"{least} to {greatest}, median {median}"
