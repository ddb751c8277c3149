"""The loop of an analysis: images of a scene over exposures, textures and pixel phases."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.images import (
    Array,
    Effect,
    ExposureImages,
    ReferenceKind,
    Stack,
    around,
    pixel_phases,
)
from chipglow.analysis.places import Place
from chipglow.camera import Camera, Exposure
from chipglow.scene import Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import EmissivityField, Surface

Variables: TypeAlias = dict[str, Any]

_DRAWS: Final = ("exposure", "texture", "pixel_phase")
_VARIED: Final = 3
"""Positions of the pixels along each axis, or a few more, for the other cameras."""


@dataclass(frozen=True, eq=False)
class View:
    """A surface and the places that are read on it in each drawn exposure."""

    surface: str
    places: Sequence[Sequence[Place]]  # by drawn exposure
    numbers: NDArray[np.int_]  # of the detector's noise, shape (exposure, texture, pixel phase)
    undrawn: tuple[str, ...]  # causes of scatter of which only one value is drawn

    @property
    def textures(self) -> int:
        return int(self.numbers.shape[1])


@dataclass(frozen=True, eq=False)
class Schedule:
    """The exposures, draws, effects and other cameras of an analysis."""

    starts: Array  # in s
    drawn: tuple[int, ...]  # exposures that are read with all textures and pixel phases
    shown: int  # the exposure of which the images are kept
    views: tuple[View, ...]
    phases: int
    reference: ReferenceKind
    effects: Mapping[str, Effect]  # the first switches nothing off
    vary: Sequence[Callable[[Camera], Camera]] = ()  # other cameras, for the first texture
    headlines: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Names of the readings of a cut, by place and quantity."""

    def named(self, view: int, text: str) -> str:
        """Return the name of a line or reading, with its surface if there are several."""
        several = not self.headlines and len(self.views) > 1
        return f"{text} ({self.views[view].surface})" if several else text

    def reading(self, view: int, place: str, quantity: str) -> str:
        """Return the name of a reading."""
        return self.headlines.get((place, quantity)) or self.named(view, f"{place}, {quantity}")

    @property
    def varied_phases(self) -> tuple[int, ...]:
        """Indices of the pixel phases of the other cameras."""
        along = range(0, self.phases, max(self.phases // _VARIED, 1))
        return tuple(row * self.phases + column for row in along for column in along)


class Looked:
    """Images by surface, and readings of every view, NaN for nothing."""

    def __init__(self, schedule: Schedule, surfaces: Iterable[str], pitch: float) -> None:
        self.schedule = schedule
        self.images: dict[str, list[Array]] = {name: [] for name in surfaces}
        self.references: dict[str, list[Array]] = {name: [] for name in surfaces}
        self.shown: dict[str, tuple[Exposure, Stack]] = {}
        placed = [
            (number, i, place)
            for number, view in enumerate(schedule.views)
            for i, place in enumerate(view.places[0])
        ]
        self.readings = [(n, i, p.name, name) for n, i, p in placed for name in p.quantities]
        self.lines = [(n, i, name) for n, i, p in placed for name in p.lines(pitch)]
        every = [p for v in schedule.views for places in v.places for p in places]
        sizes = [line.distance.size for p in every for line in p.lines(pitch).values()]
        # Reference, measured temperature with each effect, true temperature.
        points, rows = max(sizes, default=0), 2 + len(schedule.effects)
        exposures, phases = len(schedule.drawn), schedule.phases**2
        draws = exposures, max(view.textures for view in schedule.views)
        readings, lines = (len(self.readings),), (len(self.lines),)
        self.read = np.full((*readings, *draws, phases, rows), np.nan)
        varied = len(schedule.vary), exposures, len(schedule.varied_phases)
        self.varied = np.full((*readings, *varied, rows), np.nan)
        self.along = np.full((*lines, *draws, phases, rows, points), np.nan)
        self.places = np.full((*lines, exposures, 3, points), np.nan)
        self.scene = np.full((*lines, *draws, points), np.nan)
        self.motion = np.full((*lines, *draws), np.nan)

    def draw(
        self,
        exposure: int,
        exposures: Mapping[tuple[str, int], Exposure],
        cameras: Sequence[Camera],
        progress: Callable[[float], None],
    ) -> None:
        """Read every view of one exposure, for all textures, pixel phases and other cameras."""
        schedule, finished = self.schedule, 0
        textures = sum(view.textures for view in schedule.views)
        for number, view in enumerate(schedule.views):
            places = view.places[exposure]
            for texture in range(view.textures):
                images = ExposureImages(exposures[view.surface, texture], schedule.reference, True)
                draws = view.numbers[exposure, texture]
                noisy = [c.redrawn(int(draw)) for c, draw in zip(cameras, draws, strict=True)]
                for i, place in enumerate(places):
                    index = exposure, texture
                    self._read_scene((number, i), place, index, images.exposure, noisy[0])
                others = enumerate(schedule.vary if texture == 0 else (), 1)
                kept = [noisy[phase] for phase in schedule.varied_phases]
                looks = [*product([(0, None)], enumerate(noisy)), *product(others, enumerate(kept))]
                for step, ((case, change), (phase, camera)) in enumerate(looks):
                    progress((finished + step / len(looks)) / textures)
                    changed = change(camera) if change else camera
                    stack = images.stack(changed, schedule.effects)
                    stack = np.append(stack, images.reference(camera, "true-maximum")[None], axis=0)
                    pixels = camera.pixels(images.exposure.raster)
                    for i, place in enumerate(places):
                        indices = case, exposure, texture, phase
                        self._read((number, i), place, indices, stack, pixels)
                finished += 1

    def _read(
        self,
        key: tuple[int, int],
        place: Place,
        indices: tuple[int, int, int, int],
        stack: Stack,
        pixels: Raster,
    ) -> None:
        """Read a place by the camera itself (case 0) or one of the other cameras."""
        case, exposure, texture, phase = indices
        lines = place.sampled(stack, pixels)
        rows = [one[:2] == key for one in self.readings]
        values = place.read(stack, pixels, lines)
        if case:
            self.varied[rows, case - 1, exposure, phase] = values
            return
        self.read[rows, exposure, texture, phase] = values
        for name, along in lines.items():
            row = self.lines.index((*key, name))
            self.along[row, exposure, texture, phase, :, : along.shape[1]] = along

    def _read_scene(
        self,
        key: tuple[int, int],
        place: Place,
        index: tuple[int, int],
        exposure: Exposure,
        camera: Camera,
    ) -> None:
        """Read where the lines of a place lie, the scene's samples there, and motion."""
        raster, temperature = exposure.raster, camera.band.temperature
        for name, line in place.lines(camera.pitch).items():
            row, points = self.lines.index((*key, name)), line.distance.size
            self.places[row, index[0], :, :points] = line.distance, *line.points.T
            part, window = around(raster, line.points)
            along = sample(temperature(exposure.centre_radiance[part]), window, line.points)
            self.scene[row, *index, :points] = along
            at = place.motion_samples * raster.spacing
            point = line.points[np.argmin(np.abs(line.distance - at))]
            mean = nearest(exposure.mean_radiance, raster, point)
            peak = nearest(exposure.peak_radiance, raster, point)
            self.motion[row, *index] = temperature(mean) - temperature(peak)

    def variables(self, cause: str) -> Variables:
        """Return variables of the Dataset; `cause` of the scatter over the exposures."""
        schedule, views = self.schedule, self.schedule.views
        readings, lines, kelvin, metre = self.readings, self.lines, {"units": "K"}, {"units": "m"}

        starts = schedule.starts[list(schedule.drawn)]
        variables: Variables = {
            "effects": ("effects", list(schedule.effects)),
            "exposure": ("exposure", starts, {"units": "s", "title": cause}),
            "texture": ("texture", np.arange(self.read.shape[2])),
            "pixel_phase": ("pixel_phase", np.arange(self.read.shape[3])),
            "reading": ("reading", [schedule.reading(v, p, q) for v, _, p, q in readings]),
            "place": ("reading", [place for _, _, place, _ in readings]),
            "quantity": ("reading", [quantity for *_, quantity in readings]),
            "seen_surface": ("reading", [views[view].surface for view, *_ in readings]),
            "textures": ("reading", [views[view].textures for view, *_ in readings]),
            "undrawn": ("reading", [", ".join(views[view].undrawn) for view, *_ in readings]),
            "reference": (("reading", *_DRAWS), self.read[..., 0], kelvin),
            "measured": (("reading", *_DRAWS, "effects"), self.read[..., 1:-1], kelvin),
            "true": (("reading", *_DRAWS), self.read[..., -1], kelvin),
        }
        if lines:
            over = "line", *_DRAWS
            variables |= {
                "line": ("line", [schedule.named(view, line) for view, _, line in lines]),
                "line_surface": ("line", [views[view].surface for view, _, _ in lines]),
                "line_textures": ("line", [views[view].textures for view, _, _ in lines]),
                **{
                    f"line_{name}": (("line", "exposure", "point"), self.places[:, :, i], metre)
                    for i, name in enumerate(("distance", "x", "y"))
                },
                "line_reference": ((*over, "point"), self.along[..., 0, :], kelvin),
                "line_measured": ((*over, "effects", "point"), self.along[..., 1:-1, :], kelvin),
                "line_true": ((*over, "point"), self.along[..., -1, :], kelvin),
                "line_scene": ((*over[:3], "point"), self.scene, kelvin),
                "line_motion": (over[:3], self.motion, kelvin),
            }
        if schedule.vary:
            shape = self.varied.shape
            varied = self.varied.reshape(shape[0], 2, shape[1] // 2, *shape[2:])
            dims = ("reading", "psf_order", "psf_width", "exposure", "varied_phase")
            variables["varied_reference"] = dims, varied[..., 0], kelvin
            variables["varied_measured"] = (*dims, "effects"), varied[..., 1:-1], kelvin
        return variables


def look(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    fields: Mapping[str, EmissivityField],
    camera: Camera,
    schedule: Schedule,
    progress: Callable[[float], None],
) -> Looked:
    """Take the images of a schedule and read them; `fields` are the surfaces on the scene."""
    first = {(name, 0): laid for name, laid in fields.items()}
    others = {
        (view.surface, number): camera.prepare(surfaces[view.surface].redrawn(number), scene)
        for view in schedule.views
        for number in range(1, view.textures)
    }
    looked = Looked(schedule, fields, camera.pitch)
    cameras = pixel_phases(camera, schedule.phases)
    share = 1 / (len(schedule.starts) + len(schedule.drawn))

    def share_from(begun: float) -> Callable[[float], None]:
        return lambda part: progress(begun + share * part)

    for i, start in enumerate(schedule.starts):
        begun = share * (i + sum(number < i for number in schedule.drawn))
        progress(begun)
        laid = first | others if i in schedule.drawn else first
        exposed = camera.expose_fields(scene, list(laid.values()), float(start))
        exposures = dict(zip(laid, exposed, strict=True))
        for number, name in enumerate(fields):
            images = ExposureImages(exposures[name, 0], schedule.reference)
            looked.images[name].append(images.radiance(camera))
            looked.references[name].append(images.reference(camera))
            if i == schedule.shown:
                stack = images.stack(camera.redrawn(number), schedule.effects)
                looked.shown[name] = images.exposure, stack[1:]
        if i in schedule.drawn:
            looked.draw(schedule.drawn.index(i), exposures, cameras, share_from(begun + share))
    progress(1.0)
    return looked
