"""Images of edges and apertures of known optics, without the code that is tested.

Edge-spread functions are closed forms, or come from the closed form of the point spread function
by Abel's integral; each pixel's mean over its square is taken by Gauss's quadrature.
"""

from functools import cache
from math import cos, log, pi, radians, sin, sqrt

import numpy as np
from scipy.integrate import cumulative_simpson, trapezoid
from scipy.interpolate import CubicSpline
from scipy.special import j1, k1, ndtr, stdtr

from chipglow.camera import Measurement
from chipglow.laboratory.psf import ApertureImage, EdgeImage
from chipglow.radiometry import Band
from chipglow.scene import Raster

PITCH = 6e-6
BAND = Band(3.8e-6, 5.1e-6)
WAVELENGTH = 4.45e-6
FWHM_PER_SIGMA = 2 * sqrt(2 * log(2))


def gaussian_edge(fwhm):
    """Edge-spread function of a Gaussian."""
    return lambda u: ndtr(u * FWHM_PER_SIGMA / fwhm)


def tailed_edge(fwhm, fraction, length):
    """Of a Gaussian with a tail exp(−r/L)/(2πL²), whose line-spread function is a Bessel's K1."""
    x = np.concatenate([np.linspace(0, 2, 2001), np.linspace(2, 60, 4000)[1:]])
    line = np.where(x == 0, 1.0, x * k1(np.where(x == 0, 1.0, x))) / pi
    half = CubicSpline(x * length, cumulative_simpson(line, x=x, initial=0.0))

    def edge(u):
        tail = 0.5 + np.sign(u) * half(np.minimum(np.abs(u), 60 * length))
        return (1 - fraction) * ndtr(u * FWHM_PER_SIGMA / fwhm) + fraction * tail

    return edge


def annular_edge(wavelength, aperture, obscuration):
    """Of an annular pupil, by Abel's integral of the closed form of its point spread function."""
    far, line, energy = annular_line(obscuration)
    unit = wavelength / (2 * pi * aperture)
    half = CubicSpline(far * unit, cumulative_simpson(line, x=far, initial=0.0) / energy)
    return lambda u: 0.5 + np.sign(u) * half(np.abs(u))


@cache
def annular_line(obscuration):
    """Distances v = 2π NA r / λ, the line-spread function there, and all light."""
    far = np.concatenate([np.arange(0, 100, 0.15), np.geomspace(100, 4000, 400)])
    along = np.concatenate([np.arange(0, 200, 0.2), np.geomspace(200, 40000, 1500)])
    line = np.array(
        [2 * trapezoid(annular_density(np.hypot(x, along), obscuration), along) for x in far]
    )
    return far, line, 4 * pi / (1 - obscuration**2)


def annular_density(v, o):
    """Irradiance over that in the middle, at v = 2π NA r / λ, of a pupil with an obscuration o."""

    def jinc(t):
        return 2 * j1(np.maximum(t, 1e-9)) / np.maximum(t, 1e-9)

    return ((jinc(v) - o**2 * jinc(o * v)) / (1 - o**2)) ** 2


def disc_edge(radius):
    """Of an even disc, as a lens out of focus makes it."""

    def edge(u):
        t = np.clip(u / radius, -1.0, 1.0)
        return 0.5 + (np.arcsin(t) + t * np.sqrt(1 - t**2)) / pi

    return edge


def ring_edge(inner, outer):
    """Of an even ring, as a mirror objective out of focus makes it."""
    large, small, fraction = disc_edge(outer), disc_edge(inner), (inner / outer) ** 2
    return lambda u: (large(u) - fraction * small(u)) / (1 - fraction)


def moffat_edge(fwhm, exponent):
    """Of Moffat's function, whose line-spread function is the density of Student's t."""
    radius, freedom = fwhm / (2 * sqrt(2 ** (1 / exponent) - 1)), 2 * exponent - 2
    return lambda u: stdtr(freedom, u * sqrt(freedom) / radius)


