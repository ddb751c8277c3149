"""The side of a chip that flowed sideways at the rake face: a wedge in which light is reflected."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import cos, pi, radians
from typing import Annotated, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array, Family, Parameter, zero_to_one
from chipglow.quantities.units import ANGLE, LENGTH, POSITION
from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Raster, Scene, Tool
from chipglow.surface.directional import Direction
from chipglow.surface.exchange import Exchange
from chipglow.surface.spectral import required_band
from chipglow.surface.surface import Change, ModifiedSurface, Modifier, Surface

REFLECTIONS: Final = Family("reflections")
"""Shapes of the side by their kind; other packages add theirs in ``chipglow.reflections``."""

TOUCHING: Final = 3e-6
"""Distance from the rake face in m within which chip counts as touching it."""

TOWARD_CAMERA: Final = (0.0, 1.0)

_INSIDE: Final = 0.75
"""Depth in samples at which the sample that holds a point lies wholly on one side of a face."""

_RAKE_ELEMENTS: Final = 16
"""Elements of the rake face, graded towards the contact."""

_SIDE_ELEMENTS: Final = 24
"""Elements of the bulged side of the chip, graded."""

_FLAT_ELEMENTS: Final = 16
"""Elements of the flat side of tool or chip, of that which is lower, graded."""

_FLAT_REACH: Final = 8.0
"""Length of a flat side that is looked at, in heights of what stands out beside it."""


@dataclass(frozen=True, eq=False)
class SideElements:
    """Cross-section of the sides of tool and chip at the rake face, in elements.

    Places are (depth, height) in m: depth from the rake face into the chip, height from the side of
    the tool to the camera.
    """

    exchange: Exchange
    """The elements: those of the tool's side, of the rake face, then of the chip's side."""
    tool_side: int
    """Number of elements of the tool's side; the rake face has 16."""

    @property
    def depths(self) -> NDArray[np.float64]:
        """Middles of the elements from the rake face into the chip in m; 0 on the face."""
        return self.exchange.middles[:, 0]

    @cached_property
    def cosines(self) -> NDArray[np.float64]:
        """Cosines of the angles between the elements' normals and the direction to the camera."""
        along = self.exchange.ends - self.exchange.starts
        return np.asarray(along[:, 0] / self.exchange.lengths, np.float64)

    @property
    def chip(self) -> slice:
        """The elements of the chip."""
        return slice(self.tool_side + _RAKE_ELEMENTS, None)

    @property
    def face(self) -> slice:
        """The elements of the rake face."""
        return slice(self.tool_side, self.tool_side + _RAKE_ELEMENTS)


