"""Contents of a real camera file, before calibration."""

from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.quantities import Array
from chipglow.radiometry import Band, ObjectParameters
from chipglow.text import Notes

Quantity: TypeAlias = Literal["counts", "radiance", "temperature"]
QUANTITIES: Final = ("counts", "radiance", "temperature")


@dataclass(frozen=True)
class PlanckConversion:
    """A factory conversion between counts S and the temperature of a blackbody in K.

    T = b / ln(r1 / (r2 (S + o)) + f); r1, r2 and b, in K, are over 0.
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
                raise ValueError(f"Planck conversion: {name} is {value!r}, expected over 0")

    def temperature(self, counts: NDArray[Any]) -> Array:
        """Return the temperature in K of the blackbody that gives these counts, or NaN."""
        signal = np.asarray(counts, np.float64) + self.o
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(self.r1 / (self.r2 * signal) + self.f)
            temperature = self.b / logarithm
        return np.where((signal > 0) & (logarithm > 0), temperature, np.nan)


@dataclass(frozen=True)
class Recording:
    """Frames as a camera wrote them."""

    signal: NDArray[Any]
    """Frames, shape (time, y, x), of any real type; row 0 at the top."""
    quantity: Quantity
    """Counts, in-band radiance in W/(m² sr) or K, the file's object parameters included."""
    times: Array
    """Time of each frame in s, shape (time,)."""
    camera: str
    """Name of the camera."""
    integration_time: float | None = None
    """In s."""
    saturation: float | None = None
    """The largest signal that is not saturated."""
    band: Band | None = None
    pitch: float | None = None
    """Distance between pixels on the object in m."""
    conversion: PlanckConversion | None = None
    """Factory conversion of counts."""
    object_parameters: ObjectParameters | None = None
    """Those set in the camera; temperatures depend on them, counts do not."""
    range_name: str | None = None
    """Measuring range, as the maker calls it."""
    fill_factor: float | None = None
    """Fraction of a pixel's square that takes light."""
    stated_band: Band | None = None
    """Band that the file states, in a unit that it does not: it is compared, not used."""
    notes: Notes = field(default_factory=Notes)
    """Assumptions and warnings of reading the file, and what else the file states."""

    def __post_init__(self) -> None:
        if self.signal.ndim != 3 or 0 in self.signal.shape:
            raise ValueError(
                f"recording: signal has shape {self.signal.shape}, expected (time, y, x)"
            )
        if self.quantity not in QUANTITIES:
            raise ValueError(
                f"recording: quantity is {self.quantity!r}, expected {', '.join(QUANTITIES)}"
            )
        if self.times.shape != self.signal.shape[:1]:
            raise ValueError(
                f"recording: {self.times.size} times for {len(self.signal)} frames, "
                "expected as many"
            )
        for name in ("integration_time", "pitch"):
            value = getattr(self, name)
            if value is not None and not 0 < value < np.inf:
                raise ValueError(f"recording: {name} is {value!r}, expected over 0, or None")
        if self.fill_factor is not None and not 0 < self.fill_factor <= 1:
            raise ValueError(
                f"recording: fill_factor is {self.fill_factor!r}, expected over 0 to 1, or None"
            )
