"""The detector: from in-band radiance to counts, with noise, fixed pattern and a limited range."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector.terms import DeadElements, DetectorTerm, FixedPattern, ReadNoise
from chipglow.camera.measurement import Measurement
from chipglow.camera.recording import Recording
from chipglow.quantities import Parameter, Part


@dataclass(frozen=True)
class Detector(Part):
    """A photon detector and its digitiser.

    An element's mean signal is gain times radiance plus offset, in counts (DN). The terms
    change it and add their noise, which is normal, in one draw. The sum is rounded to whole counts
    and ends at the digitiser's limits. `terms` are the effects of the detector; by default a read
    noise of two counts.
    """

    gain: Annotated[float, Parameter("Counts per W/(m² sr).", over=0.0)]
    offset: Annotated[float, Parameter("Counts without light.")] = 400.0
    bits: Annotated[int, Parameter("Bits of the digitiser.", least=1, most=32)] = 12
    terms: tuple[DetectorTerm, ...] = (ReadNoise(),)

    @property
    def saturation(self) -> int:
        """The greatest count that is not saturated: one under the digitiser's limit."""
        return (1 << self.bits) - 2

    def with_pattern(
        self,
        shape: tuple[int, int],
        gain_spread: float,
        offset_spread: float,
        dead_fraction: float,
        generator: np.random.Generator,
    ) -> "Detector":
        """The same detector with detector elements that differ.

        Parameters
        ----------
        shape : tuple of int
            Rows and columns.
        gain_spread : float
            Standard deviation of the elements' gains, as a fraction of the mean gain.
        offset_spread : float
            Standard deviation of their offsets in counts.
        dead_fraction : float
            Fraction of dead elements, 0 to 1.
        generator : numpy.random.Generator
            Where the random numbers come from.
        """
        pattern = FixedPattern(
            1.0 + gain_spread * generator.standard_normal(shape),
            offset_spread * generator.standard_normal(shape),
        )
        dead = DeadElements(generator.random(shape) < dead_fraction)
        return replace(self, terms=(*self.terms, pattern, dead))

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
        light = self.gain * np.asarray(radiance, np.float64)
        for term in self.terms:
            light = term.light(light)
        variance = sum((term.variance(light) for term in self.terms), start=np.zeros(1))
        signal = self.offset + light + np.sqrt(variance) * generator.standard_normal(radiance.shape)
        for term in self.terms:
            signal = signal + term.offset(signal.shape)
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
