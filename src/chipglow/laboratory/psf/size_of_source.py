"""Size-of-source effect: what a camera reads in the middle of apertures of several diameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import UNUSABLE, Flag, Measurement
from chipglow.laboratory.psf.psf_fit import ApertureSignals
from chipglow.quantities import Array, Brief
from chipglow.uncertainty.component import MAD_FACTOR

_LEAST_APERTURES: Final = 3
"""Fewest diameters of apertures."""

_FEWEST_OUTSIDE: Final = 20
"""Fewest pairs of pixels beyond an aperture that show the noise."""


@dataclass(frozen=True, eq=False, repr=False)
class ApertureImage(Brief):
    """A round aperture before a source of even radiance."""

    diameter: float
    """In m, on the object."""
    radiance: Array
    """In W/(m² sr), NaN where it is not usable, shape (y, x)."""
    x: Array
    y: Array
    """Positions of columns and rows in m."""
    name: str
    """Its name in messages."""

    def __post_init__(self) -> None:
        if not 0 < self.diameter < np.inf:
            raise ValueError(f"{self.name}: diameter is {self.diameter!r} m, expected more than 0")


def aperture_image(measurement: Measurement, diameter: float, name: str) -> ApertureImage:
    """Return the mean of a measurement's frames as an image of an aperture."""
    usable = (np.bitwise_or.reduce(measurement.flags, axis=0) & (UNUSABLE | Flag.REPLACED)) == 0
    radiance = np.where(usable, measurement.radiance.mean(axis=0), np.nan)
    raster = measurement.raster
    return ApertureImage(diameter, radiance, raster.x, raster.y, name)


def aperture_signals(images: Sequence[ApertureImage], footprint: float) -> ApertureSignals:
    """Read the pixels within a pitch of the centroid of the bright pixels in each aperture."""
    diameters = np.array([image.diameter for image in images])
    if (several := np.unique(diameters).size) < _LEAST_APERTURES:
        raise ValueError(
            f"apertures: {len(images)} images of {several} diameters, "
            f"expected {_LEAST_APERTURES} diameters or more"
        )
    signals, sigmas, radii, outside = zip(*map(_middle, images), strict=True)
    radiance, sigma = np.array(signals), np.array(sigmas)
    return ApertureSignals(diameters, radiance, sigma, radii, footprint, min(outside))


def _middle(image: ApertureImage) -> tuple[float, float, Array, float]:
    """Return signal, uncertainty and distances of the middle pixels, and the surroundings."""
    known = np.isfinite(image.radiance)
    if not known.any():
        raise ValueError(f"{image.name}: no usable pixel, expected an aperture")
    pitch = float(image.x[1] - image.x[0])
    # The 10th percentile is dark: the image shows the surroundings of the aperture.
    low, high = np.percentile(image.radiance[known], 10), image.radiance[known].max()
    bright = known & (image.radiance > (low + high) / 2)
    x, y = np.meshgrid(image.x, image.y)
    weight = np.where(bright, image.radiance - low, 0.0)
    if weight.sum() <= 0:
        raise ValueError(f"{image.name}: all pixels are as bright, expected an aperture")
    across, up = ((weight * place).sum() / weight.sum() for place in (x, y))
    away = np.hypot(x - across, y - up)
    radius = image.diameter / 2
    room = min(np.abs(across - image.x[[0, -1]]).min(), np.abs(up - image.y[[0, -1]]).min())
    seen = pitch * (np.count_nonzero(bright) / np.pi) ** 0.5
    # Blur and the coarse grid of pixels change the bright area, but by less than this.
    if not 0.6 * radius - pitch < seen < 1.5 * radius + 3 * pitch or room < radius:
        raise ValueError(
            f"{image.name}: no aperture of {image.diameter * 1e6:.4g} um within the image; what is "
            f"bright is {2 * seen * 1e6:.4g} um wide, and {room * 1e6:.4g} um from the image's edge"
        )
    inner = known & (away <= pitch)
    if not inner.any():
        raise ValueError(f"{image.name}: no usable pixel in the middle of the aperture")
    beside = known & (away > radius + 3 * pitch)
    sigma = _noise(image.radiance, beside) / int(inner.sum()) ** 0.5
    outside = float(np.median(image.radiance[beside])) if beside.any() else float(low)
    signal = float(image.radiance[inner].mean())
    # Without noise, the rounding of 32-bit numbers is left.
    return signal, max(sigma, 1e-7 * float(high - low)), away[inner], outside


def _noise(radiance: Array, outside: NDArray[np.bool_]) -> float:
    """Return the noise of a pixel in W/(m² sr), from differences of neighbours outside."""
    pairs = outside[:, 1:] & outside[:, :-1]
    if pairs.sum() < _FEWEST_OUTSIDE:
        pairs = np.isfinite(radiance[:, 1:]) & np.isfinite(radiance[:, :-1])
    difference = np.diff(radiance, axis=1)[pairs]
    return float(MAD_FACTOR * np.median(np.abs(difference - np.median(difference))) / 2**0.5)
