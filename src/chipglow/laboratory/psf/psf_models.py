"""Models of a camera's optics that a knife edge can be fitted with, by their transfer functions."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, cos, exp, inf, pi, sin, sqrt
from typing import Final

import numpy as np
from scipy import fft
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import chndtr, gamma, j0, j1, kve, ndtr

from chipglow.camera import AnnularAperturePSF, GaussianPSF, MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.psf import FWHM_PER_SIGMA, jinc
from chipglow.camera.optics.pupil import annular_transfer
from chipglow.quantities import Array

_SAMPLES_PER_FOOTPRINT: Final = 8
"""Samples along a pixel of the edge-spread function."""

_PERIODS: Final = 64
"""Length of the table of an edge, in its largest distance: diffraction wraps around by 3e-6."""

_FEW_PERIODS: Final = 16
"""The same for light that ends, within 4 of these distances from the farthest pixel at most."""

_TAIL_ENERGY: Final = 0.9999
"""Fraction of the light within the reach of a tail."""

_KERNEL_NODES: Final = 3
"""Gauss nodes along a sample, over which a density is integrated."""

_MOST_SIDE: Final = 1025
"""Largest side of a kernel in samples: 8 MB."""

_LARGEST_WIDTH: Final = 1e-3
"""Largest width in m that is fitted."""

_NARROWEST: Final = 0.02
"""Smallest width over the pitch: the image would not change if it were narrower."""

_SMALLEST_DISC: Final = 0.1
"""Smallest diameter of a disc over the pitch, likewise."""

_LENGTHS: Final = ("fwhm", "diameter")
_EVEN_DISC: Final = 30.0
"""A disc of this many deviations of its blur is half as bright at its rim, within its 2000th."""
_BLUR_STEP: Final = 1 / 32
"""Distance of the nodes of a blurred disc, in deviations of its blur."""
_MOFFAT_NODES: Final = np.geomspace(1e-7, 60.0, 1000)
"""Arguments of the transfer function: it is 1 under and 0 over them."""

_MOST_WIDTHS: Final = 60.0
"""Largest reach of a Moffat function in its widths."""

_SAMPLES_PER_WIDTH: Final = 8
"""Samples of a kernel over its full width at half maximum, or over the radius of a disc."""

_MOST_OBSCURED: Final = 0.81
"""Largest obscured area, by that of the aperture: 0.9 of its diameter."""

_DIRECTIONS: Final = 12
"""Directions within 90 degrees over which the transfer function of a pixel is averaged."""

_RADII: Final = 201
"""Radii among which the largest density is looked for."""


class PSFModel(ABC):
    """A family of point spread functions of the optics alone."""

    name: str
    parameters: tuple[str, ...]
    """Names of its parameters; `is_length` marks those in m, others are pure numbers."""
    periods: int = _PERIODS
    """Length of the table of an edge, in its largest distance."""

    shapes: tuple[tuple[float, ...], ...] = ()
    """Parameters from which fits start; lengths over the full width at half maximum."""
    lowest: tuple[float, ...] = ()
    """Smallest parameters; lengths over the pitch."""
    highest: tuple[float, ...] = ()
    """Largest parameters; lengths have separate limits."""

    def starts(self, fwhm: float) -> list[list[float]]:
        """Return parameters from which fits start, for about this width in m."""
        return [self._scaled(shape, fwhm) for shape in self.shapes]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """Return the smallest and largest parameters for a pitch and an image's extent in m."""
        high = [
            min(extent, _LARGEST_WIDTH) if is_length(name) else most
            for name, most in zip(self.parameters, self.highest, strict=False)
        ]
        return self._scaled(self.lowest, pitch), high

    def _scaled(self, values: tuple[float, ...], length: float) -> list[float]:
        pairs = zip(self.parameters, values, strict=False)
        return [value * length if is_length(name) else value for name, value in pairs]

    @abstractmethod
    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        """Return the optical transfer function at frequencies in 1/m along an angle in rad."""

    def density(self, values: Array, x: Array, y: Array) -> Array:
        """Return the light per area, up to a factor, at positions in m from the middle."""
        raise NotImplementedError

    def sampling(self, values: Array) -> tuple[float, float]:
        """Return the distance up to which the kernel reaches, and its spacing, in m."""
        raise NotImplementedError

    def fwhm(self, values: Array) -> float:
        """Return twice the largest radius with half the largest density in m."""
        radii = np.linspace(0.0, self.sampling(values)[0], _RADII)
        density = self.density(values, radii, np.zeros(()))
        half = float(density.max()) / 2
        last = int(np.flatnonzero(density >= half)[-1])

        def excess(radius: float) -> float:
            return float(self.density(values, np.array(radius), np.zeros(()))) - half

        if excess(radii[last]) <= 0:  # the radius itself, but for rounding
            return 2 * float(radii[last])
        return 2 * float(brentq(excess, radii[last], radii[last + 1]))

    def psf(self, values: Array) -> PointSpreadFunction:
        """Return the optics' point spread function, for a camera of order ``optics``."""
        return MeasuredPSF(
            *sampled_kernel(lambda x, y: self.density(values, x, y), *self.sampling(values))
        )

    def mean_transfer(self, values: Array, frequency: Array) -> Array:
        """Return the mean of the transfer function over all directions."""
        return self.transfer(values, frequency, 0.0)


