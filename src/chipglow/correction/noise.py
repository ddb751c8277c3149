"""Noise of a frame: stated, known from the detector, or estimated from the frame."""

from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve

from chipglow.camera import Measurement
from chipglow.quantities import Array
from chipglow.text import Notes

REFERENCE: Final = 600.0
"""Temperature in K at which a noise in K is stated."""

_MASK: Final = np.outer([1.0, -2.0, 1.0], [1.0, -2.0, 1.0])
"""Mixed second differences, which vanish for images that are planes or curve along one axis."""

_BLOCK: Final = 8
"""Side in pixels of the blocks in which the noise is estimated."""

_QUIET: Final = 0.1
"""Quantile of the blocks: detail of the object raises the estimate in most of them."""

_LEAST: Final = 1e-4
"""Smallest noise relative to the radiance, far below the noise of any camera."""


def noise_of(
    measurement: Measurement, frame: int, usable: NDArray[np.bool_], stated: float | None
) -> tuple[Array, Notes]:
    """Return the standard deviation of the noise in W/(m² sr), shape (y, x), and its origin."""
    radiance, attributes = measurement.radiance[frame], measurement.data.attrs
    known = stated, REFERENCE
    if stated is None and "netd" in attributes:
        known = float(attributes["netd"]), float(attributes["netd_temperature"])
    netd, temperature = known
    least = _LEAST * np.abs(np.nan_to_num(radiance))
    if netd is not None:
        deviation = netd * float(measurement.band.slope(temperature))
        return np.maximum(deviation, least), Notes()
    deviation = _estimated(radiance, usable)
    kelvins = deviation / float(measurement.band.slope(REFERENCE))
    note = (
        f"Noise: neither stated nor in the measurement; estimated from the frame, {kelvins:.2g} K "
        f"at {REFERENCE:.0f} K."
    )
    return np.maximum(deviation, least), Notes([note])


def _estimated(radiance: Array, usable: NDArray[np.bool_]) -> float:
    """Return the noise in the quietest blocks (Immerkaer, Comput. Vis. Im. Und. 64 (1996) 300)."""
    known = np.where(usable, radiance, np.nan)
    differences = convolve(known, _MASK, mode="nearest") / np.sqrt((_MASK**2).sum())
    rows, columns = (max(count // _BLOCK, 1) for count in radiance.shape)
    blocks = [
        float(np.sqrt(np.nanmean(part**2)))
        for lines in np.array_split(differences, rows)
        for part in np.array_split(lines, columns, axis=1)
        if np.isfinite(part).sum() > part.size / 2
    ]
    return float(np.quantile(blocks, _QUIET)) if blocks else 0.0
