"""Description of places in a file: named regions, points and lines of an image."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Final, Literal, TypeAlias

from pydantic import BeforeValidator, PlainValidator, ValidationInfo

from chipglow.camera import PSFS, PSFChoice
from chipglow.laboratory.emissivity.emissivity import LABORATORY, EmissivityLine
from chipglow.laboratory.emissivity.file import read_emissivity_lines
from chipglow.laboratory.emissivity.temperature import reflected_temperature
from chipglow.quantities import FileBeside, Parameter, Part
from chipglow.quantities.part import beside_the_study
from chipglow.quantities.units import KELVINS, LENGTH, POSITION, TEMPERATURE, TEMPERATURE_DIFFERENCE
from chipglow.scene import Circle, Pixel, Polygon, Polyline, Region
from chipglow.scene.regions import named_value
from chipglow.text import DescriptionError, load_described
from chipglow.uncertainty import Estimate

Palette: TypeAlias = Literal["inferno", "viridis", "cividis", "grey", "turbo"]

FOUND: Final = "found"
"""Names the tool that is detected in the image."""

TOOL: Final = "tool"
"""Name of the tool's emissivity and zone."""

ELSEWHERE: Final = "elsewhere"
"""Name of the rest of the image."""

OF_A_CORRECTION: Final = (TOOL, ELSEWHERE)
"""Names of emissivities that are not those of a place."""

_SHAPES: Final = ("polygon", "rectangle", "circle")


def _tool(file: object, info: ValidationInfo) -> object:
    return file if file == FOUND else beside_the_study(file, info)


PSFField = Annotated[PSFChoice, PSFS]
ToolField = Annotated[str, BeforeValidator(_tool)]


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

    Its name is its key in the file, and each shape has its own key; a `Region` has one shape.
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
class KnownEmissivity(Part):
    """Emissivity of a place, known from elsewhere."""

    mean: Annotated[float, Parameter("Emissivity.", over=0.0, most=1.0)]
    uncertainty: Annotated[float, Parameter("Its standard uncertainty.", least=0.0, under=1.0)] = (
        0.0
    )

    def line(self) -> EmissivityLine:
        """Return it as the same emissivity at all temperatures."""
        return EmissivityLine.constant(self.mean, self.uncertainty)


