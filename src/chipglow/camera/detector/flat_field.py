"""The camera's own calibration, from frames of blackbodies that its detector sees."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import exp, log, nan
from typing import Final

import numpy as np
import scipy
from numpy.typing import NDArray

from chipglow.camera.detector.detector import BRIGHTER_SOURCE, DARKER_SOURCE, Detector
from chipglow.camera.detector.pixels import (
    NonUniformity,
    find_bad_pixels,
    mean_frame,
    replace_bad_pixels,
)
from chipglow.camera.detector.response import OperationPoint
from chipglow.camera.measurement import Flag
from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.quantities.units import COLDEST

HALF: Final = 0.5
"""Filled part of the capacity at which the NETD is stated."""

_BEYOND: Final = 10.0
"""Capacities' light by which saturated frames are made."""

_MARGIN: Final = 5.0
"""Standard deviations under the mean of saturated frames from which on a count is saturated."""

_SATURATED_FRAMES: Final = 8
"""Frames of a saturated source from whose scatter the limit of the counts follows."""

_SMALL: Final = (32, 32)
"""Elements by which the lower range limit is found."""

_QUANTISATION: Final = 12**-0.5
"""Standard deviation of rounding to whole counts."""

_FAINTEST: Final = 1e-9
"""Smallest light, as a fraction of that which fills the capacity, of a source that is searched for.
"""

_STREAMS: Final = {"cold": 1, "hot": 2, "saturated": 3, "netd": 4}
"""Streams of random numbers, one for each source."""


@dataclass(frozen=True, eq=False, repr=False)
class FlatFieldCalibration(Brief):
    """A camera's conversion of its detector's counts to radiance.

    The detector's `correction` equalises the pixels. Two blackbodies of known radiance give the
    straight line from the median pixel's counts to radiance.
    """

    detector: Detector
    point: OperationPoint
    """How the camera uses the detector."""
    uniformity: NonUniformity
    bad: NDArray[np.bool_]
    """Pixels that do not answer as others do, or that the brighter source saturates, (y, x)."""
    saturated: Array
    """Saturation of each pixel in counts, shape (y, x)."""
    sources: tuple[float, float]
    """Radiance of the darker and of the brighter source in W/(m² sr)."""
    levels: tuple[float, float]
    """The median pixel's counts of them."""

    @property
    def effects(self) -> Mapping[str, str]:
        """Attributes of a measurement about detector and calibration, in SI."""
        made, kelvins = self.detector, self.point.band.temperature(np.array(self.sources))
        well = "" if made.full_well is None else f", full well {made.full_well:g} e-"
        low, high = kelvins.tolist()
        return {
            "detector_response": repr(made.response),
            "detector_terms": ", ".join(repr(term) for term in made.terms) or "none",
            "digitiser": (
                f"{made.bits} bits, gain {made.conversion_gain:g} DN/e-, offset {made.offset:g} DN"
                f"{well}"
            ),
            "calibration": (
                f"correction {made.correction}, {made.frames} frames of each of two blackbodies, "
                f"{low:.5g} K and {high:.5g} K, seed {made.seed}"
            ),
        }

    def radiance(self, counts: NDArray[np.uint32] | Array) -> tuple[Array, NDArray[np.uint8]]:
        """Return radiance in W/(m² sr) and flags of counts (time, y, x).

        Radiance is NaN where a pixel is dead and not replaced by its neighbours.
        """
        signal, replaced = replace_bad_pixels(self.uniformity.apply(counts), self.bad)
        dead = np.where(replaced, Flag.REPLACED, np.where(self.bad, Flag.DEAD, 0))
        flags = np.array(np.broadcast_to(dead, counts.shape), np.uint8)
        flags[(counts >= self.saturated) & ~self.bad] |= np.uint8(Flag.SATURATED)
        flags[(counts == 0) & ~self.bad] |= np.uint8(Flag.UNDER_RANGE)
        (low, high), (dark, bright) = self.levels, self.sources
        return dark + (signal - low) * (bright - dark) / (high - low), flags

    def netd(self, temperature: float) -> float:
        """Return the noise-equivalent temperature difference in K of a blackbody in K.

        Temporal noise of the calibrated radiance, root mean square over the pixels, divided by
        dL/dT, and not below the noise of rounding to whole counts. NaN for a blackbody that
        saturates it.
        """
        seen = float(self.point.band.radiance(temperature))
        if seen >= full_light(self.detector, self.point):
            return nan
        frames = _frames(
            self.detector, self.point, self.bad.shape, seen, self.detector.frames, "netd"
        )
        variance = self.radiance(frames)[0].var(axis=0, ddof=1)
        noise = max(float(np.sqrt(variance[~self.bad].mean())), self.rounding)
        return float(noise / self.point.band.slope(temperature))

    @property
    def rounding(self) -> float:
        """Standard deviation of the radiance by rounding to counts in W/(m² sr)."""
        (low, high), (dark, bright) = self.levels, self.sources
        return _QUANTISATION * (bright - dark) / (high - low)

    @cached_property
    def half_temperature(self) -> float:
        """Temperature in K of a blackbody whose light fills half of the detector."""
        light = HALF * full_light(self.detector, self.point)
        return float(self.point.band.temperature(light))

    @property
    def full_temperature(self) -> float:
        """Temperature in K of a blackbody whose light fills the detector."""
        return float(self.point.band.temperature(full_light(self.detector, self.point)))

    @cached_property
    def half_netd(self) -> float:
        """NETD in K at that temperature."""
        return self.netd(self.half_temperature)


