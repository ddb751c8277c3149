"""Contents of a camera file, before calibration."""

from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array, Brief, Parameter, Part
from chipglow.quantities.units import LENGTH, TIME
from chipglow.radiometry import Band, ObjectParameters
from chipglow.text import Notes

SignalKind: TypeAlias = Literal["counts", "radiance", "temperature"]
QUANTITIES: Final = ("counts", "radiance", "temperature")


@dataclass(frozen=True)
class PlanckConversion:
    """A factory conversion between counts S and the temperature of a blackbody in K.

    T = b / ln(r1 / (r2 (S + o)) + f); r1, r2 and b (in K) are positive.
    """

    r1: float
    r2: float
    b: float
    f: float
    o: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            possible = np.isfinite(value) and (value > 0 or name in ("f", "o"))
            if not possible:
                raise ValueError(f"Planck conversion: {name} must be positive, not {value!r}")

    def temperature(self, counts: NDArray[Any]) -> Array:
        """Return the temperature in K of a blackbody with these counts; NaN if undefined."""
        signal = np.asarray(counts, np.float64) + self.o
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(self.r1 / (self.r2 * signal) + self.f)
            temperature = self.b / logarithm
        return np.where((signal > 0) & (logarithm > 0), temperature, np.nan)


@dataclass(frozen=True, kw_only=True)
class MeasuringRange(Part):
    """Setting of a camera for which its counts have one meaning."""

    integration_time: Annotated[
        float | None, Parameter("Integration time; none: not stated.", TIME)
    ] = None
    range: Annotated[
        str | None, Parameter("Measuring range of the camera by its name; none: not stated.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class RecordingSettings(MeasuringRange):
    """Statements on a `Recording`, of its file or of who describes it."""

    camera: Annotated[
        str | None, Parameter("Name of the camera, for readers; none: not stated.")
    ] = None
    pitch: Annotated[
        float | None, Parameter("Distance between pixels on the object; none: not stated.", LENGTH)
    ] = None
    fill_factor: Annotated[
        float | None,
        Parameter(
            "Portion of a pixel's square that takes light; none: not stated, 1 is assumed for an "
            "edge.",
            over=0.0,
            most=1.0,
        ),
    ] = None
    saturation: Annotated[
        float | None,
        Parameter("Largest number in the file that is not saturated; none: not stated."),
    ] = None


@dataclass(frozen=True, repr=False)
class Recording(Brief, RecordingSettings):
    """Frames as a camera wrote them."""

    signal: NDArray[Any]
    """Frames, shape (time, y, x), of any real type; row 0 at the top."""
    quantity: SignalKind
    """Quantity of `signal`: counts, in-band radiance in W/(m² sr), or temperature in K as computed
    by the camera with its object parameters."""
    times: Array
    """Time of each frame in s, shape (time,)."""
    camera: str = field(default="unknown", kw_only=True)
    least_signal: float | None = None
    """Smallest signal within the measuring range."""
    band: Band | None = None
    position: tuple[float, float] | None = None
    """Left and upper edge of the image in m, in coordinates that the file states."""
    stored: str = "y, x"
    """Order of the image's axes in the file; a minus before one whose direction was reversed."""
    conversion: PlanckConversion | None = None
    """Factory conversion of counts."""
    object_parameters: ObjectParameters | None = None
    """Object parameters set in the camera; temperatures depend on them, counts do not."""
    stated_band: Band | None = None
    """Band in the file, whose unit is assumed: it is compared, not used."""
    notes: Notes = field(default_factory=Notes)
    """Assumptions and warnings of reading the file, and its other statements."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.signal.ndim != 3 or 0 in self.signal.shape:
            raise ValueError(
                f"recording: signal must have shape (time, y, x), not {self.signal.shape}"
            )
        if self.quantity not in QUANTITIES:
            raise ValueError(
                f"recording: quantity must be one of {', '.join(QUANTITIES)}, not {self.quantity!r}"
            )
        if self.times.shape != self.signal.shape[:1]:
            raise ValueError(
                f"recording: {self.times.size} times for {len(self.signal)} frames, must be equal"
            )

    def saturated(self) -> NDArray[np.bool_]:
        """Return where the signal is saturated; nowhere if no limit is known."""
        limit = np.inf if self.saturation is None else self.saturation
        return np.asarray(self.signal > limit)

    def under_range(self) -> NDArray[np.bool_]:
        """Return where the signal is below the measuring range; nowhere if no limit is known."""
        limit = -np.inf if self.least_signal is None else self.least_signal
        return np.asarray(self.signal < limit)
