"""Description of regions in a file: named polygons, rectangles and circles of an image."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import PlainValidator

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import POSITION
from chipglow.scene import Circle, Polygon, Region
from chipglow.text import load_described

_SHAPES: Final = ("polygon", "rectangle", "circle")


def _coordinate(value: object) -> float | str:
    """Check a number of pixels, or a text with a unit of length."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    try:
        POSITION.parse(value)
    except ValueError:
        raise ValueError(
            f"{value!r}, expected a number of pixels, or a position such as 120 um"
        ) from None
    return str(value)


Coordinate = Annotated[float | str, PlainValidator(_coordinate)]
PointField = tuple[Coordinate, Coordinate]


@dataclass(frozen=True)
class CircleSection(Part):
    """A circle; coordinates may be text with a unit, those of a `Region` are in m."""

    centre: Annotated[PointField, Parameter("Its middle.")] = (0.0, 0.0)
    radius: Annotated[Coordinate, Parameter("Its radius.")] = 0.0


@dataclass(frozen=True)
class RegionSection(Part):
    """One region: a polygon, a rectangle or a circle.

    Its name is its key in the file, and each shape is a key of its own; a `Region` has one shape.
    """

    polygon: Annotated[tuple[PointField, ...] | None, Parameter("Corners in order.")] = None
    rectangle: Annotated[
        tuple[PointField, PointField] | None, Parameter("Two opposite corners.")
    ] = None
    circle: Annotated[CircleSection | None, Parameter("Centre and radius.")] = None
    feature: Annotated[str, Parameter("The feature to which it belongs; by default its name.")] = ""

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
            (*centre, radius), unit = _numbers(*self.circle.centre, self.circle.radius)
            return Region(name, Circle((centre[0], centre[1]), radius), self.feature, unit)
        corners = self.polygon or self.rectangle or ()
        numbers, unit = _numbers(*(coordinate for corner in corners for coordinate in corner))
        points = tuple(zip(numbers[::2], numbers[1::2], strict=True))
        shape = Polygon(points) if self.rectangle is None else Polygon.rectangle(*points)
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


def _numbers(*coordinates: float | str) -> tuple[list[float], Literal["pixel", "m"]]:
    """Return coordinates in pixels or in m, and which of these it is."""
    kinds = {isinstance(coordinate, str) for coordinate in coordinates}
    if len(kinds) > 1:
        raise ValueError("pixels and lengths are mixed, expected all of one kind")
    numbers = [POSITION.parse(one) if isinstance(one, str) else one for one in coordinates]
    return numbers, "m" if True in kinds else "pixel"


def load_regions(path: str | Path) -> tuple[Region, ...]:
    """Read named regions of an image from a YAML file.

    Parameters
    ----------
    path : str or Path
        YAML file of polygons, rectangles and circles.
    """
    return load_described(RegionsDescription, path).build()