def is_length(parameter: str) -> bool:
    """Return whether a parameter of a model is a length in m, by its name."""
    return any(word in parameter for word in _LENGTHS)


@dataclass(frozen=True)
class GaussianModel(PSFModel):
    """A round Gaussian; its transfer function is exp(−2π²σ²f²)."""

    name = "gaussian"
    periods = _FEW_PERIODS
    parameters = ("fwhm",)
    shapes, lowest, highest = ((1.0,),), (_NARROWEST,), (inf,)

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        return _gaussian_transfer(values[0], frequency)

    def fwhm(self, values: Array) -> float:
        return float(values[0])

    def psf(self, values: Array) -> PointSpreadFunction:
        return GaussianPSF(float(values[0]))


@dataclass(frozen=True)
class GaussianTailModel(PSFModel):
    """A round Gaussian and, for a fraction of the light, a tail exp(−r / length) / (2π length²).

    The tail describes stray light and the size-of-source effect. Its transfer function is
    (1 + (2π length f)²)^(−3/2). Its parameter ``tail_ratio`` is the length over the core's width;
    it is 0.72 or more, with which the tail is as wide as the core: it can't be a sharp tip.
    """

    name = "gaussian with tail"
    parameters = ("core_fwhm", "tail_fraction", "tail_ratio")
    # A faint wide tail, or a strong short one.
    shapes = (0.9, 0.1, 4.0), (0.9, 0.25, 1.5)
    # A core remains; the ratio is as above.
    lowest, highest = (_NARROWEST, 0.0, 0.72), (inf, 0.95, inf)

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        low, high = super().bounds(pitch, extent)
        return low, [*high[:2], extent / pitch]

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        core, fraction, ratio = values
        tail = (1 + (2 * pi * ratio * core * frequency) ** 2) ** -1.5
        return np.asarray((1 - fraction) * _gaussian_transfer(core, frequency) + fraction * tail)

    def density(self, values: Array, x: Array, y: Array) -> Array:
        core, fraction, ratio = values
        sigma, length, radius = core / FWHM_PER_SIGMA, ratio * core, np.hypot(x, y)
        gauss = np.exp(-(radius**2) / (2 * sigma**2)) / sigma**2
        tail = np.exp(-radius / length) / length**2
        return np.asarray((1 - fraction) * gauss + fraction * tail)

    def sampling(self, values: Array) -> tuple[float, float]:
        core, fraction, length = float(values[0]), float(values[1]), float(values[2] * values[0])
        reach = 2.0 * core
        # The fraction (1 + r / length) exp(−r / length) of the tail is beyond r.
        while fraction * (1 + reach / length) * exp(-reach / length) > 1 - _TAIL_ENERGY:
            reach += 0.5 * length
        return reach, core / _SAMPLES_PER_WIDTH


@dataclass(frozen=True)
class AnnularModel(PSFModel):
    """Diffraction of a round pupil with a round obstruction; see `AnnularAperturePSF`."""

    wavelength: float
    """In m. Only its ratio to the numerical aperture is known from an image."""
    name = "annular aperture"
    parameters = ("numerical_aperture", "obscured_area")

    def starts(self, fwhm: float) -> list[list[float]]:
        # Diffraction is about 0.49 wavelengths over the numerical aperture wide.
        aperture = min(0.9, 0.49 * self.wavelength / fwhm)
        # Small, middle and large obscured areas.
        return [[aperture, area] for area in (0.02, 0.12, 0.35)]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        # With a smaller aperture, diffraction is wider than the image.
        return [max(1e-4, 0.4 * self.wavelength / extent), 0.0], [1.0, _MOST_OBSCURED]

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        relative = frequency * self.wavelength / (2 * values[0])
        return annular_transfer(relative, sqrt(max(values[1], 0.0)))

    def fwhm(self, values: Array) -> float:
        return self.psf(values).fwhm

    def psf(self, values: Array) -> PointSpreadFunction:
        aperture, area = min(float(values[0]), 1.0), float(np.clip(values[1], 0.0, _MOST_OBSCURED))
        return AnnularAperturePSF(self.wavelength, aperture, sqrt(area))


