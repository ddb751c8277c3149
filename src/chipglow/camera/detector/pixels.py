"""Pixels that answer differently to the same light: corrections, and finding the bad ones."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from chipglow.quantities import Array, Brief
from chipglow.uncertainty.component import MAD_FACTOR

LEAST_FRAMES: Final = 8
"""Number of frames from which the noise of a pixel is determined."""

NOISE_LIMIT: Final = 5.0
"""Multiple of the median standard deviation over time from which on a pixel is noisy."""

GAIN_LIMITS: Final = (0.5, 1.5)
"""Gains relative to the median gain that are still good."""

LEVEL_LIMIT: Final = 8.0
"""Multiple of the pixels' spread (1.48 times the median absolute deviation) by which the mean of
a good pixel is from the median at most, of one flat-field source."""

LARGEST_CLUSTER: Final = 4
"""Pixels of the largest cluster, neighbours over corner included, that is replaced."""

_FEWEST_NEIGHBOURS: Final = 3
"""Fewest good pixels around a bad one that replace it."""


@dataclass(frozen=True, eq=False, repr=False)
class NonUniformity(Brief):
    """Makes every pixel answer like the median pixel: gain × signal + offset, each of shape (y, x).

    NaN where a pixel does not answer to light.
    """

    gain: Array
    offset: Array

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
        _check_size("non-uniformity: frames", signal.shape[1:], self.gain.shape)
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
    _check_size("uniform frames: the second", hot.shape, cold.shape)
    if not np.median(hot - cold) > 0:
        raise ValueError(
            f"uniform frames: the second have a median of {np.median(hot):g} and the first of "
            f"{np.median(cold):g}, expected the second brighter"
        )
    return hot - cold


def _check_size(name: str, found: tuple[int, ...], expected: tuple[int, ...]) -> None:
    if found != expected:
        seen, wanted = (f"{columns} x {rows}" for rows, columns in (found, expected))
        raise ValueError(f"{name} of {seen} pixels, expected {wanted}")


@dataclass(frozen=True, eq=False, repr=False)
class BadPixels(Brief):
    """Pixels that do not answer to light as others do, each an array of bool of shape (y, x)."""

    stuck: NDArray[np.bool_]
    """The value never changes, while that of others does."""
    noisy: NDArray[np.bool_]
    """The value changes much more than that of others."""
    unresponsive: NDArray[np.bool_]
    """The gain is out of limits or, of one flat-field source, the value is far off."""

    @property
    def mask(self) -> NDArray[np.bool_]:
        """All of them."""
        return self.stuck | self.noisy | self.unresponsive


def find_bad_pixels(frames: NDArray[Any], hot: NDArray[Any] | None = None) -> BadPixels:
    """Find bad pixels in the signal (time, y, x) of one flat-field source, or of two.

    Noise is judged by `NOISE_LIMIT`, from `LEAST_FRAMES` frames on; of two sources the gain by
    `GAIN_LIMITS`, of one the level by `LEVEL_LIMIT`.
    """
    level = mean_frame(frames)
    stuck, noisy = _by_noise(frames)
    if hot is None:
        distance = np.abs(level - np.median(level))
        spread = MAD_FACTOR * float(np.median(distance))
        far_off = ~(distance <= LEVEL_LIMIT * spread) if spread > 0 else distance > 0
        return BadPixels(stuck, noisy, far_off)
    stuck_hot, noisy_hot = _by_noise(hot)
    rise = signal_rise(level, mean_frame(hot))
    gain = rise / np.median(rise)
    unresponsive = ~((gain >= GAIN_LIMITS[0]) & (gain <= GAIN_LIMITS[1]))
    return BadPixels(stuck | stuck_hot, noisy | noisy_hot, unresponsive)


def _by_noise(frames: NDArray[Any]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return pixels without any noise, and with too much."""
    none = np.zeros(frames.shape[1:], np.bool_)
    if len(frames) < LEAST_FRAMES:
        return none, none
    noise = frames.std(axis=0, dtype=np.float64)
    usual = float(np.median(noise))
    if not usual > 0:
        return none, none
    return noise == 0, noise > NOISE_LIMIT * usual


def replace_bad_pixels(signal: Array, bad: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Replace bad pixels of frames (time, y, x) by the median of their good neighbours.

    Returns the frames and which were replaced; others are NaN: clusters of more than
    `LARGEST_CLUSTER`, and pixels of whose eight neighbours less than three are good.
    """
    _check_size("bad pixels: frames", signal.shape[1:], bad.shape)
    result = np.array(signal, np.float64)
    result[:, bad] = np.nan
    clusters, _ = label(bad, np.ones((3, 3)))
    small = bad & (np.bincount(clusters.ravel())[clusters] <= LARGEST_CLUSTER)
    replaced = np.zeros_like(bad)
    for y, x in np.argwhere(small):
        around = np.s_[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        good = ~bad[around]
        if np.count_nonzero(good) >= _FEWEST_NEIGHBOURS:
            result[:, y, x] = np.median(signal[(slice(None), *around)][:, good], axis=1)
            replaced[y, x] = True
    return result, replaced