class _Sections(NamedTuple):
    """Cross-sections at right angles to the rake face, one to a sample along it."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    """Samples that the elements are seen in, shape (section, element)."""
    probes: tuple[NDArray[np.intp], NDArray[np.intp]]
    """Rows and columns of the samples by which a section is touched, (section, height) each."""
    samples: NDArray[np.intp]
    """Row, column, section and element of all samples beside the face, shape (4, sample)."""
    weight: NDArray[np.float64]
    """Position of each sample between its element and the next one, 0 to 1."""


def _sections(raster: Raster, tool: Tool, elements: SideElements) -> _Sections:
    """Return the cross-sections of a scene."""
    x, y = np.meshgrid(raster.x, raster.y)
    along, depth = tool.face_coordinates(np.stack([x, y], axis=-1))
    count = max(int(along.max() / raster.spacing) + 1, 0)
    foot = tool.rake_point((np.arange(count) + 0.5) * raster.spacing)
    step = raster.spacing / 2
    # Lines half a sample apart miss no sample; the first is within the samples on the face.
    heights = np.arange(raster.spacing / 4, TOUCHING + step, step)
    section = np.floor(along / raster.spacing).astype(np.intp)
    beside = np.flatnonzero((section >= 0) & (section < count))
    known, number, weight = _between(elements, depth.ravel()[beside])
    beside = beside[known]
    placed = (*np.divmod(beside, raster.columns), section.ravel()[beside], number)
    # So far from the face that a sample is on its element's side of it; the rake face has the
    # temperature of the tool beside it.
    inside, depths = _INSIDE * raster.spacing, elements.depths
    of_tool = np.arange(depths.size) < elements.chip.start
    looked_up = np.where(of_tool, np.minimum(depths, -inside), np.maximum(depths, inside))
    rows, columns = _samples_at(raster, tool, foot, looked_up)
    probes = _samples_at(raster, tool, foot, heights)
    return _Sections(rows, columns, probes, np.stack(placed), weight)


@dataclass(frozen=True)
class SideShape(Modifier):
    """Reflections between the rake face and the chip's side: a class that adds `outline`.

    Samples seen in the camera's direction have the temperatures of the scene; the rake face has
    that of the tool's side next to it. In each cross-section at right angles to the rake face that
    the chip touches, all bounces are summed as if it continued unchanged (`Exchange`). The apparent
    radiance is ε L + (1 − ε) times the incident radiance. It is returned as an effective
    emissivity: apparent radiance over blackbody radiance, each minus that of the surroundings;
    above 1 where the sample reflects more than it would emit as a blackbody.
    """

    effect = "reflections"
    is_grey = False
    max_emissivity = np.inf
    overhang: Annotated[
        float,
        Parameter(
            "Distance of the tool's side beyond the chip's; negative: the chip's is beyond.",
            POSITION,
        ),
    ] = 0.0
    mirror: Annotated[
        float,
        zero_to_one(
            "Fraction of the reflected light that is reflected as by a mirror; the rest diffusely."
        ),
    ] = 0.0
    rake_emissivity: Annotated[
        float | None,
        zero_to_one(
            "Emissivity of the rake face beside the chip; none: that of the tool's side there."
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
                f"the rake face, expected more than {self.overhang + self.outline[0, 1]:.3g} m"
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
        return SideElements(exchange, len(tool) - 1)

    def change(
        self, surface: Surface, scene: Scene, band: Band | None, reflected: float | None
    ) -> Change:
        if scene.tool is None:
            raise ValueError(
                "reflections: the scene has no tool; state the tool whose rake face exchanges "
                "light with the chip"
            )
        black_in_band, cosines = required_band(self.effect, band).radiance, self.elements.cosines
        surroundings = 0.0 if reflected is None else float(black_in_band(reflected))
        modifiers = surface.modifiers if isinstance(surface, ModifiedSurface) else ()
        directions = [one for one in modifiers if isinstance(one, Direction)]
        ratio = directions[-1].slope_ratio(cosines) if directions else np.ones(cosines.shape)
        sections = _sections(scene.raster, scene.tool, self.elements)

        def black(frame: Frame, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
            return np.asarray(black_in_band(frame.temperature[rows, columns].astype(np.float64)))

        def with_reflections(emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float32]:
            chip = frame.material[sections.probes] == Material.WORKPIECE
            tool = frame.material[sections.rows, sections.columns] == Material.TOOL
            touching = chip.any(axis=1) & tool.any(axis=1)
            if not touching.any():
                return emissivity
            rows, columns = sections.rows[touching], sections.columns[touching]
            # Beyond the end of the chip is void, from which the light of the surroundings comes.
            void = frame.material[rows, columns] == Material.VOID
            values = emissivity[rows, columns].astype(np.float64)
            if self.rake_emissivity is not None:
                values[:, self.elements.face] = self.rake_emissivity
            incident = np.full((len(touching), values.shape[1]), surroundings)
            light = np.where(void, surroundings, black(frame, rows, columns))
            values = np.where(void, 1.0, values)
            incident[touching] = self.elements.exchange.incident(
                light, values, surroundings, self.mirror, TOWARD_CAMERA
            )
            rows, columns, section, _ = sections.samples
            visible = touching[section] & (frame.material[rows, columns] != Material.VOID)
            rows, columns, section, element = sections.samples[:, visible]
            weight = sections.weight[visible]
            slopes = (1 - weight) * ratio[element] + weight * ratio[element + 1]
            added = (1 - weight) * incident[section, element]
            added += weight * incident[section, element + 1]
            own = np.minimum(emissivity[rows, columns] * slopes, 1.0)
            gain = black(frame, rows, columns) - surroundings
            # A sample just as warm as its surroundings shows neither itself nor what it reflects.
            shows = np.abs(gain) > 1e-6 * surroundings
            effective = own + (1.0 - own) * np.divide(
                added - surroundings, gain, out=np.zeros_like(gain), where=shows
            )
            result = emissivity.copy()
            result[rows, columns] = np.maximum(effective, 0.0)
            return result

        return with_reflections

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

    kind = "wedge"
    example = "{kind: wedge, angle: 45 deg, bulge_radius: 100 um}"
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
        float, Parameter("Radius of the bulge's arc; an assumption.", LENGTH)
    ] = 100e-6

    @property
    def outline(self) -> NDArray[np.float64]:
        slope = (pi / 2 - self.angle) * (1.0 - _graded(_SIDE_ELEMENTS))
        depth = self.bulge_radius * (cos(self.angle) - np.sin(slope))
        height = self.bulge_radius * (np.cos(slope) - 1.0) - self.overhang
        return np.stack([depth, height], axis=1)


def _graded(count: int) -> NDArray[np.float64]:
    """Return the ends of `count` elements from 0 to 1, shorter toward 0."""
    return np.linspace(0.0, 1.0, count + 1) ** 2


def _between(
    elements: SideElements, depth: Array
) -> tuple[NDArray[np.bool_], NDArray[np.intp], Array]:
    """Return which depths are beside a side, the element before each of them, and the way on."""
    middles, in_tool = elements.depths, depth < 0
    first = np.where(in_tool, 0, elements.chip.start)
    last = np.where(in_tool, elements.tool_side, middles.size) - 1
    known = (first < last) & (depth != 0) & (depth >= middles[0]) & (depth <= middles[-1])
    depth = depth[known]
    number = np.searchsorted(middles, depth) - 1
    number = np.clip(number, first[known], last[known] - 1)
    weight = (depth - middles[number]) / (middles[number + 1] - middles[number])
    return known, number, np.clip(weight, 0.0, 1.0)


def _samples_at(
    raster: Raster, tool: Tool, foot: NDArray[np.float64], depths: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of the samples at depths from points of the rake face.

    Beyond the scene's border it continues as at the border.
    """
    points = foot[:, None] + depths[:, None] * np.array(tool.rake_normal)
    rows = np.floor((raster.top - points[..., 1]) / raster.spacing).astype(np.intp)
    columns = np.floor((points[..., 0] - raster.left) / raster.spacing).astype(np.intp)
    return np.clip(rows, 0, raster.rows - 1), np.clip(columns, 0, raster.columns - 1)
