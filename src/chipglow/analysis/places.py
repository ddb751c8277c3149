"""Where the error is read: points, lines, regions, the hottest pixel, rake face, shear band."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.images import Stack
from chipglow.chip import ShearBand
from chipglow.quantities import Array
from chipglow.scene import Line, Raster, Region, Tool, sample, straight_line
from chipglow.scene.lines import nearest, polyline
from chipglow.scene.regions import Point

_EXTREMES: Final = ("mean", "most negative", "greatest")
LINE_REACH, LINE_STEP = 60e-6, 1e-6
"""Reach of the lines across rake face and shear band to either side, and their points' distance."""

_STEPS: Final = round(LINE_REACH / LINE_STEP)
_ACROSS: Final = LINE_STEP * np.arange(-_STEPS, _STEPS + 1.0)
"""Distances of the points of such a line in m."""

TOUCHING: Final = 3e-6
"""Distance from the rake face in m within which material touches it: half the paper's pixel."""

NEAR: Final = 2.0
"""Distance in pixels within which an extremum of an image belongs to a place."""


@dataclass(frozen=True)
class Place(ABC):
    """Somewhere in the images, with a name."""

    name: str
    quantities: ClassVar[tuple[str, ...]]
    """Names of the readings."""
    motion_samples: ClassVar[float] = 0.0
    """Position of the reading of motion on its lines, in samples of the scene."""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("place: the name is empty, expected a name such as melt pool")

    def lines(self, pitch: float) -> Mapping[str, Line]:
        """Return lines along which the images are sampled, by name; `pitch` is in m."""
        return {}

    def sampled(self, images: Sequence[Array] | Stack, pixels: Raster) -> dict[str, Stack]:
        """Return images along its lines by name, each of shape (image, point)."""
        return {
            name: np.array([sample(image, pixels, line.points) for image in images])
            for name, line in self.lines(pixels.spacing).items()
        }

    @abstractmethod
    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        """Return the `quantities` of images (reference first) and their `lines`; NaN for none."""

    def read_parts(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        """Return the readings of all images at the positions that the first two determine."""
        return self.read(images, pixels, lines)

    def outline(self) -> NDArray[np.float64] | None:
        """Return points to draw it, x and y in m, shape (n, 2); None for the whole image."""
        return None

    def covered(self, where: NDArray[np.bool_], image: Array, raster: Raster) -> float:
        """Return the fraction of its pixels for which `where` is true; NaN without pixels.

        Pixels count where `image` is finite. This method counts along the outline.
        """
        outline = self.outline()
        if outline is None:
            return nan
        if len(outline) > 1:
            outline = polyline(outline, raster.spacing).points
        return _mean(nearest(np.where(np.isfinite(image), where, nan), raster, outline))

    def check_within(self, raster: Raster) -> None:
        """Raise a ValueError if a part of the place is outside the pixels."""
        outline = self.outline()
        if outline is None:
            return
        left, right, bottom, top = raster.extent
        x, y = outline.T
        if x.min() < left or x.max() > right or y.min() < bottom or y.max() > top:
            raise ValueError(
                f"{self.name}: reaches over x {_microns(x)}, y {_microns(y)}, expected within the "
                f"pixels' x {1e6 * left:.4g} to {1e6 * right:.4g} um, y {1e6 * bottom:.4g} to "
                f"{1e6 * top:.4g} um"
            )


@dataclass(frozen=True)
class PointPlace(Place):
    """The pixel that holds a point, x and y in m."""

    point: Point
    quantities: ClassVar = ("pixel",)

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        return np.array([[nearest(one, pixels, self.point) for one in images]])

    def outline(self) -> NDArray[np.float64]:
        return np.array([self.point])


@dataclass(frozen=True)
class LinePlace(Place):
    """A polyline through two or more corners, x and y in m, read every half pixel."""

    corners: tuple[Point, ...]
    quantities: ClassVar = _EXTREMES

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.corners) < 2:
            raise ValueError(f"{self.name}: has {len(self.corners)} corners, expected 2 or more")
        if not (np.hypot(*np.diff(np.array(self.corners), axis=0).T) > 0).all():
            raise ValueError(f"{self.name}: two corners are the same, expected a line")

    def line(self, pitch: float) -> Line:
        """Return points along it, the distance in m from its first corner."""
        return polyline(np.array(self.corners), pitch)

    def lines(self, pitch: float) -> Mapping[str, Line]:
        return {self.name: self.line(pitch)}

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        return _mean_and_extremes(lines[self.name])

    def outline(self) -> NDArray[np.float64]:
        return np.array(self.corners)


