"""Description of regions in a file: named polygons, rectangles and circles of an image."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import PlainSerializer, PlainValidator

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import POSITION
from chipglow.scene import Circle, Polygon, Region
from chipglow.scene.regions import Point
from chipglow.text import load_described

_SHAPES: Final = ("polygon", "rectangle", "circle")


@dataclass(frozen=True)
class Coordinate:
    """A coordinate or a length of a region."""

    value: float
    """In pixels or in m."""
    unit: Literal["pixel", "m"]


def _coordinate(value: object) -> Coordinate:
    """Read a number of pixels, or a text with a unit of length."""
    if isinstance(value, Coordinate):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool):
        return Coordinate(float(value), "pixel")
    try:
        return Coordinate(POSITION.parse(value), "m")
    except ValueError:
        raise ValueError(
            f"{value!r}, expected a number of pixels, or a position such as 120 um"
        ) from None


def _as_written(coordinate: Coordinate) -> float | str:
    return coordinate.value if coordinate.unit == "pixel" else POSITION.text(coordinate.value)


CoordinateField = Annotated[
    Coordinate, PlainValidator(_coordinate), PlainSerializer(_as_written, when_used="json")
]
PointField = tuple[CoordinateField, CoordinateField]


@dataclass(frozen=True)
class CircleSection(Part):
    """A circle."""

    centre: Annotated[PointField, Parameter("Its middle.")] = (
        Coordinate(0.0, "pixel"),
        Coordinate(0.0, "pixel"),
    )
    radius: Annotated[CoordinateField, Parameter("Its radius.")] = Coordinate(0.0, "pixel")


@dataclass(frozen=True)
class RegionSection(Part):
    """One region: a polygon, a rectangle or a circle."""

    polygon: Annotated[tuple[PointField, ...] | None, Parameter("Corners in order.")] = None
    rectangle: Annotated[
        tuple[PointField, PointField] | None, Parameter("Two opposite corners.")
    ] = None
    circle: Annotated[CircleSection | None, Parameter("Centre and radius.")] = None
    feature: Annotated[str, Parameter("What it is a part of; by default its own name.")] = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        given = [name for name in _SHAPES if getattr(self, name) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "no shape"
            raise ValueError(f"{found}, expected one of {', '.join(_SHAPES)}")
        self.region("region")

    def region(self, name: str) -> Region:
        """Return the region that this section describes."""
        if self.circle is not None:
            places, radius = (self.circle.centre,), self.circle.radius
            unit = _unit([*places[0], radius])
            return Region(name, Circle(_point(places[0]), radius.value), self.feature, unit)
        corners = self.polygon if self.rectangle is None else self.rectangle
        assert corners is not None
        points = tuple(_point(corner) for corner in corners)
        shape = Polygon(points) if self.rectangle is None else Polygon.rectangle(*points)
        unit = _unit(coordinate for corner in corners for coordinate in corner)
        return Region(name, shape, self.feature, unit)


@dataclass(frozen=True)
class RegionsDescription(Part):
    """A file of regions."""

    regions: Annotated[dict[str, RegionSection], Parameter("Regions by name.")] = field(
        default_factory=dict
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.regions:
            raise ValueError("regions: there are none, expected 1 region or more")
        self.build()

    def build(self) -> tuple[Region, ...]:
        """Return the regions."""
        return tuple(section.region(name) for name, section in self.regions.items())


def _point(place: tuple[Coordinate, Coordinate]) -> Point:
    return place[0].value, place[1].value


def _unit(coordinates: Iterable[Coordinate]) -> Literal["pixel", "m"]:
    units = {coordinate.unit for coordinate in coordinates}
    if len(units) > 1:
        raise ValueError("pixels and lengths are mixed, expected all of one kind")
    return units.pop() if units else "pixel"


def load_regions(path: str | Path) -> tuple[Region, ...]:
    """Read named regions of an image from a YAML file.

    Parameters
    ----------
    path : str or Path
        YAML file of polygons, rectangles and circles.
    """
    return load_described(RegionsDescription, path).build()
