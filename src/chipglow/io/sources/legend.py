"""Legends in a picture: a bar whose colours run along one axis."""

from collections.abc import Iterator
from itertools import compress
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing

from chipglow.io.sources.colour_scale import ColourScale, Picture, lab
from chipglow.io.sources.overlays import (
    MARK_TOLERANCE,
    Box,
    box_mask,
    check_box,
    dark_lines,
    plain_colours,
)
from chipglow.io.sources.source import SourceError

_SHORTEST: Final = 24
_NARROWEST: Final = 4
_EDGE: Final = 8.0  # differences in CIE L*a*b*
_END: Final = 16.0
_USUAL: Final = 1.5
_FLAT: Final = 6.0
_UNEVEN: Final = 0.15
_PATH: Final = 60.0
_DISTINCT: Final = 5
_BLUR: Final = 3
_MOST_EDGES: Final = 400
_MOST_BOXES: Final = 40
_GAP: Final = 5
_BEYOND: Final = 4
_AROUND: Final = 6
_MOST_PIXELS: Final = 3000

LEAST_EXPLAINED: Final = 0.7
"""Fraction of a picture that must have the colours of its legend."""


def find_legend(picture: Picture) -> Box | None:
    """Return the longest bar of one colour across and many along; None without one."""
    upright = _upright_bars(picture)
    lying = ((top, left, bottom, right) for left, top, right, bottom in _upright_bars(
        picture.transpose(1, 0, 2)
    ))  # fmt: skip
    boxes = sorted([*upright, *lying], key=_length_then_narrow, reverse=True)[:_MOST_BOXES]
    best = max(boxes, key=lambda box: _worth(picture, box), default=None)
    if best is None:
        return None
    # An outline moves the ends by a pixel or two; the bar within it is the smaller one.
    inward = np.subtract(boxes, best) * (1, 1, -1, -1)
    within = compress(boxes, np.all((inward >= 0) & (inward <= _BLUR), axis=1))
    return _extended(picture, min(within, key=lambda box: (box[2] - box[0]) * (box[3] - box[1])))


def is_cut(picture: Picture, box: Box) -> bool:
    """Return whether the colours continue beyond an end of a legend."""
    along, first, last = _along(picture, box)
    return _goes_on(along[last:], along[first:last][::-1]) or _goes_on(
        along[:first][::-1], along[first:last]
    )


def _goes_on(beyond: NDArray[np.float64], inside: NDArray[np.float64]) -> bool:
    """Return whether colours from an end outward change no more than those from it inward."""
    if len(beyond) < _BEYOND:
        return False
    jump = np.linalg.norm(beyond[:_BEYOND] - inside[0], axis=1).max()
    run = inside[_BLUR : _BLUR + _BEYOND + 1]
    usual = np.linalg.norm(run - run[0], axis=1).max()
    return bool(jump < max(_END, _USUAL * usual))


def _along(picture: Picture, box: Box) -> tuple[NDArray[np.float64], int, int]:
    """Return colours along the middle of a bar to the picture's edges, and where the bar ends."""
    left, top, right, bottom = box
    upright = bottom - top >= right - left
    strip = picture[:, left:right] if upright else picture[top:bottom].transpose(1, 0, 2)
    along = np.median(_middle(lab(strip / 255.0)), axis=1)
    return (along, top, bottom) if upright else (along, left, right)


def _extended(picture: Picture, box: Box) -> Box:
    """Extend a bar to where its colours do not run on: its sides may be too faint to be seen."""
    along, first, last = _along(picture, box)
    steps = np.linalg.norm(np.diff(along, axis=0), axis=1)
    if steps[first : last - 1].max() > _END:
        return box
    jumps = np.flatnonzero(steps > _END)
    before, after = jumps[jumps < first], jumps[jumps >= last - 1]
    first = int(before[-1]) + 1 if before.size else 0
    last = int(after[0]) + 1 if after.size else len(along)
    left, top, right, bottom = box
    longer = (
        (left, first, right, last) if bottom - top >= right - left else (first, top, last, bottom)
    )
    return longer if last - first <= 2 * max(right - left, bottom - top) else box


