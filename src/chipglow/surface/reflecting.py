"""A surface that reflects what the rake face and the chip's side send each other."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np
from numpy.typing import NDArray

from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Raster, Scene, Tool
from chipglow.surface.directional import slope_ratio
from chipglow.surface.side_flow import SideShape, Wedge
from chipglow.surface.surface import EmissivityField, EmissivityStack, WrappedSurface

TOUCHING: Final = 3e-6
"""Distance from the rake face in m within which chip counts as touching it."""

_INSIDE: Final = 0.75
"""Depth in samples at which the sample that holds a point lies wholly on one side of a face."""


@dataclass(frozen=True)
class ReflectingSurface(WrappedSurface):
    """Another surface with the reflections between rake face and chip's side.

    Parameters
    ----------
    bare : Surface
        The emissivity.
    shape : SideShape
        Shape of the chip's side, and how it reflects.
    band : Band, optional
        Spectral band in which it is seen; `in_band` sets it, a camera does so by itself.
    reflected : float, optional
        Temperature of the surroundings in K; none by default: they are dark.

    Notes
    -----
    Samples seen in the camera's direction have the temperatures of the scene; the rake face has
    that of the tool's side next to it. In each cross-section at right angles to the rake face that
    the chip touches, all bounces are summed as if it went on alike (`Exchange`). What is seen is
    ε L + (1 − ε) times the incident radiance. It is given as an effective emissivity, by which the
    radiance of the blackbody (less that of the surroundings) is what is seen (less the same): over
    1 where more is reflected than the sample would emit as a blackbody.
    """

    shape: SideShape = field(default_factory=Wedge)
    band: Band | None = None
    reflected: float | None = None

    @property
    def effects(self) -> Mapping[str, str]:
        """See `Surface.effects`."""
        return {**self.bare.effects, "reflections": repr(self.shape)}

    def in_band(self, band: Band, reflected: float | None) -> Self:
        """See `Surface.in_band`."""
        bare = self.bare.in_band(band, reflected)
        return replace(self, bare=bare, band=band, reflected=reflected)

    def on(self, scene: Scene) -> "ReflectingField":
        """Lay the surface on a scene.

        Raises
        ------
        ValueError
            If the scene does not state its tool, or no band is set.
        """
        if scene.tool is None:
            raise ValueError(
                "reflections: the scene does not state its tool, expected one, between whose rake "
                "face and the chip light is reflected"
            )
        if self.band is None:
            raise ValueError("reflections: no band is set, expected that of a camera (in_band)")
        return ReflectingField(
            self.bare.on(scene),
            self.shape,
            self.band,
            0.0 if self.reflected is None else float(self.band.radiance(self.reflected)),
            _Sections.of(scene.raster, scene.tool, self.shape),
            slope_ratio(self.bare, self.shape.elements.cosines),
        )


@dataclass(frozen=True, eq=False)
class ReflectingField(EmissivityField):
    """A `ReflectingSurface` on one scene; made by `ReflectingSurface.on`."""

    bare: EmissivityField
    shape: SideShape
    band: Band
    surroundings: float
    sections: "_Sections"
    slope_ratio: NDArray[np.float64]

    @property
    def needs(self) -> Collection[str] | None:
        """See `EmissivityField.needs`."""
        return self.bare.needs

    @property
    def most(self) -> float:
        """No limit: more may be reflected than a blackbody emits."""
        return np.inf

    def emissivity(self, frame: Frame) -> NDArray[np.float32]:
        """Effective emissivity of every sample of a frame, shape (y, x); 0 in the void."""
        result: NDArray[np.float32] = self.beside(()).emissivities(frame)[0]
        return result

    def beside(self, others: Sequence[EmissivityField]) -> EmissivityStack:
        """Stack of this and other fields: those of one shape look up their bare ones together."""
        alike = [one for one in others if isinstance(one, ReflectingField) and self._is_like(one)]
        if len(alike) < len(others):
            return super().beside(others)
        return _ReflectingStack(self, self.bare.beside([one.bare for one in alike]))

    def _is_like(self, other: "ReflectingField") -> bool:
        return (
            (
                (self.shape, self.band, self.surroundings)
                == (other.shape, other.band, other.surroundings)
            )
            and np.array_equal(self.slope_ratio, other.slope_ratio)
            and (self.sections.raster, self.sections.tool)
            == (
                other.sections.raster,
                other.sections.tool,
            )
        )


@dataclass(frozen=True, eq=False)
class _ReflectingStack(EmissivityStack):
    """Fields of one shape, band and scene."""

    first: ReflectingField
    bare: EmissivityStack

    @property
    def needs(self) -> Collection[str] | None:
        """See `EmissivityStack.needs`."""
        return self.bare.needs

    @property
    def most(self) -> float:
        """No limit: more may be reflected than a blackbody emits."""
        return np.inf

    def emissivities(self, frame: Frame) -> NDArray[np.float32]:
        """See `EmissivityStack.emissivities`; effective emissivities may be over 1."""
        result, sections = self.bare.emissivities(frame), self.first.sections
        touching = sections.touching(frame.material)
        if not touching.any():
            return result
        (rows, columns, section, element), weight = sections.seen(touching, frame.material)
        black = self.first.band.radiance(frame.temperature[rows, columns].astype(np.float64))
        environment = self.first.surroundings
        gain = np.asarray(black, np.float64) - environment
        of_element = self.first.slope_ratio
        slopes = (1 - weight) * of_element[element] + weight * of_element[element + 1]
        # A sample just as warm as its surroundings shows neither itself nor what it reflects.
        told = np.abs(gain) > 1e-6 * environment
        for emissivity in result:
            incident = self._incident(frame, emissivity, touching)
            added = (1 - weight) * incident[section, element]
            added += weight * incident[section, element + 1]
            own = np.minimum(emissivity[rows, columns] * slopes, 1.0)
            effective = own + (1.0 - own) * np.divide(
                added - environment, gain, out=np.zeros_like(gain), where=told
            )
            emissivity[rows, columns] = np.maximum(effective, 0.0)
        return result

    def _incident(
        self, frame: Frame, emissivity: NDArray[np.float32], touching: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Incident radiance on the elements of every section, shape (section, element)."""
        first, sections = self.first, self.first.sections
        rows, columns = sections.rows[touching], sections.columns[touching]
        black = first.band.radiance(frame.temperature[rows, columns].astype(np.float64))
        values = emissivity[rows, columns].astype(np.float64)
        if first.shape.rake_emissivity is not None:
            values[:, first.shape.elements.face] = first.shape.rake_emissivity
        # Where the chip ends there is nothing: what comes from there comes from the surroundings.
        void = frame.material[rows, columns] == Material.VOID
        black = np.where(void, first.surroundings, black)
        values = np.where(void, 1.0, values)
        result = np.full((len(sections.rows), values.shape[1]), first.surroundings)
        result[touching] = first.shape.incident(black, values, first.surroundings)
        return result


