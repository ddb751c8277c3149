"""Exchange of radiation between long surfaces: diffuse and mirror-like, with all bounces."""

from dataclasses import dataclass
from functools import cached_property
from typing import Final, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Array

RAYS: Final = 2048
"""Rays that leave each element."""
BOUNCES: Final = 64
"""Most reflections by mirrors along a ray; what is left then comes from the surroundings."""

_Paths: TypeAlias = tuple[NDArray[np.int16], Array, NDArray[np.int64]]

_GOLDEN: Final = (5.0**0.5 - 1.0) / 2.0
"""Fractional part of the golden ratio, whose multiples spread rays evenly."""

_OPEN: Final = -1
"""Index for a ray that meets no element."""

_ROUNDING: Final = 1e-12
"""Part of an element by which a ray may miss it by rounding."""


@dataclass(frozen=True, eq=False)
class Exchange:
    """Surfaces that are long in one direction, in their cross-section, before surroundings.

    Elements are straight and see what is on their left, looking from start to end: they are the
    borders of bodies, whose inside no ray reaches. Every element has one temperature and
    emissivity, reflects grey and partly like a mirror, the rest diffusely.

    A diffuse element sends (1/2) d(sin φ) of its radiation into the angle dφ to its normal; a
    mirror is one in the cross-section too (Howell, Mengüç, Daun and Siegel, Thermal Radiation Heat
    Transfer, chapters 4 to 6). The irradiation H of element i, as a radiance, is the mean over its
    rays: B of the first element that they meet, m times B of the next, and so on, and the rest of
    the surroundings. B = ε L + (1 − ε)(1 − s) H is the diffuse radiosity, m = (1 − ε) s
    with the fraction s of the reflected light that mirrors make.
    """

    starts: Array
    ends: Array
    """Ends of the elements in m, shape (element, 2)."""
    rays: int = RAYS
    """Rays that leave each element, evenly over its length and the sine of their angle."""

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the elements in m."""
        return np.asarray(np.hypot(*(self.ends - self.starts).T), np.float64)

    @property
    def middles(self) -> Array:
        """Middles of the elements in m, shape (element, 2)."""
        return (self.starts + self.ends) / 2

    def incident(
        self,
        radiance: ArrayLike,
        emissivity: ArrayLike,
        surroundings: float = 0.0,
        mirror: ArrayLike = 0.0,
        eye: ArrayLike | None = None,
    ) -> Array:
        """Return the irradiation over π of each element, shape (..., element).

        Take the blackbody radiance (..., element), emissivities, the surroundings' radiance, and
        the fraction of reflected light that is reflected as by a mirror. For an eye far off in a
        direction (2,), which sees ε L + (1 − ε) times the result, the mirrors' fraction is the
        radiance in the mirrored direction.
        """
        black = np.asarray(radiance, np.float64)
        emissivities = np.broadcast_to(np.asarray(emissivity, np.float64), black.shape)
        mirrors = np.broadcast_to(np.asarray(mirror, np.float64), black.shape)
        shape, count = black.shape, len(self.lengths)
        own = (emissivities * black).reshape(-1, count)
        reflectance = (1.0 - emissivities).reshape(-1, count)
        mirror_part = mirrors.reshape(-1, count)
        specular, diffuse = reflectance * mirror_part, reflectance * (1.0 - mirror_part)
        paths = self._all_hits if mirrors.any() else self._first_hits

        def arriving(factors: Array, radiosity: Array) -> Array:
            to_elements, leaving = factors[..., :-1], factors[..., -1]
            return np.asarray((to_elements @ radiosity[..., None])[..., 0] + surroundings * leaving)

        # H − F (1 − ε)(1 − s) H = F ε L + F_open L_env, case by case.
        factors = _factors(*paths, specular)
        matrix = np.eye(count) - factors[..., :-1] * diffuse[:, None, :]
        result = np.linalg.solve(matrix, arriving(factors, own)[..., None])[..., 0]
        if eye is not None and mirrors.any():
            seen = _factors(*self._mirrored(np.asarray(eye)), specular)
            result += mirror_part * (arriving(seen, own + diffuse * result) - result)
        return np.asarray(result.reshape(shape))

    @cached_property
    def _first_hits(self) -> _Paths:
        return self._traced(1)

    @cached_property
    def _all_hits(self) -> _Paths:
        return self._traced(BOUNCES)

    def _traced(self, bounces: int) -> _Paths:
        """Different paths of rays, their fractions, and where those of each element begin."""
        number = np.arange(self.rays) + 0.5
        place, sine = np.modf(_GOLDEN * number)[0], 2.0 * number / self.rays - 1.0
        paths, weights, first = [], [], [0]
        for element in range(len(self.lengths)):
            hits = _trace(self.starts, self.ends, element, place, sine, bounces)
            different, count = np.unique(hits, axis=0, return_counts=True)
            paths.append(different)
            weights.append(count / self.rays)
            first.append(first[-1] + len(different))
        return np.concatenate(paths), np.concatenate(weights), np.array(first)

    def _mirrored(self, eye: Array) -> _Paths:
        """Return what an eye sees in the elements' middles, a path each."""
        along = (self.ends - self.starts) / self.lengths[:, None]
        sine = -(along @ (eye / np.hypot(*eye)))
        number = np.arange(len(sine) + 1)
        seen = [_trace_one(self.starts, self.ends, i, 0.5, sine[i], BOUNCES) for i in number[:-1]]
        return np.stack(seen), np.ones(len(sine)), number


