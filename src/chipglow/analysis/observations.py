"""Images of one place as observations: what they have in common, and what chance does to them."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, nan, sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from chipglow.camera import Flag, Measurement

_DOUBTFUL_SHARE: Final = 0.05
"""Share of an area's pixels that may be left out before its result is doubtful."""

_COVERAGE: Final = 0.975


class AreaResult(ABC):
    """What is determined of an area: the interval that holds it, and whether enough pixels count.

    Attributes
    ----------
    name : str
        The area's name.
    pixels, left_out : int
        Number of pixels that count, and of those that do not, because they are flagged.
    flagged : dict
        How many have each `Flag`.
    """

    name: str
    pixels: int
    left_out: int
    flagged: dict[Flag, int]

    @property
    @abstractmethod
    def standard_uncertainty(self) -> float:
        """Combined standard uncertainty."""

    @property
    @abstractmethod
    def degrees_of_freedom(self) -> float:
        """Effective number of the standard uncertainty."""

    @property
    def coverage_factor(self) -> float:
        """Student's t for 95 %: 1.96 where chance plays no part."""
        return float(stdtrit(self.degrees_of_freedom, _COVERAGE))

    @property
    def expanded_uncertainty(self) -> float:
        """Half the width of the interval that holds what is determined with 95 %, in its unit."""
        return self.coverage_factor * self.standard_uncertainty

    def left_out_doubt(self) -> str | None:
        """A sentence if many pixels are left out."""
        total = self.pixels + self.left_out
        if self.left_out <= _DOUBTFUL_SHARE * total:
            return None
        return (
            f"{self.name}: {self.left_out} of {total} pixels are left out "
            f"({flag_text(self.flagged)})"
        )


@dataclass(frozen=True)
class Scatter:
    """What the observations of an area tell of chance; standard uncertainties of its mean.

    Parameters
    ----------
    repeatability : float
        Of what changes from one observation to the next in the whole area, over what noise
        explains; NaN of one observation.
    noise : float
        Of the pixels' noise. Of one observation, an upper limit: the spread over the pixels, of
        which noise is a part, divided by the root of their number.
    degrees_of_freedom : float
        Of both together.
    """

    repeatability: float
    noise: float
    degrees_of_freedom: float

    @classmethod
    def of(cls, values: NDArray[np.float64]) -> "Scatter":
        """What values of shape (observation, pixel) tell of chance: an analysis of variance."""
        observations, pixels = values.shape
        if observations == 1:
            return cls(nan, float(values[0].std(ddof=1)) / sqrt(pixels), pixels - 1.0)
        means = values.mean(axis=1)
        total = float(means.var(ddof=1)) / observations
        residual = values - means[:, None] - values.mean(axis=0) + means.mean()
        freedom = (observations - 1.0) * (pixels - 1.0)
        noise = float((residual**2).sum()) / freedom / values.size
        if total > noise:
            return cls(sqrt(total - noise), sqrt(noise), observations - 1.0)
        return cls(0.0, sqrt(noise), freedom)

    @property
    def standard_uncertainty(self) -> float:
        """Of both together."""
        repeatability = self.repeatability if isfinite(self.repeatability) else 0.0
        return float(np.hypot(repeatability, self.noise))


def check_same_pixels(measurements: Sequence[Measurement], purpose: str) -> None:
    """Raise ValueError unless there are images, all of one camera that see the same place."""
    if not measurements:
        raise ValueError(f"{purpose}: there is no image, expected 1 or more")
    first = measurements[0]
    for number, other in enumerate(measurements[1:], 2):
        if other.raster != first.raster or other.band != first.band:
            raise ValueError(
                f"image {number}: has other pixels, or another band, than image 1, "
                "expected images of one camera that see the same place"
            )


def observed_radiance(measurements: Sequence[Measurement]) -> NDArray[np.float64]:
    """Radiance of every observation in W/(m² sr), shape (observation, y, x).

    The frames of one image, or the means of several; NaN where a frame is flagged.
    """
    frames = [_usable_radiance(measurement) for measurement in measurements]
    return np.stack([image.mean(axis=0) for image in frames]) if len(frames) > 1 else frames[0]


def observed_flags(measurements: Sequence[Measurement]) -> NDArray[np.uint8]:
    """All `Flag` that a pixel has in any frame, shape (y, x)."""
    flags = [np.bitwise_or.reduce(measurement.flags, axis=0) for measurement in measurements]
    return np.asarray(np.bitwise_or.reduce(flags, axis=0), np.uint8)


def told_calibration(measurements: Sequence[Measurement]) -> NDArray[np.float64] | None:
    """Standard uncertainty of the mean radiance from the calibration, shape (y, x).

    In W/(m² sr); None unless all measurements tell it.
    """
    known = [measurement.calibration_uncertainty for measurement in measurements]
    told = [image.mean(axis=0) for image in known if image is not None]
    return np.asarray(np.mean(told, axis=0), np.float64) if len(told) == len(known) else None


def count_flags(flags: NDArray[np.uint8]) -> dict[Flag, int]:
    """How many pixels have each `Flag` that makes them unusable."""
    return {
        flag: int((flags & flag != 0).sum())
        for flag in (Flag.BELOW_FLOOR, Flag.SATURATED, Flag.DEAD)
    }


def flag_text(flagged: dict[Flag, int]) -> str:
    """The same for people."""
    words = {Flag.BELOW_FLOOR: "under the floor", Flag.SATURATED: "saturated", Flag.DEAD: "dead"}
    told = [f"{count} {words[flag]}" for flag, count in flagged.items() if count]
    return ", ".join(told) or "none flagged"


def _usable_radiance(measurement: Measurement) -> NDArray[np.float64]:
    return np.where(measurement.usable.all(axis=0), measurement.radiance, np.nan)
