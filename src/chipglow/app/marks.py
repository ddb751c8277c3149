"""Places that a user draws on the images: outlines, handles, and the file that states them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

import numpy as np

from chipglow.laboratory.emissivity import EmissivityLine, PlacesDescription
from chipglow.laboratory.emissivity.places import KnownEmissivity
from chipglow.quantities import Array
from chipglow.quantities.units import KELVINS, POSITION, TEMPERATURE_DIFFERENCE
from chipglow.scene import Circle, Pixel, Polygon, Polyline, Raster, Region
from chipglow.scene.regions import Point, named_value
from chipglow.text.template import yaml_line

Kind: TypeAlias = Literal["point", "line", "box", "circle", "polygon"]

_DECIMALS: Final = 9
"""Decimals of a position in m: a nanometre, which is far less than a pixel."""

_LEAST: Final = 0.5
"""Smallest extent of a drawn line or region, in pixels: less is a click."""


@dataclass(frozen=True)
class Mark:
    """A place that is drawn; its points, in m, are corners, or centre and rim of a circle."""

    name: str
    kind: Kind
    points: tuple[Point, ...]
    emissivity: KnownEmissivity | None = None
    feature: str = ""

    @property
    def region(self) -> Region:
        """The pixels that it means."""
        if self.kind == "point":
            shape: Any = Pixel(self.points[0])
        elif self.kind == "line":
            shape = Polyline(self.points)
        elif self.kind == "box":
            shape = Polygon.rectangle(*self.points)
        elif self.kind == "circle":
            shape = Circle(self.points[0], self.radius)
        else:
            shape = Polygon(self.points)
        return Region(self.name, shape, self.feature, "m")

    @property
    def radius(self) -> float:
        """Distance of its first two points in m."""
        (x, y), (rim_x, rim_y) = self.points[:2]
        return float(np.hypot(rim_x - x, rim_y - y))

    @property
    def line(self) -> EmissivityLine | None:
        """Emissivity, if it is known."""
        return None if self.emissivity is None else self.emissivity.line()

    @property
    def outline(self) -> Array:
        """Points to draw it, shape (n, 2)."""
        outline = self.region.shape.outline
        return outline if self.kind in ("point", "line") else np.concatenate([outline, outline[:1]])

    @property
    def handles(self) -> tuple[Point, ...]:
        """Points by which it is edited: first the one that moves it as a whole."""
        if self.kind in ("point", "circle"):
            return self.points
        x, y = np.mean(self.points, axis=0).tolist()
        return ((x, y), *self.points)

    def moved(self, handle: int, to: Point, raster: Raster) -> "Mark":
        """Return the place with a handle moved, within the image."""
        if handle == 0:
            shift = np.subtract(to, self.handles[0])
            return replace(self, points=_shifted(self.points, shift, raster))
        points = list(self.points)
        points[handle if self.kind == "circle" else handle - 1] = to
        return replace(self, points=tuple(points)).within(raster)

    def within(self, raster: Raster) -> "Mark":
        """Return the place within the image; ValueError if nothing of it is left."""
        points = _rounded(_clipped(self.points, raster))
        if self.kind == "circle":
            points = self._circle(points, raster)
        mark = replace(self, points=points)
        extent = np.ptp(mark.region.shape.outline, axis=0)
        least = extent.max() if self.kind == "line" else extent.min()
        if self.kind != "point" and least < _LEAST * raster.spacing:
            raise ValueError(f"{self.kind}: is smaller than a pixel; drag to draw it")
        return mark

    def _circle(self, points: tuple[Point, ...], raster: Raster) -> tuple[Point, ...]:
        """Return centre and rim of the circle, no larger than the image allows."""
        (x, y), rim = points[0], self.points[1]
        left, right, bottom, top = raster.extent
        radius = float(np.hypot(rim[0] - x, rim[1] - y))
        radius = min(radius, x - left, right - x, y - bottom, top - y)
        return _rounded(((x, y), (x + radius, y)))

    def entry(self) -> tuple[str, Any]:
        """Return the key of the file of places that states it, and its text as YAML has it."""
        texts = [[POSITION.text(value) for value in point] for point in self.points]
        if self.kind == "point":
            return "points", texts[0]
        if self.kind == "line":
            return "lines", texts
        if self.kind == "circle":
            radius = POSITION.text(round(self.radius, _DECIMALS))
            shape: dict[str, Any] = {"circle": {"centre": texts[0], "radius": radius}}
        else:
            shape = {"rectangle" if self.kind == "box" else "polygon": texts}
        return "regions", shape | ({"feature": self.feature} if self.feature else {})


def _clipped(points: Sequence[Point], raster: Raster) -> tuple[Point, ...]:
    left, right, bottom, top = raster.extent
    inside = np.clip(np.array(points), (left, bottom), (right, top))
    return tuple(map(tuple, inside.tolist()))


def _rounded(points: Sequence[Point]) -> tuple[Point, ...]:
    return tuple((round(x, _DECIMALS), round(y, _DECIMALS)) for x, y in points)


def _shifted(points: Sequence[Point], shift: Array, raster: Raster) -> tuple[Point, ...]:
    """Return points moved together, as far as all stay in the image."""
    left, right, bottom, top = raster.extent
    corners = np.array(points)
    low, high = (left, bottom) - corners.min(axis=0), (right, top) - corners.max(axis=0)
    moved = corners + np.clip(shift, np.minimum(low, 0.0), np.maximum(high, 0.0))
    return _rounded(tuple(map(tuple, moved.tolist())))


def new_name(kind: Kind, taken: Sequence[Mark]) -> str:
    """Return the first name of a kind that is not taken, such as box 2."""
    names = {mark.name for mark in taken}
    number = 1
    while f"{kind} {number}" in names:
        number += 1
    return f"{kind} {number}"


def marks_of(described: PlacesDescription, raster: Raster) -> Iterator[Mark]:
    """Yield the places of a file; ValueError for one that is not in the image."""
    for place in described.places():
        place.mask(raster)
        emissivity = named_value(described.emissivities, place)
        feature = "" if place.feature == place.name else place.feature
        yield Mark(place.name, *_drawn(place, raster), emissivity, feature)


def _drawn(place: Region, raster: Raster) -> tuple[Kind, tuple[Point, ...]]:
    """Return the kind of a place and its points in m."""
    points = _rounded(tuple(map(tuple, place.outline(raster).tolist())))
    if isinstance(place.shape, Circle):
        scale = 1.0 if place.unit == "m" else raster.spacing
        (x, y), radius = np.mean(points, axis=0).tolist(), scale * place.shape.radius
        return "circle", _rounded(((x, y), (x + radius, y)))
    if isinstance(place.shape, Pixel):
        return "point", points
    if isinstance(place.shape, Polyline):
        return "line", points
    (left, bottom), (right, top) = np.min(points, axis=0), np.max(points, axis=0)
    corners = {(left, bottom), (right, bottom), (right, top), (left, top)}
    if len(points) == 4 and set(points) == corners:
        return "box", (points[0], points[2])
    return "polygon", points


def places_text(
    marks: Sequence[Mark],
    file: str,
    surroundings: tuple[float, float] | None,
    view: dict[str, Any],
    correction: Mapping[str, Any] = {},
) -> str:
    """Return the file of places as YAML.

    `surroundings` are the reflected temperature and its standard uncertainty in K; `correction`
    has further entries, and emissivities that are not those of places.
    """
    sections: dict[str, dict[str, Any]] = {"regions": {}, "points": {}, "lines": {}}
    for mark in marks:
        key, value = mark.entry()
        sections[key][mark.name] = value
    known = {
        mark.name: {"mean": mark.emissivity.mean, "uncertainty": mark.emissivity.uncertainty}
        for mark in marks
        if mark.emissivity is not None
    }
    known |= correction.get("emissivities", {})
    lines = ["# chipglow app session.yaml", f"file: {yaml_line(file)}"]
    for key, entries in {**sections, "emissivities": known}.items():
        if entries:
            lines.append(f"{key}:")
            lines += [f"  {yaml_line(name)}: {yaml_line(one)}" for name, one in entries.items()]
    if surroundings is not None:
        reflected, uncertainty = surroundings
        lines.append(f"reflected: {KELVINS.text(reflected)}")
        if uncertainty:
            lines.append(f"reflected_uncertainty: {TEMPERATURE_DIFFERENCE.text(uncertainty)}")
    others = {key: value for key, value in correction.items() if key != "emissivities"}
    lines += [f"{key}: {yaml_line(value)}" for key, value in others.items()]
    lines.append(f"view: {yaml_line(view)}")
    return "\n".join(lines) + "\n"
