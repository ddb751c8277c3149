"""Contents of a picture of a field: values, background, tool, and lines and text over them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import grey_closing, maximum_filter, minimum_filter

from chipglow.io.nearest import fill
from chipglow.io.sources.movies.colour_scale import ColourScale, Picture, lab_of_bytes
from chipglow.io.sources.source import SourceError
from chipglow.scene import FILLED, Material
from chipglow.scene.regions import in_polygon

Box = tuple[int, int, int, int]
"""Left, top, right and bottom edge in whole pixels from the upper left corner of a picture."""

Colour = tuple[int, int, int]
"""Red, green and blue of 0 to 255."""


class Legend(NamedTuple):
    """Place of a legend in a picture."""

    box: Box
    """Edges of its colours as stated."""
    uncertainty: float
    """Standard uncertainty of their ends in pixels."""


MARK_TOLERANCE: Final = 10.0
"""Tolerance of the colours of background and tool, in CIE L*a*b*."""

_GREY: Final = 10.0
"""Chroma in CIE L*a*b* below which a colour is grey."""

_FEWEST_FILLED: Final = 0.01
"""Fraction of filled pixels below which the error of filling is neglected."""

_SHIFTS: Final = ((2, 3), (5, -4), (-3, 6))
"""Displacements down and right, in pixels, at which lines are tried elsewhere."""

_LUMA: Final = np.array([0.299, 0.587, 0.114])
"""Weights of red, green and blue in the brightness (ITU-R BT.601)."""

_VALLEY: Final = 0.2
"""Depth of a dark line as a fraction of the brightness around it."""

_NOISE: Final = 8.0
"""Smallest depth of a dark line in 8-bit brightness: more than the noise of codecs."""

_ONE_COLOUR: Final = 3.0
"""Root mean square distance in CIE L*a*b* up to which pixels have one colour."""

_MESH_SHARE: Final = 0.03
"""Fraction of dark pixels of a picture above which a mesh is drawn."""

_BORDER_SHARE: Final = 0.1
"""Smallest fraction of the border of a picture that a background covers."""

_COARSE: Final = 16
"""Width in 8-bit levels of the classes in which colours of the border are counted."""


@dataclass(frozen=True)
class FieldPicture:
    """Picture of a field, read; arrays of shape (y, x)."""

    values: NDArray[np.float32]
    """Values in SI units; NaN where they are unknown."""
    material: NDArray[np.uint8]
    """`chipglow.scene.Material` of each pixel."""
    quality: NDArray[np.uint8]
    """See `chipglow.scene.QUALITY`."""
    seen: NDArray[np.bool_]
    """Whether the value belongs to the pixel's colour."""
    distance: NDArray[np.float32]
    """Distance from the scale in CIE L*a*b*."""


