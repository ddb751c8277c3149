"""One- and two-point corrections of pixels that answer differently to the same light."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array


@dataclass(frozen=True, eq=False)
class NonUniformity:
    """Makes every pixel answer like the median pixel: gain × signal + offset, each of shape (y, x).

    NaN where a pixel does not answer to light.
    """

    gain: Array
    offset: Array

    def __post_init__(self) -> None:
        if self.gain.ndim != 2 or self.gain.shape != self.offset.shape:
            raise ValueError(
                f"non-uniformity: gain and offset have shapes {self.gain.shape} and "
                f"{self.offset.shape}, expected one shape (y, x)"
            )

    @classmethod
    def one_point(cls, frames: NDArray[Any]) -> "NonUniformity":
        """Find offsets from frames (time, y, x) of a flat-field source, right at its radiance."""
        level = mean_frame(frames)
        return cls(np.ones_like(level), float(np.median(level)) - level)

    @classmethod
    def two_point(cls, cold: NDArray[Any], hot: NDArray[Any]) -> "NonUniformity":
        """Find gains and offsets from frames (time, y, x) of two flat-field sources.

        Right at both, and at all other radiances as far as the pixels are linear.
        """
        low, high = mean_frame(cold), mean_frame(hot)
        rise = signal_rise(low, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.where(rise > 0, np.median(rise) / rise, np.nan)
        return cls(gain, float(np.median(low)) - gain * low)

    def apply(self, signal: NDArray[Any]) -> Array:
        """Return the corrected signal of frames (time, y, x); NaN where a pixel does not answer."""
        if signal.shape[1:] != self.gain.shape:
            raise ValueError(
                f"non-uniformity: is of {size_text(self.gain.shape)} pixels, the frames of "
                f"{size_text(signal.shape[1:])}, expected the same"
            )
        return np.asarray(self.gain * signal + self.offset, np.float64)


def mean_frame(frames: NDArray[Any]) -> Array:
    """Return the mean over time of frames of shape (time, y, x), shape (y, x)."""
    if frames.ndim != 3 or 0 in frames.shape:
        raise ValueError(
            f"uniform frames: have shape {frames.shape}, expected (time, y, x) with 1 frame or more"
        )
    return np.asarray(frames.mean(axis=0, dtype=np.float64))


def signal_rise(cold: Array, hot: Array) -> Array:
    """Return how much more each pixel gives of the brighter of two flat-field sources, (y, x)."""
    if cold.shape != hot.shape:
        raise ValueError(
            f"uniform frames: are of {size_text(cold.shape)} and {size_text(hot.shape)} pixels, "
            "expected the same"
        )
    if not np.median(hot - cold) > 0:
        raise ValueError(
            f"uniform frames: the second have a median of {np.median(hot):g} and the first of "
            f"{np.median(cold):g}, expected the second brighter"
        )
    return hot - cold


def size_text(shape: tuple[int, ...]) -> str:
    """Return columns and rows as text."""
    return f"{shape[1]} x {shape[0]}"
