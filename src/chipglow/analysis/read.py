"""The loop of an analysis: readings of places over exposures, textures and pixel phases."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from chipglow.analysis.images import Stack, around, pixel_phases
from chipglow.analysis.places import Place
from chipglow.camera import Camera, Exposure
from chipglow.camera.chain import Chain, ExposedChain, expose_chains
from chipglow.camera.reference import ReferenceKind
from chipglow.quantities import Array
from chipglow.scene import Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import EmissivityField, Surface

Variables: TypeAlias = dict[str, Any]

_DRAWS: Final = ("exposure", "texture", "pixel_phase")
_VARIED_PHASES: Final = 3
"""Positions of the pixels along each axis, or a few more, for the other cameras."""

_ROWS_OF_IMAGES: Final = 2
"""Rows of a stack besides the readings with each set of effects: the reference and the truth."""

_KELVIN: Final = {"units": "K"}
_METRE: Final = {"units": "m"}


class Draw(NamedTuple):
    """One of the draws of a reading: numbers of exposure, texture and pixel phase."""

    exposure: int
    texture: int
    phase: int


@dataclass(frozen=True, eq=False)
class SurfacePlaces:
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
    views: tuple[SurfacePlaces, ...]
    phases: int
    reference: ReferenceKind
    effects: Mapping[str, Collection[str]]  # sets of effects that are on; the first has all
    vary: Sequence[Callable[[Camera], Camera]] = ()  # other cameras, for the first texture
    headlines: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Names of the readings of a cut, by place and quantity."""
    cause: str = "exposure"
    """Cause of the scatter over the exposures."""

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
        along = range(0, self.phases, max(self.phases // _VARIED_PHASES, 1))
        return tuple(row * self.phases + column for row in along for column in along)


class PlaceReading(NamedTuple):
    """The readings of a place, (quantity, row), and the images along its lines, (row, point)."""

    values: Array
    lines: Mapping[str, Stack]


def read_place(place: Place, images: Stack, pixels: Raster) -> PlaceReading:
    """Read a place in images of one exposure, of which the reference is the first."""
    lines = place.sampled(images, pixels)
    return PlaceReading(place.read(images, pixels, lines), lines)


@dataclass(frozen=True)
class _Rows:
    """Positions in the arrays of the readings and lines of a place on a surface."""

    view: int
    place: int
    readings: slice
    lines: Mapping[str, int]


class Readings(NamedTuple):
    """Result of `read`."""

    data: xr.Dataset
    """Readings and lines of all places over the draws, in K, NaN for nothing; images of the
    surfaces. An element of the axis ``reading`` is a quantity of a place on a surface: each place
    has its own quantities, and a cut reads each place on one surface."""
    shown: Mapping[str, Exposure]
    """The shown exposure of each surface."""


def rows_of(data: xr.Dataset, surface: str, place: Place) -> NDArray[np.intp]:
    """Return the indices of a place's readings on a surface, in the order of its quantities."""
    here = (data.place.values == place.name) & (data.seen_surface.values == surface)
    return np.flatnonzero(here)


class _Arrays:
    """Arrays of the readings and lines, filled draw by draw; NaN for nothing.

    Rows of a reading are the reference, the measured temperature with each set of effects, and the
    true temperature.
    """

    def __init__(self, schedule: Schedule, pitch: float) -> None:
        self.schedule = schedule
        self.rows: list[_Rows] = []
        self.readings: list[tuple[int, str, str]] = []  # view, place, quantity
        self.lines: list[tuple[int, str]] = []  # view, line
        for number, view in enumerate(schedule.views):
            for i, place in enumerate(view.places[0]):
                self._add_rows(number, i, place, pitch)
        every = [p for v in schedule.views for places in v.places for p in places]
        sizes = [line.distance.size for p in every for line in p.lines(pitch).values()]
        points, rows = max(sizes, default=0), _ROWS_OF_IMAGES + len(schedule.effects)
        exposures, textures = len(schedule.drawn), max(view.textures for view in schedule.views)
        draws = exposures, textures, schedule.phases**2
        varied = len(schedule.vary), exposures, len(schedule.varied_phases)
        readings, lines = len(self.readings), len(self.lines)
        self.values = np.full((readings, *draws, rows), np.nan)
        self.varied = np.full((readings, *varied, rows), np.nan)
        self.along = np.full((lines, *draws, rows, points), np.nan)
        self.positions = np.full((lines, exposures, 3, points), np.nan)  # distance, x, y
        self.scene = np.full((lines, exposures, textures, points), np.nan)
        self.motion = np.full((lines, exposures, textures), np.nan)

    def _add_rows(self, view: int, number: int, place: Place, pitch: float) -> None:
        first = len(self.readings)
        self.readings += [(view, place.name, quantity) for quantity in place.quantities]
        lines = {name: len(self.lines) + i for i, name in enumerate(place.lines(pitch))}
        self.lines += [(view, name) for name in lines]
        self.rows.append(_Rows(view, number, slice(first, len(self.readings)), lines))

    def of(self, view: int) -> Iterator[_Rows]:
        """Yield where the places of a view stand."""
        return (one for one in self.rows if one.view == view)

    def read_draws(
        self,
        exposure: int,
        exposed: Mapping[tuple[str, int], ExposedChain],
        cameras: Sequence[Camera],
        progress: Callable[[float], None],
    ) -> None:
        """Read every view of one exposure, for all textures, pixel phases and other cameras."""
        views = self.schedule.views
        textures = sum(view.textures for view in views)
        finished = 0
        for number, view in enumerate(views):
            for texture in range(view.textures):
                chain = exposed[view.surface, texture]
                draws = view.numbers[exposure, texture]
                noisy = [c.redrawn(int(draw)) for c, draw in zip(cameras, draws, strict=True)]
                self._read_scene(number, exposure, texture, chain.through(noisy[0]))
                looks = list(self._looks(texture, noisy))
                for step, (case, phase, camera) in enumerate(looks):
                    progress((finished + step / len(looks)) / textures)
                    draw = Draw(exposure, texture, phase)
                    self._read_places(number, case, draw, chain.through(camera))
                finished += 1

    def _looks(
        self, texture: int, cameras: Sequence[Camera]
    ) -> Iterator[tuple[int | None, int, Camera]]:
        """Yield the number of an other camera or None, the pixel phase, and the camera."""
        for phase, camera in enumerate(cameras):
            yield None, phase, camera
        if texture > 0:
            return
        for case, change in enumerate(self.schedule.vary):
            for phase, number in enumerate(self.schedule.varied_phases):
                yield case, phase, change(cameras[number])

    def _read_places(self, view: int, case: int | None, draw: Draw, chain: ExposedChain) -> None:
        """Read the places of a view by the camera itself, or by one of the other cameras."""
        images = chain.stack(self.schedule.effects)
        images = np.append(images, chain.reference("true-maximum")[None], axis=0)
        pixels = chain.camera.pixels(chain.exposure.raster)
        places = self.schedule.views[view].places[draw.exposure]
        for rows in self.of(view):
            reading = read_place(places[rows.place], images, pixels)
            if case is not None:
                self.varied[rows.readings, case, draw.exposure, draw.phase] = reading.values
                continue
            self.values[(rows.readings, *draw)] = reading.values
            for name, along in reading.lines.items():
                self.along[(rows.lines[name], *draw)][:, : along.shape[1]] = along

    def _read_scene(self, view: int, exposure: int, texture: int, chain: ExposedChain) -> None:
        """Read where the lines of the places lie, the scene's samples there, and motion."""
        seen, temperature = chain.exposure, chain.camera.band.temperature
        places = self.schedule.views[view].places[exposure]
        for rows in self.of(view):
            place = places[rows.place]
            for name, line in place.lines(chain.camera.pitch).items():
                row, points = rows.lines[name], line.distance.size
                self.positions[row, exposure, :, :points] = line.distance, *line.points.T
                part, window = around(seen.raster, line.points)
                along = sample(temperature(seen.centre_radiance[part]), window, line.points)
                self.scene[row, exposure, texture, :points] = along
                at = place.motion_samples * seen.raster.spacing
                point = line.points[np.argmin(np.abs(line.distance - at))]
                mean = nearest(seen.mean_radiance, seen.raster, point)
                peak = nearest(seen.peak_radiance, seen.raster, point)
                self.motion[row, exposure, texture] = temperature(mean) - temperature(peak)

    def variables(self) -> Variables:
        """Return the variables of the Dataset."""
        variables = self._coordinates() | {
            "reference": (("reading", *_DRAWS), self.values[..., 0], _KELVIN),
            "measured": (("reading", *_DRAWS, "effects"), self.values[..., 1:-1], _KELVIN),
            "true": (("reading", *_DRAWS), self.values[..., -1], _KELVIN),
        }
        if self.lines:
            variables |= self._line_variables()
        if self.schedule.vary:
            variables |= self._varied_variables()
        return variables

    def _coordinates(self) -> Variables:
        schedule, views, readings = self.schedule, self.schedule.views, self.readings
        starts = schedule.starts[list(schedule.drawn)]
        return {
            "effects": ("effects", list(schedule.effects)),
            "exposure": ("exposure", starts, {"units": "s", "title": schedule.cause}),
            "texture": ("texture", np.arange(self.values.shape[2])),
            "pixel_phase": ("pixel_phase", np.arange(self.values.shape[3])),
            "reading": ("reading", [schedule.reading(*one) for one in readings]),
            "place": ("reading", [place for _, place, _ in readings]),
            "quantity": ("reading", [quantity for *_, quantity in readings]),
            "seen_surface": ("reading", [views[view].surface for view, *_ in readings]),
            "textures": ("reading", [views[view].textures for view, *_ in readings]),
            "undrawn": ("reading", [", ".join(views[view].undrawn) for view, *_ in readings]),
        }

    def _line_variables(self) -> Variables:
        schedule, views, lines = self.schedule, self.schedule.views, self.lines
        over = "line", *_DRAWS
        return {
            "line": ("line", [schedule.named(*one) for one in lines]),
            "line_surface": ("line", [views[view].surface for view, _ in lines]),
            "line_textures": ("line", [views[view].textures for view, _ in lines]),
            **{
                f"line_{name}": (("line", "exposure", "point"), self.positions[:, :, i], _METRE)
                for i, name in enumerate(("distance", "x", "y"))
            },
            "line_reference": ((*over, "point"), self.along[..., 0, :], _KELVIN),
            "line_measured": ((*over, "effects", "point"), self.along[..., 1:-1, :], _KELVIN),
            "line_true": ((*over, "point"), self.along[..., -1, :], _KELVIN),
            "line_scene": ((*over[:3], "point"), self.scene, _KELVIN),
            "line_motion": (over[:3], self.motion, _KELVIN),
        }

    def _varied_variables(self) -> Variables:
        readings, cameras, *others = self.varied.shape
        varied = self.varied.reshape(readings, 2, cameras // 2, *others)
        over = "reading", "psf_order", "psf_width", "exposure", "varied_phase"
        return {
            "varied_reference": (over, varied[..., 0], _KELVIN),
            "varied_measured": ((*over, "effects"), varied[..., 1:-1], _KELVIN),
        }


class _Images:
    """Images of the surfaces in all exposures, and with each set of effects in the shown one."""

    def __init__(self, surfaces: Sequence[str], schedule: Schedule) -> None:
        self.schedule = schedule
        self.radiances: dict[str, list[Array]] = {name: [] for name in surfaces}
        self.references: dict[str, list[Array]] = {name: [] for name in surfaces}
        self.measured: list[Stack] = []
        self.shown: dict[str, Exposure] = {}

    def add(self, instant: int, number: int, chain: ExposedChain) -> None:
        """Add the images of a surface in an exposure; its noise belongs to draw `number`."""
        name = list(self.radiances)[number]
        self.radiances[name].append(chain.radiance())
        self.references[name].append(chain.reference())
        if instant == self.schedule.shown:
            redrawn = chain.through(chain.camera.redrawn(number))
            self.measured.append(redrawn.stack(self.schedule.effects)[1:])
            self.shown[name] = chain.exposure

    def variables(self, pixels: Raster) -> Variables:
        """Return the variables of the Dataset."""
        over = "surface", "instant", "pixel_y", "pixel_x"
        return {
            "surface": ("surface", list(self.radiances)),
            "instant": ("instant", self.schedule.starts, {"units": "s"}),
            "pixel_y": ("pixel_y", pixels.y, _METRE),
            "pixel_x": ("pixel_x", pixels.x, _METRE),
            "radiance": (over, np.array(list(self.radiances.values())), {"units": "W/(m² sr)"}),
            "reference_temperature": (over, np.array(list(self.references.values())), _KELVIN),
            "image_measured": (("surface", "effects", *over[2:]), np.stack(self.measured), _KELVIN),
        }


def read(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    fields: Mapping[str, EmissivityField],
    camera: Camera,
    schedule: Schedule,
    progress: Callable[[float], None],
) -> Readings:
    """Take the images of a schedule and read them; `fields` are the surfaces on the scene."""
    chains = {
        (name, 0): Chain(camera, scene, surfaces[name], laid) for name, laid in fields.items()
    }
    textured = {
        (view.surface, number): Chain(camera, scene, surfaces[view.surface].redrawn(number))
        for view in schedule.views
        for number in range(1, view.textures)
    }
    arrays = _Arrays(schedule, camera.pitch)
    images = _Images(list(fields), schedule)
    cameras = pixel_phases(camera, schedule.phases)
    share = 1 / (len(schedule.starts) + len(schedule.drawn))

    def share_from(begun: float) -> Callable[[float], None]:
        return lambda part: progress(begun + share * part)

    for i, start in enumerate(schedule.starts):
        begun = share * (i + sum(number < i for number in schedule.drawn))
        progress(begun)
        is_drawn = i in schedule.drawn
        looking = chains | textured if is_drawn else chains
        exposures = expose_chains(list(looking.values()), float(start))
        exposed = {
            key: chain.exposed(exposure, schedule.reference)
            for (key, chain), exposure in zip(looking.items(), exposures, strict=True)
        }
        for number, name in enumerate(fields):
            images.add(i, number, exposed[name, 0])
        if is_drawn:
            sharing = {
                key: chain.exposed(exposed[key].exposure, schedule.reference, shares_blur=True)
                for key, chain in looking.items()
            }
            drawn = schedule.drawn.index(i)
            arrays.read_draws(drawn, sharing, cameras, share_from(begun + share))
    progress(1.0)
    pixels = camera.pixels(scene.raster)
    return Readings(xr.Dataset(images.variables(pixels) | arrays.variables()), images.shown)
