"""Zones of the observed object: their emissivity and their outlines."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import astuple, dataclass, replace
from math import cos, isfinite, sin
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.scene import Raster, Region, Tool

Labels: TypeAlias = NDArray[np.int16]
"""Index of the zone at each point, or `NOTHING`."""

NOTHING: Final = -1
"""Label of points that emit no light."""


@dataclass(frozen=True)
class Zone:
    """A part of the object with one emissivity, such as the body of a chip.

    Parameters
    ----------
    name : str
        Name in budgets and messages.
    emissivity : float or None
        Emissivity, above 0 and at most 1; None: unknown, so that no temperature is determined.
    shape : Region, Tool or None
        Outline in the measurement's coordinates; None: the rest of the image.
    uncertainty : float
        Standard uncertainty of the emissivity that is common to the zone.
    texture : float
        Standard deviation of the emissivity within the zone.
    grain : float
        Length in m over which the texture changes.

    Raises
    ------
    ValueError
        If a number is out of its limits.
    """

    name: str
    emissivity: float | None
    shape: Region | Tool | None = None
    uncertainty: float = 0.0
    texture: float = 0.0
    grain: float = 20e-6

    def __post_init__(self) -> None:
        if self.emissivity is not None and not 0 < self.emissivity <= 1:
            raise ValueError(
                f"zone {self.name}: emissivity is {self.emissivity!r}, "
                "must be above 0 and at most 1"
            )
        for name in ("uncertainty", "texture"):
            value = getattr(self, name)
            if not (isfinite(value) and 0 <= value < 1):
                raise ValueError(f"zone {self.name}: {name} is {value!r}, expected 0 to below 1")
        if not 0 < self.grain < 1:
            raise ValueError(f"zone {self.name}: grain is {self.grain!r} m, must be above 0 m")


def covers_a_pixel(tool: Tool, pixels: Raster) -> bool:
    """Return whether a tool covers the centre of a pixel."""
    return bool(_inside(tool, pixels, *np.meshgrid(pixels.x, pixels.y)).any())


def check_tools(shapes: Iterable[Region | Tool | None], pixels: Raster) -> None:
    """Raise a ValueError if a tool covers no pixel's centre: its place is wrong."""
    for tool in shapes:
        if isinstance(tool, Tool) and not covers_a_pixel(tool, pixels):
            left, right, bottom, top = (1e6 * edge for edge in pixels.extent)
            x, y = (1e6 * float(place) for place in tool.tip)
            raise ValueError(
                f"tool: its tip at ({x:.4g}, {y:.4g}) um is outside the image, expected a tool "
                f"that reaches x {left:.4g} to {right:.4g} um and y {bottom:.4g} to {top:.4g} um"
            )


@dataclass(frozen=True)
class Motion:
    """A rigid displacement of the outlines: to the right and up in m, and a turn in rad."""

    right: float = 0.0
    up: float = 0.0
    turn: float = 0.0


AT_REST: Final = Motion()


class ObservedObject(ABC):
    """Zones of the object and their emissivity at each point of the image."""

    zones: tuple[Zone, ...]
    motion: Motion
    centre: tuple[float, float]
    """Point in m about which a turn of the outlines is taken."""

    @abstractmethod
    def moved(self, motion: Motion) -> "ObservedObject":
        """Return the object with its outlines displaced by `motion` from their stated position."""

    def look_up(self, x: Array, y: Array) -> tuple[Labels, Array]:
        """Return the label and the emissivity of points in m, each of the shape of `x`."""
        right, up, turn = astuple(self.motion)
        across, along = x - self.centre[0] - right, y - self.centre[1] - up
        # The inverse of the motion leads from the image to the stated outlines.
        stated_x = self.centre[0] + cos(turn) * across + sin(turn) * along
        stated_y = self.centre[1] - sin(turn) * across + cos(turn) * along
        return self._at(stated_x, stated_y)

    @abstractmethod
    def _at(self, x: Array, y: Array) -> tuple[Labels, Array]:
        """Return labels and emissivities of points before the motion."""


@dataclass(frozen=True)
class ShapedObject(ObservedObject):
    """An object whose zones have shapes; where shapes overlap, the later zone counts."""

    zones: tuple[Zone, ...]
    pixels: Raster
    motion: Motion = AT_REST

    def __post_init__(self) -> None:
        if not self.zones:
            raise ValueError("zones: there are none, expected 1 or more")
        names = [zone.name for zone in self.zones]
        if len(set(names)) < len(names):
            raise ValueError(f"zones: a name occurs twice: {', '.join(names)}")

    @property
    def centre(self) -> tuple[float, float]:  # type: ignore[override]
        left, right, bottom, top = self.pixels.extent
        return (left + right) / 2, (bottom + top) / 2

    def moved(self, motion: Motion) -> "ShapedObject":
        return replace(self, motion=motion)

    def _at(self, x: Array, y: Array) -> tuple[Labels, Array]:
        labels = np.full(x.shape, NOTHING, np.int16)
        for number, zone in enumerate(self.zones):
            labels[_inside(zone.shape, self.pixels, x, y)] = number
        known = np.array([zone.emissivity or 1.0 for zone in self.zones])
        return labels, np.where(labels == NOTHING, 0.0, known[labels])


def _inside(shape: Region | Tool | None, pixels: Raster, x: Array, y: Array) -> NDArray[np.bool_]:
    if shape is None:
        return np.ones(x.shape, np.bool_)
    if isinstance(shape, Tool):
        return shape.signed_distance(x, y) < 0
    if shape.unit == "m":
        return shape.shape.holds(x, y)
    column, row = (x - pixels.left) / pixels.spacing, (pixels.top - y) / pixels.spacing
    return shape.shape.holds(column, row)


@dataclass(frozen=True, eq=False)
class SampledObject(ObservedObject):
    """An object whose labels and emissivities are known on the samples of a raster.

    Beyond the raster, those of its edge continue.
    """

    zones: tuple[Zone, ...]
    samples: Raster
    labels: Labels
    emissivity: Array
    motion: Motion = AT_REST

    @property
    def centre(self) -> tuple[float, float]:  # type: ignore[override]
        left, right, bottom, top = self.samples.extent
        return (left + right) / 2, (bottom + top) / 2

    def moved(self, motion: Motion) -> "SampledObject":
        return replace(self, motion=motion)

    def _at(self, x: Array, y: Array) -> tuple[Labels, Array]:
        samples = self.samples
        column = np.floor((x - samples.left) / samples.spacing).astype(np.intp)
        row = np.floor((samples.top - y) / samples.spacing).astype(np.intp)
        at = row.clip(0, samples.rows - 1), column.clip(0, samples.columns - 1)
        return self.labels[at], self.emissivity[at]