@dataclass(frozen=True)
class MoffatModel(PSFModel):
    """Light as (1 + (r / a)²)^(−exponent): a core with tails that fall as a power of the radius.

    A. F. J. Moffat, Astronomy and Astrophysics 3 (1969) 455. The transfer function is Hankel's
    transform, 2 (π a f)^(β−1) K_(β−1)(2π a f) / Γ(β−1) of the exponent β (Basset's integral).
    """

    name = "moffat"
    parameters = ("fwhm", "exponent")
    # Wide wings, or nearly a Gaussian. With an exponent of 1 the light would be infinite, with 20
    # it is that of a Gaussian but for the far wings.
    shapes = (1.0, 1.8), (1.0, 3.5)
    lowest, highest = (_NARROWEST, 1.2), (inf, 20.0)

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        cycles = 2 * pi * self._radius(values) * frequency
        curve = _moffat_curve(float(values[1]) - 1)
        result = np.where(cycles < _MOFFAT_NODES[0], 1.0, 0.0)
        some = (cycles >= _MOFFAT_NODES[0]) & (cycles < _MOFFAT_NODES[-1])
        result[some] = curve(np.log(cycles[some]))
        return result

    def density(self, values: Array, x: Array, y: Array) -> Array:
        return np.asarray((1 + (x**2 + y**2) / self._radius(values) ** 2) ** -values[1])

    def sampling(self, values: Array) -> tuple[float, float]:
        fwhm, exponent = values.tolist()
        # (1 + (r / a)²)^(1 − exponent) of the light is beyond r.
        reach = self._radius(values) * sqrt((1 - _TAIL_ENERGY) ** (1 / (1 - exponent)) - 1)
        return max(min(reach, _MOST_WIDTHS * fwhm), 2 * fwhm), fwhm / _SAMPLES_PER_WIDTH

    def fwhm(self, values: Array) -> float:
        return float(values[0])

    def _radius(self, values: Array) -> float:
        """Return the length a in m."""
        return float(values[0]) / (2 * sqrt(2 ** (1 / float(values[1])) - 1))


@lru_cache(maxsize=4)
def _moffat_curve(order: float) -> CubicSpline:
    """Return Moffat's transform over the logarithm, over which it is smooth."""
    bessel = kve(order, _MOFFAT_NODES) * np.exp(-_MOFFAT_NODES)
    nodes = 2 * (_MOFFAT_NODES / 2) ** order * bessel / gamma(order)
    return CubicSpline(np.log(_MOFFAT_NODES), nodes)


@dataclass(frozen=True)
class DefocusedDiscModel(PSFModel):
    """An even disc, as a lens out of focus makes it, blurred by a Gaussian (Stokseth 1969)."""

    name = "defocused disc"
    periods = _FEW_PERIODS
    parameters = ("disc_diameter", "blur_fwhm")
    # Hardly and much blurred.
    shapes = (1.0, 0.2), (1.0, 0.6)
    lowest, highest = (_SMALLEST_DISC, _NARROWEST), (inf, inf)

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        disc = jinc(2 * pi * (values[0] / 2 * frequency))
        return disc * _gaussian_transfer(values[1], frequency)

    def density(self, values: Array, x: Array, y: Array) -> Array:
        return _blurred_disc(values[0] / 2, values[1] / FWHM_PER_SIGMA, np.hypot(x, y))

    def sampling(self, values: Array) -> tuple[float, float]:
        radius, sigma = float(values[0]) / 2, float(values[1]) / FWHM_PER_SIGMA
        # A Gaussian has exp(−5²/2) = 4e-6 of its light beyond 5 standard deviations. At most 40
        # samples over a radius keep the kernel of a hardly blurred disc small.
        return radius + 5 * sigma, max(min(radius / _SAMPLES_PER_WIDTH, sigma), radius / 40)


