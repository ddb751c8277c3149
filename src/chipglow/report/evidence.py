"""Sentences that explain a difference, each from what the study measured."""

from collections.abc import Callable
from math import isfinite
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.lines import Line, sample
from chipglow.analysis.paper import PAPER, StudyResult
from chipglow.analysis.segmentation import Segmentation
from chipglow.analysis.sensitivity import Sensitivity

ORDER_TEXT: Final = {
    "sensor": "from sensor to sensor, as in the paper",
    "optics": "before the sensors integrate",
}

REFERENCE_TEXT: Final = {
    "maximum": "the greatest radiance temperature (emissivity included) in a sensor's square "
    "during the exposure",
    "mean": "the radiance temperature of the mean radiance over a sensor's square and the exposure",
    "centre": "the radiance temperature under a sensor's centre in the middle of the exposure",
    "true": "the greatest true temperature in a sensor's square during the exposure",
}


def error_definition(result: StudyResult) -> str:
    """What an error of this study is."""
    return f"Errors are measured radiance temperature less {REFERENCE_TEXT[result.plan.reference]}."


def rake_error(result: StudyResult) -> str:
    """Why the error at the rake face differs."""
    rake, surface = result.rake, result.surfaces[result.plan.rake_surface]
    low, high = rake.error_range
    pitch = result.camera.pitch
    ends = sample(surface.scene_temperature, result.raster, rake.line.points)
    distance = rake.line.distance
    step = np.interp(pitch, distance, ends) - np.interp(-pitch, distance, ends)
    return _join(
        f"From one sensor inside the chip to one inside the tool the radiance temperature changes "
        f"by {_degrees(-step)}.",
        f"Without PSF the error is {_degrees(rake.error - rake.psf_error)}, of which motion during "
        f"the exposure alone makes {_degrees(surface.rake_motion)}: the rest is size of source.",
        _reach(result, lambda s: s.rake_error, PAPER.rake_error.value, _degrees),
        f"The face crosses the sensors aslant, so along the contact the error runs from "
        f"{_degrees(low)} to {_degrees(high)}, {_degrees(rake.mean_error)} in the mean.",
    )


def rake_share(result: StudyResult) -> str:
    """Why the PSF's share at the rake face differs."""
    return _join(
        _psf_text(result),
        _wings_text(result, lambda s: s.rake_share, result.rake.psf_share),
        _reach(result, lambda s: s.rake_share, PAPER.rake_psf_share.value, _percent),
        f"Of the mean error along the contact it is {_percent(result.rake.mean_psf_share)}.",
    )


def band_error(result: StudyResult) -> str:
    """Why the error at the centre of the shear band differs."""
    band, surface = result.band_errors, result.surfaces[result.plan.band_surface]
    return _join(
        _band_text(result),
        f"Without PSF the error is {_degrees(band.error - band.psf_error)}, of which motion during "
        f"the exposure alone makes {_degrees(surface.band_motion)}.",
        _reach(result, lambda s: s.band_error, PAPER.band_error.value, _degrees),
    )


def band_share(result: StudyResult) -> str:
    """Why the PSF's share at the centre of the shear band differs."""
    band = result.momentary_band or result.band
    psf = result.camera.psf
    compared = ""
    if psf is not None and isfinite(band.width):
        compared = (
            f"The band's width of {_micrometres(band.width)} is "
            f"{band.width / psf.fwhm:.1f} times the PSF's, and the PSF takes off the more, the "
            "narrower the band."
        )
    return _join(
        compared,
        _wings_text(result, lambda s: s.band_share, result.band_errors.psf_share),
        _reach(result, lambda s: s.band_share, PAPER.band_psf_share.value, _percent),
    )


def band_worst(result: StudyResult) -> str:
    """Why the error beside the shear band differs."""
    band, surface = result.band_errors, result.surfaces[result.plan.band_surface]
    workpiece_side, chip_side = band.beside
    steepest = _steepest(
        band.line, sample(surface.scene_temperature, result.raster, band.line.points), result
    )
    return _join(
        f"{_degrees(workpiece_side)} on the workpiece's side and {_degrees(chip_side)} on the "
        f"chip's, within {_micrometres(result.plan.line_reach)} of the ridge.",
        f"The radiance temperature changes there by up to {_degrees(steepest)} over one sensor of "
        f"{_micrometres(result.camera.pitch)}.",
        _reach(result, lambda s: s.band_worst, PAPER.band_worst.value, _degrees),
    )


