"""The detector: from in-band radiance to counts, with noise, fixed pattern and a limited range."""

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.measurement import Measurement
from chipglow.camera.recording import Recording


@dataclass(frozen=True)
class Detector:
    """A photon detector and its digitiser.

    A sensor's mean signal is gain times radiance plus offset, in counts. Photons arrive at random:
    the variance of gain times radiance is itself times `counts_per_electron`. Reading adds noise of
    its own. The sum is rounded to whole counts and ends at the digitiser's limits.

    Parameters
    ----------
    gain : float
        Counts per W/(m² sr).
    offset : float
        Counts without light.
    bits : int
        Bits of the digitiser: counts go from 0 to 2**bits − 1.
    read_noise : float
        Standard deviation of the noise that does not depend on the signal, in counts.
    counts_per_electron : float
        Counts that one electron makes: over 0 with shot noise, 0 without.
    gain_pattern : ndarray, optional
        What each sensor's gain is multiplied with, shape (y, x).
    offset_pattern : ndarray, optional
        What is added to each sensor's offset in counts, shape (y, x).
    dead : ndarray of bool, optional
        Sensors whose counts stay at the offset, shape (y, x).

    Raises
    ------
    ValueError
        If a value is impossible.
    """

    gain: float
    offset: float = 400.0
    bits: int = 12
    read_noise: float = 2.0
    counts_per_electron: float = 0.0
    gain_pattern: NDArray[np.float64] | None = None
    offset_pattern: NDArray[np.float64] | None = None
    dead: NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        _expect(isfinite(self.gain) and self.gain > 0, "gain", self.gain, "over 0")
        _expect(isfinite(self.offset), "offset", self.offset, "a finite number")
        _expect(1 <= self.bits <= 32, "bits", self.bits, "1 to 32")
        for name in ("read_noise", "counts_per_electron"):
            value = getattr(self, name)
            _expect(isfinite(value) and value >= 0, name, value, "0 or more")

    @property
    def saturation(self) -> int:
        """The greatest count that is not saturated: one under the digitiser's limit."""
        return (1 << self.bits) - 2

    def with_pattern(
        self,
        shape: tuple[int, int],
        gain_spread: float,
        offset_spread: float,
        dead_share: float,
        generator: np.random.Generator,
    ) -> "Detector":
        """The same detector with sensors that differ.

        Parameters
        ----------
        shape : tuple of int
            Rows and columns.
        gain_spread : float
            Standard deviation of the sensors' gains, as a share of the mean gain.
        offset_spread : float
            Standard deviation of their offsets in counts.
        dead_share : float
            Share of dead sensors, 0 to 1.
        generator : numpy.random.Generator
            Where the random numbers come from.
        """
        return replace(
            self,
            gain_pattern=1.0 + gain_spread * generator.standard_normal(shape),
            offset_pattern=offset_spread * generator.standard_normal(shape),
            dead=generator.random(shape) < dead_share,
        )

    def counts(
        self, radiance: NDArray[np.floating], generator: np.random.Generator
    ) -> NDArray[np.uint32]:
        """Counts of frames.

        Parameters
        ----------
        radiance : ndarray
            In-band radiance in W/(m² sr), shape (time, y, x).
        generator : numpy.random.Generator
            Where the noise comes from: the same state gives the same counts.

        Returns
        -------
        ndarray
            Counts, of the same shape.

        Raises
        ------
        ValueError
            If a pattern has another shape than the frames.
        """
        for name in ("gain_pattern", "offset_pattern", "dead"):
            pattern = getattr(self, name)
            fits = pattern is None or pattern.shape == radiance.shape[1:]
            _expect(fits, name, getattr(pattern, "shape", None), f"shape {radiance.shape[1:]}")
        light = self.gain * np.asarray(radiance, np.float64)
        if self.gain_pattern is not None:
            light *= self.gain_pattern
        if self.dead is not None:
            light[:, self.dead] = 0.0
        deviation = np.sqrt(self.read_noise**2 + self.counts_per_electron * np.maximum(light, 0.0))
        signal = self.offset + light + deviation * generator.standard_normal(radiance.shape)
        if self.offset_pattern is not None:
            signal += self.offset_pattern
        return np.clip(np.rint(signal), 0, (1 << self.bits) - 1).astype(np.uint32)

    def record(self, measurement: Measurement, generator: np.random.Generator) -> Recording:
        """What a camera with this detector writes of what an ideal detector measured.

        Parameters
        ----------
        measurement : Measurement
            Frames without noise, such as those of `Camera.measure`.
        generator : numpy.random.Generator
            Where the noise comes from.

        Returns
        -------
        Recording
            Counts, with the camera's band, pitch and integration time.
        """
        time = measurement.data.attrs.get("integration_time")
        return Recording(
            signal=self.counts(measurement.radiance, generator),
            quantity="counts",
            times=measurement.times,
            camera="chipglow",
            integration_time=None if time is None else float(time),
            saturation=float(self.saturation),
            band=measurement.band,
            pitch=measurement.raster.spacing,
        )


def _expect(condition: bool, name: str, value: object, expected: str) -> None:
    if not condition:
        raise ValueError(f"detector: {name} is {value!r}, expected {expected}")