@dataclass(frozen=True, eq=False)
class FieldReader:
    """Reader of pictures of a field."""

    scale: ColourScale
    background: Sequence[Colour]
    """Colours that show nothing."""
    tool_colour: Colour | None
    """Colour of a tool that shows no values."""
    tool: NDArray[np.bool_]
    """Position of the tool, shape (y, x)."""
    covered: NDArray[np.bool_]
    """Where something else is drawn, shape (y, x)."""
    limit: float
    """Distance from the scale in CIE L*a*b* beyond which a colour is a line or text."""
    legend: Legend | None = None
    """Legend from which the scale was read."""

    def __post_init__(self) -> None:
        for name, colours in (("background", self.background), ("tool_colour", self._tools)):
            for colour in colours:
                value, apart = place_of(self.scale, colour)
                if apart < MARK_TOLERANCE:
                    raise SourceError(
                        f"{name}: {colour} is also the colour of {value:.5g}; set a colour "
                        f"{MARK_TOLERANCE:g} or more from the scale"
                    )

    def read(self, picture: Picture) -> FieldPicture:
        """Return a picture's contents; pixels of lines and text take those of the nearest pixel."""
        values, distance = self.scale.invert(picture)
        void, tool = self._marked(picture, distance)
        lines = ((distance > self.limit) | dark_lines(picture)) & ~void & ~tool
        # Drawings over a field shade into the pixels around.
        drawn = maximum_filter(lines.view(np.uint8), 3).view(np.bool_) | self.covered
        seen = ~(drawn | void | tool)
        material = np.full(values.shape, Material.WORKPIECE, np.uint8)
        material[void], material[tool] = Material.VOID, Material.TOOL
        known = (seen | void | tool) & ~self.covered & ~self.tool
        fill(material, known, ~known & ~self.tool)
        material[self.tool] = Material.TOOL
        quality = np.minimum(np.round(distance), FILLED - 1).astype(np.uint8)
        values[~seen] = np.nan
        for part in (material == Material.WORKPIECE, material == Material.TOOL):
            fill(values, seen & part, part & ~seen)
        quality[~seen & (material != Material.VOID)] = FILLED
        quality[material == Material.VOID] = 0
        values[material == Material.VOID] = np.nan
        return FieldPicture(values, material, quality, seen, distance)

    def error_of_filling(self, read: FieldPicture) -> float:
        """Return the error of values under lines, a root mean square over all that is shown.

        It is tried on pixels that show values, as if the lines were drawn elsewhere.
        """
        shown = read.material == Material.WORKPIECE
        filled = shown & ~read.seen & ~self.covered
        if filled.sum() < _FEWEST_FILLED * shown.sum():
            return 0.0
        errors = []
        for down, across in _SHIFTS:
            tried = np.roll(filled, (down, across), (0, 1)) & read.seen & shown
            values = np.where(tried, np.nan, read.values)
            fill(values, read.seen & shown & ~tried, tried)
            errors.append(values[tried] - read.values[tried])
        error = np.concatenate(errors)
        fraction = filled.sum() / shown.sum()
        return float(np.sqrt(fraction * np.nanmean(error**2))) if error.size else 0.0

    @property
    def _tools(self) -> tuple[Colour, ...]:
        return () if self.tool_colour is None else (self.tool_colour,)

    @cached_property
    def _marks(self) -> ColourScale | None:
        """Colours of background and tool as a scale of their numbers."""
        colours = [*self.background, *self._tools]
        if not colours:
            return None
        return ColourScale(
            np.arange(len(colours), dtype=np.float64), np.array(colours) / 255, banded=True
        )

    def _marked(
        self, picture: Picture, distance: NDArray[np.float32]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return pixels of the background and of the tool; lines in their colours are neither."""
        if self._marks is None:
            nothing = np.zeros(distance.shape, np.bool_)
            return nothing, nothing
        number, apart = self._marks.invert(picture)
        marked = (apart < MARK_TOLERANCE) & (apart < distance)
        void = _without_lines(marked & (number < len(self.background)))
        return void, _without_lines(marked & (number >= len(self.background)))


def dark_lines(picture: Picture) -> NDArray[np.bool_]:
    """Return pixels of dark lines up to 2 wide, if they are so many that a mesh is drawn.

    The colours of black lines may be of the scale, and a codec mixes them with those beside them.
    """
    light = picture @ _LUMA
    # A closing over 5 pixels fills lines up to 2 wide and their blur.
    around = grey_closing(light, 5)
    lines = around - light > np.maximum(_VALLEY * around, _NOISE)
    return lines if lines.mean() > _MESH_SHARE else np.zeros_like(lines)


def find_background(
    picture: Picture, scale: ColourScale
) -> tuple[tuple[Colour, ...], tuple[Colour, ...]]:
    """Return colours of the border that are not of the scale, and greys of both."""
    found: list[Colour] = []
    refused: list[Colour] = []
    for colour in plain_colours(picture):
        if place_of(scale, colour)[1] >= MARK_TOLERANCE:
            found.append(colour)
        elif np.hypot(*lab_of_bytes(colour)[1:]) < _GREY:
            refused.append(colour)
    return tuple(found), tuple(refused)


def plain_colours(picture: Picture) -> tuple[Colour, ...]:
    """Return colours that cover a part of the border, not as lines, the most common first."""
    border = _border(picture)
    rest = border
    found: list[Colour] = []
    while len(rest) >= _BORDER_SHARE * len(border):
        _, group, counts = np.unique(
            rest // _COARSE, axis=0, return_inverse=True, return_counts=True
        )
        if counts.max() < _BORDER_SHARE * len(border) / 2:
            break
        middle = np.median(rest[group.ravel() == counts.argmax()], axis=0).astype(int).tolist()
        colour = (middle[0], middle[1], middle[2])
        like = _like(rest[None], colour)[0]
        wide = _border(_without_lines(_like(picture, colour))).mean() >= _BORDER_SHARE
        if wide and _is_plain(rest[like], colour):
            found.append(colour)
        rest = rest[~like]
    return tuple(found)


def _is_plain(pixels: NDArray[np.uint8], colour: Colour) -> bool:
    """Return whether pixels have one colour, or a range of greys."""
    place = lab_of_bytes(colour)
    apart = np.linalg.norm(lab_of_bytes(pixels) - place, axis=1)
    return bool(np.hypot(*place[1:]) < _GREY or np.sqrt((apart**2).mean()) < _ONE_COLOUR)


def check_box(name: str, box: Box, rows: int, columns: int) -> Box:
    """Return a box, which must lie in a picture."""
    left, top, right, bottom = box
    if not (0 <= left < right <= columns and 0 <= top < bottom <= rows):
        raise SourceError(
            f"{name}: box {box} does not lie in the picture of {columns} x {rows} pixels, expected "
            "left, top, right, bottom"
        )
    return box


def box_mask(shape: tuple[int, int], boxes: Sequence[Box], margin: int = 0) -> NDArray[np.bool_]:
    """Return the pixels within boxes, with a margin around them."""
    mask = np.zeros(shape, np.bool_)
    for left, top, right, bottom in boxes:
        rows = slice(max(top - margin, 0), max(bottom + margin, 0))
        mask[rows, max(left - margin, 0) : max(right + margin, 0)] = True
    return mask


def polygon_mask(
    shape: tuple[int, int], corners: Sequence[tuple[float, float]]
) -> NDArray[np.bool_]:
    """Return pixels whose centre is within a polygon; two corners are opposite ones of a box."""
    if not corners:
        return np.zeros(shape, np.bool_)
    if len(corners) == 2:
        (left, top), (right, bottom) = corners
        corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    rows, columns = np.mgrid[: shape[0], : shape[1]] + 0.5
    return in_polygon(corners, columns, rows)


def _border(picture: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([picture[0], picture[-1], picture[1:-1, 0], picture[1:-1, -1]])


def _like(picture: Picture, colour: Colour) -> NDArray[np.bool_]:
    apart = lab_of_bytes(picture) - lab_of_bytes(colour)
    return np.asarray(np.linalg.norm(apart, axis=-1) < MARK_TOLERANCE)


def place_of(scale: ColourScale, colour: Colour) -> tuple[float, float]:
    """Return the value of the nearest place of a scale, and its distance."""
    value, apart = scale.invert(np.array([[colour]], np.uint8))
    return float(value[0, 0]), float(apart[0, 0])


def _without_lines(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Remove what is less than 3 pixels wide."""
    wide = minimum_filter(mask.view(np.uint8), 3)
    # At the border of the picture the mirrored pixels would let it grow.
    return np.asarray(maximum_filter(wide, 3)).view(np.bool_) & mask
