"""Pixels that answer differently to the same light: one- and two-point corrections."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class NonUniformity:
    """What makes every pixel answer like the median pixel: gain × signal + offset.

    Parameters
    ----------
    gain, offset : ndarray
        Shape (y, x); NaN where a pixel does not answer to light.

    Raises
    ------
    ValueError
        If shapes differ.
    """

    gain: NDArray[np.float64]
    offset: NDArray[np.float64]

    def __post_init__(self) -> None:
        if self.gain.ndim != 2 or self.gain.shape != self.offset.shape:
            raise ValueError(
                f"non-uniformity: gain and offset have shapes {self.gain.shape} and "
                f"{self.offset.shape}, expected one shape (y, x)"
            )

    @classmethod
    def one_point(cls, frames: NDArray[Any]) -> "NonUniformity":
        """Offsets from frames of a flat-field source.

        Parameters
        ----------
        frames : ndarray
            Signal, shape (time, y, x). Right at the radiance of that object; elsewhere as far as
            the pixels' gains are equal.
        """
        level = mean_frame(frames)
        return cls(np.ones_like(level), float(np.median(level)) - level)

    @classmethod
    def two_point(cls, cold: NDArray[Any], hot: NDArray[Any]) -> "NonUniformity":
        """Gains and offsets from frames of two flat-field sources.

        Parameters
        ----------
        cold, hot : ndarray
            Signal of the darker and of the brighter object, shape (time, y, x). Right at both, and
            at all other radiances as far as the pixels are linear.

        Raises
        ------
        ValueError
            If the frames are of different sizes, or the second object is not brighter.
        """
        low, high = mean_frame(cold), mean_frame(hot)
        rise = response(low, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.where(rise > 0, np.median(rise) / rise, np.nan)
        return cls(gain, float(np.median(low)) - gain * low)

    def apply(self, signal: NDArray[Any]) -> NDArray[np.float64]:
        """Corrected signal of frames of shape (time, y, x); NaN where a pixel does not answer.

        Raises
        ------
        ValueError
            If the frames are of another size.
        """
        if signal.shape[1:] != self.gain.shape:
            raise ValueError(
                f"non-uniformity: is of {size_text(self.gain.shape)} pixels, the frames of "
                f"{size_text(signal.shape[1:])}, expected the same"
            )
        return np.asarray(self.gain * signal + self.offset, np.float64)


def mean_frame(frames: NDArray[Any]) -> NDArray[np.float64]:
    """Mean over time of frames of shape (time, y, x), shape (y, x).

    Raises
    ------
    ValueError
        If there is no frame.
    """
    if frames.ndim != 3 or 0 in frames.shape:
        raise ValueError(
            f"uniform frames: have shape {frames.shape}, expected (time, y, x) with 1 frame or more"
        )
    return np.asarray(frames.mean(axis=0, dtype=np.float64))


def response(cold: NDArray[np.float64], hot: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much more each pixel gives of the brighter of two flat-field sources, shape (y, x).

    Raises
    ------
    ValueError
        If sizes differ or the second is not brighter.
    """
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
    """Columns and rows, as people say them."""
    return f"{shape[1]} x {shape[0]}"
