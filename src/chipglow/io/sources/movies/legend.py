"""Legends in a picture: a bar whose colours run along one axis."""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.movies.colour_scale import ColourScale, Picture, lab_of_bytes
from chipglow.io.sources.movies.overlays import (
    MARK_TOLERANCE,
    Box,
    box_mask,
    check_box,
    dark_lines,
    plain_colours,
)
from chipglow.io.sources.source import SourceError

_EDGE: Final = 8.0  # a difference in CIE L*a*b*

_BLUR: Final = 3
"""Pixels at an end of a legend whose colours are mixed with those outside by codecs."""

_AROUND: Final = 6
"""Pixels around a legend that are left out with it: outline, ticks and their blur."""

_MOST_PIXELS: Final = 3000
"""Pixels compared with a scale: enough for a fraction with a standard error of 1 %."""

_REACH: Final = 5
"""Pixels before and behind an end that are examined: fewer than the narrowest band has."""

_LARGEST_OFFSET: Final = 3.5
"""Pixels by which the colours may end beside the end of the box: codecs blur it by up to 3."""

_LEAST_UNCERTAINTY: Final = 1.0
"""Standard uncertainty of an end in pixels: an outline may have the colour of the end."""

_DRIFT: Final = 0.3
"""Largest change of a page's colour, as a fraction of that of the legend over as many pixels."""

_NEAR, _FAR = 4.0, 24.0
"""Differences from the page, in 8 bits, between which the colours of a scale run evenly."""

_SHORTEST: Final = 4 * _REACH
"""Pixels of the shortest legend, whose ends do not meet."""

LEAST_EXPLAINED: Final = 0.7
"""Fraction of a picture that must have the colours of its legend."""


def end_uncertainty(picture: Picture, box: Box) -> float:
    """Return the standard uncertainty of the ends of a legend's colours in a box, in pixels.

    Raises
    ------
    SourceError
        If the colours end more than 3 pixels inside or outside the box.
    """
    left, top, right, bottom = check_box("legend", box, *picture.shape[:2])
    upright = bottom - top >= right - left
    strip = picture[::-1, left:right] if upright else picture[top:bottom].transpose(1, 0, 2)
    first, last = (len(picture) - bottom, len(picture) - top) if upright else (left, right)
    along = np.median(_middle(strip), axis=1)
    names = ("lower", "upper") if upright else ("left", "right")
    return max(
        _uncertainty(along[:first][::-1], along[first:last], names[0], box),
        _uncertainty(along[last:], along[first:last][::-1], names[1], box),
    )


def _uncertainty(
    beyond: NDArray[np.float64], inside: NDArray[np.float64], name: str, box: Box
) -> float:
    """Return the uncertainty of an end, at which both arrays begin, shape (pixels, 3)."""
    if len(beyond) < _REACH:  # at the border of the picture nothing can be compared
        return _LEAST_UNCERTAINTY
    near = np.concatenate([beyond[:_REACH][::-1], inside[:_REACH]])
    jumps = np.flatnonzero(np.linalg.norm(np.diff(lab_of_bytes(near), axis=0), axis=1) > _EDGE)
    # An outline makes several jumps: the innermost is the legend's.
    offset = jumps[-1] + 1.0 - _REACH if jumps.size else _start_of_gradient(beyond, inside)
    if not abs(offset) <= _LARGEST_OFFSET:
        found = f"{abs(offset):.0f} pixels {'inside' if offset > 0 else 'outside'} it"
        raise SourceError(
            f"legend: at the {name} end of the box {list(box)} the colours end "
            f"{found if np.isfinite(offset) else 'elsewhere'}, expected the edges of the colours "
            "alone, or colours: the name of their map"
        )
    return float(max(abs(offset), _LEAST_UNCERTAINTY))


