"""Movies of fields with a colour scale: a source of scenes."""

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import dist, isfinite, sqrt
from pathlib import Path
from statistics import fmean
from typing import Annotated, Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator

from chipglow.io.nearest import fill
from chipglow.io.sources.conventions import SI_UNITS, PlacedGrid, PlacedSource
from chipglow.io.sources.movies.colour_scale import (
    ColourScale,
    ColourUncertainty,
    Picture,
    colour_uncertainty,
)
from chipglow.io.sources.movies.legend import (
    LEAST_EXPLAINED,
    end_uncertainty,
    explained,
    legend_noise,
    legend_pixels,
)
from chipglow.io.sources.movies.overlays import (
    Box,
    Colour,
    FieldPicture,
    FieldReader,
    Legend,
    box_mask,
    check_box,
    find_background,
    place_of,
    polygon_mask,
)
from chipglow.io.sources.movies.pictures import MovieIndex, index_movie, pictures
from chipglow.io.sources.source import SourceError, Survey, even_times, extent_of, naming
from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.units import LENGTH, parse_unit
from chipglow.scene import FIELD_UNITS, FILLED, Material, Raster, SampledFrame
from chipglow.scene.regrid import regrid, taps
from chipglow.text import Notes

_EXAMPLES: Final = {
    "temperature": "1127 degC",
    "plastic_strain": "4",
    "plastic_strain_rate": "1e5 1/s",
}
"""Fields that a movie can show, with a value of each; the temperature determines the material."""

Pixel = tuple[float, float]
"""Place in a picture: pixels right and down from its upper left corner."""

_LEGEND_MARGIN: Final = 3
"""Pixels around a legend that are left out with it."""

_LIKE_TOOL: Final = 16
"""Difference from the tool's colour in 8 bits up to which a colour is the tool, not background."""

_NOISE_OF_YUV: Final = 1.0
"""Smallest noise in CIE L*a*b* of colours stored as 8 bits of luminance and chrominance.

It is the median error of ramps in `viridis` and `jet` as MJPEG and H.264 of good quality. Within a
uniform area it is the same everywhere, and so cannot be seen there.
"""
_LOWEST: Final = 0.02
"""Fraction of a scale up to which a colour at the border is taken for its lowest value."""


# A number of a file is text, which may lack its unit; Python's numbers are in SI.
_Value = Annotated[
    str | int | float, AfterValidator(lambda value, info: str(value) if info.context else value)
]


@dataclass(frozen=True)
class FieldMovie(Part):
    """A movie of one field; its values are text with a unit, or numbers in SI units."""

    file: Annotated[FileBeside | None, Parameter("The movie.")] = None
    first: Annotated[
        _Value, Parameter("Value of the first colour, or at the bottom or left of the legend.")
    ] = ""
    last: Annotated[
        _Value, Parameter("Value of the last colour, or at the top or right of the legend.")
    ] = ""
    colours: Annotated[
        str | None,
        Parameter(
            "Name of the colour map; none: the legend in the picture is read, see legend.",
            allowed="none, rainbow, jet, viridis, ... of matplotlib",
        ),
    ] = None
    bands: Annotated[
        int,
        Parameter(
            "Number of bands of the colour map; 0: no steps, or as counted in the legend.",
            allowed="0, 2 to 256",
        ),
    ] = 0
    legend: Annotated[
        Box | None,
        Parameter(
            "Left, top, right and bottom edge of the legend's colours, in pixels from the upper "
            "left corner of the picture; none: colours names the map.",
            allowed="none, or [600, 40, 620, 400]",
        ),
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.bands == 0 or 2 <= self.bands <= 256):
            raise ValueError(f"bands: {self.bands!r}, expected 0 or 2 to 256")
        if self.legend is not None and self.colours is not None:
            raise ValueError(f"legend: {self.legend} as well as colours, expected one of them")

    def check_scale(self, name: str) -> None:
        """Refuse a field whose scale is not stated."""
        if self.legend is None and self.colours is None:
            raise ValueError(
                f"movie.{name}.legend: is missing, expected the edges of the legend's colours: "
                "left, top, right and bottom in pixels from the upper left corner of a frame, as "
                "an image viewer shows them, such as legend: [600, 40, 620, 400]; or the name of "
                "their map, such as colours: jet"
            )

    def ends(self, name: str) -> tuple[float, float]:
        """Return the values of a field at the ends of the scale in SI units."""
        first, last = (
            _number(f"movie.{name}.{end}", name, getattr(self, end)) for end in ("first", "last")
        )
        if not (isfinite(first) and isfinite(last) and first != last):
            raise ValueError(
                f"movie.{name}: first {first:g} and last {last:g}, expected two finite values"
            )
        return first, last


