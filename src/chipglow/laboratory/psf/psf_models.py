"""Models of a camera's optics that a knife edge can be fitted with, by their transfer functions."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, cos, exp, pi, sin, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import fft
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq
from scipy.special import chndtr, gamma, j0, j1, kve, ndtr

from chipglow.camera import AnnularAperturePSF, GaussianPSF, MeasuredPSF, PointSpreadFunction
from chipglow.camera.optics.psf import FWHM_PER_SIGMA

_SAMPLES_PER_FOOTPRINT: Final = 8
_PERIODS: Final = 64
"""Length of the table of an edge, in its largest distance.

What wraps around of the tails of diffraction is then 3e-6 of the step. With 16 it would be 4e-5,
which moves the width by a third of its standard uncertainty where noise is 1/2000 of the step.
"""
_TAIL_ENERGY: Final = 0.9999
_KERNEL_NODES: Final = 3
_MOST_SIDE: Final = 1025
_LENGTHS: Final = ("fwhm", "diameter")
_EVEN_DISC: Final = 30.0
"""A disc of so many deviations of its blur is half as bright at its rim, within its 2000th."""
_MOFFAT_NODES: Final = np.geomspace(1e-7, 60.0, 1000)
"""Arguments of the transfer function: it is 1 under and 0 over them."""
_MOST_WIDTHS: Final = 60.0


class PSFModel(ABC):
    """A family of point spread functions of the optics alone.

    Attributes
    ----------
    name : str
        How it is called.
    parameters : tuple of str
        Names of its parameters; `is_length` says which are in m, others are pure numbers.
    """

    name: str
    parameters: tuple[str, ...]

    @abstractmethod
    def starts(self, fwhm: float) -> list[list[float]]:
        """Parameters to begin a fit with, for about this full width at half maximum in m."""

    @abstractmethod
    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """Least and greatest parameters, for a pitch and an extent of the image in m."""

    @abstractmethod
    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """Optical transfer function.

        Parameters
        ----------
        values : ndarray
            The parameters.
        frequency : ndarray
            Spatial frequencies in 1/m, 0 or more.
        angle : float
            Direction of the frequencies in rad, counterclockwise from x.
        """

    @abstractmethod
    def fwhm(self, values: NDArray[np.float64]) -> float:
        """Full width at half maximum of the optics' point spread function in m."""

    @abstractmethod
    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """The optics' point spread function, for a camera of order ``optics``."""

    def mean_transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Mean of the transfer function over all directions."""
        return self.transfer(values, frequency, 0.0)

    def scales(self, pitch: float) -> NDArray[np.float64]:
        """What a step of 1 in a fit means for each parameter."""
        return np.array([pitch if is_length(name) else 1.0 for name in self.parameters])


def is_length(parameter: str) -> bool:
    """Whether a parameter of a model is a length in m, by its name."""
    return any(word in parameter for word in _LENGTHS)


@dataclass(frozen=True)
class GaussianModel(PSFModel):
    """A round Gaussian."""

    name = "gaussian"
    parameters = ("fwhm",)

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        return [[fwhm]]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        return [0.02 * pitch], [min(extent, 1e-3)]

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """exp(−2π²σ²f²)."""
        return _gaussian_transfer(values[0], frequency)

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """See `PSFModel.fwhm`."""
        return float(values[0])

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`."""
        return GaussianPSF(float(values[0]))


