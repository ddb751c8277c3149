"""The detector: from in-band radiance to electrons and counts, with noise and a limited range."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Annotated, Any, ClassVar, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.detector.response import (
    RESPONSES,
    DetectorResponse,
    OperationPoint,
    RangeResponse,
    in_tables,
)
from chipglow.camera.detector.terms import DETECTOR_TERMS, DetectorTerm, Readout, Stage
from chipglow.camera.measurement import Measurement
from chipglow.camera.recording import Recording
from chipglow.quantities import Array, Parameter, Part
from chipglow.quantities.units import HOTTEST

Correction: TypeAlias = Literal["two-point", "one-point", "none"]
"""Non-uniformity correction: by frames of two flat-field sources, of one, or none."""

NETD, AT = "netd", "netd_temperature"
"""Keys of the short form: the noise of a data sheet, and the blackbody for which it is stated."""

DARKER_SOURCE: Final = 0.1
"""Fraction of the capacity that the darker source of the correction fills, if none is named."""

BRIGHTER_SOURCE: Final = 0.8
"""Fraction that the brighter source fills, likewise."""


@dataclass(frozen=True, kw_only=True)
class Detector(Part):
    """A detector, its digitiser, and its non-uniformity correction.

    Light makes electrons by the `response`. The `terms` change them in the order of their `Stage`:
    light, dark, charge; then the full well limits them; transfer, read-out; then they are
    counts, offset + gain × electrons, rounded to whole ones between 0 and 2^bits − 1.
    """

    response: Annotated[DetectorResponse, RESPONSES, Parameter("Electrons that light makes.")]
    full_well: Annotated[
        float | None,
        Parameter("Electrons that an element holds; none: as many as the digitiser.", over=0.0),
    ] = None
    gain: Annotated[
        float | None,
        Parameter(
            "Counts of one electron (DN/e-); none: the full well fills the digitiser, or 1 if only "
            "the measuring range is known.",
            over=0.0,
        ),
    ] = None
    offset: Annotated[float, Parameter("Counts without electrons.", least=0.0)] = 400.0
    bits: Annotated[int, Parameter("Bits of the digitiser.", least=1, most=32)] = 12
    terms: Annotated[
        tuple[Annotated[DetectorTerm, DETECTOR_TERMS], ...],
        Parameter("Other effects, a list; each acts at its stage between light and counts."),
    ] = ()
    correction: Annotated[
        Correction, Parameter("Non-uniformity correction: two-point, one-point or none.")
    ] = "two-point"
    frames: Annotated[int, Parameter("Frames of each source for that.", least=2, most=10_000)] = 32
    cold: Annotated[
        float | None, in_tables("The darker source, a blackbody; none: what fills a tenth.")
    ] = None
    hot: Annotated[
        float | None, in_tables("The brighter source; none: what fills eight tenths.")
    ] = None
    least_signal: Annotated[
        float,
        Parameter(
            "Signal at the lower range limit, in standard deviations of its noise, if the limit "
            "is the detector's.",
            over=0.0,
        ),
    ] = 10.0
    seed: Annotated[
        int, Parameter("Seed of the patterns and of the frames of the correction.", least=0)
    ] = 1
    digitises: ClassVar[bool] = True
    """Whether full well and digitiser limit and round the signal."""

    def __post_init__(self) -> None:
        super().__post_init__()
        kinds = [term.kind for term in self.terms]
        for kind in kinds:
            if kinds.count(kind) > 1:
                raise ValueError(f"Detector.terms: two are of kind {kind!r}, expected one of each")
        if self.offset >= self._top:
            raise ValueError(
                f"Detector.offset: {self.offset:g}, expected less than the {self._top} of "
                f"{self.bits} bits"
            )
        counted = isinstance(self.response, RangeResponse) or self.gain or self.full_well
        if not counted:
            raise ValueError("Detector: gain or full_well is required")
        if self.cold is not None and self.hot is not None and not self.cold < self.hot:
            raise ValueError(
                f"Detector.hot: {self.hot:g} K, expected more than the {self.cold:g} K of cold"
            )

    @classmethod
    def completed(cls, data: Any) -> Any:
        """Return the data, a stated NETD as a term, without limits of range if none is stated."""
        if not isinstance(data, Mapping) or NETD not in data:
            return data
        stated = {key: value for key, value in data.items() if key not in (NETD, AT)}
        term = {"kind": "netd", "netd": data[NETD]}
        if AT in data:
            term["temperature"] = data[AT]
        if "response" not in stated:
            stated |= {"response": {"kind": "range", "hottest": f"{HOTTEST:g} K"}, "bits": 32}
        terms = stated.get("terms", ())
        if not isinstance(terms, list | tuple):
            return stated  # which its field refuses
        return {**stated, "terms": [*terms, term]}

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> Any:
        section = super().__get_pydantic_json_schema__(schema, handler)
        short = {"properties": {NETD: {"type": "string"}}, "required": [NETD], "type": "object"}
        return {"anyOf": [section, short]}

    @property
    def conversion_gain(self) -> float:
        """Counts of one electron (DN/e-)."""
        if self.gain is not None:
            return self.gain
        return 1.0 if self.full_well is None else (self._top - self.offset) / self.full_well

    @property
    def capacity(self) -> float:
        """Electrons that fill the well or, if they come before, the digitiser."""
        digitised = (self._top - self.offset) / self.conversion_gain
        return digitised if self.full_well is None else min(self.full_well, digitised)

    @property
    def saturation(self) -> int:
        """The largest count that is not saturated, if elements do not differ."""
        full = self.offset + self.conversion_gain * self.capacity
        return min(self._top, round(full)) - 1

    def per_radiance(self, point: OperationPoint) -> float:
        """Return the electrons that 1 W/(m² sr) makes in an element in one frame."""
        return self.response.electrons(point, self.capacity)

    def counts(
        self,
        radiance: NDArray[np.floating],
        generator: np.random.Generator | Sequence[np.random.Generator],
        point: OperationPoint | None = None,
        times: Array | None = None,
    ) -> NDArray[np.uint32] | Array:
        """Return counts of frames of in-band radiance in W/(m² sr), shape (time, y, x).

        `generator` makes the noise of all frames, or one each; `times` are starts of integration in
        s. The paper's operation point, and frames at the frame rate, by default.
        """
        point, count = point or OperationPoint(), len(radiance)
        if isinstance(generator, np.random.Generator):
            generator = [generator] * count
        if times is None:
            times = np.arange(count, dtype=np.float64) * point.frame_time
        keys = [int(one.integers(2**63)) for one in generator]
        per_radiance = self.per_radiance(point)
        readout = partial(Readout, times, point, per_radiance, self.capacity, keys, self.seed)
        electrons = per_radiance * np.asarray(radiance, np.float64)
        for stage in Stage:
            if stage == Stage.TRANSFER and self.full_well is not None and self.digitises:
                electrons = np.minimum(electrons, self.full_well)
            for term in self.terms:
                if term.stage == stage:
                    electrons = term.apply(electrons, readout(term.kind))
        signal = self.offset + self.conversion_gain * electrons
        if not self.digitises:
            return signal
        return np.clip(np.rint(signal), 0, self._top).astype(np.uint32)

    def record(self, measurement: Measurement, generator: np.random.Generator) -> Recording:
        """Return the recording that a camera with this detector writes of an ideal measurement."""
        attributes = measurement.data.attrs
        if "detector" in attributes:
            raise ValueError("detector: the measurement already contains one")
        known = {
            name: float(attributes[name])
            for name in ("integration_time", "frame_rate", "fill_factor")
            if name in attributes
        }
        point = OperationPoint(band=measurement.band, **known)
        return Recording(
            signal=self.counts(measurement.radiance, generator, point, measurement.times),
            quantity="counts",
            times=measurement.times,
            camera="chipglow",
            integration_time=known.get("integration_time"),
            saturation=float(self.saturation),
            band=measurement.band,
            pitch=measurement.raster.spacing,
        )

    def undigitised(self) -> "Detector":
        """Return the detector without the limits and rounding of full well and digitiser."""
        return _Undigitised(**{one.name: getattr(self, one.name) for one in fields(self)})

    @property
    def _top(self) -> int:
        return (1 << self.bits) - 1


@dataclass(frozen=True, kw_only=True)
class _Undigitised(Detector):
    """A detector whose signal is neither limited nor rounded."""

    digitises: ClassVar[bool] = False
