"""Cross-sections of tool and chip at the rake face of a scene, in which light is reflected."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.radiometry import Band
from chipglow.scene import Frame, Material, Raster, Tool
from chipglow.surface.exchange import Exchange

TOUCHING: Final = 3e-6
"""Distance from the rake face in m within which chip counts as touching it."""

TOWARD_CAMERA: Final = (0.0, 1.0)

_INSIDE: Final = 0.75
"""Depth in samples at which the sample that holds a point lies wholly on one side of a face."""


@dataclass(frozen=True, eq=False)
class SideElements:
    """Cross-section of the sides of tool and chip at the rake face, in elements.

    Places are (depth, height) in m: depth from the rake face into the chip, height from the side of
    the tool to the camera.
    """

    exchange: Exchange
    """The elements: those of the tool's side, of the rake face, then of the chip's side."""
    tool_side: int
    rake_face: int
    """Number of elements of the first two."""

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
        return slice(self.tool_side + self.rake_face, None)

    @property
    def face(self) -> slice:
        """The elements of the rake face."""
        return slice(self.tool_side, self.tool_side + self.rake_face)


@dataclass(frozen=True, eq=False)
class Sections:
    """Cross-sections at right angles to the rake face, one to a sample along it."""

    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    """Samples that the elements are seen in, shape (section, element)."""
    probes: NDArray[np.intp]
    """Rows and columns of the samples by which a section is touched, (2, section, height)."""
    samples: NDArray[np.intp]
    """Row, column, section and element of all samples beside the face, shape (4, sample)."""
    weight: NDArray[np.float64]
    """How far each sample is on the way from its element to the next one, 0 to 1."""

    @classmethod
    def of(cls, raster: Raster, tool: Tool, elements: SideElements) -> "Sections":
        """Return the cross-sections of a scene."""
        x, y = np.meshgrid(raster.x, raster.y)
        along, depth = tool.face_coordinates(np.stack([x, y], axis=-1))
        count = max(int(along.max() / raster.spacing) + 1, 0)
        foot = tool.rake_point((np.arange(count) + 0.5) * raster.spacing)
        step = raster.spacing / 2
        heights = np.arange(raster.spacing / 4, TOUCHING + step, step)
        section = np.floor(along / raster.spacing).astype(np.intp)
        beside = np.flatnonzero((section >= 0) & (section < count))
        number, weight, known = _between(elements, depth.ravel()[beside])
        beside = beside[known]
        placed = (*np.divmod(beside, raster.columns), section.ravel()[beside], number[known])
        return cls(
            *_samples_at(raster, tool, foot, _looked_up(elements, raster.spacing)),
            np.stack(_samples_at(raster, tool, foot, heights)),
            np.stack(placed),
            weight[known],
        )

    def touching(self, material: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """Tell in which sections the chip touches the rake face and the tool is seen."""
        rows, columns = self.probes
        chip = (material[rows, columns] == Material.WORKPIECE).any(axis=1)
        return np.asarray(chip & (material[self.rows, self.columns] == Material.TOOL).any(axis=1))

    def seen(
        self, touching: NDArray[np.bool_], material: NDArray[np.uint8]
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Return the `samples` in those sections, and their weights."""
        rows, columns, section, _ = self.samples
        there = touching[section] & (material[rows, columns] != Material.VOID)
        return self.samples[:, there], self.weight[there]


@dataclass(frozen=True, eq=False)
class Reflections:
    """The change of a surface's emissivity by reflections between rake face and chip's side.

    Samples seen in the camera's direction have the temperatures of the scene; the rake face has
    that of the tool's side next to it. In each cross-section at right angles to the rake face that
    the chip touches, all bounces are summed as if it went on alike (`Exchange`). What is seen is
    ε L + (1 − ε) times the incident radiance. It is given as an effective emissivity, by which the
    radiance of the blackbody (less that of the surroundings) is what is seen (less the same): over
    1 where more is reflected than the sample would emit as a blackbody.
    """

    elements: SideElements
    sections: Sections
    band: Band
    surroundings: float
    """Radiance of the surroundings in W/(m² sr)."""
    mirror: float
    rake_emissivity: float | None
    slope_ratio: NDArray[np.float64]
    """Emissivity of each element over that of the plane, by its slope."""

    def __call__(self, emissivity: NDArray[np.float32], frame: Frame) -> NDArray[np.float32]:
        """Return the effective emissivity of every sample of a frame."""
        touching = self.sections.touching(frame.material)
        if not touching.any():
            return emissivity
        (rows, columns, section, element), weight = self.sections.seen(touching, frame.material)
        black = self.band.radiance(frame.temperature[rows, columns].astype(np.float64))
        gain = np.asarray(black, np.float64) - self.surroundings
        ratio, incident = self.slope_ratio, self._incident(frame, emissivity, touching)
        slopes = (1 - weight) * ratio[element] + weight * ratio[element + 1]
        added = (1 - weight) * incident[section, element]
        added += weight * incident[section, element + 1]
        own = np.minimum(emissivity[rows, columns] * slopes, 1.0)
        # A sample just as warm as its surroundings shows neither itself nor what it reflects.
        told = np.abs(gain) > 1e-6 * self.surroundings
        effective = own + (1.0 - own) * np.divide(
            added - self.surroundings, gain, out=np.zeros_like(gain), where=told
        )
        result = emissivity.copy()
        result[rows, columns] = np.maximum(effective, 0.0)
        return result

    def _incident(
        self, frame: Frame, emissivity: NDArray[np.float32], touching: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """Return the incident radiance on the elements of sections, shape (section, element)."""
        sections = self.sections
        rows, columns = sections.rows[touching], sections.columns[touching]
        black = self.band.radiance(frame.temperature[rows, columns].astype(np.float64))
        values = emissivity[rows, columns].astype(np.float64)
        if self.rake_emissivity is not None:
            values[:, self.elements.face] = self.rake_emissivity
        # Where the chip ends there is nothing: what comes from there comes from the surroundings.
        void = frame.material[rows, columns] == Material.VOID
        black = np.where(void, self.surroundings, black)
        values = np.where(void, 1.0, values)
        result = np.full((len(sections.rows), values.shape[1]), self.surroundings)
        result[touching] = self.elements.exchange.incident(
            black, values, self.surroundings, self.mirror, TOWARD_CAMERA
        )
        return result


def _looked_up(elements: SideElements, spacing: float) -> NDArray[np.float64]:
    """Return the elements' depths, so far from the face that a sample is on their side of it.

    The rake face has the temperature of the tool beside it.
    """
    inside = _INSIDE * spacing
    depths = elements.depths
    tool, chip = np.minimum(depths, -inside), np.maximum(depths, inside)
    number = np.arange(depths.size)
    return np.where(number < elements.chip.start, tool, chip)


def _between(
    elements: SideElements, depth: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.bool_]]:
    """Return the element before each depth, the way to the next, and whether any is so near."""
    middles = elements.depths
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
    """Return rows and columns of the samples at depths from points of the rake face.

    Beyond the scene's border it goes on as at it.
    """
    points = foot[:, None] + depths[:, None] * np.array(tool.rake_normal)
    rows = np.floor((raster.top - points[..., 1]) / raster.spacing).astype(np.intp)
    columns = np.floor((points[..., 0] - raster.left) / raster.spacing).astype(np.intp)
    return np.clip(rows, 0, raster.rows - 1), np.clip(columns, 0, raster.columns - 1)