@dataclass(frozen=True)
class GaussianTailModel(PSFModel):
    """A round Gaussian and, for a fraction of the light, a tail exp(−r / length) / (2π length²).

    The tail is that of stray light and of the size-of-source effect. Its transfer function is
    (1 + (2π length f)²)^(−3/2). Its parameter ``tail_ratio`` is the length over the core's width;
    it is 0.72 or more, with which the tail is as wide as the core: it can't be a sharp tip.
    """

    name = "gaussian with tail"
    parameters = ("core_fwhm", "tail_fraction", "tail_ratio")

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        return [[0.9 * fwhm, fraction, ratio] for fraction, ratio in ((0.1, 4.0), (0.25, 1.5))]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        return [0.02 * pitch, 0.0, 0.72], [min(extent, 1e-3), 0.95, extent / pitch]

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """Sum of the core's and the tail's."""
        core, fraction, length = self._numbers(values)
        tail = (1 + (2 * pi * length * frequency) ** 2) ** -1.5
        return np.asarray((1 - fraction) * _gaussian_transfer(core, frequency) + fraction * tail)

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """See `PSFModel.fwhm`."""
        half = self._density(values, np.array(0.0)) / 2
        far = 2.0 * max(1.0, values[2]) * values[0]
        found = brentq(lambda r: float(self._density(values, np.array(r)) - half), 0.0, far)
        return 2 * float(found)

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`."""
        core, fraction, length = self._numbers(values)
        reach = 2.0 * core
        # Of the tail, (1 + r / length) exp(−r / length) is beyond r.
        while fraction * (1 + reach / length) * exp(-reach / length) > 1 - _TAIL_ENERGY:
            reach += 0.5 * length
        return sampled_psf(lambda x, y: self._density(values, np.hypot(x, y)), reach, core / 8)

    def _numbers(self, values: NDArray[np.float64]) -> tuple[float, float, float]:
        """Width of the core in m, fraction of the tail, length of the tail in m."""
        core, fraction, ratio = values
        return float(core), float(fraction), float(ratio * core)

    def _density(
        self, values: NDArray[np.float64], radius: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        core, fraction, length = self._numbers(values)
        sigma = core / FWHM_PER_SIGMA
        gauss = np.exp(-(radius**2) / (2 * sigma**2)) / sigma**2
        tail = np.exp(-radius / length) / length**2
        return np.asarray(((1 - fraction) * gauss + fraction * tail) / (2 * pi))


@dataclass(frozen=True)
class AnnularModel(PSFModel):
    """Diffraction of a round pupil with a round obstruction; see `AnnularAperturePSF`.

    Parameters
    ----------
    wavelength : float
        In m. Only its ratio to the numerical aperture is known from an image.
    """

    wavelength: float
    name = "annular aperture"
    parameters = ("numerical_aperture", "obscured_area")

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        aperture = min(0.9, 0.49 * self.wavelength / fwhm)
        return [[aperture, area] for area in (0.02, 0.12, 0.35)]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        return [max(1e-4, 0.4 * self.wavelength / extent), 0.0], [1.0, 0.81]

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """Area that the pupil shares with itself when shifted (O'Neill, 1956), over its own."""
        inner = sqrt(max(values[1], 0.0))
        shift = frequency * self.wavelength / values[0]
        shared = _lens(1.0, 1.0, shift) - 2 * _lens(1.0, inner, shift) + _lens(inner, inner, shift)
        return np.asarray(shared / (pi * (1 - inner**2)))

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """See `PSFModel.fwhm`."""
        return self._aperture(values).fwhm

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`."""
        return self._aperture(values)

    def _aperture(self, values: NDArray[np.float64]) -> AnnularAperturePSF:
        aperture, area = min(float(values[0]), 1.0), float(np.clip(values[1], 0.0, 0.81))
        return AnnularAperturePSF(self.wavelength, aperture, sqrt(area))


@dataclass(frozen=True)
class MoffatModel(PSFModel):
    """Light as (1 + (r / a)²)^(−exponent): a core with tails that fall as a power of the radius.

    Notes
    -----
    A. F. J. Moffat, Astronomy and Astrophysics 3 (1969) 455. The transfer function is Hankel's
    transform, 2 (π a f)^(β−1) K_(β−1)(2π a f) / Γ(β−1) of the exponent β (Basset's integral).
    """

    name = "moffat"
    parameters = ("fwhm", "exponent")

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        return [[fwhm, 1.8], [fwhm, 3.5]]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        return [0.02 * pitch, 1.2], [min(extent, 1e-3), 20.0]

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """That of the notes."""
        cycles = 2 * pi * self._radius(values) * frequency
        curve = _moffat_curve(float(values[1]) - 1)
        result = np.where(cycles < _MOFFAT_NODES[0], 1.0, 0.0)
        some = (cycles >= _MOFFAT_NODES[0]) & (cycles < _MOFFAT_NODES[-1])
        result[some] = curve(np.log(cycles[some]))
        return np.asarray(result)

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """See `PSFModel.fwhm`."""
        return float(values[0])

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`; the kernel ends where a ten-thousandth of the light is beyond."""
        exponent, radius = float(values[1]), self._radius(values)
        # (1 + (r / a)²)^(1 − exponent) of the light is beyond r.
        reach = radius * sqrt((1 - _TAIL_ENERGY) ** (1 / (1 - exponent)) - 1)
        reach = min(reach, _MOST_WIDTHS * float(values[0]))

        def density(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray((1 + (x**2 + y**2) / radius**2) ** -exponent)

        return sampled_psf(density, max(reach, 2 * float(values[0])), float(values[0]) / 8)

    def _radius(self, values: NDArray[np.float64]) -> float:
        """The length a in m."""
        return float(values[0]) / (2 * sqrt(2 ** (1 / float(values[1])) - 1))


@lru_cache(maxsize=4)
def _moffat_curve(order: float) -> CubicSpline:
    """Moffat's transform over the logarithm; Bessel's function is slow, and smooth over it."""
    bessel = kve(order, _MOFFAT_NODES) * np.exp(-_MOFFAT_NODES)
    nodes = 2 * (_MOFFAT_NODES / 2) ** order * bessel / gamma(order)
    return CubicSpline(np.log(_MOFFAT_NODES), nodes)


@dataclass(frozen=True)
class DefocusedDiscModel(PSFModel):
    """An even disc, as a lens out of focus makes it, blurred by a Gaussian.

    Its transfer function is 2 J1(π d f) / (π d f) of the diameter d, times the Gaussian's
    (P. A. Stokseth, Journal of the Optical Society of America 59 (1969) 1314).
    """

    name = "defocused disc"
    parameters = ("disc_diameter", "blur_fwhm")

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        return [[fwhm, 0.2 * fwhm], [fwhm, 0.6 * fwhm]]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        return [0.1 * pitch, 0.02 * pitch], [min(extent, 1e-3)] * 2

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """Product of the disc's and the Gaussian's."""
        argument = pi * values[0] * frequency
        safe = np.where(argument == 0.0, 1.0, argument)
        disc = np.where(argument == 0.0, 1.0, 2 * j1(safe) / safe)
        return np.asarray(disc * _gaussian_transfer(values[1], frequency))

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """See `PSFModel.fwhm`."""
        radius, sigma = self._lengths(values)
        if radius > _EVEN_DISC * sigma:
            return float(values[0])
        half = self._density(values, np.array(0.0)) / 2
        far = radius + 3 * sigma
        found = brentq(lambda r: float(self._density(values, np.array(r)) - half), 0.0, far)
        return 2 * float(found)

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`."""
        radius, sigma = self._lengths(values)
        fine = max(min(radius / 8, sigma), radius / 40)

        def density(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
            return self._density(values, np.hypot(x, y))

        return sampled_psf(density, radius + 5 * sigma, fine)

    def _lengths(self, values: NDArray[np.float64]) -> tuple[float, float]:
        """Radius of the disc and standard deviation of the blur in m."""
        return float(values[0]) / 2, float(values[1]) / FWHM_PER_SIGMA

    def _density(
        self, values: NDArray[np.float64], radius: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Light of the disc that the blur puts on a point: the noncentral chi-squared."""
        disc, sigma = self._lengths(values)
        if disc > _EVEN_DISC * sigma:
            return np.asarray(ndtr((disc - radius) / sigma))
        return np.asarray(chndtr((disc / sigma) ** 2, 2.0, (radius / sigma) ** 2))


@dataclass(frozen=True)
class EllipticalModel(PSFModel):
    """A Gaussian of another width in each direction.

    Parameters
    ----------
    tilted : bool
        Whether its axes may be tilted, for which edges of three orientations are needed; else they
        are those of the image.
    """

    tilted: bool
    name = "elliptical gaussian"

    @property
    def parameters(self) -> tuple[str, ...]:  # type: ignore[override]
        """Widths along x and y and, if the axes may be tilted, their correlation."""
        return ("fwhm_x", "fwhm_y", "correlation") if self.tilted else ("fwhm_x", "fwhm_y")

    def starts(self, fwhm: float) -> list[list[float]]:
        """See `PSFModel.starts`."""
        return [[fwhm, fwhm, 0.0] if self.tilted else [fwhm, fwhm]]

    def bounds(self, pitch: float, extent: float) -> tuple[list[float], list[float]]:
        """See `PSFModel.bounds`."""
        low, high = [0.02 * pitch] * 2, [min(extent, 1e-3)] * 2
        return ([*low, -0.99], [*high, 0.99]) if self.tilted else (low, high)

    def transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64], angle: float
    ) -> NDArray[np.float64]:
        """That of a Gaussian with the width along the angle."""
        along = np.array([cos(angle), sin(angle)])
        return _gaussian_transfer(sqrt(float(along @ self._squares(values) @ along)), frequency)

    def mean_transfer(
        self, values: NDArray[np.float64], frequency: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """See `PSFModel.mean_transfer`."""
        angles = np.arange(8) * pi / 8
        return np.asarray(
            np.mean([self.transfer(values, frequency, angle) for angle in angles], axis=0)
        )

    def fwhm(self, values: NDArray[np.float64]) -> float:
        """Geometric mean of the two widths along the ellipse's axes in m."""
        return sqrt(sqrt(float(np.linalg.det(self._squares(values)))))

    def axes(self, values: NDArray[np.float64]) -> tuple[float, float, float]:
        """Greatest and least width in m, and the direction of the greatest in rad from x."""
        squares, directions = np.linalg.eigh(self._squares(values))
        direction = float(np.arctan2(directions[1, 1], directions[0, 1])) % pi
        return sqrt(float(squares[1])), sqrt(float(squares[0])), direction

    def psf(self, values: NDArray[np.float64]) -> PointSpreadFunction:
        """See `PSFModel.psf`."""
        inverse = np.linalg.inv(self._squares(values)) * FWHM_PER_SIGMA**2
        greatest, least, _ = self.axes(values)

        def density(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
            form = inverse[0, 0] * x**2 + 2 * inverse[0, 1] * x * y + inverse[1, 1] * y**2
            return np.asarray(np.exp(-form / 2))

        return sampled_psf(density, 2.0 * greatest, least / 8)

    def _squares(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        both = values[2] * values[0] * values[1] if self.tilted else 0.0
        return np.array([[values[0] ** 2, both], [both, values[1] ** 2]])


@dataclass(frozen=True, eq=False)
class EdgeResponse:
    """Edge-spread function of optics and pixel, a curve through even samples.

    Parameters
    ----------
    spacing : float
        Distance of the samples in m; the one in the middle is on the edge.
    edge, line : ndarray
        Edge-spread function, from 0 on the dark side to 1 on the bright one, and its derivative,
        the line-spread function in 1/m, shape (n,), n odd.
    """

    spacing: float
    edge: NDArray[np.float64]
    line: NDArray[np.float64]

    def __call__(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Edge-spread function at distances in m (Hermite's cubic); beyond the samples the last."""
        k, t = self._place(distance)
        rise = self.edge[k + 1] - self.edge[k]
        first, last = self.spacing * self.line[k], self.spacing * self.line[k + 1]
        bend, twist = 3 * rise - 2 * first - last, first + last - 2 * rise
        return np.asarray(self.edge[k] + t * (first + t * (bend + t * twist)))

    def slope(self, distance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Line-spread function at distances in m, in 1/m, by straight lines."""
        k, t = self._place(distance)
        return np.asarray(self.line[k] + t * (self.line[k + 1] - self.line[k]))

    def _place(
        self, distance: NDArray[np.float64]
    ) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Sample before each distance, and how far on the way to the next one it is."""
        last = self.edge.size - 1
        place = np.clip(np.asarray(distance) / self.spacing + last // 2, 0.0, last)
        before = np.minimum(place.astype(np.int64), last - 1)
        return before, place - before


def edge_response(
    transfer: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    angle: float,
    footprint: float,
    reach: float,
) -> EdgeResponse:
    """Edge-spread function of optics and pixel.

    Parameters
    ----------
    transfer : callable
        Transfer function of the optics over the frequency in 1/m.
    angle : float
        Direction of the edge's normal in rad. A square footprint that is looked at under an angle
        acts as two slits of the lengths side |cos| and side |sin|, one after the other.
    footprint : float
        Side of the sensitive square in m.
    reach : float
        Largest distance from the edge in m that is asked for.
    """
    step = footprint / _SAMPLES_PER_FOOTPRINT
    count = fft.next_fast_len(ceil(_PERIODS * reach / step), real=True)
    frequency, square = _footprint_along(count, step, angle, footprint)
    response = transfer(frequency) * square
    integral = np.zeros(frequency.size, dtype=np.complex128)
    integral[1:] = response[1:] / (2j * pi * frequency[1:])
    line, edge = fft.irfft(np.stack([response, integral]), count) / step
    half = min(ceil(reach / step) + 2, count // 2 - 1)
    index = np.arange(-half, half + 1)
    # The series is that of an edge less a ramp over the whole period.
    return EdgeResponse(step, 0.5 + edge[index] + index / count, line[index])


@lru_cache(maxsize=16)
def _footprint_along(
    count: int, step: float, angle: float, footprint: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies of samples at a distance, and the footprint's transfer function there."""
    frequency = np.arange(count // 2 + 1, dtype=np.float64) / (count * step)
    return frequency, footprint_transfer(frequency, angle, footprint)


def footprint_transfer(
    frequency: NDArray[np.float64], angle: float, footprint: float
) -> NDArray[np.float64]:
    """Transfer function of a square pixel along a direction; shapes and units as above."""
    across, down = footprint * cos(angle), footprint * sin(angle)
    return np.asarray(np.sinc(frequency * across) * np.sinc(frequency * down))


def disc_response(
    frequency: NDArray[np.float64],
    diameter: float,
    radii: NDArray[np.float64],
    footprint: float,
) -> NDArray[np.float64]:
    """Weights that make of a transfer function the signal in the middle of a bright disc.

    Parameters
    ----------
    frequency : ndarray
        Even frequencies in 1/m from 0, shape (n,).
    diameter : float
        The disc's in m.
    radii : ndarray
        Distances from its middle in m of the pixels whose mean is taken.
    footprint : float
        Side of the sensitive square in m.

    Returns
    -------
    ndarray
        Shape (n,): the product with the optics' transfer function, averaged over directions, is
        the signal as a fraction of that of an endless source: R ∫ H(f) J0(2πfρ) J1(2πfR) 2π df.
    """
    radius = diameter / 2
    angles = ((np.arange(12) + 0.5) * pi / 24).tolist()
    square = np.zeros_like(frequency)
    for angle in angles:
        square += footprint_transfer(frequency, angle, footprint) / len(angles)
    middle = np.mean([j0(2 * pi * frequency * rho) for rho in radii.tolist()], axis=0)
    weight = 2 * pi * radius * j1(2 * pi * frequency * radius) * middle * square
    step = float(frequency[1])
    weight *= step
    # The rule of rectangles misses the slope with which the integrand begins (Euler, Maclaurin).
    weight[0] += 2 * (pi * radius * step) ** 2 / 12
    return np.asarray(weight)


def sampled_psf(
    density: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
    reach: float,
    spacing: float,
) -> MeasuredPSF:
    """Point spread function of a density over the plane; parameters as of `sampled_kernel`."""
    return MeasuredPSF(*sampled_kernel(density, reach, spacing))


def sampled_kernel(
    density: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
    reach: float,
    spacing: float,
) -> tuple[NDArray[np.float64], float]:
    """Kernel of a density over the plane, integrated over squares, and their side in m.

    Parameters
    ----------
    density : callable
        Light per area at x and y in m, in any unit.
    reach : float
        Half side of the kernel in m.
    spacing : float
        Side of a square in m; coarser if the kernel would be very large.
    """
    spacing = max(spacing, 2 * reach / (_MOST_SIDE - 1))
    half = ceil(reach / spacing)
    node, weight = np.polynomial.legendre.leggauss(_KERNEL_NODES)
    line = spacing * (np.arange(-half, half + 1, dtype=np.float64)[:, None] + node / 2)
    kernel = np.zeros((2 * half + 1, 2 * half + 1))
    for i in range(_KERNEL_NODES):
        for j in range(_KERNEL_NODES):
            x, y = line[None, :, j], line[::-1, i, None]
            kernel += weight[i] * weight[j] * density(x, y)
    return kernel, spacing


def _gaussian_transfer(fwhm: float, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    sigma = fwhm / FWHM_PER_SIGMA
    return np.asarray(np.exp(-2 * (pi * sigma * frequency) ** 2))


def _lens(large: float, small: float, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area that two discs of these radii share, their middles at a distance."""
    if small == 0.0:
        return np.zeros_like(distance)
    apart = np.clip(distance, large - small, large + small)
    safe = np.maximum(apart, 1e-12)
    first = np.arccos(np.clip((safe**2 + large**2 - small**2) / (2 * safe * large), -1, 1))
    second = np.arccos(np.clip((safe**2 + small**2 - large**2) / (2 * safe * small), -1, 1))
    product = (small + large - apart) * (apart + small - large)
    product = product * (apart - small + large) * (apart + small + large)
    triangle = np.sqrt(np.maximum(product, 0.0)) / 2
    area = large**2 * first + small**2 * second - triangle
    return np.asarray(np.where(apart <= large - small, pi * small**2, area))
