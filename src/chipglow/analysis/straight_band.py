"""Errors in a straight shear band of any width, rise and speed: which band has given errors."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, log, radians, sin
from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from chipglow.analysis.images import CASES, ExposureImages
from chipglow.camera import Camera, Exposure
from chipglow.laboratory.chip import Segment
from chipglow.quantities import Array
from chipglow.scene import Raster, sample

READINGS: Final = ("band", "band_worst", "band_psf_fraction")
"""Error at the centre and the most negative beside it in K, and the PSF's fraction of the first."""

_REACH: Final = 60e-6
"""Distance in m to either side up to which the band is read."""

_ANGLE: Final = radians(40.0)
_SAMPLES_A_PIXEL: Final = 9
_MOMENTS: Final = 41
_GRID: Final = np.arange(-240e-6, 240e-6, 0.25e-6)
_STARTS: Final = (30e-6, 300.0, 30e-6)
_SPREAD: Final = (0.05, 0.05, 0.1)
"""Relative tolerances of the error at the centre and beside it, absolute of the fraction."""


@dataclass(frozen=True)
class StraightBand:
    """A band with a Gaussian profile of temperature, which moves across itself."""

    width: float
    """Full width at half maximum in m."""
    rise: float
    """Maximum rise over its sides in K."""
    sweep: float
    """Travel during an exposure in m."""
    beside: float
    """Temperature of its sides in K."""

    @classmethod
    def of(cls, segment: Segment, raster: Raster) -> "StraightBand":
        """Return the straight band closest to a segment's band across its centre."""
        line = segment.moment.across(_REACH, 1e-6)
        profile = sample(segment.frame.temperature, raster, line.points)
        sides = np.interp(line.distance, line.distance[[0, -1]], profile[[0, -1]])
        rises = profile - sides
        top = int(np.nanargmax(rises))
        wide = np.count_nonzero(rises > rises[top] / 2) * 1e-6
        return cls(wide, float(rises[top]), abs(segment.sweep), float(sides[top]))


def read_straight_band(camera: Camera, emissivity: float, band: StraightBand) -> Array:
    """Return the `READINGS` of a camera without range limit and noise, means over pixel phases."""
    camera = replace(camera, detector=None, lower_limit=None, shape=None, offset=(0.0, 0.0))
    spacing = camera.pitch / _SAMPLES_A_PIXEL
    side = round(2 * (_REACH + 6 * camera.pitch) / spacing)
    raster = Raster(-side * spacing / 2, side * spacing / 2, spacing, side, side)
    across = raster.x * sin(_ANGLE) + raster.y[:, None] * cos(_ANGLE)
    centres = band.sweep * np.linspace(-0.5, 0.5, _MOMENTS)[:, None]
    profile = np.exp(-4 * log(2) * ((_GRID - centres) / band.width) ** 2)
    temperature = band.beside + band.rise * profile
    radiance = emissivity * camera.band.radiance(temperature)
    mean, peak, hottest, centre, mean_temperature, central = (
        np.interp(across, _GRID, values)
        for values in (
            radiance.mean(axis=0),
            radiance.max(axis=0),
            temperature.max(axis=0),
            radiance[_MOMENTS // 2],
            temperature.mean(axis=0),
            temperature[_MOMENTS // 2],
        )
    )
    exposure = Exposure(
        0.0,
        camera.integration_time,
        raster,
        mean,
        peak.astype(np.float32),
        hottest.astype(np.float32),
        centre,
        mean_temperature,
        np.ones(raster.shape),
        central.astype(np.float32),
    )
    reference, measured, ideal = ExposureImages(exposure).stack(camera, CASES)
    distance = np.arange(-_REACH, _REACH + 1e-7, 1e-6)
    along = 1.2 * camera.pitch * np.arange(-3.0, 4.0)
    points = along[:, None, None] * [cos(_ANGLE), -sin(_ANGLE)]
    points = points + distance[:, None] * [sin(_ANGLE), cos(_ANGLE)]
    error, portion = (
        sample(image, camera.pixels(raster), points)
        for image in (measured - reference, measured - ideal)
    )
    middle = error[:, distance.size // 2]
    fraction = portion[:, distance.size // 2] / middle
    return np.array([middle.mean(), np.nanmin(error, axis=1).mean(), fraction.mean()])


def band_chart(
    camera: Camera, emissivity: float, band: StraightBand, widths: ArrayLike, rises: ArrayLike
) -> xr.Dataset:
    """Return the `READINGS` over widths (m) and rises (K) of a band that is otherwise the same."""
    axes = np.asarray(widths, np.float64), np.asarray(rises, np.float64)
    read = [
        [
            read_straight_band(camera, emissivity, replace(band, width=width, rise=rise))
            for rise in axes[1].tolist()
        ]
        for width in axes[0].tolist()
    ]
    over = ("width", "rise")
    variables = {name: (over, np.array(read)[..., i]) for i, name in enumerate(READINGS)}
    return xr.Dataset(variables, dict(zip(over, axes, strict=True)))


def band_with(
    camera: Camera, emissivity: float, beside: float, readings: Sequence[float]
) -> StraightBand:
    """Return the band whose `READINGS` come closest to given ones."""
    wanted, spread = np.array(readings), np.array(_SPREAD)
    spread[:2] *= np.abs(wanted[:2])

    def band(logs: Array) -> StraightBand:
        width, rise, sweep = np.exp(logs)
        return StraightBand(float(width), float(rise), float(sweep), beside)

    def differences(logs: Array) -> Array:
        return np.asarray((read_straight_band(camera, emissivity, band(logs)) - wanted) / spread)

    return band(least_squares(differences, np.log(_STARTS), diff_step=1e-3).x)