def _number(place: str, name: str, value: str | float) -> float:
    """Return a value of a field in SI, such as ``1127 degC`` or ``4``."""
    if not isinstance(value, str):
        return float(value)
    number, _, unit = value.strip().partition(" ")
    lacks_unit = not unit and name != "plastic_strain"
    with suppress(ValueError):
        if not lacks_unit:
            return float(parse_unit(unit, SI_UNITS[name], name).to_si(float(number)))
    what = f"{value!r}{' has no unit' if lacks_unit else ''}" if number else "is missing"
    raise ValueError(f"{place}: {what}, expected a value such as {_EXAMPLES[name]}")


@dataclass(frozen=True)
class MovieSource(PlacedSource, Part):
    """Movies of fields with a colour scale, a movie a field.

    They have the same size and number of pictures. ``files`` is the movie of the temperature if
    that names none; an ``interval`` in s replaces the time of playing. In the ``placement`` ``x``
    is to the right in the picture and ``y`` up.
    """

    title: ClassVar[str] = "a movie"
    endings: ClassVar[tuple[str, ...]] = (
        ".avi", ".mp4", ".m4v", ".mov", ".mkv", ".webm", ".wmv", ".mpg", ".mpeg", ".gif",
        ".png", ".jpg", ".jpeg", ".bmp",
    )  # fmt: skip
    temperature: Annotated[FieldMovie, Parameter("The movie of the temperature.")] = field(
        default_factory=FieldMovie
    )
    plastic_strain: Annotated[FieldMovie | None, Parameter("The movie of the plastic strain.")] = (
        None
    )
    plastic_strain_rate: Annotated[
        FieldMovie | None, Parameter("The movie of the plastic strain rate.")
    ] = None
    pixel: Annotated[float | None, Parameter("Side of a pixel.", LENGTH, over=0.0)] = None
    pixel_height: Annotated[
        float | None,
        Parameter("Height of a pixel, where pixel is its width; none: the same.", LENGTH, over=0.0),
    ] = None
    scale_from: Annotated[
        Pixel | None,
        Parameter(
            "A point whose distance from another is known, in pixels right and down.",
            allowed="none, or [120, 400]",
        ),
    ] = None
    scale_to: Annotated[Pixel | None, Parameter("The other point.")] = None
    scale_length: Annotated[float | None, Parameter("Their distance.", LENGTH, over=0.0)] = None
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
    every: Annotated[int, Parameter("Take every n-th picture.", least=1)] = 1
    background: Annotated[
        tuple[Colour, ...] | None,
        Parameter(
            "Colours of where nothing is, such as [[255, 255, 255]]; none: looked for at the "
            "border."
        ),
    ] = None
    covered: Annotated[
        tuple[Box, ...], Parameter("Boxes where something else is drawn, such as text.")
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
    files: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
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

        if self.files:  # the description of an import is whole
            _ = self._sides
            for name, movie in self._movies.items():
                _ = self._path(name), movie.ends(name)
                movie.check_scale(name)

    @property
    def own_files(self) -> str | None:
        return self.temperature.file

    def survey(self) -> Survey:
        indices, _, assumed = self._opened
        index = indices["temperature"]
        times, clock = self._times(index)
        x, y, _ = self._grid(index)
        return Survey(
            kind=f"movie, {index.count} pictures of {index.columns} x {index.rows}, {index.codec}",
            times=times,
            extent=extent_of(x, y),
            found={name: self._path(name).name for name in self._movies},
            spacing=min(self._sides),
            notes=Notes([*clock, *assumed, *_doubts(self.uncertainty())]),
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the pictures: means of values, not of colours; see `Source.frames`."""
        indices, readers, _ = self._opened
        index = indices["temperature"]
        times, _ = self._times(index)
        x, y, turned = self._grid(index)
        across, down = taps(x, raster.spacing, raster.x), taps(-y, raster.spacing, -raster.y)
        numbers = range(start * self.every, index.count, self.every)
        shown = [pictures(self._path(name), indices[name], numbers) for name in readers]
        for number, *together in zip(numbers, *shown, strict=True):
            read = {
                name: self._read(name, reader, picture, number)
                for (name, reader), picture in zip(readers.items(), together, strict=True)
            }
            material = read["temperature"].material
            values, material = regrid(turned(_values(read)), turned(material), across, down)
            *means, distance, filled = values
            quality = np.round(np.nan_to_num(distance)).astype(np.uint8)
            quality[filled > 0.5] = FILLED
            fields = dict(zip(readers, means, strict=True))
            yield SampledFrame(float(times[number // self.every]), fields, material, quality)

    def uncertainty(self) -> dict[str, ColourUncertainty]:
        """Return the uncertainty of each field, from the first, the middle and the last picture."""
        indices, readers, _ = self._opened
        result = {}
        for name, reader in readers.items():
            last = indices[name].count - 1
            numbers = sorted({0, last // 2, last})
            shown = pictures(self._path(name), indices[name], numbers)
            reads = [
                self._read(name, reader, picture, number)
                for number, picture in zip(numbers, shown, strict=True)
            ]
            values = np.concatenate([read.values[read.seen] for read in reads])
            distance = np.concatenate([read.distance[read.seen] for read in reads])
            movie = self._movies[name]
            result[name] = replace(
                colour_uncertainty(reader.scale, values, distance),
                legend=_uncertainty_of_legend(reader.legend, movie.ends(name)),
                lines=sqrt(fmean(reader.error_of_filling(read) ** 2 for read in reads)),
            )
        return result

    @property
    def _movies(self) -> dict[str, FieldMovie]:
        return {name: movie for name in _EXAMPLES if (movie := getattr(self, name)) is not None}

    def _path(self, name: str) -> Path:
        file = self._movies[name].file or (name == "temperature" and self.files)
        if not file:
            raise ValueError(f"movie.{name}.file: is missing, expected the name of a movie")
        return Path(file)

    @property
    def _sides(self) -> tuple[float, float]:
        """Width and height of a pixel in m."""
        if self.pixel is not None:
            return self.pixel, self.pixel_height or self.pixel
        if self.scale_from is None or self.scale_to is None or self.scale_length is None:
            raise ValueError(
                "movie.pixel: is missing, expected the side of a pixel such as 1 um, "
                "or scale_from, scale_to and scale_length"
            )
        pixels = dist(self.scale_from, self.scale_to)
        if not pixels:
            raise ValueError(f"movie.scale_to: {self.scale_to}, expected another point")
        return self.scale_length / pixels, self.scale_length / pixels

    @cached_property
    def _opened(self) -> tuple[dict[str, MovieIndex], dict[str, FieldReader], list[str]]:
        """Indices of the movies, which must agree, readers of their pictures, and assumptions."""
        paths = {name: self._path(name) for name in self._movies}
        indices = {name: index_movie(path) for name, path in paths.items()}
        first = indices["temperature"]
        shape = (first.rows, first.columns)
        self._crop(first)
        tool = self._cropped(polygon_mask(shape, self.tool_polygon))
        square = "The pixels are square, although the movie states otherwise."
        assumed = [] if first.square or self.pixel_height else [square]
        readers = {}
        for name, index in indices.items():
            if (index.rows, index.columns, index.count) != (*shape, first.count):
                raise SourceError(
                    f"{paths[name]}: {index.count} pictures of {index.columns} x {index.rows}, "
                    f"expected {first.count} of {first.columns} x {first.rows} as in "
                    f"{paths['temperature']}"
                )
            picture = next(pictures(paths[name], index, (0,)))
            with naming(paths[name]):
                movie = self._movies[name]
                movie.check_scale(name)
                scale, legend, said = _scale(movie, movie.ends(name), picture, index.codec)
                background, also = self._background(self._cropped(picture), scale)
                covered = box_mask(shape, self.covered)
                if legend is not None:
                    covered |= box_mask(shape, [legend.box], _LEGEND_MARGIN)
                readers[name] = FieldReader(
                    scale, background, self.tool_colour, tool,
                    self._cropped(covered), self.overlay_limit, legend,
                )  # fmt: skip
            assumed += [f"{name}: {text}" for text in (*said, *also)]
        return indices, readers, assumed

    def _times(self, index: MovieIndex) -> tuple[NDArray[np.float64], tuple[str, ...]]:
        if self.interval is not None:
            return even_times(index.count, self.interval, Notes())[:: self.every], ()
        if index.times is None:
            raise SourceError(f"{self._path('temperature')}: it has no times, expected interval")
        step = index.times[-1] / max(index.count - 1, 1)
        said = f"The times are the playing times of the movie, {step:.6g} s per frame."
        return index.times[:: self.every], (said,)

    def _grid(self, index: MovieIndex) -> PlacedGrid:
        """Return the pixels of the cropped picture in the scene."""
        left, top, right, bottom = self._crop(index)
        width, height = self._sides
        x = width * (np.arange(left, right, dtype=np.float64) + 0.5 - self.origin[0])
        y = height * (self.origin[1] - np.arange(top, bottom, dtype=np.float64) - 0.5)
        return self.placement.grid(x, y)

    def _crop(self, index: MovieIndex) -> Box:
        box = self.crop or (0, 0, index.columns, index.rows)
        return check_box("crop", box, index.rows, index.columns)

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
        found, values = find_background(picture, scale)
        if self.tool_colour is not None:
            tool = np.array(self.tool_colour)
            found, values = (
                tuple(colour for colour in colours if np.abs(tool - colour).max() > _LIKE_TOOL)
                for colours in (found, values)
            )
        # Pixels at the cold end of the scale may be background; hotter ones are not.
        coldest = scale.values[0] + _LOWEST * (scale.values[-1] - scale.values[0])
        hotter = [colour for colour in values if place_of(scale, colour)[0] > coldest]
        if hotter and not found:
            raise SourceError(
                f"background: {hotter[0]} at the border is a colour of the scale too, expected "
                "another background, or background: [] if it shows values"
            )
        named = ", ".join(str(colour) for colour in found) or "none"
        said = [f"Background colours at the border: {named}."]
        said += [f"The colour {colour} at the border is a value." for colour in values]
        return found, tuple(said)

    def _read(self, name: str, reader: FieldReader, picture: Picture, number: int) -> FieldPicture:
        """Read a picture; it may be all void but not all lines."""
        read = reader.read(self._cropped(picture))
        workpiece = read.material == Material.WORKPIECE
        if workpiece.any() and not np.isfinite(read.values[workpiece]).any():
            raise SourceError(
                f"{self._path(name)}: picture {number + 1} has no colour of the scale"
            )
        return read


def _uncertainty_of_legend(legend: Legend | None, ends: tuple[float, float]) -> float:
    """Return the uncertainty of a field by the ends of its legend."""
    if legend is None:
        return 0.0
    left, top, right, bottom = legend.box
    pixel = abs(ends[1] - ends[0]) / max(right - left, bottom - top)
    return pixel * legend.uncertainty


def _scale(
    movie: FieldMovie, ends: tuple[float, float], picture: Picture, codec: str
) -> tuple[ColourScale, Legend | None, list[str]]:
    """Return the scale of a movie, its legend, and the assumptions."""
    if movie.legend is None:
        return ColourScale.named(str(movie.colours), ends, movie.bands), None, []
    box = movie.legend
    pixels = legend_pixels(picture, box)
    legend = Legend(box, end_uncertainty(picture, box))
    noise = max(legend_noise(picture, box), _NOISE_OF_YUV if "yuv" in codec else 0.0)
    scale = ColourScale.from_legend(pixels, ends, movie.bands, noise)
    fraction = explained(picture, box, scale)
    if fraction < LEAST_EXPLAINED:
        raise SourceError(
            f"legend: the picture has the colours of {list(box)} in {fraction:.0%} of its pixels, "
            f"expected {LEAST_EXPLAINED:.0%} or more; give the edges of the legend's colours, or "
            "the name of their map"
        )
    kind = f"{len(scale.values)} bands" if scale.banded else "colours without steps"
    first, last = ends
    limits = f"{first:g} at its lower or left end, {last:g} at the other"
    return scale, legend, [f"Legend of {kind}, {limits}."]


def _values(read: Mapping[str, FieldPicture]) -> NDArray[np.float32]:
    """Return values of pictures, distances from the scale, and what is filled."""
    material = read["temperature"].material
    completed = [_completed(picture, material) for picture in read.values()]
    quality = np.max([of for _, of in completed], axis=0)
    filled = quality == FILLED
    distance = np.where(filled, np.nan, quality)
    return np.stack([*(of for of, _ in completed), distance, filled]).astype(np.float32)


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
