"""Sentences that explain a difference, each from what the study measured."""

from collections.abc import Callable
from math import isfinite
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis import Distribution, Headline, ReferenceKind, Sensitivity, StudyResult
from chipglow.analysis.distribution import COVERAGE
from chipglow.laboratory.chip import Segmentation
from chipglow.quantities.format import quantity_text
from chipglow.report.page import Statement
from chipglow.report.paper import PAPER, PaperValue, stands_beside

ORDER_TEXT: Final = {
    "detector": "from pixel to pixel",
    "optics": "before the pixels integrate",
}

_OUT_OF_VIEW: Final = "In some draws the place is not in the image."

REFERENCE_TEXT: Final = {
    "maximum": "the greatest radiance temperature (emissivity included) in a pixel's square "
    "during the exposure",
    "mean": "the radiance temperature of the mean radiance over a pixel's square and the exposure",
    "centre": "the radiance temperature under a pixel's centre in the middle of the exposure",
    "true": "the greatest true temperature in a pixel's square during the exposure",
}


def error_definition(result: StudyResult) -> str:
    """What an error of this study is."""
    return definition_of(result.plan.reference)


def definition_of(reference: ReferenceKind) -> str:
    """What an error is with a reference, as a sentence."""
    return f"Errors are measured radiance temperature less {REFERENCE_TEXT[reference]}."


def answer(result: StudyResult) -> list[Statement]:
    """What came out, a sentence with its interval for each place."""
    plan = result.plan
    places = (
        (
            "rake",
            f"At the rake face ({plan.rake_surface}), half-way up the contact, the camera reads",
            PAPER.rake_error,
        ),
        (
            "band",
            f"At the centre of the shear band ({plan.band_surface}) it reads",
            PAPER.band_error,
        ),
        ("band_worst", "Where it is worst beside the band, it reads", PAPER.band_worst),
    )
    return [
        Statement(_sentence(result, begin, result.draws.headlines[name], paper), why(name))
        for name, begin, paper in places
        if name in result.draws.headlines
    ]


def why(name: str) -> str:
    """Id of what explains a headline error."""
    return f"why-{name}_error_degC"


def _sentence(result: StudyResult, begin: str, headline: Headline, paper: PaperValue) -> str:
    error, fraction = headline.error, headline.psf_fraction
    parts = [f"{begin} {error_text(error)}"]
    if fraction is not None and fraction.mean > 0:  # beside the band the blur may bring light
        parts.append(f"the point spread function makes {_mean_text(fraction, 100)} % of it")
    if stands_beside(result) and error.draws > 1:
        side = "outside" if error.differs_from(paper.value) else "inside"
        parts.append(f"the paper's {-paper.value:.0f} °C lies {side} the interval")
    return "; ".join(parts) + "."


def error_text(error: Distribution) -> str:
    """How much too little or too much is read, with its interval."""
    scale, way = (-1.0, "little") if error.mean < 0 else (1.0, "much")
    text = f"{_mean_text(error, scale)} °C too {way} radiance temperature"
    if error.draws < 2:
        return f"{text} (a single draw)"
    ends = sorted(scale * end for end in error.interval)
    if not all(map(isfinite, ends)):
        return f"{text} ({error.draws} draws)"
    low, high = (quantity_text(end, "°C", 0) for end in ends)
    unknown = ", so its sign is not known" if ends[0] < 0 < ends[1] else ""
    percent = f"{COVERAGE * 100:.0f} %"
    return f"{text} ({error.draws} draws; {percent} interval {low} to {high}{unknown})"


def answer_note(draws: Distribution | None) -> str:
    """How the numbers of the answer are to be read."""
    if draws is None or draws.draws < 2:
        return ""
    *first, last = draws.causes
    return (
        f"± is the standard deviation over all draws of {', '.join(first)} and {last}; the "
        f"interval is where one more draw lies with {COVERAGE * 100:.0f} % probability."
    )


def _mean_text(draws: Distribution, scale: float) -> str:
    """Mean and standard deviation; the mean alone of a single draw."""
    mean = quantity_text(scale * draws.mean, "", 0)
    if draws.draws < 2:
        return mean
    return f"{mean} ± {abs(scale) * draws.standard_deviation:.0f}"