@dataclass(frozen=True)
class DefocusedRingModel(PSFModel):
    """An even ring, as a mirror objective out of focus makes it, blurred by a Gaussian."""

    name = "defocused ring"
    periods = _FEW_PERIODS
    parameters = ("disc_diameter", "blur_fwhm", "obscured_area")
    # Hardly blurred with a small and a large obscuration, and much blurred.
    shapes = (1.0, 0.2, 0.2), (1.0, 0.2, 0.6), (1.0, 0.6, 0.2)
    # A ring of 10 % of the disc remains.
    lowest, highest = (_SMALLEST_DISC, _NARROWEST, 0.0), (inf, inf, 0.9)

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        radius, area = values[0] / 2, values[2]
        inner = jinc(2 * pi * (radius * sqrt(max(area, 0.0)) * frequency))
        ring = (jinc(2 * pi * (radius * frequency)) - area * inner) / (1 - area)
        return np.asarray(ring * _gaussian_transfer(values[1], frequency))

    def density(self, values: Array, x: Array, y: Array) -> Array:
        outer, sigma, radius = values[0] / 2, values[1] / FWHM_PER_SIGMA, np.hypot(x, y)
        inner = max(outer * sqrt(max(values[2], 0.0)), 1e-3 * outer)
        return _blurred_disc(outer, sigma, radius) - _blurred_disc(inner, sigma, radius)

    def sampling(self, values: Array) -> tuple[float, float]:
        return DefocusedDiscModel().sampling(values)


def _blurred_disc(disc: float, sigma: float, radius: Array) -> Array:
    """Return the light that a blur puts on points of a disc: the noncentral chi-squared.

    For many radii, a spline replaces it, with nodes a 32nd of the blur's deviation apart: within
    1e-7 of the light in the middle.
    """
    if disc > _EVEN_DISC * sigma:
        return np.asarray(ndtr((disc - radius) / sigma))
    place = radius / sigma
    nodes = np.arange(0.0, float(place.max()) + 2 * _BLUR_STEP, _BLUR_STEP)
    if place.size > nodes.size:
        return np.asarray(CubicSpline(nodes, _noncentral(disc / sigma, nodes))(place))
    return _noncentral(disc / sigma, place)


def _noncentral(disc: float, place: Array) -> Array:
    return np.asarray(chndtr(disc**2, 2.0, place**2))


@dataclass(frozen=True)
class EllipticalModel(PSFModel):
    """A Gaussian of another width in each direction."""

    tilted: bool
    """Whether its axes may be tilted against the image's; that needs three orientations."""
    name = "elliptical gaussian"
    periods = _FEW_PERIODS
    shapes = ((1.0, 1.0, 0.0),)
    # The last is a correlation: at 1 the spread would be a line.
    lowest, highest = (_NARROWEST, _NARROWEST, -0.99), (inf, inf, 0.99)

    @property
    def parameters(self) -> tuple[str, ...]:  # type: ignore[override]
        """Widths along x and y and, if the axes may be tilted, their correlation."""
        return ("fwhm_x", "fwhm_y", "correlation") if self.tilted else ("fwhm_x", "fwhm_y")

    def transfer(self, values: Array, frequency: Array, angle: float) -> Array:
        along = np.array([cos(angle), sin(angle)])
        return _gaussian_transfer(sqrt(float(along @ self._squares(values) @ along)), frequency)

    def mean_transfer(self, values: Array, frequency: Array) -> Array:
        angles = np.arange(8) * pi / 8
        every = np.array([self.transfer(values, frequency, angle) for angle in angles])
        return np.asarray(every.mean(axis=0))

    def fwhm(self, values: Array) -> float:
        """Return the geometric mean of the two widths along the ellipse's axes in m."""
        return sqrt(sqrt(float(np.linalg.det(self._squares(values)))))

    def density(self, values: Array, x: Array, y: Array) -> Array:
        inverse = np.linalg.inv(self._squares(values)) * FWHM_PER_SIGMA**2
        form = inverse[0, 0] * x**2 + 2 * inverse[0, 1] * x * y + inverse[1, 1] * y**2
        return np.asarray(np.exp(-form / 2))

    def sampling(self, values: Array) -> tuple[float, float]:
        least, largest = np.sqrt(np.linalg.eigvalsh(self._squares(values))).tolist()
        return 2.0 * largest, least / _SAMPLES_PER_WIDTH

    def _squares(self, values: Array) -> Array:
        both = values[2] * values[0] * values[1] if self.tilted else 0.0
        return np.array([[values[0] ** 2, both], [both, values[1] ** 2]])


