"""What happens between light and counts: each effect a small term, chosen by its kind."""

from abc import ABC
from dataclasses import dataclass
from typing import Annotated, ClassVar, Final, TypeVar, final

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Family, Parameter, Part

_Kind = TypeVar("_Kind", bound=np.generic)

DETECTOR_TERMS: Final = Family("detector_term")
"""Terms by their kind; other packages add theirs in the group ``chipglow.detector_term``."""


class DetectorTerm(Part, ABC):
    """An effect of the detector; a term overrides what it changes.

    Signals are in counts (DN), of shape (time, y, x).
    """

    def light(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Mean counts that light makes, as this effect leaves them."""
        return light

    def offset(self, shape: tuple[int, ...]) -> NDArray[np.float64] | float:
        """Counts that come without light."""
        return 0.0

    def variance(self, light: NDArray[np.float64]) -> NDArray[np.float64] | float:
        """Variance of the noise at these mean counts of light."""
        return 0.0


@final
@DETECTOR_TERMS.part
@dataclass(frozen=True)
class ReadNoise(DetectorTerm):
    """Noise of reading, which does not depend on the light (EMVA 1288)."""

    kind: ClassVar[str] = "read-noise"
    example: ClassVar[str] = "{kind: read-noise, standard_deviation: 2}"
    standard_deviation: Annotated[float, Parameter("Of the noise, in counts.", least=0.0)] = 2.0

    def variance(self, light: NDArray[np.float64]) -> float:
        """Square of the standard deviation."""
        return self.standard_deviation**2


@final
@DETECTOR_TERMS.part
@dataclass(frozen=True)
class ShotNoise(DetectorTerm):
    """Photons arrive at random: the variance of n electrons is n (EMVA 1288)."""

    kind: ClassVar[str] = "shot-noise"
    example: ClassVar[str] = "{kind: shot-noise, conversion_gain: 0.02}"
    conversion_gain: Annotated[
        float, Parameter("Counts that one electron makes (DN/e-).", over=0.0)
    ]

    def variance(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Conversion gain times the mean counts."""
        return np.asarray(self.conversion_gain * np.maximum(light, 0.0))


@final
@dataclass(frozen=True, eq=False)
class FixedPattern(DetectorTerm):
    """Detector elements that differ.

    Parameters
    ----------
    gain : ndarray
        What each element's gain is multiplied with, shape (y, x).
    dark : ndarray
        What is added to each element's offset in counts, shape (y, x).
    """

    gain: NDArray[np.float64]
    dark: NDArray[np.float64]

    def light(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Light times each element's own gain."""
        return light * _fitting("gain", self.gain, light.shape)

    def offset(self, shape: tuple[int, ...]) -> NDArray[np.float64]:
        """Each element's own offset."""
        return _fitting("dark", self.dark, shape)


@final
@dataclass(frozen=True, eq=False)
class DeadElements(DetectorTerm):
    """Detector elements whose counts stay at the offset.

    Parameters
    ----------
    mask : ndarray of bool
        Where they are, shape (y, x).
    """

    mask: NDArray[np.bool_]

    def light(self, light: NDArray[np.float64]) -> NDArray[np.float64]:
        """Light, but none where an element is dead."""
        return np.where(_fitting("mask", self.mask, light.shape), 0.0, light)


def _fitting(name: str, pattern: NDArray[_Kind], shape: tuple[int, ...]) -> NDArray[_Kind]:
    if pattern.shape != shape[1:]:
        raise ValueError(f"detector: {name} is of shape {pattern.shape}, expected {shape[1:]}")
    return pattern
