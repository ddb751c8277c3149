"""The side of a chip that flowed sideways at the rake face: a wedge in which light is reflected."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import cos, pi, radians, sin
from typing import Annotated, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Family, Parameter
from chipglow.quantities.units import ANGLE, LENGTH, POSITION
from chipglow.radiometry import Band
from chipglow.scene import Scene
from chipglow.surface.cross_section import TOWARD_CAMERA, Reflections, Sections, SideElements
from chipglow.surface.directional import Direction
from chipglow.surface.exchange import Exchange
from chipglow.surface.spectral import known_band
from chipglow.surface.surface import ModifiedSurface, Modifier, Surface

REFLECTIONS: Final = Family("reflections")
"""Shapes of the side by their kind; other packages add theirs in ``chipglow.reflections``."""


_RAKE_ELEMENTS: Final = 16
_SIDE_ELEMENTS: Final = 24
_FLAT_ELEMENTS: Final = 16
_FLAT_REACH: Final = 8.0
"""Length of a flat side that is looked at, in heights of what stands out beside it."""


@dataclass(frozen=True)
class SideShape(Modifier):
    """Reflections between the rake face and the chip's side: a class that adds `outline`.

    See `Reflections`.
    """

    effect = "reflections"
    is_grey = False
    max_emissivity = np.inf
    overhang: Annotated[
        float,
        Parameter(
            "How far the tool's side stands out beyond the chip's; negative: the chip's does.",
            POSITION,
        ),
    ] = 0.0
    mirror: Annotated[
        float,
        Parameter(
            "Fraction of the reflected light that is reflected as by a mirror; the rest diffusely.",
            least=0.0,
            most=1.0,
        ),
    ] = 0.0
    rake_emissivity: Annotated[
        float | None,
        Parameter(
            "Emissivity of the rake face beside the chip; none: that of the tool's side there.",
            least=0.0,
            most=1.0,
        ),
    ] = None

    @property
    @abstractmethod
    def outline(self) -> NDArray[np.float64]:
        """Side of the chip from the rake face on: depth and height in m, shape (n, 2).

        The last point is where the chip's side is flat, at a height of ``-overhang``.
        """

    def __post_init__(self) -> None:
        super().__post_init__()
        if not -self.outline[0, 1] > 0:
            raise ValueError(
                f"{type(self).__name__}.overhang: {self.overhang:g} m, with which the chip covers "
                f"the rake face, expected over {self.overhang + self.outline[0, 1]:.3g} m"
            )

    @cached_property
    def elements(self) -> SideElements:
        """The cross-section in elements."""
        side = self.outline
        flat = _FLAT_REACH * abs(self.overhang) * _graded(_FLAT_ELEMENTS)
        level = np.zeros(flat.size)
        height = side[0, 1] * (1.0 - _graded(_RAKE_ELEMENTS)[::-1])
        # Only the lower one of the two flat sides sees anything.
        tool = np.stack([-flat[::-1], level], axis=1) if self.overhang < 0 else np.zeros((1, 2))
        rake = np.stack([np.zeros(height.size), height], axis=1)
        chip = side[-1] + np.stack([flat, level], axis=1)
        sides = [side, chip] if self.overhang > 0 else [side]
        starts, ends = (
            np.concatenate([line[part] for line in (tool, rake, *sides)])
            for part in (slice(None, -1), slice(1, None))
        )
        there = np.hypot(*(ends - starts).T) > 0.0  # an arc of 90° has no length
        exchange = Exchange(starts[there], ends[there])
        return SideElements(exchange, len(tool) - 1, _RAKE_ELEMENTS)

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Reflections:
        if scene.tool is None:
            raise ValueError(
                "reflections: the scene does not state its tool, expected one, between whose rake "
                "face and the chip light is reflected"
            )
        band, cosines = known_band(self.effect, band), self.elements.cosines
        modifiers = surface.modifiers if isinstance(surface, ModifiedSurface) else ()
        directions = [one for one in modifiers if isinstance(one, Direction)]
        return Reflections(
            self.elements,
            Sections.of(scene.raster, scene.tool, self.elements),
            band,
            0.0 if reflected is None else float(band.radiance(reflected)),
            self.mirror,
            self.rake_emissivity,
            directions[-1].slope_ratio(cosines) if directions else np.ones(cosines.shape),
        )

    def effective_emissivity(
        self, chip: float, tool: float, tool_radiance: float = 1.0, surroundings: float = 0.0
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return depths in m into an isothermal chip, and what the camera sees there.

        All radiances are over that of a blackbody as warm as the chip.
        """
        elements = self.elements
        count = len(elements.exchange.lengths)
        black, emissivities = np.full(count, float(tool_radiance)), np.full(count, tool)
        black[elements.chip], emissivities[elements.chip] = 1.0, chip
        emissivities[elements.face] = tool if self.rake_emissivity is None else self.rake_emissivity
        seen = emissivities * black
        incident = elements.exchange.incident
        seen += (1.0 - emissivities) * incident(
            black, emissivities, surroundings, self.mirror, TOWARD_CAMERA
        )
        return elements.depths[elements.chip], seen[elements.chip]


@REFLECTIONS.part
@dataclass(frozen=True)
class Wedge(SideShape):
    """A bulge of the chip's side: it leaves the rake face at an angle and bends flat in an arc.

    An angle of 90° and an overhang of the tool are a chip without side flow that runs behind the
    tool's side. Angle and radius are assumptions: the paper says only that side flow makes a
    three-dimensional side, and that reflections there explain its rake face. The defaults open
    a wedge of 71 um that is 29 um deep, 1 % of the width of the paper's disc.
    """

    kind: ClassVar[str] = "wedge"
    example: ClassVar[str] = "{kind: wedge, angle: 45 deg, bulge_radius: 100 um}"
    angle: Annotated[
        float,
        Parameter(
            "Angle between rake face and chip's side where they meet; an assumption.",
            ANGLE,
            over=0.0,
            most=pi / 2,
        ),
    ] = radians(45.0)
    bulge_radius: Annotated[
        float, Parameter("Radius of the bulge's arc; an assumption.", LENGTH, over=0.0)
    ] = 100e-6

    @property
    def outline(self) -> NDArray[np.float64]:
        slope = (pi / 2 - self.angle) * (1.0 - _graded(_SIDE_ELEMENTS))
        depth = self.bulge_radius * (cos(self.angle) - np.sin(slope))
        height = self.bulge_radius * (np.cos(slope) - 1.0) - self.overhang
        return np.stack([depth, height], axis=1)

    @property
    def width(self) -> float:
        """Depth into the chip in m at which its side is flat."""
        return self.bulge_radius * cos(self.angle)

    @property
    def height(self) -> float:
        """Height of the rake face that is bare beside the chip, in m."""
        return self.bulge_radius * (1.0 - sin(self.angle)) + self.overhang


def _graded(count: int) -> NDArray[np.float64]:
    """Ends of `count` elements from 0 to 1, shorter toward 0."""
    return np.linspace(0.0, 1.0, count + 1) ** 2