@dataclass(frozen=True)
class RegionPlace(Place):
    """The pixels whose centre is in a region, which is in m."""

    region: Region
    quantities: ClassVar = _EXTREMES

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.region.unit != "m":
            raise ValueError(f"{self.name}: is in pixels, expected lengths such as 120 um")

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        inside = self.region.shape.holds(*np.meshgrid(pixels.x, pixels.y))
        return _mean_and_extremes(images[:, inside])

    def covered(self, where: NDArray[np.bool_], image: Array, raster: Raster) -> float:
        inside = self.region.shape.holds(*np.meshgrid(raster.x, raster.y))
        return _mean(where[inside & np.isfinite(image)].astype(np.float64))

    def outline(self) -> NDArray[np.float64]:
        corners = self.region.shape.outline
        return np.concatenate([corners, corners[:1]])


@dataclass(frozen=True)
class HottestPlace(Place):
    """The largest temperature of each image at any position: the error of a peak temperature."""

    name: str = "hottest pixel"
    quantities: ClassVar = ("peak",)

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        largest = np.where(np.isnan(images), -np.inf, images).max(axis=(1, 2))
        return np.where(np.isfinite(largest), largest, np.nan)[None]

    def read_parts(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        row, column = np.unravel_index(np.nanargmax(images[0]), images[0].shape)
        return images[None, :, row, column]

    def covered(self, where: NDArray[np.bool_], image: Array, raster: Raster) -> float:
        return float(where.flat[np.nanargmax(image)]) if np.isfinite(image).any() else nan


@dataclass(frozen=True)
class RakePlace(Place):
    """The rake face as far as the chip touches it, read across at mid-contact and along it."""

    tool: Tool
    contact_length: float
    quantities: ClassVar = (
        "mid-contact",
        "most negative within two pixels",
        "mean along the contact",
    )
    motion_samples: ClassVar[float] = 1.5  # from there on a sample shows the chip alone

    def lines(self, pitch: float) -> Mapping[str, Line]:
        length = self.contact_length
        along = np.linspace(0.0, length, max(round(length / LINE_STEP) + 1, 2))
        middle = self.tool.rake_point(length / 2)
        return {
            "rake": straight_line(middle, self.tool.rake_normal, _ACROSS),
            "contact": Line(along, self.tool.rake_point(along)),
        }

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        across, contact = lines["rake"], lines["contact"]
        reference = _mean(contact[0])
        errors = [_mean(measured - contact[0]) for measured in contact[1:]]
        lowest = _lowest_near(_ACROSS, across[1] - across[0], pixels.spacing)
        along = reference + np.array([0.0, *errors])
        return np.stack([across[:, np.argmin(np.abs(_ACROSS))], across[:, lowest], along])

    def outline(self) -> NDArray[np.float64]:
        return np.asarray(self.tool.rake_point(np.array([0.0, self.contact_length])))


@dataclass(frozen=True)
class BandPlace(Place):
    """The shear band, read on a line across its centre."""

    band: ShearBand
    quantities: ClassVar = (
        "ridge of strain rate",
        "ridge of measured temperature",
        "most negative beside it",
    )

    def lines(self, pitch: float) -> Mapping[str, Line]:
        return {"band": self.band.across(LINE_REACH, LINE_STEP)}

    def read(self, images: Stack, pixels: Raster, lines: Mapping[str, Stack]) -> Array:
        across = lines["band"]
        distance = self.band.across(LINE_REACH, LINE_STEP).distance
        # A camera shows no strain rate: the hottest is the centre for who has the image alone.
        hottest = _lowest_near(distance, -across[1], pixels.spacing)
        lowest = _lowest_near(distance, across[1] - across[0], inf)
        return across[:, [int(np.argmin(np.abs(distance))), hottest, lowest]].T

    def outline(self) -> NDArray[np.float64]:
        return self.band.ridge.points


def _lowest_near(distance: NDArray[np.float64], values: Stack, pitch: float) -> int:
    """Return the number of the lowest value within `NEAR` pixels of distance 0."""
    near = np.abs(distance) <= NEAR * pitch
    return int(np.argmin(np.where(near & np.isfinite(values), values, np.inf)))


def _mean(values: Stack) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else nan


def _mean_and_extremes(values: Stack) -> Array:
    """Return mean, and the values at the smallest and the largest error, shape (3, row)."""
    known = values[:, np.isfinite(values).all(axis=0)]
    if known.shape[1] == 0:
        return np.full((3, len(values)), np.nan)
    errors = known[1] - known[0]
    return np.stack([known.mean(axis=1), known[:, errors.argmin()], known[:, errors.argmax()]])


def _microns(values: NDArray[np.float64]) -> str:
    return f"{1e6 * values.min():.4g} to {1e6 * values.max():.4g} um"
