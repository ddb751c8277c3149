"""Places of an image with names: points, lines, and regions such as polygons and circles."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Brief
from chipglow.scene.lines import Line, nearest_sample, polyline
from chipglow.scene.raster import Raster

Value = TypeVar("Value")
Point: TypeAlias = tuple[float, float]
"""Column and row in pixels from the image's upper left corner, or x and y in m."""

_CIRCLE_POINTS: Final = 72
"""Points of a circle's outline."""

_ROUNDING: Final = 1e-6
"""Part of a pixel by which a place may be beyond the image by rounding."""


def in_polygon(corners: Sequence[Point], x: ArrayLike, y: ArrayLike) -> NDArray[np.bool_]:
    """Tell which points lie in a polygon; where it overlaps itself, those twice in it do not."""
    x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    inside = np.zeros(x.shape, np.bool_)
    for (x1, y1), (x2, y2) in zip(corners, [*corners[1:], corners[0]], strict=True):
        if y1 != y2:
            crossed = (y1 > y) != (y2 > y)
            inside[crossed] ^= x[crossed] < x1 + (y[crossed] - y1) * (x2 - x1) / (y2 - y1)
    return inside


@dataclass(frozen=True)
class Polygon:
    """A polygon."""

    corners: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.corners) < 3:
            raise ValueError(f"polygon: has {len(self.corners)} corners, expected 3 or more")
        if not np.isfinite(self.corners).all():
            raise ValueError("polygon: a corner is not finite, expected numbers")

    @classmethod
    def rectangle(cls, corner: Point, opposite: Point) -> "Polygon":
        """Return an upright rectangle between two opposite corners."""
        (left, top), (right, bottom) = corner, opposite
        return cls(((left, top), (right, top), (right, bottom), (left, bottom)))

    @property
    def outline(self) -> NDArray[np.float64]:
        """Points along its edge, shape (n, 2)."""
        return np.array(self.corners, np.float64)

    def holds(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points lie in it."""
        return in_polygon(self.corners, x, y)


@dataclass(frozen=True)
class Circle:
    """A circle."""

    centre: Point
    radius: float

    def __post_init__(self) -> None:
        if not np.isfinite(self.centre).all():
            raise ValueError(f"circle: centre is {self.centre!r}, expected numbers")
        if not 0 < self.radius < np.inf:
            raise ValueError(f"circle: radius is {self.radius!r}, expected more than 0")

    @property
    def outline(self) -> NDArray[np.float64]:
        """Points along its edge, shape (n, 2)."""
        angle = np.linspace(0.0, 2 * np.pi, _CIRCLE_POINTS, endpoint=False)
        directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return np.asarray(self.centre, np.float64) + self.radius * directions

    def holds(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which points lie in it."""
        return np.asarray(np.hypot(x - self.centre[0], y - self.centre[1]) <= self.radius)


@dataclass(frozen=True)
class Pixel:
    """The pixel that contains a point."""

    point: Point

    def __post_init__(self) -> None:
        if not np.isfinite(self.point).all():
            raise ValueError(f"point: is {self.point!r}, expected numbers")

    @property
    def outline(self) -> NDArray[np.float64]:
        """The point, shape (1, 2)."""
        return np.array([self.point], np.float64)

    def holds(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return False for all points: a point has no area."""
        return np.zeros(np.broadcast(x, y).shape, np.bool_)


@dataclass(frozen=True)
class Polyline:
    """The pixels along a line from corner to corner."""

    corners: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.corners) < 2:
            raise ValueError(f"line: has {len(self.corners)} corners, expected 2 or more")
        if not np.isfinite(self.corners).all():
            raise ValueError("line: a corner is not finite, expected numbers")
        if not (np.hypot(*np.diff(np.array(self.corners), axis=0).T) > 0).all():
            raise ValueError("line: two corners are the same, expected a line")

    @property
    def outline(self) -> NDArray[np.float64]:
        """Its corners, shape (n, 2)."""
        return np.array(self.corners, np.float64)

    def holds(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return False for all points: a line has no area."""
        return np.zeros(np.broadcast(x, y).shape, np.bool_)


@dataclass(frozen=True)
class Region:
    """A place of an image with a name: the pixels in a polygon or circle, or at a point or line."""

    name: str
    shape: Polygon | Circle | Pixel | Polyline
    feature: str = ""
    """Regions of one feature, such as "chip body", are taken together; by default its own name."""
    unit: Literal["pixel", "m"] = "pixel"
    """Unit of the points: column and row from the image's upper left corner, or x and y in m."""

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("region: the name is empty; name it, such as chip body")
        if self.unit not in ("pixel", "m"):
            raise ValueError(f"region {self.name}: unit is {self.unit!r}, expected pixel or m")
        if not self.feature:
            object.__setattr__(self, "feature", self.name)

    @property
    def has_area(self) -> bool:
        """Whether it is a polygon or a circle, and not a point or a line."""
        return isinstance(self.shape, Polygon | Circle)

    def line(self, raster: Raster) -> Line:
        """Return points every half pixel along its outline, the distance in m from the first."""
        return polyline(self.outline(raster), raster.spacing)

    def mask(self, raster: Raster) -> NDArray[np.bool_]:
        """Return the pixels of the place, shape (y, x).

        They have their centre in a region, contain a point, or are on a line.
        """
        self._check_inside(raster)
        if not self.has_area:
            return self._crossed(raster)
        columns, rows = np.arange(raster.columns) + 0.5, np.arange(raster.rows) + 0.5
        is_pixel = self.unit == "pixel"
        x, y = (columns, rows) if is_pixel else (raster.x, raster.y)
        side = 1.0 if is_pixel else raster.spacing
        across, down = (
            np.flatnonzero((centres > ends.min() - side) & (centres < ends.max() + side))
            for centres, ends in zip((x, y), self.shape.outline.T, strict=True)
        )
        mask = np.zeros(raster.shape, np.bool_)
        mask[np.ix_(down, across)] = self.shape.holds(*np.meshgrid(x[across], y[down]))
        if not mask.any():
            raise ValueError(f"region {self.name}: is empty: it contains no pixel centre")
        return mask

    def outline(self, raster: Raster) -> NDArray[np.float64]:
        """Return points along its edge as x and y in m, shape (n, 2)."""
        points = self.shape.outline
        if self.unit == "m":
            return points
        corner = np.array([raster.left, raster.top])
        return np.asarray(corner + raster.spacing * points * [1.0, -1.0])

    def _crossed(self, raster: Raster) -> NDArray[np.bool_]:
        """Return the pixels that contain a point of the place."""
        is_line = isinstance(self.shape, Polyline)
        points = self.line(raster).points if is_line else self.outline(raster)
        row, column = nearest_sample(raster, points)
        mask = np.zeros(raster.shape, np.bool_)
        # A point on the right or the lower edge belongs to the last pixel.
        mask[row.clip(0, raster.rows - 1), column.clip(0, raster.columns - 1)] = True
        return mask

    def _check_inside(self, raster: Raster) -> None:
        points = self.outline(raster)
        places = (points - [raster.left, raster.top]) / raster.spacing * [1.0, -1.0]
        for name, place, count in zip(
            ("columns", "rows"), places.T, (raster.columns, raster.rows), strict=True
        ):
            if place.min() < -_ROUNDING or place.max() > count + _ROUNDING:
                raise ValueError(
                    f"region {self.name}: reaches over {name} {place.min():.4g} to "
                    f"{place.max():.4g}, expected within the image's 0 to {count}"
                )


@dataclass(frozen=True, eq=False, repr=False)
class Area(Brief):
    """Pixels of an image that a table has a row for: a region, or all regions of a feature."""

    name: str
    feature: str
    mask: NDArray[np.bool_]
    whole: bool
    """Whether it is all that there is of the feature."""


def named_value(values: Mapping[str, Value], place: Region | Area) -> Value | None:
    """Return the value of a place by its name, or else by its feature; None without one."""
    return values.get(place.name, values.get(place.feature))


def areas(regions: Sequence[Region], raster: Raster) -> tuple[Area, ...]:
    """Pixels of regions and of the features that they make up.

    Parameters
    ----------
    regions : sequence of Region
        The regions, with different names.
    raster : Raster
        The image's pixels.

    Returns
    -------
    tuple of Area
        One of each region, then one of each feature that has several regions. A pixel in two
        regions of one feature counts once in the feature.

    Raises
    ------
    ValueError
        If there is no region, two of one name, or one that is outside the image or empty.
    """
    if not regions:
        raise ValueError("regions: there are none, expected 1 or more")
    parts: dict[str, list[Region]] = {}
    for region in regions:
        parts.setdefault(region.feature, []).append(region)
    several = {feature: those for feature, those in parts.items() if len(those) > 1}
    names = [region.name for region in regions] + list(several)
    for name in names:
        if names.count(name) > 1:
            raise ValueError(
                f"region {name}: another region, or a feature of several, has that name, "
                "expected names that differ"
            )
    single = [
        Area(region.name, region.feature, region.mask(raster), region.feature not in several)
        for region in regions
    ]
    joined = [
        Area(feature, feature, np.any([part.mask(raster) for part in those], axis=0), True)
        for feature, those in several.items()
    ]
    return (*single, *joined)


def shared_pixels(regions: Sequence[Region], raster: Raster) -> dict[tuple[str, str], int]:
    """Count the pixels that two regions of different features share, by their names."""
    masks = {region.name: region.mask(raster) for region in regions}
    shared = {
        (one.name, other.name): int((masks[one.name] & masks[other.name]).sum())
        for one, other in combinations(regions, 2)
        if one.feature != other.feature
    }
    return {names: count for names, count in shared.items() if count}
