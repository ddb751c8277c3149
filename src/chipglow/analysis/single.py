"""Single readings: one place in one exposure with one texture and pixel position, quickly.

An uncertainty budget and a choice of settings need thousands of readings with other cameras and
surfaces. Each exposes only a window of the scene around the place. The light that blurs into the
window from beyond it is computed with the nominal camera and surface.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.cut import Progress
from chipglow.analysis.engine import schedule_of
from chipglow.analysis.outside import fractions_outside
from chipglow.analysis.places import Place
from chipglow.analysis.plan import Plan
from chipglow.analysis.read import Schedule, read_place
from chipglow.camera import Camera
from chipglow.camera.chain import Chain, expose_chains, read_temperature
from chipglow.quantities import Array
from chipglow.scene import Frame, Raster, Scene, sample
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

_BLUR_WIDTHS: Final = 3.0
"""Margin of a window around its place, in full widths at half maximum of the blur."""

_PIXELS: Final = 4.0
"""Further margin in pixels."""

_SEEDS: Final = 2**31
"""Seeds of textures and noise: those that fit into 31 bits."""


@dataclass(frozen=True, eq=False)
class _Window:
    """Part of a scene during one exposure; `beyond` is light on the nominal camera's pixels."""

    scene: Scene
    place: Place
    surface: str
    rows: NDArray[np.bool_]  # of the readings
    start: float
    limits: tuple[float, float]  # in which an exposure must lie, in s
    beyond: Array | None = None
    pixels: Raster | None = None


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
        self._raster = scene.raster
        self._reference, self._duration = plan.reference, spread.integration_time
        keys = {key[:2] for key in kept.values()}
        owners = [key[:2] for key in every.values()]
        self._kept = np.array([name in kept for name in every])
        self._rows = {key: np.array([one == key for one in owners]) for key in keys}
        self._size = len(every)
        self._exposures = [
            self._windows(scene, surfaces, replace(camera, shape=None), schedule, number)
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
        values = np.full((self._size, 4), np.nan)
        number = int(draw.get(EXPOSURE, 0.0) * len(self._exposures))
        for window in self._exposures[number]:
            surface = surfaces[window.surface].redrawn(texture)
            moved = _on_grid(seen, self._raster, window)
            stack, flags, pixels = self._look(window, moved, surface)
            values[window.rows, :BELOW] = read_place(window.place, stack, pixels).values
            outside = fractions_outside(window.place, flags, stack[MEASURED], pixels)
            values[window.rows, BELOW:] = outside
        return np.asarray(values[self._kept])

    def _look(
        self, window: _Window, camera: Camera, surface: Surface
    ) -> tuple[Array, NDArray[np.uint8], Raster]:
        """Return `REFERENCE` and `MEASURED` of a window, and the flags of its pixels."""
        start = self._start(camera, window.start, window.limits)
        chain = Chain(camera, window.scene, surface).at(start, self._reference)
        pixels, radiance = camera.pixels(window.scene.raster), chain.radiance()
        if window.beyond is not None and window.pixels is not None:
            light = sample(window.beyond, window.pixels, pixels.centres)
            radiance = np.maximum(radiance + np.nan_to_num(light), 0.0)
        kelvins, flags = read_temperature(camera, radiance, start)
        reference = chain.reference()
        measured = np.where(np.isnan(reference), np.nan, kelvins)
        return np.stack([reference, measured]), flags, pixels

    def _start(self, camera: Camera, start: float, limits: tuple[float, float]) -> float:
        """Return the start of a camera's exposure in the middle of one of the spread ones."""
        first, last = limits
        middle = start + (self._duration - camera.integration_time) / 2
        return max(min(middle, last - camera.integration_time), first)

    def _windows(
        self,
        scene: Scene,
        surfaces: Mapping[str, Surface],
        camera: Camera,
        schedule: Schedule,
        number: int,
    ) -> list[_Window]:
        """Return the windows of the places in one exposure."""
        start = float(schedule.starts[schedule.drawn[number]])
        frame = scene.frame_at(start)
        block = next(one for one in scene.blocks if frame in one)
        limits = float(scene.times[block[0]]), float(scene.times[block[-1]] + scene.frame_spacing)
        if len(scene.times) == 1:
            limits = -np.inf, np.inf
        begin = self._start(camera, start, limits)
        used = {schedule.views[n].surface for n, _ in self._rows}
        small = [name for name in used if _is_local(surfaces[name]) and camera.line_time is None]
        whole, frames = {}, []
        if small:
            chains = [Chain(camera, scene, surfaces[name]) for name in small]
            exposures = expose_chains(chains, begin)
            whole = {
                name: chain.exposed(exposure).radiance()
                for name, chain, exposure in zip(small, chains, exposures, strict=True)
            }
            reach = camera.integration_time / 2
            # The frames from half an exposure before to half an exposure after it.
            first, last = (scene.frame_at(begin + at * reach) for at in (-1.0, 3.0))
            frames = list(scene.frames(range(max(first, block[0]), min(last, block[-1]) + 1)))
        windows = []
        for key, rows in self._rows.items():
            view = schedule.views[key[0]]
            place = view.places[number][key[1]]
            part = _around(place, scene.raster, camera) if view.surface in whole else None
            one = _Window(scene, place, view.surface, rows, start, limits)
            if part is not None:
                one = replace(one, scene=_cropped(frames, scene, part))
                moved = _on_grid(camera, scene.raster, one)
                image = Chain(moved, one.scene, surfaces[view.surface]).at(begin).radiance()
                pixels = moved.pixels(one.scene.raster)
                light = nearest(whole[view.surface], camera.pixels(scene.raster), pixels.centres)
                one = replace(one, beyond=np.nan_to_num(light - image), pixels=pixels)
            windows.append(one)
        return windows


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


def _on_grid(camera: Camera, scene: Raster, window: _Window) -> Camera:
    """Return a camera on a scene with the same pixels on a window of it."""
    own = window.scene.raster
    shift = own.left - scene.left, scene.top - own.top
    if not any(shift):
        return camera
    right, down = np.mod(np.subtract(camera.offset, shift), camera.pitch).tolist()
    return replace(camera, offset=(right, down))