@njit(cache=True)
def _trace(starts, ends, element, places, sines, bounces):  # type: ignore[no-untyped-def]
    """Elements met by the rays of an element in turn, shape (ray, bounce); −1: none."""
    hits = np.empty((len(sines), bounces), np.int16)
    for r in range(len(sines)):
        hits[r] = _trace_one(starts, ends, element, places[r], sines[r], bounces)
    return hits


@njit(cache=True)
def _trace_one(starts, ends, element, place, sine, bounces):  # type: ignore[no-untyped-def]
    """Elements met by one ray: from a place on an element, 0 to 1, at an angle's sine."""
    path = np.full(bounces, _OPEN, np.int16)
    cosine = np.sqrt(max(1.0 - sine * sine, 0.0))
    ux, uy = ends[element, 0] - starts[element, 0], ends[element, 1] - starts[element, 1]
    x, y = starts[element, 0] + place * ux, starts[element, 1] + place * uy
    length = np.sqrt(ux * ux + uy * uy)
    dx, dy = (sine * ux - cosine * uy) / length, (sine * uy + cosine * ux) / length
    for bounce in range(bounces):
        nearest, found = np.inf, _OPEN
        for j in range(len(starts)):
            if j == element:
                continue
            ux, uy = ends[j, 0] - starts[j, 0], ends[j, 1] - starts[j, 1]
            facing = dx * -uy + dy * ux
            if facing >= 0.0:
                continue
            fx, fy = starts[j, 0] - x, starts[j, 1] - y
            distance = (fx * -uy + fy * ux) / facing
            part = (fy * dx - fx * dy) / facing
            if -_ROUNDING <= part <= 1.0 + _ROUNDING and 0.0 <= distance < nearest:
                nearest, found = distance, j
        if found == _OPEN:
            break
        path[bounce] = found
        element = found
        x, y = x + nearest * dx, y + nearest * dy
        ux, uy = ends[found, 0] - starts[found, 0], ends[found, 1] - starts[found, 1]
        twice = 2.0 * (dx * -uy + dy * ux) / (ux * ux + uy * uy)
        dx, dy = dx + twice * uy, dy - twice * ux
    return path


@njit(cache=True)
def _factors(paths, weights, first, specular):  # type: ignore[no-untyped-def]
    """Fractions of the radiosity of elements, and of the surroundings, that arrive at each element.

    Shape (case, element, element + 1), by the reflectance of mirrors (case, element) on the way.
    """
    cases, elements = specular.shape
    result = np.zeros((cases, elements, elements + 1))
    for c in range(cases):
        for i in range(elements):
            for p in range(first[i], first[i + 1]):
                left = weights[p]
                for hit in paths[p]:
                    if hit == _OPEN or left == 0.0:
                        break
                    result[c, i, hit] += left
                    left *= specular[c, hit]
                result[c, i, elements] += left
    return result
