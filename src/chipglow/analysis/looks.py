"""The loop of an analysis: images of a scene over exposures, textures and pixel phases.

Images that agree up to a stage share it: frames are read once for all surfaces and textures of an
exposure, an exposure is formed by all cameras, and blurred radiance serves all pixel phases.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np

from chipglow.analysis.images import (
    Array,
    Effect,
    ExposureImages,
    ReferenceKind,
    Stack,
    pixel_phases,
)
from chipglow.analysis.places import Place
from chipglow.camera import Camera, Exposure
from chipglow.radiometry import Band
from chipglow.scene import Line, Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import EmissivityField, Surface


@dataclass(frozen=True, eq=False)
class View:
    """A surface and the places that are read on it in each drawn exposure.

    Draws of a view have other noise of the detector each: their numbers begin with `first` and
    grow by `strides` from one exposure, texture and pixel phase to the next.
    """

    surface: str
    places: Sequence[Sequence[Place]]
    textures: int
    first: int
    strides: tuple[int, int, int]

    def number(self, *index: int) -> int:
        """Number of the draw of an exposure, texture and pixel phase."""
        return self.first + sum(i * step for i, step in zip(index, self.strides, strict=True))


@dataclass(frozen=True, eq=False)
class Schedule:
    """Which images are taken: exposures that begin at `starts`, of which some are drawn.

    `drawn` are the numbers of those that are read for all textures and pixel phases, and `shown`
    is that of which the images are kept. The first of the `effects` is that nothing is switched
    off. `vary` makes other cameras of the camera, which are read for the first texture.
    """

    starts: Array
    drawn: tuple[int, ...]
    shown: int
    views: tuple[View, ...]
    phases: int
    reference: ReferenceKind
    effects: Mapping[str, Effect]
    vary: Sequence[Callable[[Camera], Camera]] = ()


class Table:
    """Arrays of one shape by key, NaN where nothing was put."""

    def __init__(self, *shape: int) -> None:
        self.shape = shape
        self.rows: dict[tuple[int, str, str], Array] = {}

    def put(self, key: tuple[int, str, str], index: tuple[int, ...], values: Array) -> None:
        """Put values at an index of the first axes, and from the beginning of the last."""
        row = self.rows.setdefault(key, np.full(self.shape, np.nan))
        row[index][..., : values.shape[-1]] = values

    def stacked(self) -> Array:
        """All rows; the first axis is the keys'."""
        return np.stack(list(self.rows.values())) if self.rows else np.empty((0, *self.shape))


@dataclass(frozen=True, eq=False)
class Looked:
    """What was read and seen. Keys of the tables are number of the view, place and quantity.

    `images` (radiance) and `references` are by surface and exposure, `shown` by surface: the
    exposure, and what is measured with each of the effects, NaN where the reference is.
    """

    images: Mapping[str, list[Array]]
    references: Mapping[str, list[Array]]
    shown: dict[str, tuple[Exposure, Stack]]
    readings: Table
    varied: Table
    lines: Table
    line_places: Table
    line_scene: Table
    line_motion: Table


def look(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    first: Mapping[str, EmissivityField],
    camera: Camera,
    schedule: Schedule,
    progress: Callable[[float], None],
) -> Looked:
    """Take the images of a schedule and read them; `progress` is told the fraction done.

    `first` are the surfaces with their first texture on the scene.
    """
    others = {
        (view.surface, number): camera.lay(surfaces[view.surface].redrawn(number), scene)
        for view in schedule.views
        for number in range(1, view.textures)
    }
    looked = _empty(schedule, first, camera.pitch)
    cameras = pixel_phases(camera, schedule.phases)
    share = 1 / (len(schedule.starts) + len(schedule.drawn))
    for i, start in enumerate(schedule.starts):
        progress(share * (i + sum(number < i for number in schedule.drawn)))
        drawn = schedule.drawn.index(i) if i in schedule.drawn else None
        fields = [*first.values(), *(others.values() if drawn is not None else ())]
        exposed = camera.expose_fields(scene, fields, float(start))
        textures = dict(zip(first, exposed, strict=False))
        for name, exposure in textures.items():
            images = ExposureImages(exposure, schedule.reference)
            looked.images[name].append(images.radiance(camera))
            looked.references[name].append(images.reference(camera))
        seen = {(name, 0): exposure for name, exposure in textures.items()}
        seen |= dict(zip(others, exposed[len(first) :], strict=drawn is not None))
        if i == schedule.shown:
            for number, (name, exposure) in enumerate(textures.items()):
                images = ExposureImages(exposure, schedule.reference)
                stack = images.stack(camera.redrawn(number), schedule.effects)
                looked.shown[name] = exposure, stack[1:]
        if drawn is not None:
            _draw(looked, schedule, drawn, seen, cameras)
    progress(1.0)
    return looked