def blurred_disc_edge(diameter, fwhm):
    """Of an even disc behind a Gaussian, the mean of the disc's over the blur."""
    sharp, sigma = disc_edge(diameter / 2), fwhm / FWHM_PER_SIGMA
    far = diameter / 2 + 6 * sigma
    u, blur = np.linspace(-far, far, 801), np.linspace(-6, 6, 1201)
    weight = np.exp(-(blur**2) / 2)
    curve = CubicSpline(u, sharp(u[:, None] + sigma * blur) @ weight / weight.sum())
    return lambda v: curve(np.clip(v, -far, far))


def edge_radiance(edge, normal, side=40, position=1e-6, background=2.0, step=5.0, fill=1.0):
    """Mean radiance of each pixel's square; the normal in degrees points to the bright side."""
    rows, columns = (side, side) if np.isscalar(side) else side
    node, weight = np.polynomial.legendre.leggauss(6)
    inside = node * PITCH * sqrt(fill) / 2
    x = (PITCH * (np.arange(columns) - (columns - 1) / 2)[:, None] + inside).ravel()
    y = (PITCH * ((rows - 1) / 2 - np.arange(rows))[:, None] + inside).ravel()
    angle = radians(normal)
    value = edge(x * cos(angle) + y[:, None] * sin(angle) - position)
    fractions = value.reshape(rows, 6, columns, 6)
    return background + step * np.einsum("iajb,a,b->ij", fractions, weight / 2, weight / 2)


def image_of(radiance, noise=0.0, seed=0, saturation=None, name="edge", band=BAND):
    """The image of a pixel with noise, cut off at its saturation."""
    radiance = radiance + np.random.default_rng(seed).normal(0.0, 1.0, radiance.shape) * noise
    rows, columns = radiance.shape
    none = np.zeros(radiance.shape, dtype=bool)
    saturated = none if saturation is None else radiance > saturation
    radiance = radiance if saturation is None else np.minimum(radiance, saturation)
    return EdgeImage(
        radiance,
        PITCH * np.arange(columns),
        -PITCH * np.arange(rows, dtype=float),
        none,
        saturated,
        none,
        PITCH,
        band,
        name,
    )


def measurement_of(radiance, flags=None):
    """A measurement of one frame."""
    raster = Raster(0.0, 0.0, PITCH, *radiance.shape)
    return Measurement.from_radiance(radiance[None], BAND, np.zeros(1), raster, flags=flags)


def gaussian_aperture(fwhm, diameter, fraction=0.0, length=1.0, side=61, noise=0.0, seed=0):
    """Image of a disc before a source of 5 over a background of 1 W/(m² sr), without footprint.

    The signal in the middle is that of the closed form of the encircled light; elsewhere a disc
    stands for it, as only the middle is read.
    """
    radius, sigma = diameter / 2, fwhm / FWHM_PER_SIGMA
    gauss = 1 - np.exp(-(radius**2) / (2 * sigma**2))
    tail = 1 - (1 + radius / length) * np.exp(-radius / length)
    x = PITCH * (np.arange(side) - side // 2)
    inside = np.hypot(x, x[:, None]) < radius
    middle = (1 - fraction) * gauss + fraction * tail
    image = 1.0 + 5.0 * np.where(inside, middle, 0.0)
    image += np.random.default_rng(seed).normal(0.0, 1.0, image.shape) * noise
    return ApertureImage(diameter, image, x, x[::-1], f"{diameter * 1e6:.0f} um")


def gaussian_transfer(frequency, fwhm, normal):
    """Modulation transfer function of a Gaussian and a square pixel along the edge's normal."""
    optics = np.exp(-2 * (pi * fwhm / FWHM_PER_SIGMA * frequency) ** 2)
    angle = radians(normal)
    sensor = np.sinc(frequency * PITCH * cos(angle)) * np.sinc(frequency * PITCH * sin(angle))
    return optics * np.abs(sensor)
