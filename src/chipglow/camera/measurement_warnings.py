"""Warnings about a measurement that a camera forms."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from chipglow.camera.description import CameraDescription
from chipglow.camera.detector.terms import EquivalentNoise, Lag, follows
from chipglow.quantities import ROUNDING, ZERO_CELSIUS, Array
from chipglow.scene import Raster

BORDER_TOLERANCE: Final = 1.0
"""Change of a pixel in K above which the border of the scene is a warning."""

_FEWEST_SAMPLES: Final = 2.0
"""Samples of the scene in the width of a pixel."""

_SUSPECT_LIMIT: Final = 373.15
"""Lower range limits in K that are probably meant in °C, if they are multiples of 10."""


def sampling_warning(camera: CameraDescription, scene: Raster) -> Iterator[str]:
    """Yield a warning if the scene's samples are too coarse for blur and footprint."""
    if camera.pitch < _FEWEST_SAMPLES * scene.spacing * (1 - ROUNDING):
        yield (
            f"The scene's samples are {1e6 * scene.spacing:.3g} µm wide, more than half a "
            f"pixel of {1e6 * camera.pitch:.3g} µm: what changes within a sample is missing, and "
            "the errors by pixels and blur may be too small."
        )


def limit_warning(camera: CameraDescription) -> Iterator[str]:
    """Yield a warning if the lower range limit is probably in °C instead of K."""
    limit = camera.lower_limit
    # A limit that was meant in °C is a round number.
    if limit is not None and limit <= _SUSPECT_LIMIT and limit % 10 == 0:
        yield (
            f"The lower range limit of {limit:g} K is {limit - ZERO_CELSIUS:g} °C. If "
            f"{limit:g} °C is meant, write {limit + ZERO_CELSIUS:g} K."
        )


def rounding_warning(camera: CameraDescription, shape: tuple[int, int]) -> Iterator[str]:
    """Yield a warning if rounding to counts exceeds the stated NETD."""
    calibration = camera.calibration(shape)
    for term in camera.detector.terms if camera.detector else ():
        if isinstance(term, EquivalentNoise) and calibration is not None:
            kelvins = calibration.rounding / float(camera.band.slope(term.temperature))
            if kelvins > term.netd:
                yield (
                    f"The stated NETD of {1e3 * term.netd:.3g} mK is not reached: rounding to "
                    f"{calibration.detector.bits} bits up to "
                    f"{calibration.full_temperature - ZERO_CELSIUS:.0f} °C causes "
                    f"{1e3 * kelvins:.0f} mK at {term.temperature - ZERO_CELSIUS:.4g} °C. NETD and "
                    "range must be those of the same setting of the camera."
                )


def lag_warning(camera: CameraDescription, starts: Array) -> Iterator[str]:
    """Yield warnings if lag is modelled but no frame follows another."""
    if follows(starts, 1 / camera.frame_rate).any():
        return
    if camera.detector is not None and any(isinstance(t, Lag) for t in camera.detector.terms):
        yield (
            "Lag: no two frames are one frame period apart, so each frame is its own "
            "predecessor and shows no lag."
        )
    if camera.time_constant is not None:
        yield (
            f"The thermal time constant is {1e3 * camera.time_constant:.3g} ms, but no two "
            "frames are one frame period apart: each frame shows its scene in a steady state. "
            "A real camera shows much less of shorter events."
        )


def border_warning(
    camera: CameraDescription, images: Array, similar: Array, scene: Raster
) -> Iterator[str]:
    """Yield a warning if the assumption about the surroundings changes temperatures."""
    kelvins = camera.band.temperature(images)
    change = np.abs(kelvins - camera.band.temperature(similar))
    change[~(kelvins >= (camera.lower_limit or 0.0))] = np.nan
    changed = change > BORDER_TOLERANCE
    if not changed.any():
        return
    pixels, (left, right, bottom, top) = camera.pixels(scene), scene.extent
    across = np.minimum(pixels.x - left, right - pixels.x)
    down = np.minimum(top - pixels.y, pixels.y - bottom)
    reach = np.minimum(across, down[:, None])[changed.any(axis=0)].max()
    yield (
        "The border of the scene: beyond it, the radiance at the edge is assumed. If the "
        "surroundings instead resembled what each pixel sees within the scene, "
        f"{100 * changed.mean():.3g} % of the pixels (up to {1e6 * reach:.3g} µm from the "
        f"border) would change by more than {BORDER_TOLERANCE:g} K, by at most "
        f"{np.nanmax(change):.3g} K."
    )
