"""Measurement error: measured radiance temperature minus what was there (the paper's Figure 10)."""

from dataclasses import dataclass, replace
from math import sqrt
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import UNUSABLE, Camera, Exposure
from chipglow.camera.optics.sampling import integrate, overlap_lengths
from chipglow.scene import Raster
from chipglow.scene.lines import nearest

ReferenceKind: TypeAlias = Literal["maximum", "mean", "centre", "true"]
"""What the measured radiance temperature is compared with.

``maximum`` (the paper's): the greatest radiance temperature, emissivity included, of any scene
sample in the pixel's square during the exposure; ``mean``: that of the mean radiance over square
and exposure; ``centre``: that of the sample under the pixel's centre in the middle of the
exposure; ``true``: the greatest true temperature in the square during the exposure.
"""

LEAST_COVERED: Final = 0.05
"""Part of a sample's width that a pixel must cover for the sample to count in its maximum.

Where a whole number of samples makes a pixel, a pitch that was rounded adds up to slivers of the
neighbours' samples. A single hot one would be the reference of the whole pixel.
"""


@dataclass(frozen=True)
class ErrorImages:
    """Measurement error of every pixel in one exposure, in K of radiance temperature.

    `reference` is what the measured temperature is compared with, NaN where nothing radiates.
    `case_1` is the error with all effects, `case_2` that without the point spread function and
    with the same noise. Pixels that the camera marks as unusable are `flagged`; their errors
    follow from the radiance nevertheless.
    """

    raster: Raster
    reference: NDArray[np.float64]
    case_1: NDArray[np.float64]
    case_2: NDArray[np.float64]
    flagged: NDArray[np.bool_]

    @property
    def measured(self) -> NDArray[np.float64]:
        """Measured radiance temperature in K, with everything, whether flagged or not."""
        return self.reference + self.case_1

    @property
    def psf_portion(self) -> NDArray[np.float64]:
        """The part of the error that the point spread function makes: case 1 − case 2, in K."""
        return self.case_1 - self.case_2


def error_images(
    camera: Camera, exposure: Exposure, reference: ReferenceKind = "maximum"
) -> ErrorImages:
    """Error images of one exposure, with and without the point spread function.

    Parameters
    ----------
    camera : Camera
        The camera, with its point spread function.
    exposure : Exposure
        What reached it.
    reference : ReferenceKind
        What to compare with; the paper's is the maximum.
    """
    return Unblurred.of(camera, exposure, reference).errors(
        camera.form_image(exposure.mean_radiance, exposure.raster)
    )


@dataclass(frozen=True)
class Unblurred:
    """What cameras that differ in their point spread function alone have in common.

    `ideal` is the radiance of the pixels without point spread function in W/(m² sr); the noise is
    that of the frame that begins at `start`.
    """

    camera: Camera
    raster: Raster
    reference: NDArray[np.float64]
    ideal: NDArray[np.float64]
    start: float

    @classmethod
    def of(cls, camera: Camera, exposure: Exposure, reference: ReferenceKind) -> "Unblurred":
        """Compute it for one exposure."""
        return cls(
            camera,
            camera.pixels(exposure.raster),
            reference_temperature(camera, exposure, reference),
            replace(camera, psf=None).form_image(exposure.mean_radiance, exposure.raster),
            exposure.start,
        )

    def errors(self, radiance: NDArray[np.float64]) -> ErrorImages:
        """Error images of the radiance that `Camera.form_image` gives."""
        lower_limit = self.camera.lower_limit
        measured, unusable = read_temperature(self.camera, radiance, self.start)
        ideal, _ = read_temperature(self.camera, self.ideal, self.start)
        return ErrorImages(
            raster=self.raster,
            reference=self.reference,
            case_1=measured - self.reference,
            case_2=ideal - self.reference,
            flagged=~(measured >= (lower_limit or 0.0)) | unusable,
        )


def read_temperature(
    camera: Camera, radiance: NDArray[np.float64], start: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_] | bool]:
    """Temperatures that a camera reads of an image, and which its detector marks as unusable."""
    read, flags = camera.read(radiance[None], np.array([start]))
    kelvins = np.asarray(camera.band.temperature(read[0]), dtype=np.float64)
    return kelvins, False if flags is None else flags[0] & UNUSABLE != 0


def reference_temperature(
    camera: Camera, exposure: Exposure, kind: ReferenceKind = "maximum"
) -> NDArray[np.float64]:
    """Temperature in K that a pixel without error would read; NaN where nothing radiates."""
    pixels = camera.pixels(exposure.raster)
    if kind == "maximum":
        return _temperature(camera, _maximum(exposure.peak_radiance, camera, exposure, pixels))
    if kind == "mean":
        mean = integrate(exposure.mean_radiance, exposure.raster, pixels, camera.fill_factor)
        return _temperature(camera, mean)
    if kind == "centre":
        points = np.stack(np.meshgrid(pixels.x, pixels.y), axis=-1)
        return _temperature(camera, nearest(exposure.centre_radiance, exposure.raster, points))
    if kind == "true":
        return _maximum(exposure.peak_temperature, camera, exposure, pixels)
    raise ValueError(f"reference: unknown {kind!r}, expected one of {get_args(ReferenceKind)}")


def _maximum(
    values: NDArray[np.floating], camera: Camera, exposure: Exposure, pixels: Raster
) -> NDArray[np.float64]:
    """Greatest value of the samples in every pixel's sensitive square; NaN for none."""
    grid, side = exposure.raster, camera.pitch * sqrt(camera.fill_factor)
    known = np.where(np.isnan(values), values.dtype.type(-np.inf), values)
    columns = _covered(pixels.x - grid.left, side, grid.columns, grid.spacing)
    rows = _covered(grid.top - pixels.y, side, grid.rows, grid.spacing)
    down = np.stack([known[part].max(axis=0) for part in rows])
    greatest = np.stack([down[:, part].max(axis=1) for part in columns], axis=1)
    return np.where(np.isfinite(greatest), greatest, np.nan).astype(np.float64)


def _covered(
    centres: NDArray[np.float64], side: float, samples: int, spacing: float
) -> list[slice]:
    """Samples under each pixel along a line; slivers under `LEAST_COVERED` do not count."""
    least = LEAST_COVERED * min(spacing, side)
    covered = overlap_lengths(centres - side / 2, side, samples, spacing) > least
    first = covered.argmax(axis=1)
    return [slice(i, i + n) for i, n in zip(first, covered.sum(axis=1), strict=True)]


def _temperature(camera: Camera, radiance: NDArray[np.floating]) -> NDArray[np.float64]:
    return np.asarray(camera.band.temperature(radiance.astype(np.float64)), dtype=np.float64)