def _start_of_gradient(beyond: NDArray[np.float64], inside: NDArray[np.float64]) -> float:
    """Return where colours depart from the page's colour, which equals the legend's end colour.

    NaN if they are not constant outside, or constant inside as well.
    """
    compared = min(len(beyond), 2 * _REACH)
    drift, change = (np.abs(of[compared - 1] - of[0]).max() for of in (beyond, inside))
    if drift > _DRIFT * change:
        return np.nan
    page = np.median(beyond[_BLUR - 1 : _REACH], axis=0)
    apart = np.abs(np.concatenate([beyond[:_REACH][::-1], inside]) - page).max(axis=1)
    reached = np.flatnonzero(apart > _FAR)
    if not reached.size or reached[0] <= _REACH or apart[: _REACH - _BLUR + 1].max() > _NEAR:
        return np.nan
    rising = np.flatnonzero(apart[: reached[0]] > _NEAR)
    rising = np.append(rising, reached[0])
    if len(rising) < _BLUR:
        return float(rising[0] - _REACH)
    slope, start = np.polyfit(rising, apart[rising], 1)
    return float(-start / slope - _REACH + 0.5)


def explained(picture: Picture, box: Box, scale: ColourScale) -> float:
    """Return the fraction of a picture without legend and background in a scale's colours."""
    shown = ~(dark_lines(picture) | box_mask(picture.shape[:2], [box], _AROUND))
    labs = lab_of_bytes(picture[shown][:: max(1, int(shown.sum()) // _MOST_PIXELS)])
    for colour in plain_colours(picture):
        labs = labs[np.linalg.norm(labs - lab_of_bytes(colour), axis=1) > MARK_TOLERANCE]
    if not len(labs):
        return 0.0
    known = scale.labs
    if not scale.banded:
        known = np.concatenate([known, (known[1:] + known[:-1]) / 2])
    apart = np.linalg.norm(labs[:, None] - known[None], axis=2).min(axis=1)
    return float((apart < MARK_TOLERANCE).mean())


def legend_pixels(picture: Picture, box: Box) -> NDArray[np.uint8]:
    """Return medians of the colours along a legend, from its bottom or left end, shape (n, 3)."""
    return _unblurred(np.median(_bar(picture, box), axis=1).astype(np.uint8))


def legend_noise(picture: Picture, box: Box) -> float:
    """Return the standard deviation of colours of one value in a legend, in CIE L*a*b*."""
    bar = lab_of_bytes(_bar(picture, box))
    apart = np.linalg.norm(bar - np.median(bar, axis=1, keepdims=True), axis=2)
    return float(np.sqrt((apart**2).mean()))


def _bar(picture: Picture, box: Box) -> NDArray[np.uint8]:
    """Return the middle of a legend from its bottom or left end, shape (n, pixels across, 3)."""
    left, top, right, bottom = check_box("legend", box, *picture.shape[:2])
    bar = picture[top:bottom, left:right]
    bar = bar[::-1] if bottom - top >= right - left else bar.transpose(1, 0, 2)
    if len(bar) < _SHORTEST:
        raise SourceError(
            f"legend: box {box} is {len(bar)} pixels long, expected {_SHORTEST} or more"
        )
    return np.asarray(_middle(bar))


def _middle(bar: NDArray[Any]) -> NDArray[Any]:
    """Return the half of a bar that is far from its long edges."""
    quarter = bar.shape[1] // 4
    return bar[:, quarter : bar.shape[1] - quarter]


def _unblurred(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    steps = np.linalg.norm(np.diff(lab_of_bytes(colours), axis=0), axis=1)
    start = _after_jump(steps[:_BLUR])
    end = len(colours) - _after_jump(steps[::-1][:_BLUR])
    if end <= start:
        return colours
    result = colours.copy()
    result[:start], result[end:] = colours[start], colours[end - 1]
    return result


def _after_jump(steps: NDArray[np.float64]) -> int:
    jumps = np.flatnonzero(steps > _EDGE)
    return int(jumps[-1]) + 1 if jumps.size else 0
