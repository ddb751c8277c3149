"""Where a straight edge lies in an image, at any orientation."""

from dataclasses import dataclass
from math import atan2, cos, degrees, hypot, pi, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.uncertainty.component import MAD_FACTOR

_LEAST_SIGNIFICANCE: Final = 50.0
"""Square of Student's t of a step that is taken for an edge; the best of noise reaches about 20."""

_LEAST_PIXELS: Final = 10
"""Fewest pixels on each side of a line that may be an edge."""

_WINDOW_PIXELS: Final = 6
"""Distance in pixels from the line at which the window of the derivative (Hamming's) ends."""

_FEWEST_ROWS: Final = 8
"""Fewest rows of which the centroids determine a line."""

_WEAK_ROW: Final = 0.3
"""Step of a row, by the median one, below which its centroid is not used."""

_ITERATIONS: Final = 4
"""Iterations of a line and its window, and of a line and its outliers."""

_OUTLIER: Final = 3.5
"""Residual of an outlier in standard deviations: one of 2,000 normal ones."""


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


def find_edge(image: Array, x: Array, y: Array) -> tuple[EdgeLine, tuple[float, float] | None]:
    """Find the edge in an image, and its sagitta with its standard uncertainty in m (ISO 12233)."""
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
    # In degrees: all directions in steps of 1, then those around the best in steps of 0.1.
    _, coarse, _ = _best_step(*pixels, pitch, np.arange(0.0, 180.0, 1.0))
    around = degrees(coarse) + np.arange(-1.0, 1.05, 0.1)
    significance, normal, position = _best_step(*pixels, pitch / 2, around)
    if significance < _LEAST_SIGNIFICANCE:
        raise NoEdgeError(
            "no edge stands out of the noise: the clearest step is "
            f"{significance**0.5:.2g} of its standard uncertainties, expected "
            f"{_LEAST_SIGNIFICANCE**0.5:.2g} or more"
        )
    return _refined(image, x, y, EdgeLine(normal, position))


def _best_step(
    x: Array, y: Array, value: Array, width: float, angles: Array
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
        # A step without noise leaves the rounding of the sum.
        left = max(total - gain[k], 1e-12 * total) / (count - 2)
        if gain[k] / left > best[0]:
            normal = float(angle) + (pi if mass[k] > 0 else 0.0)
            place = float(first + (k + 1) * width) * (-1 if mass[k] > 0 else 1)
            best = (float(gain[k] / left), atan2(sin(normal), cos(normal)), place)
    return best


def _refined(
    image: Array, x: Array, y: Array, line: EdgeLine
) -> tuple[EdgeLine, tuple[float, float] | None]:
    """Return the line through the centroids of the derivative, and how far they are bent."""
    steep = abs(cos(line.normal)) < abs(sin(line.normal))
    rows, along, other = (image.T, y, x) if steep else (image, x, y)
    pitch = abs(float(along[1] - along[0]))
    middles = (along[:-1] + along[1:]) / 2
    derivative = np.diff(rows, axis=1)
    for _ in range(_ITERATIONS):
        a, b = cos(line.normal), sin(line.normal)
        here, there = (b, a) if steep else (a, b)
        expected = (line.position - there * other) / here
        place, centre = _centroids(derivative, middles, other, expected, pitch)
        kept = _without_outliers(place, centre)
        if kept.sum() < _FEWEST_ROWS:
            return line, None
        slope, start = np.polyfit(place[kept], centre[kept], 1)
        line = _line_of(float(slope), float(start), steep, line)
    # A parabola through the centroids deviates from its chord.
    unit = (place[kept] - place[kept].mean()) / (np.ptp(place[kept]) / 2)
    (bend, *_), covariance = np.polyfit(unit, centre[kept], 2, cov=True)
    return line, (abs(float(bend)), float(covariance[0, 0]) ** 0.5)


def _centroids(
    derivative: Array, middles: Array, other: Array, expected: Array, pitch: float
) -> tuple[Array, Array]:
    """Return the centroids of the derivative near the line, of rows that show all of it."""
    off = (middles[None, :] - expected[:, None]) / (_WINDOW_PIXELS * pitch)
    window = np.where(np.abs(off) <= 1, 0.54 + 0.46 * np.cos(pi * off), 0.0)  # Hamming's
    known = np.isfinite(derivative) | (window == 0.0)
    whole = known.all(axis=1) & (
        np.abs(expected - middles.mean()) < np.ptp(middles) / 2 - 3 * pitch
    )
    weight = window * np.where(np.isfinite(derivative), derivative, 0.0)
    mass = weight.sum(axis=1)
    strong = whole & (mass / np.median(mass[whole]) > _WEAK_ROW) if whole.any() else whole
    return other[strong], (weight[strong] @ middles) / mass[strong]


def _without_outliers(place: Array, centre: Array) -> NDArray[np.bool_]:
    """Return which centroids lie near their line, by the median of their distances."""
    kept = np.ones(place.size, dtype=np.bool_)
    for _ in range(_ITERATIONS):
        if kept.sum() < _FEWEST_ROWS:
            break
        residual = centre - np.polyval(np.polyfit(place[kept], centre[kept], 1), place)
        spread = MAD_FACTOR * float(np.median(np.abs(residual[kept])))
        kept = np.abs(residual) <= max(_OUTLIER * spread, 1e-12)  # in m: rounding
    return kept


def _line_of(slope: float, start: float, steep: bool, before: EdgeLine) -> EdgeLine:
    """Return the line on which one coordinate is slope times the other plus start."""
    length = hypot(1.0, slope)
    normal = (-slope / length, 1 / length) if steep else (1 / length, -slope / length)
    sign = 1.0 if normal[0] * cos(before.normal) + normal[1] * sin(before.normal) > 0 else -1.0
    return EdgeLine(atan2(sign * normal[1], sign * normal[0]), sign * start / length)
