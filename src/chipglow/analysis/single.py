"""Single readings: one place in one exposure with one texture and pixel position, quickly.

An uncertainty budget and a choice of settings need thousands of readings with other cameras and
surfaces, at random instead of all draws of a schedule.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final, TypeAlias

import numpy as np

from chipglow.analysis.cut import Progress
from chipglow.analysis.engine import schedule_of
from chipglow.analysis.images import ALL, CASES
from chipglow.analysis.outside import fractions_outside
from chipglow.analysis.plan import Plan
from chipglow.analysis.read import Schedule, read_place
from chipglow.analysis.window import Moment, Nominal, Window
from chipglow.camera import Camera
from chipglow.quantities import Array
from chipglow.scene import Scene
from chipglow.surface import Surface

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

_SEEDS: Final = 2**31
"""Seeds of textures and noise: those that fit into 31 bits."""

_Key: TypeAlias = tuple[int, int]
"""Index of a view of the schedule, and of a place in it."""


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
        nominal = Nominal(scene, surfaces, replace(camera, shape=None))
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
        moment, windows = self._moments[int(draw.get(EXPOSURE, 0.0) * len(self._moments))]
        start = moment.begin(camera.integration_time)
        values = np.full((self._size, 4), np.nan)
        for key, window in windows.items():
            rows = self._rows[key]
            surface = surfaces[window.surface].redrawn(texture)
            chain = window.chain(seen, surface).at(start, self._reference)
            images, pixels = chain.stack(_EVERY_EFFECT), chain.pixels
            values[rows, :BELOW] = read_place(window.place, images, pixels).values
            flags = chain.read().flags
            values[rows, BELOW:] = fractions_outside(window.place, flags, images[MEASURED], pixels)
        return np.asarray(values[self._kept])

    def _moment(
        self, nominal: Nominal, schedule: Schedule, number: int, duration: float
    ) -> tuple[Moment, dict[_Key, Window]]:
        """Return an exposure of a schedule, and a window around each place that is read."""
        start = float(schedule.starts[schedule.drawn[number]])
        moment = Moment.of(nominal.scene, start, duration)
        parts = nominal.parts({schedule.views[n].surface for n, _ in self._rows}, moment)
        windows = {}
        for view, place in self._rows:
            seen = schedule.views[view]
            windows[view, place] = parts.window(seen.places[number][place], seen.surface)
        return moment, windows