def period(segments: Segmentation) -> str:
    """Why the segment period differs."""
    if not isfinite(segments.period):
        return "The cutting force shows no period: the chip is not segmented regularly."
    uncertain = (
        f"with a standard uncertainty of {segments.period_uncertainty * 1e6:.1f} µs"
        if isfinite(segments.period_uncertainty)
        else "too few to say how uncertain"
    )
    return (
        f"Mean of the intervals between {segments.segments} force peaks, {uncertain}; the "
        f"autocorrelation gives {segments.correlation_period * 1e6:.0f} µs. The camera has no part "
        "in it: the flow stress and its softening set the period, and the paper's simulation has "
        "other ones than ours."
    )


def _band_text(result: StudyResult) -> str:
    band = result.momentary_band or result.band
    moved = (
        f", and its middle moves {_micrometres(result.sweep)} across itself during the exposure"
        if isfinite(result.sweep)
        else ""
    )
    return (
        f"Our band is {_micrometres(band.width)} wide (strain rate, full width at half maximum)"
        f"{moved}."
    )


def _psf_text(result: StudyResult) -> str:
    psf = result.camera.psf
    if psf is None:
        return "This camera has no PSF."
    return (
        f"Our PSF is {_micrometres(psf.fwhm)} wide at half maximum, applied "
        f"{ORDER_TEXT[result.camera.psf_order]}; the paper gives its own as a picture only."
    )


def _wings_text(
    result: StudyResult, values: Callable[[Sensitivity], NDArray[np.float64]], ours: float
) -> str:
    """What a Gaussian as wide at half maximum as the camera's PSF would make: the rest is wings."""
    psf, found = result.camera.psf, _same_order(result)
    if psf is None or not found.widths[0] <= psf.fwhm <= found.widths[-1]:
        return ""
    gaussian = float(np.interp(psf.fwhm, found.widths, values(found)))
    if not (isfinite(ours) and isfinite(gaussian)):
        return ""
    return (
        f"It makes {_percent(ours)} of the error, a Gaussian of the same width {_percent(gaussian)}"
        ": what it does beyond its half maximum counts too."
    )


def _same_order(result: StudyResult) -> Sensitivity:
    """The sensitivity for the camera's own order of PSF and sensors."""
    order = result.camera.psf_order
    return next(series for series in result.sensitivity if series.psf_order == order)


def _reach(
    result: StudyResult,
    values: Callable[[Sensitivity], NDArray[np.float64]],
    target: float,
    text: Callable[[float], str],
) -> str:
    """Which width of a Gaussian PSF gives the paper's figure."""
    found = _same_order(result)
    series, widths = values(found), found.widths
    if not np.isfinite(series).all():
        return ""
    span = (
        f"Gaussian PSFs of {widths[0] * 1e6:.0f} to {_micrometres(widths[-1])} give "
        f"{text(series[0])} to {text(series[-1])}"
    )
    width = crossing(widths, series, target)
    if width is None:
        return f"{span}, none of them the paper's {text(target)}."
    return f"{span}; the paper's {text(target)} is met at {_micrometres(width)}."


def crossing(
    widths: NDArray[np.float64], series: NDArray[np.float64], target: float
) -> float | None:
    """First width at which a series meets a value, by straight lines; None if it never does."""
    above = series >= target
    if series.size and series[0] == target:
        return float(widths[0])
    changes = np.flatnonzero(above[1:] != above[:-1])
    if changes.size == 0:
        return None
    i = int(changes[0])
    part = (target - series[i]) / (series[i + 1] - series[i])
    return float(widths[i] + part * (widths[i + 1] - widths[i]))


def _steepest(line: Line, values: NDArray[np.float64], result: StudyResult) -> float:
    """Greatest change over one sensor's pitch along a line."""
    ahead = np.interp(line.distance + result.camera.pitch, line.distance, values)
    return float(np.nanmax(np.abs(ahead - values)))


def _join(*sentences: str) -> str:
    return " ".join(sentence for sentence in sentences if sentence)


def _degrees(value: float) -> str:
    return f"{value:.0f} °C".replace("-", "−") if isfinite(value) else "an unknown amount"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %".replace("-", "−") if isfinite(value) else "unknown"


def _micrometres(value: float) -> str:
    return f"{value * 1e6:.3g} µm" if isfinite(value) else "of unknown length"