@dataclass(frozen=True)
class ImageView(Part):
    """How the app shows an image; it changes no number."""

    frame: Annotated[int, Parameter("Index of the frame.", least=0)] = 0
    low: Annotated[
        float | None, Parameter("Lower end of the colours; none: of the image.", TEMPERATURE)
    ] = None
    high: Annotated[
        float | None, Parameter("Upper end of the colours; none: of the image.", TEMPERATURE)
    ] = None
    palette: Annotated[Palette, Parameter("Colours; only turbo is not colour-blind safe.")] = (
        "inferno"
    )
    isotherm: Annotated[
        float | None, Parameter("Temperature at which a contour is drawn.", TEMPERATURE)
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low is not None and self.high is not None and not self.low < self.high:
            low, high = TEMPERATURE.text(self.low), TEMPERATURE.text(self.high)
            raise ValueError(f"low: {low} is not below high, {high}")


@dataclass(frozen=True)
class PlacesDescription(Part):
    """A file of places in an image: regions, points and lines, and what is known of them."""

    file: Annotated[str | None, Parameter("Measurement or camera file that the app opens.")] = None
    regions: Annotated[dict[str, RegionSection], Parameter("Regions by name.")] = field(
        default_factory=dict
    )
    points: Annotated[
        dict[str, PointField], Parameter("Points by name; each stands for its pixel.")
    ] = field(default_factory=dict)
    lines: Annotated[
        dict[str, tuple[PointField, ...]], Parameter("Lines by name, from corner to corner.")
    ] = field(default_factory=dict)
    emissivities: Annotated[
        dict[str, KnownEmissivity],
        Parameter(
            "Emissivities by the name of a place or feature; for a correction also 'tool', and "
            "'elsewhere' for the rest of the image."
        ),
    ] = field(default_factory=dict)
    emissivity_file: Annotated[
        FileBeside | None,
        Parameter(
            "Output of chipglow emissivity: emissivities by the name of a place or feature, except "
            "those that 'emissivities' states."
        ),
    ] = None
    elsewhere: Annotated[
        str | None,
        Parameter(
            "Name of the emissivity of the rest of the image in a correction, of 'emissivity_file'."
        ),
    ] = None
    reflected: Annotated[
        float, Parameter("Temperature of the reflected surroundings.", KELVINS)
    ] = LABORATORY
    reflected_uncertainty: Annotated[
        float, Parameter("Its standard uncertainty.", TEMPERATURE_DIFFERENCE, least=0.0)
    ] = 0.0
    psf: Annotated[PSFField | None, Parameter("Point spread function of a correction.")] = None
    psf_uncertainty: Annotated[
        float, Parameter("Relative standard uncertainty of its width.", least=0.0)
    ] = 0.0
    tool: Annotated[
        ToolField | None,
        Parameter(
            "Tool of a correction: a YAML file, or 'found' to detect it in the image; none: as the "
            "measurement states.",
            allowed="none, found, or a file such as tool.yaml",
        ),
    ] = None
    outline_uncertainty: Annotated[
        float | None,
        Parameter(
            "Standard uncertainty of the position of the outlines; none: of a found tool.",
            LENGTH,
            least=0.0,
        ),
    ] = None
    view: Annotated[ImageView, Parameter("How the app shows the image.")] = field(
        default_factory=ImageView
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        places = self.places()
        if not places and "view" not in self.given:  # a session may have none
            raise ValueError("regions: there are none, expected 1 region, point or line or more")
        names = [place.name for place in places]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name}: two places have this name, expected unique names")
        known = {*names, *(place.feature for place in places), *OF_A_CORRECTION}
        for name in self.emissivities.keys() - known:
            raise ValueError(
                f"emissivities: {name!r} is no place or feature, expected one of {', '.join(known)}"
            )
        if self.elsewhere is None:
            return
        if ELSEWHERE in self.emissivities:
            raise ValueError(
                f"elsewhere: 'emissivities' has a number for {ELSEWHERE!r}, expected one of them"
            )
        if self.emissivity_file is None:
            raise ValueError("elsewhere: is a name in 'emissivity_file', which is missing")

    def places(self) -> tuple[Region, ...]:
        """Return regions, points and lines."""
        return (
            *(section.region(name) for name, section in self.regions.items()),
            *(_named("points", name, (point,)) for name, point in self.points.items()),
            *(_named("lines", name, corners) for name, corners in self.lines.items()),
        )

    def zones(self) -> tuple[Region, ...]:
        """Return the regions with an emissivity, which a correction distinguishes."""
        known = self.known()
        return tuple(
            place
            for place in self.places()
            if place.has_area and named_value(known, place) is not None
        )

    @property
    def states_emissivity(self) -> bool:
        """Whether there are emissivities."""
        return bool(self.emissivities) or self.emissivity_file is not None

    def known(self) -> dict[str, EmissivityLine]:
        """Return the emissivities by the names of their places or features."""
        file = self.emissivity_file
        stored = {} if file is None else read_emissivity_lines(file)
        return stored | {name: one.line() for name, one in self.emissivities.items()}

    def surroundings(self) -> Estimate | None:
        """Return the temperature of the reflected surroundings in K if it is stated."""
        if not self.given & {"reflected", "reflected_uncertainty"}:
            return None
        return reflected_temperature(self.reflected, self.reflected_uncertainty)


def _named(kind: str, name: str, corners: tuple[PointField, ...]) -> Region:
    """Return a point or a line that a section names."""
    try:
        numbers, unit = _numbers(*(coordinate for corner in corners for coordinate in corner))
        points = tuple(zip(numbers[::2], numbers[1::2], strict=True))
        shape = Pixel(points[0]) if kind == "points" else Polyline(points)
    except ValueError as error:
        raise ValueError(f"{kind}.{name}: {error}") from None
    return Region(name, shape, "", unit)


def _numbers(*coordinates: float | str) -> tuple[list[float], Literal["pixel", "m"]]:
    """Return coordinates in pixels or in m, and which of these it is."""
    kinds = {isinstance(coordinate, str) for coordinate in coordinates}
    if len(kinds) > 1:
        raise ValueError("pixels and lengths are mixed, expected all of one kind")
    numbers = [POSITION.parse(one) if isinstance(one, str) else one for one in coordinates]
    return numbers, "m" if True in kinds else "pixel"


def load_places(path: str | Path) -> PlacesDescription:
    """Read the places of an image, and what is known of them, from a YAML file.

    Parameters
    ----------
    path : str or Path
        YAML file of regions, points and lines; the app saves one.
    """
    return load_described(PlacesDescription, path)


def load_regions(path: str | Path) -> tuple[Region, ...]:
    """Read named regions, points and lines of an image from a YAML file.

    Parameters
    ----------
    path : str or Path
        YAML file of polygons, rectangles, circles, points and lines.
    """
    places = load_places(path).places()
    if not places:
        raise DescriptionError(f"{path}: has no region, point or line; draw one or more")
    return places
