"""The loop of an analysis: images of a scene over exposures, textures and pixel phases.

Images that agree up to a stage share it: frames are read once for all surfaces and textures of an
exposure, an exposure is formed by all cameras, and blurred radiance serves all pixel phases.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

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
from chipglow.radiometry import Band
from chipglow.scene import Line, Raster, Scene, sample
from chipglow.scene.lines import nearest
from chipglow.surface import EmissivityField, Surface

Variables: TypeAlias = dict[str, Any]

_DRAWS = ("exposure", "texture", "pixel_phase")
_DIMS = {
    "readings": (*_DRAWS, "row"),
    "varied": ("camera", "exposure", "pixel_phase", "row"),
    "lines": (*_DRAWS, "row", "point"),
    "line_place": ("exposure", "coordinate", "point"),
    "line_scene": (*_DRAWS[:2], "point"),
    "line_motion": (*_DRAWS[:2], "value"),
}
"""Axes of what is read; a row is the reference or what is measured with one of the effects."""


@dataclass(frozen=True, eq=False)
class View:
    """A surface and the places that are read on it in each drawn exposure.

    `numbers` are those of the detector's noise, shape (exposure, texture, pixel phase).
    """

    surface: str
    places: Sequence[Sequence[Place]]
    numbers: NDArray[np.int_]

    @property
    def textures(self) -> int:
        """How many textures are drawn."""
        return int(self.numbers.shape[1])


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

    def sizes(self, pitch: float) -> dict[str, int]:
        """Lengths of the axes of what is read."""
        places = [place for view in self.views for places in view.places for place in places]
        lines = [line for place in places for line in place.lines(pitch).values()]
        return {
            "exposure": len(self.drawn),
            "texture": max((view.textures for view in self.views), default=1),
            "pixel_phase": self.phases**2,
            "row": 1 + len(self.effects),
            "camera": len(self.vary),
            "coordinate": 3,
            "point": max((line.distance.size for line in lines), default=0),
            "value": 1,
        }


class Rows(dict[tuple[int, str, str], Array]):
    """Arrays of one shape by number of the view, place and name; NaN where nothing was put."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        super().__init__()
        self.shape = shape

    def put(
        self, view: int, place: Place, index: tuple[int, ...], values: Mapping[str, Array]
    ) -> None:
        """Put values by name at an index of the first axes, from the beginning of the last."""
        for name, one in values.items():
            key = view, place.name, name
            if key not in self:
                self[key] = np.full(self.shape, np.nan)
            self[key][index][..., : one.shape[-1]] = one

    @property
    def stacked(self) -> Array:
        """All arrays; the first axis is the keys'."""
        return np.stack(list(self.values()))


@dataclass(frozen=True, eq=False)
class Looked:
    """What was read, and images (radiance) and references by surface and exposure.

    `shown` holds by surface the shown exposure and what is measured with each of the effects, NaN
    where the reference is.
    """

    images: dict[str, list[Array]]
    references: dict[str, list[Array]]
    shown: dict[str, tuple[Exposure, Stack]]
    rows: Mapping[str, Rows]


def look(
    scene: Scene,
    surfaces: Mapping[str, Surface],
    fields: Mapping[str, EmissivityField],
    camera: Camera,
    schedule: Schedule,
    progress: Callable[[float], None],
) -> Looked:
    """Take the images of a schedule and read them; `progress` is told the fraction done.

    `fields` are the surfaces with their first texture on the scene.
    """
    first = {(name, 0): laid for name, laid in fields.items()}
    others = {
        (view.surface, number): camera.lay(surfaces[view.surface].redrawn(number), scene)
        for view in schedule.views
        for number in range(1, view.textures)
    }
    sizes = schedule.sizes(camera.pitch)
    rows = {name: Rows(tuple(sizes[dim] for dim in dims)) for name, dims in _DIMS.items()}
    looked = Looked({name: [] for name in fields}, {name: [] for name in fields}, {}, rows)
    cameras = pixel_phases(camera, schedule.phases)
    share = 1 / (len(schedule.starts) + len(schedule.drawn))
    for i, start in enumerate(schedule.starts):
        progress(share * (i + sum(number < i for number in schedule.drawn)))
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
            _draw(rows, schedule, schedule.drawn.index(i), exposures, cameras)
    progress(1.0)
    return looked


