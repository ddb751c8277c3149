"""Where a straight edge lies in an image, at any orientation."""

from dataclasses import dataclass
from math import atan2, cos, degrees, pi, sin
from typing import Final

import numpy as np

from chipglow.quantities import Array

_LEAST_SIGNIFICANCE: Final = 50.0
"""Square of Student's t of a step that is taken for an edge; the best of noise reaches about 20."""
_LEAST_PIXELS: Final = 10


class NoEdgeError(ValueError):
    """There is no single straight edge in the image."""


@dataclass(frozen=True)
class EdgeLine:
    """A straight edge."""

    normal: float
    """Direction from the dark to the bright side in rad, counterclockwise from x."""
    position: float
    """Distance in m of the edge from the origin along the normal."""

    def distance(self, x: Array, y: Array) -> Array:
        """Return the signed distances of points from the edge in m, positive on the bright side."""
        return x * cos(self.normal) + y * sin(self.normal) - self.position

    @property
    def tilt(self) -> float:
        """Angle between the edge and the nearest axis of the image in rad, −π/4 to π/4."""
        return (self.normal + pi / 4) % (pi / 2) - pi / 4


def find_edge(image: Array, x: Array, y: Array) -> EdgeLine:
    """Find the edge in an image, to about a quarter of a pixel.

    It is the step that explains most of the image's variance, at any orientation.
    """
    across, down = np.meshgrid(x, y)
    usable = np.isfinite(image)
    if np.count_nonzero(usable) < 4 * _LEAST_PIXELS:
        raise NoEdgeError(
            f"{np.count_nonzero(usable)} usable pixels, expected {4 * _LEAST_PIXELS} or more"
        )
    pixels = across[usable], down[usable], image[usable]
    if np.ptp(pixels[2]) == 0.0:
        raise NoEdgeError("all pixels have the same radiance, expected an edge")
    pitch = float(x[1] - x[0])
    _, coarse, _ = _best_step(*pixels, pitch, np.arange(0.0, 180.0, 1.0))
    around = degrees(coarse) + np.arange(-1.0, 1.05, 0.1)
    significance, normal, position = _best_step(*pixels, pitch / 2, around)
    if significance < _LEAST_SIGNIFICANCE:
        raise NoEdgeError(
            "no edge stands out of the noise: the clearest step is "
            f"{significance**0.5:.2g} of its standard uncertainties, expected "
            f"{_LEAST_SIGNIFICANCE**0.5:.2g} or more"
        )
    return EdgeLine(normal, position)


def _best_step(
    x: Array,
    y: Array,
    value: Array,
    width: float,
    angles: Array,
) -> tuple[float, float, float]:
    """Return the square of Student's t, normal in rad and position in m of the clearest step."""
    centred = value - value.mean()
    count, total = value.size, float(centred @ centred)
    best = (0.0, 0.0, 0.0)
    for angle in np.radians(angles):
        distance = x * cos(angle) + y * sin(angle)
        first = distance.min()
        index = ((distance - first) / width).astype(np.int64)
        before = np.cumsum(np.bincount(index))[:-1]
        mass = np.cumsum(np.bincount(index, centred))[:-1]
        enough = np.minimum(before, count - before) >= _LEAST_PIXELS
        if not enough.any():
            continue
        after = np.where(enough, count - before, 1)
        gain = np.where(enough, mass**2 * count / (np.where(enough, before, 1) * after), 0.0)
        k = int(np.argmax(gain))
        left = max(total - gain[k], 1e-12 * total) / (count - 2)
        if gain[k] / left > best[0]:
            normal = float(angle) + (pi if mass[k] > 0 else 0.0)
            place = float(first + (k + 1) * width) * (-1 if mass[k] > 0 else 1)
            best = (float(gain[k] / left), atan2(sin(normal), cos(normal)), place)
    return best