def _empty(schedule: Schedule, surfaces: Iterable[str], pitch: float) -> Looked:
    exposures, phases = len(schedule.drawn), schedule.phases**2
    textures = max((view.textures for view in schedule.views), default=1)
    rows = 1 + len(schedule.effects)
    places = [p for view in schedule.views for places in view.places for p in places]
    sizes = [line.distance.size for place in places for line in place.lines(pitch).values()]
    points = max(sizes, default=0)
    return Looked(
        images={name: [] for name in surfaces},
        references={name: [] for name in surfaces},
        shown={},
        readings=Table(exposures, textures, phases, rows),
        varied=Table(len(schedule.vary), exposures, phases, rows),
        lines=Table(exposures, textures, phases, rows, points),
        line_places=Table(exposures, 3, points),
        line_scene=Table(exposures, textures, points),
        line_motion=Table(exposures, textures, 1),
    )


def _draw(
    looked: Looked,
    schedule: Schedule,
    exposure: int,
    seen: Mapping[tuple[str, int], Exposure],
    cameras: Sequence[Camera],
) -> None:
    """Read every view of one exposure, for all textures, pixel phases and other cameras."""
    for number, view in enumerate(schedule.views):
        for texture in range(view.textures):
            images = ExposureImages(seen[view.surface, texture], schedule.reference, True)
            noisy = [c.redrawn(view.number(exposure, texture, p)) for p, c in enumerate(cameras)]
            for place in view.places[exposure]:
                key = number, place.name
                _read_scene(looked, key, (exposure, texture), place, images.exposure, cameras[0])
            for phase, camera in enumerate(noisy):
                stack = images.stack(camera, schedule.effects)
                pixels = camera.pixels(images.exposure.raster)
                for place in view.places[exposure]:
                    key, index = (number, place.name), (exposure, texture, phase)
                    lines = _read(looked.readings, key, index, place, stack, pixels)
                    for name, values in lines.items():
                        looked.lines.put((*key, name), index, values)
            for other, change in enumerate(schedule.vary if texture == 0 else ()):
                for phase, camera in enumerate(noisy):
                    stack = images.stack(change(camera), schedule.effects)
                    pixels = camera.pixels(images.exposure.raster)
                    for place in view.places[exposure]:
                        key, index = (number, place.name), (other, exposure, phase)
                        _read(looked.varied, key, index, place, stack, pixels)


def _read(
    table: Table,
    key: tuple[int, str],
    index: tuple[int, int, int],
    place: Place,
    images: Stack,
    pixels: Raster,
) -> dict[str, Stack]:
    """Put the readings at a place into a table; gives the images along the place's lines."""
    lines = {
        name: np.array([sample(image, pixels, line.points) for image in images])
        for name, line in place.lines(pixels.spacing).items()
    }
    for quantity, values in place.read(images, pixels, lines).items():
        table.put((*key, quantity), index, values)
    return lines


def _read_scene(
    looked: Looked,
    key: tuple[int, str],
    index: tuple[int, int],
    place: Place,
    seen: Exposure,
    camera: Camera,
) -> None:
    """Where the lines of a place lie, and what the scene's samples show there."""
    for name, line in place.lines(camera.pitch).items():
        row = *key, name
        motion = _motion(camera.band, seen, line, place.motion_samples * seen.raster.spacing)
        looked.line_places.put(row, index[:1], np.stack([line.distance, *line.points.T]))
        looked.line_scene.put(row, index, _scene_along(camera.band, seen, line))
        looked.line_motion.put(row, index, np.array([motion]))


def _scene_along(band: Band, exposure: Exposure, line: Line) -> Array:
    """Radiance temperature of the samples in the middle of the exposure along a line."""
    grid = exposure.raster
    columns, rows = ((line.points - [grid.left, grid.top]) * [1, -1] / grid.spacing).T
    above, left = (
        min(max(floor(places.min()) - 2, 0), count - 1)
        for places, count in zip((rows, columns), grid.shape, strict=True)
    )
    below, right = (max(ceil(places.max()) + 2, 1) for places in (rows, columns))
    part = exposure.centre_radiance[above : max(below, above + 1), left : max(right, left + 1)]
    corner = grid.left + left * grid.spacing, grid.top - above * grid.spacing
    return sample(band.temperature(part), Raster(*corner, grid.spacing, *part.shape), line.points)


def _motion(band: Band, exposure: Exposure, line: Line, place: float) -> float:
    """Mean over the exposure less its peak, as radiance temperatures, at one sample."""
    point = line.points[np.argmin(np.abs(line.distance - place))]
    mean = nearest(exposure.mean_radiance, exposure.raster, point)
    peak = nearest(exposure.peak_radiance, exposure.raster, point)
    return float(band.temperature(mean)) - float(band.temperature(peak))