def row_variables(
    rows: Mapping[str, Rows], schedule: Schedule, names: Mapping[tuple[str, str], str], cause: str
) -> Variables:
    """Readings and lines over all draws.

    `names` are those of readings by place and quantity, and `cause` says what an exposure is.
    """
    views = schedule.views

    def named(view: int, text: str) -> str:
        return f"{text} ({views[view].surface})" if not names and len(views) > 1 else text

    readings, kelvin, metre = rows["readings"], {"units": "K"}, {"units": "m"}
    values = readings.stacked
    variables: Variables = {
        "effects": ("effects", list(schedule.effects)),
        "exposure": (
            "exposure",
            schedule.starts[list(schedule.drawn)],
            {"units": "s", "title": cause},
        ),
        "texture": ("texture", np.arange(values.shape[2])),
        "pixel_phase": ("pixel_phase", np.arange(values.shape[3])),
        "reading": ("reading", [names.get((p, q), named(v, f"{p}, {q}")) for v, p, q in readings]),
        "place": ("reading", [place for _, place, _ in readings]),
        "quantity": ("reading", [quantity for _, _, quantity in readings]),
        "seen_surface": ("reading", [views[view].surface for view, _, _ in readings]),
        "textures": ("reading", [views[view].textures for view, _, _ in readings]),
        "reference": (("reading", *_DRAWS), values[..., 0], kelvin),
        "measured": (("reading", *_DRAWS, "effects"), values[..., 1:], kelvin),
    }
    if lines := rows["lines"]:
        values, places = lines.stacked, rows["line_place"].stacked
        scene, motion = rows["line_scene"].stacked, rows["line_motion"].stacked[..., 0]
        variables |= {
            "line": ("line", [named(view, line) for view, _, line in lines]),
            "line_surface": ("line", [views[view].surface for view, _, _ in lines]),
            "line_textures": ("line", [views[view].textures for view, _, _ in lines]),
            **{
                f"line_{name}": (("line", "exposure", "point"), places[:, :, i], metre)
                for i, name in enumerate(("distance", "x", "y"))
            },
            "line_reference": (("line", *_DRAWS, "point"), values[..., 0, :], kelvin),
            "line_measured": (("line", *_DRAWS, "effects", "point"), values[..., 1:, :], kelvin),
            "line_scene": (("line", *_DRAWS[:2], "point"), scene, kelvin),
            "line_motion": (("line", *_DRAWS[:2]), motion, kelvin),
        }
    if schedule.vary:
        values = rows["varied"].stacked
        values = values.reshape(len(readings), 2, -1, *values.shape[2:])
        dims = ("reading", "psf_order", "psf_width", "exposure", "pixel_phase")
        variables["varied_reference"] = dims, values[..., 0], kelvin
        variables["varied_measured"] = (*dims, "effects"), values[..., 1:], kelvin
    return variables


def _draw(
    rows: Mapping[str, Rows],
    schedule: Schedule,
    exposure: int,
    exposures: Mapping[tuple[str, int], Exposure],
    cameras: Sequence[Camera],
) -> None:
    """Read every view of one exposure, for all textures, pixel phases and other cameras."""
    for number, view in enumerate(schedule.views):
        places = view.places[exposure]
        for texture in range(view.textures):
            images = ExposureImages(exposures[view.surface, texture], schedule.reference, True)
            draws = view.numbers[exposure, texture]
            noisy = [c.redrawn(int(draw)) for c, draw in zip(cameras, draws, strict=True)]
            for place in places:
                lines = _scene_lines(place, images.exposure, cameras[0])
                for name, index in (
                    ("line_place", (exposure,)),
                    ("line_scene", (exposure, texture)),
                    ("line_motion", (exposure, texture)),
                ):
                    rows[name].put(number, place, index, lines[name])
            for phase, camera in enumerate(noisy):
                stack = images.stack(camera, schedule.effects)
                for place in places:
                    readings, along = _read(place, stack, camera.pixels(images.exposure.raster))
                    rows["readings"].put(number, place, (exposure, texture, phase), readings)
                    rows["lines"].put(number, place, (exposure, texture, phase), along)
            for other, change in enumerate(schedule.vary if texture == 0 else ()):
                for phase, camera in enumerate(noisy):
                    stack = images.stack(change(camera), schedule.effects)
                    for place in places:
                        readings, _ = _read(place, stack, camera.pixels(images.exposure.raster))
                        rows["varied"].put(number, place, (other, exposure, phase), readings)


def _read(
    place: Place, images: Stack, pixels: Raster
) -> tuple[Mapping[str, Stack], Mapping[str, Stack]]:
    """Readings at a place, and the images along its lines."""
    lines = {
        name: np.array([sample(image, pixels, line.points) for image in images])
        for name, line in place.lines(pixels.spacing).items()
    }
    return place.read(images, pixels, lines), lines


def _scene_lines(place: Place, exposure: Exposure, camera: Camera) -> dict[str, dict[str, Array]]:
    """Where the lines of a place lie, what the scene's samples show there, and their motion."""
    lines, band = place.lines(camera.pitch), camera.band
    at = place.motion_samples * exposure.raster.spacing
    return {
        "line_place": {n: np.stack([one.distance, *one.points.T]) for n, one in lines.items()},
        "line_scene": {n: _scene_along(band, exposure, one) for n, one in lines.items()},
        "line_motion": {
            n: np.array([_motion(band, exposure, one, at)]) for n, one in lines.items()
        },
    }


def _scene_along(band: Band, exposure: Exposure, line: Line) -> Array:
    """Radiance temperature of the samples in the middle of the exposure along a line."""
    part, window = around(exposure.raster, line.points)
    return sample(band.temperature(exposure.centre_radiance[part]), window, line.points)


def _motion(band: Band, exposure: Exposure, line: Line, place: float) -> Array:
    """Mean over the exposure less its peak, as radiance temperatures, at one sample."""
    point = line.points[[np.argmin(np.abs(line.distance - place))]]
    mean = nearest(exposure.mean_radiance, exposure.raster, point)
    peak = nearest(exposure.peak_radiance, exposure.raster, point)
    return np.asarray(band.temperature(mean) - band.temperature(peak), np.float64)