@dataclass(frozen=True, eq=False)
class EdgeResponse:
    """Edge-spread function of optics and pixel, at nodes `step` apart with 0 in their middle."""

    step: float
    """Distance of the nodes in m."""
    edge: Array
    """Edge-spread function at the nodes, from 0 on the dark side to 1."""
    line: Array
    """Its derivative, the line-spread function in 1/m, at the nodes."""

    def __call__(self, distance: Array) -> Array:
        """Return the edge-spread function at distances in m, by cubics with these slopes."""
        # Thousands of fits make one for each set of widths: SciPy's spline takes thrice as long.
        place = np.clip(distance / self.step + self.edge.size // 2, 0.0, self.edge.size - 1.0)
        before = np.minimum(place.astype(np.intp), self.edge.size - 2)
        t = place - before
        value, slope = self.edge[before], self.step * self.line[before]
        rise = self.edge[before + 1] - value
        bend = slope + self.step * self.line[before + 1] - 2 * rise
        return np.asarray(value + t * (slope + t * (rise - slope - bend + t * bend)))

    def slope(self, distance: Array) -> Array:
        """Return the line-spread function at distances in m, in 1/m, by straight lines."""
        half = self.edge.size // 2
        return np.interp(distance, self.step * np.arange(-half, half + 1), self.line)


@lru_cache(maxsize=16)
def edge_response(
    model: PSFModel, values: tuple[float, ...], angle: float, footprint: float, reach: float
) -> EdgeResponse:
    """Return the edge-spread function of optics and pixel; kept, as a residual's slopes need it."""
    step = footprint / _SAMPLES_PER_FOOTPRINT
    count = fft.next_fast_len(ceil(model.periods * reach / step), real=True)
    frequency, square = _footprint_along(count, step, angle, footprint)
    response = model.transfer(np.array(values), frequency, angle) * square
    integral = np.zeros(frequency.size, dtype=np.complex128)
    integral[1:] = response[1:] / (2j * pi * frequency[1:])
    line, edge = fft.irfft(np.stack([response, integral]), count) / step
    half = min(ceil(reach / step) + 2, count // 2 - 1)
    index = np.arange(-half, half + 1)
    # The series of an edge minus a ramp over the whole period.
    whole = 0.5 + edge[index] + index / count
    return EdgeResponse(step, whole, line[index])


@lru_cache(maxsize=16)
def _footprint_along(
    count: int, step: float, angle: float, footprint: float
) -> tuple[Array, Array]:
    """Return the frequencies of samples, and the footprint's transfer function there."""
    frequency = np.arange(count // 2 + 1, dtype=np.float64) / (count * step)
    return frequency, footprint_transfer(frequency, angle, footprint)


def footprint_transfer(frequency: Array, angle: float, footprint: float) -> Array:
    """Return the transfer function of a square pixel at frequencies along a direction."""
    across, down = footprint * cos(angle), footprint * sin(angle)
    return np.sinc(frequency * across) * np.sinc(frequency * down)


def disc_response(frequency: Array, diameter: float, radii: Array, footprint: float) -> Array:
    """Return weights by which a transfer function gives the signal in the middle of a disc."""
    radius = diameter / 2
    square = np.zeros_like(frequency)
    for angle in ((np.arange(_DIRECTIONS) + 0.5) * pi / (2 * _DIRECTIONS)).tolist():
        square += footprint_transfer(frequency, angle, footprint) / _DIRECTIONS
    middle = np.mean([j0(2 * pi * frequency * rho) for rho in radii.tolist()], axis=0)
    weight = 2 * pi * radius * j1(2 * pi * frequency * radius) * middle * square
    step = float(frequency[1])
    weight *= step
    # The rule of rectangles misses the slope with which the integrand begins (Euler, Maclaurin).
    weight[0] += 2 * (pi * radius * step) ** 2 / 12
    return np.asarray(weight)


def sampled_kernel(
    density: Callable[[Array, Array], Array], reach: float, spacing: float
) -> tuple[Array, float]:
    """Return the kernel of a density, integrated over squares, and their side in m.

    Opposite places have the same density: half of the kernel is the other half, turned.
    """
    spacing = max(spacing, 2 * reach / (_MOST_SIDE - 1))
    half = ceil(reach / spacing)
    node, weight = np.polynomial.legendre.leggauss(_KERNEL_NODES)
    line = spacing * (np.arange(-half, half + 1, dtype=np.float64)[:, None] + node / 2)
    upper = np.zeros((half + 1, 2 * half + 1))
    for i in range(_KERNEL_NODES):
        for j in range(_KERNEL_NODES):
            x, y = line[None, :, j], line[: half - 1 : -1, i, None]
            upper += weight[i] * weight[j] * density(x, y)
    return np.concatenate([upper, upper[-2::-1, ::-1]]), spacing


def _gaussian_transfer(fwhm: float, frequency: Array) -> Array:
    return np.exp(-2 * (pi * (fwhm / FWHM_PER_SIGMA) * frequency) ** 2)
