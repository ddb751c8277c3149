"""Images of edges and apertures, blurred by the virtual camera's optics."""

from math import cos, radians, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Measurement, PointSpreadFunction
from chipglow.camera.optics.convolution import blur
from chipglow.radiometry import Band
from chipglow.scene import Raster

BAND: Final = Band(3.8e-6, 5.1e-6)
PITCH: Final = 6e-6
PER_SENSOR: Final = 6
SENSORS: Final = 80
NOISE: Final = 0.005


def seen(bright: NDArray[np.float64], psf: PointSpreadFunction) -> NDArray[np.float64]:
    """Return pixel values of fine samples: blurred, then the mean over each pixel's square."""
    fine = blur(bright, psf, PITCH / PER_SENSOR)
    count = len(fine) // PER_SENSOR
    return fine.reshape(count, PER_SENSOR, count, PER_SENSOR).mean(axis=(1, 3))


def edge(normal: float, psf: PointSpreadFunction) -> NDArray[np.float64]:
    """Return a sharp edge, 0 and 1, seen through a point spread function; its normal in degrees."""
    x = np.arange(SENSORS * PER_SENSOR) - SENSORS * PER_SENSOR / 2 + 0.5
    angle = radians(normal)
    distance = x * cos(angle) - x[:, None] * sin(angle)
    return seen(np.clip(distance + 0.5, 0.0, 1.0), psf)


def aperture(diameter: float, psf: PointSpreadFunction) -> NDArray[np.float64]:
    """Return a round hole, 1 inside."""
    fine = PITCH / PER_SENSOR
    x = fine * (np.arange(2 * SENSORS * PER_SENSOR) - SENSORS * PER_SENSOR + 0.5)
    inside = np.clip((diameter / 2 - np.hypot(x, x[:, None])) / fine + 0.5, 0.0, 1.0)
    return seen(inside, psf)


def measured(fraction: NDArray[np.float64], cold: float, hot: float, seed: int) -> Measurement:
    """Return a frame between two temperatures in K, with noise of a fraction of the step."""
    low, high = BAND.radiance(np.array([cold, hot]))
    noise = np.random.default_rng(seed).normal(0.0, NOISE, fraction.shape)
    raster = Raster(0.0, 0.0, PITCH, *fraction.shape)
    frame = (low + (high - low) * (fraction + noise))[None]
    return Measurement.from_radiance(frame, BAND, np.zeros(1), raster)