def explained(picture: Picture, box: Box, scale: ColourScale) -> float:
    """Return the fraction of a picture without legend and background in a scale's colours."""
    shown = ~(dark_lines(picture) | box_mask(picture.shape[:2], [box], _AROUND))
    labs = lab(picture[shown][:: max(1, int(shown.sum()) // _MOST_PIXELS)] / 255.0)
    for colour in plain_colours(picture):
        labs = labs[np.linalg.norm(labs - lab(np.array(colour) / 255.0), axis=1) > MARK_TOLERANCE]
    if not len(labs):
        return 0.0
    known = scale.labs
    if not scale.banded:
        known = np.concatenate([known, (known[1:] + known[:-1]) / 2])
    apart = np.linalg.norm(labs[:, None] - known[None], axis=2).min(axis=1)
    return float((apart < MARK_TOLERANCE).mean())


def _worth(picture: Picture, box: Box) -> tuple[float, int, int]:
    """Return how much of the picture a legend explains, in tenths; then `_length_then_narrow`."""
    scale = ColourScale.from_legend(legend_pixels(picture, box), (0.0, 1.0))
    return (round(10 * explained(picture, box, scale)), *_length_then_narrow(box))


def legend_pixels(picture: Picture, box: Box) -> NDArray[np.uint8]:
    """Return medians of the colours along a legend, from its bottom or left end, shape (n, 3)."""
    left, top, right, bottom = check_box("legend", box, *picture.shape[:2])
    bar = picture[top:bottom, left:right]
    bar = bar[::-1] if bottom - top >= right - left else bar.transpose(1, 0, 2)
    if len(bar) < 2:
        raise SourceError(f"legend: box {box} is {len(bar)} pixels long, expected 2 or more")
    return _unblurred(np.median(_middle(bar), axis=1).astype(np.uint8))


def _length_then_narrow(box: Box) -> tuple[int, int]:
    width, height = box[2] - box[0], box[3] - box[1]
    return max(width, height) // 8, -min(width, height)


def _upright_bars(picture: Picture) -> Iterator[Box]:
    labs = lab(picture / 255.0)
    runs = _edges(labs)
    for index, (first, first_top, first_bottom) in enumerate(runs):
        for second, second_top, second_bottom in runs[index + 1 :]:
            top, bottom = max(first_top, second_top), min(first_bottom, second_bottom)
            width = second - first
            if width < _NARROWEST or bottom - top < max(_shortest(picture), 2 * width):
                continue
            if _is_legend(picture, labs, (first, top, second, bottom)):
                yield first, top, second, bottom


def _edges(labs: NDArray[np.float64]) -> list[tuple[int, int, int]]:
    """Return long vertical edges: the column right of each, first row, and row after the last."""
    edge = np.linalg.norm(np.diff(labs, axis=1), axis=2) > _EDGE
    # A codec, or a colour of the bar like the one beside it, leaves gaps.
    edge = np.asarray(binary_closing(np.pad(edge, ((_GAP, _GAP), (0, 0))), np.ones((_GAP, 1))))
    edge = edge[_GAP:-_GAP]
    shortest = _shortest(labs)
    result = []
    for column in np.flatnonzero(edge.sum(axis=0) >= shortest)[:_MOST_EDGES]:
        changes = np.flatnonzero(np.diff(edge[:, column], prepend=False, append=False))
        for first, last in changes.reshape(-1, 2):
            if last - first >= shortest:
                result.append((int(column) + 1, int(first), int(last)))
    return result[:_MOST_EDGES]


def _shortest(picture: NDArray[Any]) -> int:
    return max(_SHORTEST, len(picture) // 8)


def _is_legend(picture: Picture, labs: NDArray[np.float64], box: Box) -> bool:
    left, top, right, bottom = box
    inner = _middle(labs[top:bottom, left:right])
    along = np.median(inner, axis=1)
    apart = np.linalg.norm(inner - along[:, None], axis=2).max(axis=1)
    if (apart > _FLAT).mean() > _UNEVEN:
        return False
    path = np.linalg.norm(np.diff(along, axis=0), axis=1).sum()
    if path < _PATH or len(np.unique(np.round(along / 10), axis=0)) < _DISTINCT:
        return False
    try:
        ColourScale.from_legend(legend_pixels(picture, box), (0.0, 1.0))
    except SourceError:
        return False
    return True


def _middle(bar: NDArray[Any]) -> NDArray[Any]:
    """Return the half of a bar that is far from its long edges."""
    quarter = bar.shape[1] // 4
    return bar[:, quarter : bar.shape[1] - quarter]


def _unblurred(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    steps = np.linalg.norm(np.diff(lab(colours / 255.0), axis=0), axis=1)
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