def rake_error(result: StudyResult) -> str:
    """What makes the error at the rake face."""
    headline, line = result.draws.headlines.get("rake"), result.draws.rake_line
    if headline is None:
        return _OUT_OF_VIEW
    pitch = result.camera.pitch
    return joined(
        "From one pixel inside the chip to one inside the tool the radiance temperature changes by "
        f"{_degrees(line.mean_change(pitch, -pitch))} in the mean over the draws.",
        _reach(result, lambda s: s.error("rake"), PAPER.rake_error.value, _degrees),
        _scatter(headline.error),
    )


def rake_fraction(result: StudyResult) -> str:
    """What makes the PSF's portion at the rake face."""
    return joined(
        _psf_text(result),
        _wings_text(result, "rake"),
        _reach(result, lambda s: s.psf_fraction("rake"), PAPER.rake_psf_fraction.value, _percent),
    )


def contact(result: StudyResult) -> str:
    """What the mean along the contact says."""
    low, high = result.rake.contact_range
    return (
        "The rake face crosses the pixels obliquely, so the mean over the contact holds all their "
        f"positions. In one draw the error runs from {_degrees(low)} to {_degrees(high)} along it."
    )


def band_error(result: StudyResult) -> str:
    """What makes the error at the centre of the shear band."""
    headline = result.draws.headlines.get("band")
    if headline is None:
        return _OUT_OF_VIEW
    return joined(
        _band_text(result),
        _reach(result, lambda s: s.error("band"), PAPER.band_error.value, _degrees),
        _scatter(headline.error),
    )


def band_fraction(result: StudyResult) -> str:
    """What makes the PSF's portion at the centre of the shear band."""
    width, psf = _band_width(result), result.camera.psf
    compared = ""
    if psf is not None and isfinite(width):
        compared = (
            f"The band's width of {_micrometres(width)} is {width / psf.fwhm:.1f} times the PSF's, "
            "and the PSF takes off the more, the narrower the band."
        )
    return joined(
        compared,
        _wings_text(result, "band"),
        _reach(result, lambda s: s.psf_fraction("band"), PAPER.band_psf_fraction.value, _percent),
    )


def band_worst(result: StudyResult) -> str:
    """What makes the error beside the shear band."""
    line, pitch = result.draws.band_line, result.camera.pitch
    sides = [
        float(np.mean(np.nanmin(line.case_1[..., side], axis=-1)))
        for side in (line.distance <= 0, line.distance >= 0)
    ]
    headline = result.draws.headlines.get("band_worst")
    return joined(
        f"In the mean over the draws {_degrees(sides[0])} on the workpiece's side and "
        f"{_degrees(sides[1])} on the chip's, within {_micrometres(result.plan.line_reach)} of the "
        "ridge.",
        f"The radiance temperature changes there by up to {_degrees(line.mean_steepest(pitch))} "
        f"over one pixel of {_micrometres(pitch)}.",
        _reach(result, lambda s: s.error("band_worst"), PAPER.band_worst.value, _degrees),
        _scatter(headline.error) if headline else "",
    )


def place(draws: Distribution, paper: float, unit: str) -> str:
    """Where the paper's figure lies among the draws, and whether it differs.

    Parameters
    ----------
    draws : Distribution
        Ours, in a unit that is printed.
    paper : float
        The paper's figure in the same unit.
    unit : str
        The unit.
    """
    if draws.draws < 2:
        return "A single draw: it does not say whether the paper's figure differs."
    low, high = (f"{end:.0f}".replace("-", "−") for end in draws.interval)
    below = draws.fraction_below(paper)
    where = (
        f"{below * 100:.0f} % of our {draws.draws} draws are lower than the paper's figure; with "
        f"{COVERAGE * 100:.0f} % probability one more draw lies between {low} and {high} {unit}"
    )
    if draws.differs_from(paper):
        return f"{where}: the paper's differs."
    return f"{where}: the paper's does not differ."


