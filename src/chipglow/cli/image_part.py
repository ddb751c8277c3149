"""A rectangular part of an image as text, such as ``20:90,10:70``.

Two ranges: across, then along the other axis, as in a file of regions. Plain numbers are columns
and rows of pixels from the upper left corner; lengths are positions x and y in the scene.
"""

from collections.abc import Callable
from typing import TypeVar

_Number = TypeVar("_Number")


def part_in_pixels(option: str, text: str | None) -> tuple[slice, slice]:
    """Return rows and columns of a text such as ``20:90,10:70``; all without a text.

    A limit that is left out, as in ``20:,:70``, is the border of the image.
    """
    if text is None:
        return slice(None), slice(None)

    def limit(number: str) -> int | None:
        return int(number) if number else None

    columns, rows = _ranges(option, text, limit, "columns and rows such as 20:90,10:70")
    return slice(*rows), slice(*columns)


def part_in_scene(option: str, text: str) -> tuple[float, float, float, float]:
    """Return left, bottom, right and top in m of a text such as ``-90um:-10um,20um:120um``."""
    from chipglow.quantities.units import POSITION

    expected = "x and y such as -90um:-10um,20um:120um"
    (left, right), (bottom, top) = _ranges(option, text, POSITION.parse, expected)
    if not (left < right and bottom < top):
        raise ValueError(f"{option}: {text!r}, expected ranges from the smaller to the larger")
    return left, bottom, right, top


def _ranges(
    option: str, text: str, number: Callable[[str], _Number], expected: str
) -> tuple[tuple[_Number, _Number], tuple[_Number, _Number]]:
    """Return the first and the last number of the two ranges of a text."""
    try:
        across, along = (part.split(":") for part in text.split(","))
        (first, last), (lower, upper) = across, along
        return (
            (number(first.strip()), number(last.strip())),
            (number(lower.strip()), number(upper.strip())),
        )
    except ValueError:
        raise ValueError(f"{option}: {text!r}, expected {expected}") from None