@dataclass(frozen=True, eq=False)
class _Sections:
    """Cross-sections at right angles to the rake face, one to a sample along it.

    Parameters
    ----------
    raster, tool
        Of the scene.
    rows, columns : ndarray
        Samples that the elements are seen in, shape (section, element).
    probes : ndarray
        Rows and columns of the samples by which a section is touched, shape (2, section, height).
    samples : ndarray
        Row, column, section and element of all samples beside the face, shape (4, sample).
    weight : ndarray
        How far each is on the way from its element to the next one, 0 to 1, shape (sample,).
    """

    raster: Raster
    tool: Tool
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    probes: NDArray[np.intp]
    samples: NDArray[np.intp]
    weight: NDArray[np.float64]

    @classmethod
    def of(cls, raster: Raster, tool: Tool, shape: SideShape) -> "_Sections":
        """Cross-sections of one shape on one scene."""
        x, y = np.meshgrid(raster.x, raster.y)
        along, depth = tool.face_coordinates(np.stack([x, y], axis=-1))
        count = max(int(along.max() / raster.spacing) + 1, 0)
        foot = tool.rake_point((np.arange(count) + 0.5) * raster.spacing)
        step = raster.spacing / 2
        heights = np.arange(raster.spacing / 4, TOUCHING + step, step)
        section = np.floor(along / raster.spacing).astype(np.intp)
        beside = np.flatnonzero((section >= 0) & (section < count))
        number, weight, known = _between(shape, depth.ravel()[beside])
        beside = beside[known]
        placed = (*np.divmod(beside, raster.columns), section.ravel()[beside], number[known])
        return cls(
            raster,
            tool,
            *_samples_at(raster, tool, foot, _looked_up(shape, raster.spacing)),
            np.stack(_samples_at(raster, tool, foot, heights)),
            np.stack(placed),
            weight[known],
        )

    def touching(self, material: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Which sections the chip touches the rake face in, and the tool is seen in."""
        rows, columns = self.probes
        chip = (material[rows, columns] == Material.WORKPIECE).any(axis=1)
        return np.asarray(chip & (material[self.rows, self.columns] == Material.TOOL).any(axis=1))

    def seen(
        self, touching: NDArray[np.bool_], material: NDArray[np.uint8]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Row, column, section and element of the samples in those sections, and their weights."""
        rows, columns, section, _ = self.samples
        there = touching[section] & (material[rows, columns] != Material.VOID)
        return self.samples[:, there], self.weight[there]


def _looked_up(shape: SideShape, spacing: float) -> NDArray[np.float64]:
    """Depths at which the elements' temperatures are those of a sample on their side of the face.

    The rake face has the temperature of the tool beside it.
    """
    elements = shape.elements
    inside = _INSIDE * spacing
    depths = elements.depths
    tool, chip = np.minimum(depths, -inside), np.maximum(depths, inside)
    number = np.arange(depths.size)
    return np.where(number < elements.chip.start, tool, chip)


def _between(
    shape: SideShape, depth: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
    """Element before each depth, the way to the next, 0 to 1, and whether any is so near."""
    elements, middles = shape.elements, shape.elements.depths
    number, weight = np.zeros(depth.size, np.intp), np.zeros(depth.size)
    known = np.zeros(depth.size, np.bool_)
    sides = (
        (range(elements.tool_side), (depth < 0) & (depth >= middles[0])),
        (range(elements.chip.start, middles.size), (depth > 0) & (depth <= middles[-1])),
    )
    for part, near in sides:
        if len(part) > 1:
            place = np.interp(depth[near], middles[part], np.arange(len(part)))
            first = np.minimum(place.astype(np.intp), len(part) - 2)
            number[near], weight[near] = part.start + first, place - first
            known |= near
    return number, weight, known


def _samples_at(
    raster: Raster, tool: Tool, foot: NDArray[np.float64], depths: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the samples at depths from points of the rake face, (point, depth).

    Beyond the scene's border it goes on as at it.
    """
    points = foot[:, None] + depths[:, None] * np.array(tool.rake_normal)
    rows = np.floor((raster.top - points[..., 1]) / raster.spacing).astype(np.intp)
    columns = np.floor((points[..., 0] - raster.left) / raster.spacing).astype(np.intp)
    return np.clip(rows, 0, raster.rows - 1), np.clip(columns, 0, raster.columns - 1)
