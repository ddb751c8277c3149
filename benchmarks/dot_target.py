"""A target with holes as both cameras see it, with a known map between the images.

A heated plate: its holes radiate more than its surface, so they are bright in the infrared; in the
visible picture they are dark.
"""

from dataclasses import dataclass
from functools import cached_property
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from chipglow.scene import Raster

RASTER = Raster(left=-480e-6, top=360e-6, spacing=6e-6, rows=120, columns=160)
VISIBLE_SHAPE = (480, 640)
_FINER = 4


@dataclass(frozen=True)
class DotTarget:
    """One view of the target; what is random follows the seed.

    `matrix` maps a position in m to a visible pixel. `gaps` are holes that are left out, by
    number.
    """

    seed: int = 1
    columns: int = 8
    rows: int = 6
    spacing: float = 90e-6
    radius: float = 22e-6
    centre: tuple[float, float] = (0.0, 0.0)
    jitter: float = 0.0
    gaps: tuple[int, ...] = ()
    noise: float = 0.01
    blur: float = 12e-6
    contrast: float = 0.35
    visible_noise: float = 5.0
    pitch: float = 1.5e-6
    turn: float = radians(1.5)
    stretch: float = 1.02
    shift: tuple[float, float] = (11.3, -7.6)
    perspective: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def holes(self) -> NDArray[np.float64]:
        """Middles of the holes in m, shape (n, 2)."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.spacing
        y = (np.arange(self.rows) - (self.rows - 1) / 2) * self.spacing
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + self.centre
        places += np.random.default_rng([self.seed, 0]).normal(0.0, 1.0, places.shape) * self.jitter
        return np.asarray(np.delete(places, list(self.gaps), axis=0))

    @cached_property
    def matrix(self) -> NDArray[np.float64]:
        """Position in m to column and row."""
        turn = np.array([[cos(self.turn), -sin(self.turn)], [sin(self.turn), cos(self.turn)]])
        matrix = np.eye(3)
        matrix[:2, :2] = turn @ np.diag([self.stretch, -1.0]) / self.pitch
        matrix[2, :2] = self.perspective
        middle = np.array([VISIBLE_SHAPE[1], VISIBLE_SHAPE[0]]) / 2 - 0.5 + self.shift
        matrix[:2] += np.outer(middle, matrix[2])
        return matrix

    def pixels(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where positions in m truly are in the visible picture."""
        whole = np.concatenate([positions, np.ones((len(positions), 1))], axis=1) @ self.matrix.T
        return np.asarray(whole[:, :2] / whole[:, 2:])

    @cached_property
    def infrared(self) -> NDArray[np.float64]:
        """Radiance, holes bright, warmer on the left."""
        pitch = RASTER.spacing / _FINER
        x = RASTER.left + (np.arange(RASTER.columns * _FINER) + 0.5) * pitch
        y = RASTER.top - (np.arange(RASTER.rows * _FINER) + 0.5) * pitch
        place = np.stack(np.meshgrid(x, y), axis=-1)
        seen = gaussian_filter(self._plate(place, 40.0, 90.0), self.blur / pitch)
        sensors = seen.reshape(RASTER.rows, _FINER, RASTER.columns, _FINER).mean(axis=(1, 3))
        sensors *= 1.0 - 0.2 * RASTER.x / 480e-6
        generator = np.random.default_rng([self.seed, 1])
        return np.asarray(sensors + generator.normal(0.0, self.noise * 90.0, sensors.shape))

    @cached_property
    def visible(self) -> NDArray[np.uint8]:
        """Brightness, holes dark, with grain."""
        part = (np.arange(3) - 1) / 3
        rows = (np.arange(VISIBLE_SHAPE[0])[:, None] + part).ravel()
        columns = (np.arange(VISIBLE_SHAPE[1])[:, None] + part).ravel()
        pixels = np.stack([*np.meshgrid(columns, rows), np.ones((rows.size, columns.size))], -1)
        whole = pixels @ np.linalg.inv(self.matrix).T
        plate = self._plate(whole[..., :2] / whole[..., 2:], 200.0, 200.0 * (1 - self.contrast))
        seen = plate.reshape(VISIBLE_SHAPE[0], 3, VISIBLE_SHAPE[1], 3).mean(axis=(1, 3))
        generator = np.random.default_rng([self.seed, 2])
        grain = gaussian_filter(generator.standard_normal(VISIBLE_SHAPE), 2.0)
        seen = gaussian_filter(seen * (1.0 + 0.02 * grain / grain.std()), 1.2)
        seen += generator.normal(0.0, self.visible_noise, VISIBLE_SHAPE)
        return np.clip(np.rint(seen), 0, 255).astype(np.uint8)

    def _plate(
        self, place: NDArray[np.float64], surface: float, hole: float
    ) -> NDArray[np.float64]:
        brightness = np.full(place.shape[:2], surface)
        for x, y in self.holes:
            brightness[np.hypot(place[..., 0] - x, place[..., 1] - y) < self.radius] = hole
        return brightness
