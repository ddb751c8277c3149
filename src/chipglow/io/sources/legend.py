"""Legends in a picture: a bar whose colours run along one axis."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.colour_scale import ColourScale, lab
from chipglow.io.sources.source import SourceError

Box = tuple[int, int, int, int]
"""Left, top, right and bottom edge in whole pixels from the upper left corner of a picture."""

_SHORTEST: Final = 24
_NARROWEST: Final = 4
_EDGE: Final = 8.0  # differences in CIE L*a*b*
_FLAT: Final = 6.0
_PATH: Final = 60.0
_DISTINCT: Final = 5
_BLUR: Final = 3
_MOST_EDGES: Final = 400


def find_legend(picture: NDArray[np.uint8]) -> Box | None:
    """Where a legend is: the longest bar of one colour across and many along.

    Parameters
    ----------
    picture : ndarray
        Red, green and blue, shape (y, x, 3), uint8.

    Returns
    -------
    tuple of int or None
        Its edges in pixels; None if there is none.
    """
    upright = _upright_bars(picture)
    lying = ((top, left, bottom, right) for left, top, right, bottom in _upright_bars(
        picture.transpose(1, 0, 2)
    ))  # fmt: skip
    return max([*upright, *lying], key=_length_then_narrow, default=None)


def legend_pixels(picture: NDArray[np.uint8], box: Box) -> NDArray[np.uint8]:
    """Colours along a legend, from its bottom or left end, shape (n, 3).

    The median across its middle; where its ends are blurred, the colour next to them.

    Raises
    ------
    SourceError
        If the box is not in the picture.
    """
    left, top, right, bottom = box
    rows, columns = picture.shape[:2]
    if not (0 <= left < right <= columns and 0 <= top < bottom <= rows):
        raise SourceError(
            f"legend: box {box} does not lie in the picture of {columns} x {rows} pixels, expected "
            "left, top, right, bottom"
        )
    bar = picture[top:bottom, left:right]
    bar = bar[::-1] if bottom - top >= right - left else bar.transpose(1, 0, 2)
    if len(bar) < 2:
        raise SourceError(f"legend: box {box} is {len(bar)} pixels long, expected 2 or more")
    return _unblurred(np.median(_middle(bar), axis=1).astype(np.uint8))


def _length_then_narrow(box: Box) -> tuple[int, int]:
    width, height = box[2] - box[0], box[3] - box[1]
    # An outline moves the ends by a pixel or two; the bar within it is the narrower one.
    return max(width, height) // 8, -min(width, height)


def _upright_bars(picture: NDArray[np.uint8]) -> Iterator[Box]:
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
    """Long vertical edges: the column right of each, first row, and row after the last."""
    edge = np.linalg.norm(np.diff(labs, axis=1), axis=2) > _EDGE
    shortest = _shortest(labs)
    result = []
    for column in np.flatnonzero(edge.sum(axis=0) >= shortest)[:_MOST_EDGES]:
        padded = np.concatenate([[False], edge[:, column], [False]])
        changes = np.flatnonzero(padded[1:] != padded[:-1])
        for first, last in changes.reshape(-1, 2):
            if last - first >= shortest:
                result.append((int(column) + 1, int(first), int(last)))
    return result[:_MOST_EDGES]


def _shortest(picture: NDArray[Any]) -> int:
    return max(_SHORTEST, len(picture) // 8)


def _is_legend(picture: NDArray[np.uint8], labs: NDArray[np.float64], box: Box) -> bool:
    left, top, right, bottom = box
    inner = _middle(labs[top:bottom, left:right])
    along = np.median(inner, axis=1)
    apart = np.linalg.norm(inner - along[:, None], axis=2).max(axis=1)
    if (apart > _FLAT).mean() > 0.05:
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
    """The half of a bar that is far from its long edges."""
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
