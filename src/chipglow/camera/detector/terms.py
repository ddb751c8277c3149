"""Effects between light and counts: each a small term, chosen by its kind."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property
from math import ceil, log10, pi
from typing import Annotated, ClassVar, Final
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector.response import OperationPoint, in_tables
from chipglow.quantities import Array, Family, Parameter, Part
from chipglow.quantities.units import TEMPERATURE_DIFFERENCE, TIME, Quantity

DETECTOR_TERMS: Final = Family("detector_term")
"""Terms by their kind; other packages add theirs in the group ``chipglow.detector_term``."""

ELECTRON_RATE: Final = Quantity("a current of electrons", "Hz", "Hz", "50 kHz", positive=False)

_PER_DECADE: Final = 2
"""Processes of one time constant by which noise of 1/f is made: 1/f within 0.1 %."""

_SAME_INTERVAL: Final = 0.01
"""Part of the time between frames by which the frame before may be off."""


class Stage(IntEnum):
    """Place between light and counts where a term acts; terms of one stage act in their order."""

    LIGHT = 0
    """On the electrons that light makes."""
    DARK = 1
    """Electrons that come without light."""
    CHARGE = 2
    """On all electrons of an element; then the full well limits them."""
    TRANSFER = 3
    """On the signal after conversion."""
    READOUT = 4
    """Read-out noise; then come gain, offset and the digitiser."""


@dataclass(frozen=True, eq=False)
class Readout:
    """Frames that are read from a detector, as terms see them."""

    times: Array
    """Start of each integration in s, shape (time,)."""
    point: OperationPoint
    """How the camera uses the detector."""
    per_radiance: float
    """Electrons that 1 W/(m² sr) makes in a frame."""
    capacity: float
    """Electrons that fill the detector or its digitiser."""
    keys: Sequence[int]
    """Seed of each frame's noise."""
    seed: int
    """Fixed pattern of the detector."""
    kind: str
    """Kind of the term, whose noise does not depend on what other terms there are."""

    @cached_property
    def generators(self) -> list[np.random.Generator]:
        """Source of each frame's noise of this kind."""
        return [generator_of(key, self.kind) for key in self.keys]

    def normal(self, rows: int, columns: int) -> Array:
        """Return standard normal deviates of all frames, shape (time, rows, columns)."""
        return np.stack([one.standard_normal((rows, columns)) for one in self.generators])


def generator_of(seed: int, kind: str) -> np.random.Generator:
    """Return the generator of a kind of term, by the seed of a detector's patterns or a frame."""
    return np.random.default_rng([seed, crc32(kind.encode())])


class DetectorTerm(Part, ABC):
    """An effect of the detector, at its `stage`."""

    stage: ClassVar[Stage]

    @abstractmethod
    def apply(self, electrons: Array, readout: Readout) -> Array:
        """Return with the effect the electrons of the stages before, shape (time, y, x)."""


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class GainPattern(DetectorTerm):
    """Elements that answer differently to the same light (EMVA 1288: PRNU).

    n becomes n (1 + s z) with one normal deviate z for each element.
    """

    kind = "gain-pattern"
    example = "{kind: gain-pattern, standard_deviation: 0.02}"
    stage = Stage.LIGHT
    standard_deviation: Annotated[
        float,
        Parameter("Deviation of the elements' gains, as a fraction of their mean.", least=0.0),
    ]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        deviates = generator_of(readout.seed, self.kind).standard_normal(electrons.shape[1:])
        return np.asarray(electrons * (1 + self.standard_deviation * deviates))


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class DeadElements(DetectorTerm):
    """Elements that do not answer to light, at random places."""

    kind = "dead-elements"
    example = "{kind: dead-elements, fraction: 0.002}"
    stage = Stage.LIGHT
    fraction: Annotated[float, Parameter("Fraction of all elements.", least=0.0, under=1.0)]

    def mask(self, shape: tuple[int, ...], seed: int) -> NDArray[np.bool_]:
        """Return the dead elements of a detector with this seed and shape (y, x)."""
        return np.asarray(generator_of(seed, self.kind).random(shape) < self.fraction)

    def apply(self, electrons: Array, readout: Readout) -> Array:
        return np.where(self.mask(electrons.shape[1:], readout.seed), 0.0, electrons)


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class Lag(DetectorTerm):
    """A part of the frame before that is still there.

    m(i) = (1 − a) n(i) + a m(i − 1), such as charge that is left; the camera's `time_constant` does
    it for a microbolometer. The frame before is the one that began one time between frames earlier;
    where it is not among the frames, the scene is taken to have been as it is.
    """

    kind = "lag"
    example = "{kind: lag, fraction: 0.02}"
    stage = Stage.LIGHT
    fraction: Annotated[float, Parameter("Fraction of the frame before.", least=0.0, under=1.0)]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        return lagged(electrons, readout.times, readout.point.frame_time, self.fraction)


def lagged(frames: Array, times: Array, frame_time: float, fraction: float) -> Array:
    """Return frames (time, y, x) with a fraction of the frame before: a first-order lag."""
    result = frames.copy()
    for i in np.flatnonzero(follows(times, frame_time)):
        result[i] += fraction * (result[i - 1] - frames[i])
    return result


