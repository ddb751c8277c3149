"""Measurements of a scene by a camera."""

from collections.abc import Iterable
from math import exp

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.description import CameraDescription
from chipglow.camera.detector.terms import lagged
from chipglow.camera.exposure import Exposure
from chipglow.camera.image import displayed, light_from_beyond, received
from chipglow.camera.measurement import Measurement
from chipglow.camera.measurement_warnings import (
    border_warning,
    lag_warning,
    limit_warning,
    rounding_warning,
    sampling_warning,
)
from chipglow.quantities import Array
from chipglow.scene import Raster


def form_measurement(
    camera: CameraDescription, exposures: Exposure | Iterable[Exposure]
) -> Measurement:
    """Form one frame from each exposure; see `Camera.form_measurement`."""
    images: list[Array] = []
    similar, starts, effects, grids = [], [], [], set()
    warnings: dict[str, None] = {}
    for exposure in [exposures] if isinstance(exposures, Exposure) else exposures:
        scene = exposure.raster
        pixels = camera.pixels(scene)
        image, within = received(camera, exposure.mean_radiance, scene)
        images.append(displayed(camera, image, scene))
        similar.append(displayed(camera, within / (1 - light_from_beyond(camera, scene)), scene))
        starts.append(exposure.start)
        effects.append(set(exposure.effects.items()))
        warnings |= dict.fromkeys(exposure.warnings)
        grids.add(pixels)
    if len(grids) != 1:
        raise ValueError("camera: at least one exposure, all of the same grid, is required")
    measured = measurement_of(camera, np.stack(images), np.array(starts), scene)
    measured.data.attrs.update(sorted(set.intersection(*effects)))
    warnings |= dict.fromkeys(sampling_warning(camera, scene))
    warnings |= dict.fromkeys(limit_warning(camera))
    warnings |= dict.fromkeys(rounding_warning(camera, images[0].shape))
    warnings |= dict.fromkeys(lag_warning(camera, measured.times))
    warnings |= dict.fromkeys(border_warning(camera, np.stack(images), np.stack(similar), scene))
    if warnings:
        measured.data.attrs["warnings"] = "\n".join(warnings)
    return measured


def measurement_of(
    camera: CameraDescription, images: Array, starts: Array, scene: Raster
) -> Measurement:
    """Return the measurement of images by `form_image` of a scene, shape (time, y, x)."""
    pixels = camera.pixels(scene)
    radiance, flags = read_radiance(camera, images, starts)
    attributes = _attributes(camera, pixels.shape)
    return Measurement.from_radiance(
        radiance, camera.band, starts, pixels, camera.lower_limit, flags, attributes=attributes
    )


def read_radiance(
    camera: CameraDescription, images: Array, starts: Array
) -> tuple[Array, NDArray[np.uint8] | None]:
    """Apply lag, detector and calibration to images (time, y, x); return radiance and flags."""
    if camera.time_constant is not None:
        frame_time = 1 / camera.frame_rate
        images = lagged(images, starts, frame_time, exp(-frame_time / camera.time_constant))
    calibration = camera.calibration(images.shape[1:])
    if camera.detector is None or calibration is None:
        return images, None
    # The noise of a frame follows from the seed and its start.
    keys = (np.asarray(starts, np.float64) + 0.0).view(np.uint64).tolist()
    generators = [np.random.default_rng([camera.seed, key]) for key in keys]
    counts = camera.detector.counts(images, generators, calibration.point, starts)
    return calibration.radiance(counts)


def _attributes(camera: CameraDescription, shape: tuple[int, int]) -> dict[str, float | str]:
    """Return the attributes of a measurement that describe the camera, in SI."""
    attributes: dict[str, float | str | None] = {
        "offset_right": camera.offset[0],
        "offset_down": camera.offset[1],
        "fill_factor": camera.fill_factor,
        "psf": repr(camera.psf),
        "psf_order": camera.psf_order,
        "integration_time": camera.integration_time,
        "frame_rate": camera.frame_rate,
        "time_constant": camera.time_constant,
        "shutter": (
            "global" if camera.line_time is None else f"rolling, {camera.line_time:g} s per row"
        ),
        "reflected": camera.reflected,
        "optics": repr(camera.optics) if camera.optics else None,
    }
    if calibration := camera.calibration(shape):
        attributes |= {
            **calibration.effects,
            "noise_seed": camera.seed,
            "netd": calibration.half_netd,
            "netd_temperature": calibration.half_temperature,
        }
    return {name: value for name, value in attributes.items() if value is not None}
