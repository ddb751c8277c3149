"""Movies of fields with a colour scale: a source of scenes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import hypot, isfinite, sqrt
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.colour_scale import (
    ColourScale,
    ColourUncertainty,
    Picture,
    colour_uncertainty,
)
from chipglow.io.sources.conventions import Placement
from chipglow.io.sources.legend import (
    LEAST_EXPLAINED,
    explained,
    find_legend,
    is_cut,
    legend_pixels,
)
from chipglow.io.sources.moving_pictures import MovieIndex, index_movie, pictures
from chipglow.io.sources.overlays import (
    Box,
    Colour,
    FieldPicture,
    FieldReader,
    box_mask,
    find_background,
    polygon_mask,
)
from chipglow.io.sources.source import Source, SourceError, Survey, naming
from chipglow.quantities import Parameter, Part
from chipglow.scene import FIELD_UNITS, FILLED, Material, Raster, SampledFrame
from chipglow.scene.nearest import fill
from chipglow.scene.regrid import regrid, taps
from chipglow.text import Notes

MOVIE_FIELDS: Final = ("temperature", "plastic_strain", "plastic_strain_rate")
"""Fields that a movie can show; the first one given determines the material."""

Pixel = tuple[float, float]
"""Place in a picture: pixels right and down from its upper left corner."""

_LEGEND_MARGIN: Final = 3
_HALF: Final = 0.5
_EARLY: Final = 100
_ROUNDING: Final = 0.29


@dataclass(frozen=True)
class NamedMap:
    """Colour map that is known by its name, see `ColourScale.named`."""

    name: str
    """``rainbow`` or a map of matplotlib."""
    bands: int = 0
    """Number of bands; 0 for a map without steps."""

    def __post_init__(self) -> None:
        if not (self.bands == 0 or 2 <= self.bands <= 256):
            raise ValueError(f"bands: {self.bands!r}, expected 0 or 2 to 256")


@dataclass(frozen=True)
class FieldMovie:
    """Movie of one field."""

    path: Path
    values: tuple[float, float]
    """Values in SI units at the first and last colour of a map, or the ends of a legend.

    Those of a legend are at its bottom and top, or left and right.
    """
    colours: NamedMap | Box | None = None
    """Map of the colours, or the edges of a legend in the first picture, which is found if None."""

    def __post_init__(self) -> None:
        first, last = self.values
        if not (isfinite(first) and isfinite(last) and first != last):
            raise ValueError(f"values: {self.values!r}, expected two different finite numbers")


@dataclass(frozen=True)
class MovieSource(Source, Part):
    """Fields shown by movies, one movie for each field, by names of `MOVIE_FIELDS`.

    The movies have the same size and number of pictures. ``metre_per_pixel`` is the side of a
    pixel in m, ``frame_interval`` the time from picture to picture in s, by default that of
    playing. In the ``placement`` ``x`` is to the right in the picture and ``y`` up.
    """

    movies: Mapping[str, FieldMovie]
    metre_per_pixel: float
    origin: Annotated[
        Pixel,
        Parameter(
            "The tip of the tool, in pixels right and down from the upper left corner of the "
            "whole picture: 0.5, 0.5 is the middle of the first pixel."
        ),
    ] = (0.0, 0.0)
    crop: Annotated[
        Box | None,
        Parameter(
            "Left, top, right and bottom pixel of what shows the field, such as [0, 0, 600, 400]; "
            "none: all."
        ),
    ] = None
    frame_interval: float | None = None
    every: Annotated[int, Parameter("Take one picture of so many.", least=1)] = 1
    placement: Placement = field(default_factory=Placement)
    background: Annotated[
        tuple[Colour, ...] | None,
        Parameter(
            "Colours of where nothing is, such as [[255, 255, 255]]; none: looked for at the "
            "border."
        ),
    ] = None
    covered: Annotated[
        tuple[Box, ...],
        Parameter("Boxes where something else is drawn, such as text."),
    ] = ()
    overlay_limit: Annotated[
        float,
        Parameter(
            "Distance from the scale in CIE L*a*b* beyond which a colour is a line or text.",
            over=0.0,
        ),
    ] = 20.0
    tool_polygon: Annotated[
        tuple[Pixel, ...],
        Parameter("Corners of the tool in pixels; two are opposite corners of a box."),
    ] = ()
    tool_colour: Annotated[Colour | None, Parameter("Colour of a tool that shows no values.")] = (
        None
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        unknown = sorted(set(self.movies) - set(MOVIE_FIELDS))
        if unknown or not self.movies:
            raise ValueError(f"movies: {unknown}, expected one or more of {list(MOVIE_FIELDS)}")
        for name in ("metre_per_pixel", "frame_interval"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value > 0):
                raise ValueError(f"{name}: {value!r}, expected a finite number over 0")
        colours = [*(self.background or ()), *([self.tool_colour] if self.tool_colour else [])]
        for colour in colours:
            if len(colour) != 3 or not all(0 <= part <= 255 for part in colour):
                raise ValueError(f"colour: {colour!r}, expected red, green and blue of 0 to 255")
        if len(self.tool_polygon) == 1:
            raise ValueError("tool_polygon: 1 corner, expected 3 or more, or 2 of a box")
        if self.placement.depth != 2 or self.placement.origin != (0.0, 0.0):
            raise ValueError(
                f"placement: {self.placement}, expected x and y of the picture; the origin is in "
                "pixels"
            )

    @property
    def inputs(self) -> tuple[str, ...]:
        return tuple(str(movie.path) for movie in self.movies.values())

    def survey(self) -> Survey:
        indices, _, assumed = self._opened
        index = indices[self._names[0]]
        times, clock = self._times(index)
        return Survey(
            kind=f"movie, {index.count} pictures of {index.columns} x {index.rows}, {index.codec}",
            times=times,
            extent=self._pixels(index).extent,
            found={name: self.movies[name].path.name for name in self._names},
            spacing=self.metre_per_pixel,
            notes=Notes([*clock, *assumed, *_doubts(self.uncertainty())]),
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the pictures: means of values, not of colours; see `Source.frames`.

        A tool that is known by its colour has no values.
        """
        indices, readers, _ = self._opened
        index = indices[self._names[0]]
        times, _ = self._times(index)
        if start >= len(times):
            return
        pixels = self._pixels(index)
        across = taps(pixels.x, raster.spacing, raster.x)
        down = taps(-pixels.y, raster.spacing, -raster.y)
        shown = [
            pictures(self.movies[name].path, indices[name], start * self.every, self.every)
            for name in self._names
        ]
        for number, together in enumerate(zip(*shown, strict=True), start):
            read = {
                name: self._read(name, readers[name], picture, number * self.every)
                for name, picture in zip(self._names, together, strict=True)
            }
            values, material = regrid(*self._fields(read), across, down)
            *means, distance, filled = values
            quality = np.round(np.nan_to_num(distance)).astype(np.uint8)
            quality[filled > _HALF] = FILLED
            fields = dict(zip(self._names, means, strict=True))
            yield SampledFrame(float(times[number]), fields, material, quality)

    def uncertainty(self) -> dict[str, ColourUncertainty]:
        """Return the uncertainty of each field, from three pictures.

        They are the first, the middle and the last one, or early ones of a movie that cannot be
        searched.
        """
        indices, readers, _ = self._opened
        result = {}
        for name, reader in readers.items():
            movie, index = self.movies[name], indices[name]
            last = index.count - 1 if index.marks else min(index.count - 1, _EARLY)
            values, distance, lines = [], [], []
            for number in sorted({0, last // 2, last}):
                picture = next(pictures(movie.path, index, number))
                read = self._read(name, reader, picture, number)
                values.append(read.values[read.seen])
                distance.append(read.distance[read.seen])
                lines.append(reader.error_of_filling(read))
            result[name] = replace(
                colour_uncertainty(reader.scale, np.concatenate(values), np.concatenate(distance)),
                legend=_uncertainty_of_legend(movie, reader.legend),
                lines=sqrt(fmean(error**2 for error in lines)),
            )
        return result

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(name for name in MOVIE_FIELDS if name in self.movies)

    @cached_property
    def _opened(self) -> tuple[dict[str, MovieIndex], dict[str, FieldReader], list[str]]:
        """Indices of the movies, which must agree, readers of their pictures, and assumptions."""
        paths = {name: self.movies[name].path for name in self._names}
        indices = {name: index_movie(path) for name, path in paths.items()}
        first = indices[self._names[0]]
        shape = (first.rows, first.columns)
        self._crop(first)
        tool = self._cropped(polygon_mask(shape, self.tool_polygon))
        square = "The pixels are square, although the movie states otherwise."
        assumed = [] if first.square else [square]
        readers = {}
        for name, index in indices.items():
            if (index.rows, index.columns, index.count) != (*shape, first.count):
                raise SourceError(
                    f"{paths[name]}: {index.count} pictures of {index.columns} x {index.rows}, "
                    f"expected {first.count} of {first.columns} x {first.rows} as in "
                    f"{paths[self._names[0]]}"
                )
            picture = next(pictures(paths[name], index))
            with naming(paths[name]):
                scale, legend, said = _scale(self.movies[name], picture)
                background, also = self._background(self._cropped(picture), scale)
                covered = box_mask(shape, self.covered)
                if legend is not None:
                    covered |= box_mask(shape, [legend], _LEGEND_MARGIN)
                readers[name] = FieldReader(
                    scale, background, self.tool_colour, tool,
                    self._cropped(covered), self.overlay_limit, legend,
                )  # fmt: skip
            assumed += [f"{name}: {text}" for text in (*said, *also)]
        return indices, readers, assumed

    def _times(self, index: MovieIndex) -> tuple[NDArray[np.float64], tuple[str, ...]]:
        if self.frame_interval is not None:
            times = self.frame_interval * np.arange(index.count, dtype=np.float64)
            return times[:: self.every], ()
        path = self.movies[self._names[0]].path
        if index.times is None:
            raise SourceError(f"{path}: it has no times, expected frame_interval")
        step = index.times[-1] / max(index.count - 1, 1)
        said = f"The times are those of playing the movie, {step:.6g} s per frame."
        return index.times[:: self.every], (said,)

    def _pixels(self, index: MovieIndex) -> Raster:
        """Return the pixels of the cropped and turned picture in the scene."""
        left, top, right, bottom = self._crop(index)
        side = self.metre_per_pixel
        spans = (
            (side * (left - self.origin[0]), side * (right - self.origin[0])),
            (side * (self.origin[1] - bottom), side * (self.origin[1] - top)),
        )
        across, up = (
            sorted(sign * end for end in spans[axis])
            for axis, sign in zip(self.placement.axes, self.placement.signs, strict=True)
        )
        shape = (bottom - top, right - left)
        rows, columns = shape[::-1] if self.placement.axes == (1, 0) else shape
        return Raster(across[0], up[1], side, rows, columns)

    def _crop(self, index: MovieIndex) -> Box:
        box = self.crop or (0, 0, index.columns, index.rows)
        left, top, right, bottom = box
        if not (0 <= left < right <= index.columns and 0 <= top < bottom <= index.rows):
            raise SourceError(
                f"crop: {box} does not lie in pictures of {index.columns} x {index.rows} pixels, "
                "expected left, top, right, bottom"
            )
        return box

    def _cropped(self, values: NDArray[Any]) -> NDArray[Any]:
        if self.crop is None:
            return values
        left, top, right, bottom = self.crop
        return values[top:bottom, left:right]

    def _background(
        self, picture: Picture, scale: ColourScale
    ) -> tuple[tuple[Colour, ...], tuple[str, ...]]:
        if self.background is not None:
            return self.background, ()
        found, refused = find_background(picture, scale)
        if self.tool_colour is not None:
            tool = np.array(self.tool_colour)
            found = tuple(colour for colour in found if np.abs(tool - colour).max() > 16)
            refused = tuple(colour for colour in refused if np.abs(tool - colour).max() > 16)
        if refused and not found:
            raise SourceError(
                f"background: {refused[0]} at the border is a colour of the scale too, expected "
                "another background, or background: [] if it shows values"
            )
        named = ", ".join(str(colour) for colour in found) or "none"
        said = [f"Background colours at the border: {named}."]
        said += [f"The colour {colour} at the border is a value." for colour in refused]
        return found, tuple(said)

    def _read(self, name: str, reader: FieldReader, picture: Picture, number: int) -> FieldPicture:
        """Read a picture; it may be all void but not all lines."""
        read = reader.read(self._cropped(picture))
        workpiece = read.material == Material.WORKPIECE
        if workpiece.any() and not np.isfinite(read.values[workpiece]).any():
            raise SourceError(
                f"{self.movies[name].path}: picture {number + 1} has no colour of the scale"
            )
        return read

    def _fields(
        self, read: Mapping[str, FieldPicture]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return values of pictures, distances from the scale, what is filled; and the material."""
        material = read[self._names[0]].material
        completed = [_completed(picture, material) for picture in read.values()]
        quality = np.max([of for _, of in completed], axis=0)
        filled = quality == FILLED
        distance = np.where(filled, np.nan, quality)
        values = np.stack([*(of for of, _ in completed), distance, filled]).astype(np.float32)
        return self._turned(values), self._turned(material)

    def _turned(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return pictures as they lie in the scene."""
        if self.placement.axes == (1, 0):
            values = values[..., ::-1, :].swapaxes(-1, -2)[..., ::-1, :]
        across, up = (int(sign) for sign in self.placement.signs)
        return np.ascontiguousarray(values[..., ::up, ::across])


def _uncertainty_of_legend(movie: FieldMovie, box: Box | None) -> float:
    """Return the uncertainty of a legend's ends: a pixel if it was found, else its rounding."""
    if box is None:
        return 0.0
    left, top, right, bottom = box
    pixel = abs(movie.values[1] - movie.values[0]) / max(right - left, bottom - top)
    return pixel * (_ROUNDING if movie.colours else 1.0)


def metre_per_pixel(
    first: tuple[float, float], second: tuple[float, float], length: float
) -> float:
    """Return the side of a pixel in m from two points in pixels and their distance in m."""
    pixels = hypot(second[0] - first[0], second[1] - first[1])
    if not (isfinite(pixels) and pixels > 0):
        raise ValueError(f"scale: points {first!r}, {second!r}, expected two different points")
    if not (isfinite(length) and length > 0):
        raise ValueError(f"scale: length {length!r}, expected a finite number of m over 0")
    return length / pixels


def _scale(movie: FieldMovie, picture: Picture) -> tuple[ColourScale, Box | None, list[str]]:
    """Return the scale of a movie, the place of its legend, and the assumptions."""
    if isinstance(movie.colours, NamedMap):
        name, bands = movie.colours.name, movie.colours.bands
        return ColourScale.named(name, movie.values, bands), None, []
    box = movie.colours or find_legend(picture)
    if box is None:
        raise SourceError(
            "no legend was found in the first picture, expected the box of one, or a named map"
        )
    if not movie.colours and is_cut(picture, box):
        raise SourceError(
            f"legend: an end of the one found at {box} cannot be told from what is beside it, "
            "expected the box of the legend, or a named map"
        )
    scale = ColourScale.from_legend(legend_pixels(picture, box), movie.values)
    fraction = explained(picture, box, scale)
    if fraction < LEAST_EXPLAINED:
        raise SourceError(
            f"legend: the picture has the colours of {box} in {fraction:.0%} of what it shows, "
            f"expected {LEAST_EXPLAINED:.0%} or more; give the box of the legend, or a named map"
        )
    kind = f"{len(scale.values)} bands" if scale.banded else "colours without steps"
    found = "" if movie.colours else f"Legend found at {box} (left, top, right, bottom). "
    first, last = movie.values
    ends = f"{first:g} at its lower or left end, {last:g} at the other"
    return scale, box, [f"{found}Legend of {kind}, {ends}."]


def _completed(
    picture: FieldPicture, material: NDArray[np.uint8]
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return values and quality, filled where another movie shows material and this one none."""
    values, quality = picture.values.copy(), picture.quality.copy()
    lacking = (material == Material.WORKPIECE) & ~np.isfinite(values)
    fill(values, np.isfinite(values) & (picture.material == Material.WORKPIECE), lacking)
    quality[lacking] = FILLED
    return values, quality


def _doubts(uncertainty: Mapping[str, ColourUncertainty]) -> Iterator[str]:
    for name, warning in uncertainty.items():
        unit = FIELD_UNITS[name].replace("1/s", "/s").removeprefix("1")
        yield (
            f"{name}: The colours leave a standard uncertainty of "
            + f"{warning.total:.3g} {unit}".rstrip()
            + f" ({warning.colours:.3g} by their number, {warning.noise:.3g} by their noise"
            + (f", {warning.legend:.3g} by the ends of the legend" if warning.legend else "")
            + (f", {warning.lines:.3g} by the lines drawn over them" if warning.lines else "")
            + ")."
        )