def follows(times: Array, frame_time: float) -> NDArray[np.bool_]:
    """Return which frames come one frame time after the one before them, shape (time,)."""
    off = np.abs(np.diff(times, prepend=np.nan) - frame_time)
    return np.asarray(off <= _SAME_INTERVAL * frame_time)


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class DarkCurrent(DetectorTerm):
    """Electrons that come without light: current times integration time (EMVA 1288, 2.3)."""

    kind = "dark-current"
    example = "{kind: dark-current, current: 50 kHz}  electrons per second"
    stage = Stage.DARK
    current: Annotated[
        float, Parameter("Electrons a second and element.", ELECTRON_RATE, least=0.0)
    ]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        return electrons + self.current * readout.point.integration_time


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class ShotNoise(DetectorTerm):
    """Electrons come at random: the variance of n electrons is n (EMVA 1288, 2.2).

    They are taken as normal, which a Poisson process is from some 100 electrons on.
    """

    kind = "shot-noise"
    example = "{kind: shot-noise}"
    stage = Stage.CHARGE

    def apply(self, electrons: Array, readout: Readout) -> Array:
        noise = readout.normal(*electrons.shape[1:])
        return np.asarray(electrons + np.sqrt(np.maximum(electrons, 0.0)) * noise)


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class NonLinearity(DetectorTerm):
    """A signal that falls short of a straight line: n becomes n (1 − f n / N), N the capacity.

    Beyond the capacity it continues as n (1 − f).
    """

    kind = "non-linearity"
    example = "{kind: non-linearity, fraction: 0.01}"
    stage = Stage.TRANSFER
    fraction: Annotated[
        float, Parameter("Shortfall of the largest signal; negative: excess.", least=-0.4, most=0.4)
    ]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        filled = np.minimum(electrons / readout.capacity, 1.0)
        return np.asarray(electrons * (1 - self.fraction * filled))


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class OffsetPattern(DetectorTerm):
    """Elements that differ in the dark (EMVA 1288: DSNU)."""

    kind = "offset-pattern"
    example = "{kind: offset-pattern, standard_deviation: 2000}"
    stage = Stage.READOUT
    standard_deviation: Annotated[
        float, Parameter("Deviation of the elements' offsets, in electrons.", least=0.0)
    ]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        deviates = generator_of(readout.seed, self.kind).standard_normal(electrons.shape[1:])
        return np.asarray(electrons + self.standard_deviation * deviates)


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class ReadNoise(DetectorTerm):
    """Noise of reading, which does not depend on the light (EMVA 1288, 2.2)."""

    kind = "read-noise"
    example = "{kind: read-noise, standard_deviation: 300}"
    stage = Stage.READOUT
    standard_deviation: Annotated[float, Parameter("In electrons.", least=0.0)]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        return electrons + self.standard_deviation * readout.normal(*electrons.shape[1:])


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class ColumnNoise(DetectorTerm):
    """Noise of the columns' amplifiers: in every frame the same in all elements of a column."""

    kind = "column-noise"
    example = "{kind: column-noise, standard_deviation: 100}"
    stage = Stage.READOUT
    standard_deviation: Annotated[float, Parameter("In electrons.", least=0.0)]

    def apply(self, electrons: Array, readout: Readout) -> Array:
        return electrons + self.standard_deviation * readout.normal(1, electrons.shape[2])


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class FlickerNoise(DetectorTerm):
    """Noise of 1/f: each element's signal drifts from frame to frame.

    Its power spectral density is s² / (ln 10 f), so that each decade of frequencies has the
    variance s². It is the sum of processes of one time constant each, whose variances are equal and
    whose time constants are a geometric row (Bernamont, Ann. Phys. 11 (1937) 71), exact at any
    times of the frames. Frequencies go from once in the time since the correction to half the
    frame rate; the frames of the correction have it too.
    """

    kind = "flicker-noise"
    example = "{kind: flicker-noise, standard_deviation: 50, since_correction: 100 s}  1/f"
    stage = Stage.READOUT
    standard_deviation: Annotated[
        float, Parameter("In electrons, of each decade of frequencies.", least=0.0)
    ]
    since_correction: Annotated[float, Parameter("Time since pixels were corrected.", TIME)] = 100.0

    def apply(self, electrons: Array, readout: Readout) -> Array:
        constants = self.time_constants(readout.point.frame_time)
        intervals = np.abs(np.diff(readout.times, prepend=-np.inf))
        state = np.zeros((constants.size, *electrons.shape[1:]))
        result = np.empty_like(electrons)
        for i, generator in enumerate(readout.generators):
            left = np.exp(-intervals[i] / constants)[:, None, None]
            fresh = generator.standard_normal(state.shape)
            state = left * state + np.sqrt(1 - left**2) * fresh
            result[i] = state.sum(axis=0)
        return np.asarray(electrons + self.standard_deviation / np.sqrt(_PER_DECADE) * result)

    def time_constants(self, frame_time: float) -> Array:
        """Return the time constants of the processes in s."""
        decades = max(log10(self.since_correction / (2 * frame_time)), 0.0)
        count = ceil(_PER_DECADE * decades) + 1
        return self.since_correction / (2 * pi) * 10 ** (-np.arange(count) / _PER_DECADE)


@DETECTOR_TERMS.part
@dataclass(frozen=True)
class EquivalentNoise(DetectorTerm):
    """Noise as data sheets state it: as a difference of a blackbody's temperature (NETD).

    The standard deviation of the radiance is NETD times dL/dT at the stated temperature, at any
    light. It holds all noise: do not combine it with other terms of noise.
    """

    kind = "netd"
    example = "{kind: netd, netd: 50 mK, temperature: 30 degC}"
    stage = Stage.READOUT
    netd: Annotated[
        float, Parameter("Difference as large as the noise.", TEMPERATURE_DIFFERENCE, least=0.0)
    ]
    temperature: Annotated[float, in_tables("Temperature of the blackbody.")] = 303.15

    def apply(self, electrons: Array, readout: Readout) -> Array:
        radiance = self.netd * float(readout.point.band.slope(self.temperature))
        noise = readout.per_radiance * radiance * readout.normal(*electrons.shape[1:])
        return np.asarray(electrons + noise)