def _sources(detector: Detector, point: OperationPoint) -> tuple[float, float]:
    """Return the radiance of the darker and of the brighter source."""
    band, full = point.band, full_light(detector, point)
    dark, bright = (
        part * full if kelvins is None else float(band.radiance(kelvins))
        for kelvins, part in ((detector.cold, DARKER_SOURCE), (detector.hot, BRIGHTER_SOURCE))
    )
    cold, hot = (float(band.temperature(one)) - ZERO_CELSIUS for one in (dark, bright))
    if not dark < bright:
        raise ValueError(
            f"detector: the sources of the correction are of {cold:.4g} °C and {hot:.4g} °C, "
            "expected the second brighter (cold, hot)"
        )
    if not bright < full:
        raise ValueError(
            f"Detector.hot: {hot:.4g} °C fills the detector at its exposure, expected less than "
            f"{float(band.temperature(full)) - ZERO_CELSIUS:.4g} °C"
        )
    return dark, bright


def _frames(
    detector: Detector,
    point: OperationPoint,
    shape: tuple[int, ...],
    radiance: float,
    count: int,
    stream: str,
) -> NDArray[np.uint32] | Array:
    """Return frames of a flat-field source."""
    generator = np.random.default_rng([detector.seed, _STREAMS[stream]])
    return detector.counts(np.full((count, *shape), radiance), generator, point)


@lru_cache(maxsize=32)
def flat_field_calibration(
    detector: Detector, point: OperationPoint, shape: tuple[int, int]
) -> FlatFieldCalibration:
    """Return the calibration of a detector in a camera, by frames of its sources."""
    dark, bright = sources = _sources(detector, point)
    cold = _frames(detector, point, shape, dark, detector.frames, "cold")
    hot = _frames(detector, point, shape, bright, detector.frames, "hot")
    if detector.correction == "two-point":
        uniformity = NonUniformity.two_point(cold, hot)
    elif detector.correction == "one-point":
        uniformity = NonUniformity.one_point(cold)
    else:
        uniformity = NonUniformity(np.ones(shape), np.zeros(shape))
    light = _BEYOND * full_light(detector, point)
    full = _frames(detector, point, shape, light, _SATURATED_FRAMES, "saturated")
    saturated = full.mean(axis=0) - _MARGIN * float(np.sqrt(full.var(axis=0).mean()))
    if not detector.digitises:
        saturated = np.full(shape, np.inf)
    bad = find_bad_pixels(cold, hot).unresponsive
    bad |= mean_frame(hot) >= saturated
    low, high = (
        float(np.median(mean_frame(uniformity.apply(frames))[~bad])) for frames in (cold, hot)
    )
    return FlatFieldCalibration(detector, point, uniformity, bad, saturated, sources, (low, high))


@lru_cache(maxsize=32)
def full_light(detector: Detector, point: OperationPoint) -> float:
    """Return the radiance in W/(m² sr) that fills a detector, beside its electrons in the dark."""
    dark = _seen(detector, point, 0.0)[0] - detector.offset
    electrons = detector.capacity - max(dark, 0.0) / detector.conversion_gain
    if not electrons > 0:
        raise ValueError("detector: it is full in the dark, expected a smaller current")
    return electrons / detector.per_radiance(point)


@lru_cache(maxsize=32)
def lower_range_limit(detector: Detector, point: OperationPoint) -> float:
    """Return the lowest radiance temperature in K that a detector measures at its exposure.

    At this temperature the mean signal above the dark level is `least_signal` times the noise, the
    standard deviation over time or of rounding; 200 K or more, as a band's tables.
    """

    def excess(logarithm: float) -> float:
        mean, noise = _seen(detector, point, exp(logarithm))
        return mean - dark - detector.least_signal * noise

    dark, _ = _seen(detector, point, 0.0)
    full = full_light(detector, point)
    ends = log(_FAINTEST * full), log(full)
    if excess(ends[1]) < 0:
        raise ValueError(
            "lower_limit: detector: its signal is never "
            f"{detector.least_signal:g} times its noise, expected a smaller least_signal"
        )
    # To 1e-4 of the radiance: a limit is stated to about 1 K, of which this is a hundredth.
    found = ends[0] if excess(ends[0]) > 0 else scipy.optimize.bisect(excess, *ends, xtol=1e-4)
    return max(float(point.band.temperature(exp(found))), COLDEST)


def _seen(detector: Detector, point: OperationPoint, radiance: float) -> tuple[float, float]:
    """Return the mean count of a flat-field source and its standard deviation over time."""
    counts = _frames(detector, point, _SMALL, radiance, detector.frames, "netd")
    noise = float(np.sqrt(counts.var(axis=0, ddof=1).mean()))
    return float(counts.mean()), max(noise, _QUANTISATION)