def period(result: StudyResult, segments: Segmentation) -> str:
    """How the segment period is found, and why the paper's is another."""
    if not isfinite(segments.period):
        return "The cutting force shows no period: the chip is not segmented regularly."
    uncertain = (
        f"with a standard uncertainty of {segments.period_uncertainty * 1e6:.1f} µs"
        if isfinite(segments.period_uncertainty)
        else "too few to say how uncertain"
    )
    correlated = segments.correlation_period * 1e6
    correlation = f"{correlated:.0f} µs" if isfinite(correlated) else "none"
    return beside(
        result,
        f"Mean of the intervals between {segments.segments} force peaks, {uncertain}; the "
        f"autocorrelation gives {correlation}.",
        "The camera has no part in it: the flow stress and its softening set the period, and the "
        "paper's simulation has other ones than ours.",
    )


def _band_width(result: StudyResult) -> float:
    """Mean width of the segments' bands in m; NaN where one has none."""
    return float(np.mean([segment.band_width for segment in result.segments]))


def _band_text(result: StudyResult) -> str:
    sweep = float(np.mean([segment.sweep for segment in result.segments]))
    many = len(result.segments) > 1
    moved = (
        f", and {'their' if many else 'its'} middle moves {_micrometres(sweep)} across itself "
        "during the exposure"
        if isfinite(sweep)
        else ""
    )
    subject = f"Our {len(result.segments)} bands are" if many else "Our band is"
    return (
        f"{subject} {_micrometres(_band_width(result))} wide (strain rate, full width at half "
        f"maximum){moved}."
    )


def _scatter(draws: Distribution) -> str:
    """Which cause makes the scatter, if one makes most of it."""
    if draws.draws < 2:
        return ""
    name, part = max(draws.parts.items(), key=lambda item: item[1].fraction)
    subject = {
        "segment": "which segment is looked at",
        "texture": "how the emissivity happens to vary",
        "pixel phase": "where the pixels lie",
    }.get(name, "several causes together")
    return f"The largest part of the scatter, {_percent(part.fraction)}, comes from {subject}."


def _psf_text(result: StudyResult) -> str:
    psf = result.camera.psf
    if psf is None:
        return "This camera has no PSF."
    return beside(
        result,
        f"Our PSF is {_micrometres(psf.fwhm)} wide at half maximum, applied "
        f"{ORDER_TEXT[result.camera.psf_order]}.",
        "The paper gives its own as a picture only.",
    )


def _wings_text(result: StudyResult, name: str) -> str:
    """What a Gaussian as wide at half maximum as the camera's PSF would make: the rest is wings."""
    psf, found, headline = result.camera.psf, _same_order(result), result.draws.headlines.get(name)
    fraction = headline.psf_fraction if headline else None
    if psf is None or fraction is None or not found.widths[0] <= psf.fwhm <= found.widths[-1]:
        return ""
    gaussian = float(np.interp(psf.fwhm, found.widths, found.psf_fraction(name)))
    if not isfinite(gaussian):
        return ""
    return (
        f"It makes {_percent(fraction.mean)} of the error, a Gaussian of the same width "
        f"{_percent(gaussian)}: what it does beyond its half maximum counts too."
    )


def _same_order(result: StudyResult) -> Sensitivity:
    """The sensitivity for the camera's own order of PSF and pixels."""
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
    if not stands_beside(result):
        return f"{span}."
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


def beside(result: StudyResult, text: str, of_paper: str) -> str:
    """A text, and what is said of the paper where the study is beside it."""
    return f"{text} {of_paper}" if stands_beside(result) else text


def joined(*sentences: str) -> str:
    """Sentences one after the other, without those that are empty."""
    return " ".join(sentence for sentence in sentences if sentence)


def _degrees(value: float) -> str:
    return f"{value:.0f} °C".replace("-", "−") if isfinite(value) else "an unknown amount"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %".replace("-", "−") if isfinite(value) else "unknown"


def _micrometres(value: float) -> str:
    return f"{value * 1e6:.3g} µm" if isfinite(value) else "of unknown length"
