"""A target with holes as both cameras see it, with a known map between the images.

A heated plate: its holes radiate more than its surface, so they are bright in the infrared; in the
visible picture they are dark.

``python benchmarks/dot_target.py --first 300 --count 20`` registers targets of these seeds, with
settings from `DotTarget.drawn`, and prints how far off each map is and what it says of itself.
"""

from dataclasses import dataclass
from functools import cached_property
from math import radians

import numpy as np
from common import arguments
from dual_spectrum import TwoCameraView
from scipy.ndimage import gaussian_filter
from scipy.stats import f as f_distribution

from chipglow.laboratory.registration import fit_dots
from chipglow.scene import Raster

RASTER = Raster(left=-480e-6, top=360e-6, spacing=6e-6, rows=120, columns=160)
_FINER = 4


@dataclass(frozen=True)
class DotTarget(TwoCameraView):
    """One view of the target; `gaps` are holes that are left out, by number."""

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
    raster: Raster = RASTER

    @classmethod
    def drawn(cls, seed):
        """A target whose settings are drawn, with one hole left out."""
        draw = np.random.default_rng([seed, 5]).uniform
        return cls(
            seed,
            gaps=(int(draw(8, 40)),),
            radius=draw(14e-6, 30e-6),
            noise=10 ** draw(-3.0, -1.3),
            blur=draw(6e-6, 16e-6),
            contrast=draw(0.1, 0.8),
            visible_noise=draw(1.0, 10.0),
            pitch=1.5e-6 * draw(0.9, 1.4),
            turn=radians(draw(-20.0, 20.0)),
            stretch=draw(0.97, 1.03),
            shift=(draw(-50.0, 50.0), draw(-40.0, 40.0)),
            centre=(draw(-60e-6, 60e-6), draw(-40e-6, 40e-6)),
            jitter=draw(0.0, 8e-6),
        )

    @cached_property
    def holes(self):
        """Middles of the holes in m, shape (n, 2)."""
        x = (np.arange(self.columns) - (self.columns - 1) / 2) * self.spacing
        y = (np.arange(self.rows) - (self.rows - 1) / 2) * self.spacing
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + self.centre
        places += np.random.default_rng([self.seed, 0]).normal(0.0, 1.0, places.shape) * self.jitter
        return np.delete(places, list(self.gaps), axis=0)

    @cached_property
    def infrared(self):
        raster, pitch = self.raster, self.raster.spacing / _FINER
        x = raster.left + (np.arange(raster.columns * _FINER) + 0.5) * pitch
        y = raster.top - (np.arange(raster.rows * _FINER) + 0.5) * pitch
        place = np.stack(np.meshgrid(x, y), axis=-1)
        seen = gaussian_filter(self._plate(place, 40.0, 90.0), self.blur / pitch)
        sensors = seen.reshape(raster.rows, _FINER, raster.columns, _FINER).mean(axis=(1, 3))
        sensors *= 1.0 - 0.2 * raster.x / 480e-6
        generator = np.random.default_rng([self.seed, 1])
        return sensors + generator.normal(0.0, self.noise * 90.0, sensors.shape)

    @cached_property
    def visible(self):
        """Brightness, holes dark, with grain."""
        shape, part = self.visible_shape, (np.arange(3) - 1) / 3
        rows = (np.arange(shape[0])[:, None] + part).ravel()
        columns = (np.arange(shape[1])[:, None] + part).ravel()
        plate = self._plate(self.places(columns, rows), 200.0, 200.0 * (1 - self.contrast))
        seen = plate.reshape(shape[0], 3, shape[1], 3).mean(axis=(1, 3))
        generator = np.random.default_rng([self.seed, 2])
        grain = gaussian_filter(generator.standard_normal(shape), 2.0)
        grained = seen * (1.0 + 0.02 * grain / grain.std())
        return self.photograph(grained, self.visible_noise, generator)

    def _plate(self, place, surface, hole):
        brightness = np.full(place.shape[:2], surface)
        for x, y in self.holes:
            brightness[np.hypot(place[..., 0] - x, place[..., 1] - y) < self.radius] = hole
        return brightness


def main():
    given = arguments(__doc__, first=300, count=20)
    print("seed holes match  error  stated  inside  warnings   (in infrared pixels)", flush=True)
    within = tried = 0
    places = np.stack(np.meshgrid(RASTER.x, RASTER.y), axis=-1)[10::20, 10::20].reshape(-1, 2)
    for seed in range(given.first, given.first + given.count):
        target = DotTarget.drawn(seed)
        try:
            fit = fit_dots(target.infrared, RASTER, target.visible)
        except ValueError as error:
            print(f"{seed:4d} {len(target.holes):5d}  {error}", flush=True)
            continue
        found = fit.registration
        off = found.pixels(places) - target.pixels(places)
        covariance = found.pixel_covariance(places)
        squares = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariance), off)
        inside = squares < 2 * f_distribution.ppf(0.95, 2, found.degrees_of_freedom)
        within, tried = within + inside.sum(), tried + inside.size
        size = RASTER.spacing / target.pitch
        error = np.sqrt((off**2).sum(axis=1).mean()) / size
        stated = np.sqrt(np.trace(covariance, axis1=1, axis2=2).mean()) / size
        warned = "; ".join(found.notes.warnings) or "-"
        print(f"{seed:4d} {len(target.holes):5d} {len(fit.points.pixels):5d} ", end="")
        print(f"{error:6.3f} {stated:7.3f} {inside.mean():7.2f}  {warned}", flush=True)
    print(f"{within / max(tried, 1):.2f} of the places are within their 95 % region")


if __name__ == "__main__":
    main()
