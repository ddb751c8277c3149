"""Single readings: one place in one exposure with one texture and pixel position, quickly.

An uncertainty budget and a choice of settings need thousands of readings with other cameras and
surfaces. Each exposes only a window of the scene around the place. The light that blurs into the
window from beyond it is computed with the nominal camera and surface.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.cut import Progress
from chipglow.analysis.engine import schedule_of
from chipglow.analysis.images import ALL, CASES
from chipglow.analysis.outside import fractions_outside
from chipglow.analysis.places import Place
from chipglow.analysis.plan import Plan
from chipglow.analysis.read import Schedule, read_place
from chipglow.camera import Camera
from chipglow.camera.chain import Chain, LightBeyond, expose_chains
from chipglow.quantities import Array
from chipglow.scene import Frame, Raster, Scene
from chipglow.scene.lines import nearest
from chipglow.surface import FeatureTrends, ModifiedSurface, Surface

EXPOSURE, TEXTURE, ACROSS, DOWN, NOISE = RANDOM = (
    "exposure",
    "texture",
    "pixel position across",
    "pixel position down",
    "noise",
)
"""Random inputs of a single reading, numbers from 0 to 1."""

REFERENCE, MEASURED, BELOW, SATURATED = range(4)
"""Values of a reading: temperatures, and fractions of its place that cannot be read."""

_EVERY_EFFECT: Final = {ALL: CASES[ALL]}

_BLUR_WIDTHS: Final = 3.0
"""Margin of a window around its place, in full widths at half maximum of the blur."""

_PIXELS: Final = 4.0
"""Further margin in pixels."""

_SEEDS: Final = 2**31
"""Seeds of textures and noise: those that fit into 31 bits."""


@dataclass(frozen=True, eq=False)
class _Window:
    """A place, and the part of a scene around it."""

    place: Place
    surface: str
    rows: NDArray[np.bool_]  # of the readings
    scene: Scene
    whole: Raster  # of which the scene is a part
    beyond: LightBeyond | None = None

    def chain(self, camera: Camera, surface: Surface) -> Chain:
        """Return the chain of the part, with the pixels that a camera has on the whole scene."""
        shift = self.scene.raster.left - self.whole.left, self.whole.top - self.scene.raster.top
        if any(shift):
            right, down = np.mod(np.subtract(camera.offset, shift), camera.pitch).tolist()
            camera = replace(camera, offset=(right, down))
        return Chain(camera, self.scene, surface, beyond=self.beyond)


@dataclass(frozen=True, eq=False)
class _Moment:
    """One of the exposures that are spread over a scene, in s, and the windows that are read."""

    start: float
    duration: float
    limits: tuple[float, float]  # in which an exposure must lie
    windows: tuple[_Window, ...] = ()

    def begin(self, duration: float) -> float:
        """Return the start of an exposure of some duration in the middle of this one."""
        first, last = self.limits
        middle = self.start + (self.duration - duration) / 2
        return max(min(middle, last - duration), first)


class SingleReadings:
    """Readings of single exposures of a scene by cameras and surfaces that vary.

    Parameters
    ----------
    scene : Scene
        The true fields.
    surfaces : mapping
        The nominal surfaces by name.
    camera : Camera
        The nominal camera.
    plan : Plan
        Exposures and places; its numbers of draws are not used.
    at : sequence of str
        Places or readings; all by default.
    tell : callable
        Called with the current step and the fraction of it that is complete.
    longest : float, optional
        Integration time in s of the exposures that are spread over the scene, by default the
        camera's. A shorter exposure is in the middle of one of these: cameras with the same
        `longest` see the same moments.

    Raises
    ------
    ValueError
        If a place or reading of `at` is unknown, or the analysis is impossible.
    """

    def __init__(
        self,
        scene: Scene,
        surfaces: Mapping[str, Surface],
        camera: Camera,
        plan: Plan,
        at: Sequence[str] = (),
        tell: Progress = lambda step, part: None,
        longest: float | None = None,
    ) -> None:
        spread = camera
        if longest is not None and longest > camera.integration_time:
            # The frame period must be longer than the exposure, and has no effect on a single one.
            rate = min(camera.frame_rate, 0.5 / longest)
            spread = replace(camera, integration_time=longest, frame_rate=rate)
        schedule = schedule_of(scene, surfaces, spread, plan, tell)
        places = [
            (n, i, p) for n, v in enumerate(schedule.views) for i, p in enumerate(v.places[0])
        ]
        every = {
            schedule.reading(n, p.name, quantity): (n, i, p.name)
            for n, i, p in places
            for quantity in p.quantities
        }
        known = dict.fromkeys([*(p.name for *_, p in places), *every])
        if unknown := [one for one in at if one not in known]:
            names = "; ".join(known)
            raise ValueError(f"{unknown[0]}: no such place or reading, expected one of {names}")
        kept = {name: key for name, key in every.items() if not at or name in at or key[2] in at}
        self.names, self.places = tuple(kept), tuple(key[2] for key in kept.values())
        self._reference = plan.reference
        keys = {key[:2] for key in kept.values()}
        owners = [key[:2] for key in every.values()]
        self._kept = np.array([name in kept for name in every])
        self._rows = {key: np.array([one == key for one in owners]) for key in keys}
        self._size = len(every)
        nominal = _Nominal(scene, surfaces, replace(camera, shape=None))
        self._moments = [
            self._moment(nominal, schedule, number, spread.integration_time)
            for number in range(len(schedule.drawn))
        ]
        used = {schedule.views[n].surface for n, _ in keys}
        is_random = {
            EXPOSURE: len(schedule.drawn) > 1,
            TEXTURE: any(surfaces[name].redrawn(1) is not surfaces[name] for name in used),
            NOISE: camera.detector is not None,
        }
        self.random = tuple(name for name in RANDOM if is_random.get(name, True))

    def read(
        self, camera: Camera, surfaces: Mapping[str, Surface], draw: Mapping[str, float]
    ) -> Array:
        """Return temperatures in K and fractions of each reading, shape (reading, 4).

        `draw` gives a number from 0 to 1 for each of `random`. The fractions of the place's pixels
        are those below the lower range limit, and saturated.
        """
        texture, noise = (int(draw.get(name, 0.0) * _SEEDS) for name in (TEXTURE, NOISE))
        moved = np.multiply([draw.get(name, 0.0) for name in (ACROSS, DOWN)], camera.pitch)
        right, down = (moved + camera.offset).tolist()
        seen = replace(camera, shape=None, offset=(right, down)).redrawn(noise)
        moment = self._moments[int(draw.get(EXPOSURE, 0.0) * len(self._moments))]
        start = moment.begin(camera.integration_time)
        values = np.full((self._size, 4), np.nan)
        for window in moment.windows:
            surface = surfaces[window.surface].redrawn(texture)
            chain = window.chain(seen, surface).at(start, self._reference)
            images, pixels = chain.stack(_EVERY_EFFECT), chain.pixels
            values[window.rows, :BELOW] = read_place(window.place, images, pixels).values
            outside = fractions_outside(window.place, chain.read().flags, images[MEASURED], pixels)
            values[window.rows, BELOW:] = outside
        return np.asarray(values[self._kept])

    def _moment(
        self, nominal: "_Nominal", schedule: Schedule, number: int, duration: float
    ) -> _Moment:
        """Return an exposure of a schedule, with a window around each place that is read."""
        start = float(schedule.starts[schedule.drawn[number]])
        moment = _Moment(start, duration, _limits(nominal.scene, start))
        crops = nominal.crops({schedule.views[n].surface for n, _ in self._rows}, moment)
        windows = []
        for (view, place), rows in self._rows.items():
            seen = schedule.views[view]
            windows.append(crops.window(seen.places[number][place], seen.surface, rows))
        return replace(moment, windows=tuple(windows))


@dataclass(frozen=True, eq=False)
class _Nominal:
    """A scene with the surfaces and the camera of which single readings vary."""

    scene: Scene
    surfaces: Mapping[str, Surface]
    camera: Camera

    def crops(self, used: Collection[str], moment: _Moment) -> "_Crops":
        """Return parts of the scene in an exposure; of surfaces that are not local, the whole."""
        scene, camera = self.scene, self.camera
        begin = moment.begin(camera.integration_time)
        local = [name for name in used if _is_local(self.surfaces[name])]
        if camera.line_time is not None or not local:
            return _Crops(self, begin, {}, ())
        chains = [Chain(camera, scene, self.surfaces[name]) for name in local]
        exposures = expose_chains(chains, begin)
        images = {
            name: chain.exposed(exposure).radiance()
            for name, chain, exposure in zip(local, chains, exposures, strict=True)
        }
        reach, block = camera.integration_time / 2, _block(scene, moment.start)
        first, last = (scene.frame_at(begin + at * reach) for at in (-1.0, 3.0))
        frames = scene.frames(range(max(first, block[0]), min(last, block[-1]) + 1))
        return _Crops(self, begin, images, tuple(frames))


@dataclass(frozen=True, eq=False)
class _Crops:
    """Parts of a scene during the nominal exposure that begins at `start` in s."""

    nominal: _Nominal
    start: float
    images: Mapping[str, Array]  # radiance of the pixels of the whole scene, of local surfaces
    frames: Sequence[Frame]  # of an exposure of up to twice the duration

    def window(self, place: Place, surface: str, rows: NDArray[np.bool_]) -> _Window:
        """Return the window of a place on a surface, of which the readings have these rows."""
        scene, camera = self.nominal.scene, self.nominal.camera
        whole = _Window(place, surface, rows, scene, scene.raster)
        part = _around(place, scene.raster, camera) if surface in self.images else None
        if part is None:
            return whole
        window = replace(whole, scene=_cropped(self.frames, scene, part))
        alone = window.chain(camera, self.nominal.surfaces[surface]).at(self.start)
        light = nearest(self.images[surface], camera.pixels(scene.raster), alone.pixels.centres)
        missing = np.nan_to_num(light - alone.radiance())
        return replace(window, beyond=LightBeyond(missing, alone.pixels))


def _block(scene: Scene, start: float) -> range:
    """Return the frames without a gap among which an exposure begins."""
    frame = scene.frame_at(start)
    return next(one for one in scene.blocks if frame in one)


def _limits(scene: Scene, start: float) -> tuple[float, float]:
    """Return the times in s within which an exposure near `start` must lie."""
    if len(scene.times) == 1:
        return -np.inf, np.inf
    block = _block(scene, start)
    return float(scene.times[block[0]]), float(scene.times[block[-1]] + scene.frame_spacing)


def _is_local(surface: Surface) -> bool:
    """Return whether the emissivity of a sample follows from that sample alone."""
    return not isinstance(surface, ModifiedSurface) or all(
        isinstance(one, FeatureTrends) for one in surface.modifiers
    )


def _around(place: Place, raster: Raster, camera: Camera) -> tuple[slice, slice] | None:
    """Return the rows and columns of a raster around a place; None for all."""
    outline = place.outline()
    if outline is None:
        return None
    points = np.concatenate(
        [outline, *(line.points for line in place.lines(camera.pitch).values())]
    )
    blur = camera.psf.fwhm if camera.psf is not None else 0.0
    margin = (_BLUR_WIDTHS * blur + _PIXELS * camera.pitch) / raster.spacing
    index = (points - [raster.left, raster.top]) * [1, -1] / raster.spacing
    low, high = np.floor(index.min(axis=0) - margin), np.ceil(index.max(axis=0) + margin)
    limits = np.clip([low, high], 0, [raster.columns, raster.rows]).astype(int)
    (left, top), (right, bottom) = limits.tolist()
    return slice(top, bottom), slice(left, right)


def _cropped(frames: Sequence[Frame], scene: Scene, part: tuple[slice, slice]) -> Scene:
    raster, (down, across) = scene.raster, part
    names = [name for name in scene.fields if getattr(frames[0], name, None) is not None]
    if "material" not in names:
        names.append("material")
    corner = raster.left + across.start * raster.spacing, raster.top - down.start * raster.spacing
    shape = down.stop - down.start, across.stop - across.start
    return Scene.from_fields(
        Raster(*corner, raster.spacing, *shape),
        [frame.time for frame in frames],
        {name: np.stack([getattr(frame, name)[part] for frame in frames]) for name in names},
        scene.tool,
    )
