"""What a real camera's file holds, before a calibration makes a measurement of it."""

from dataclasses import dataclass, field
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.radiometry import Band, ObjectParameters
from chipglow.text import Notes

Quantity: TypeAlias = Literal["counts", "radiance", "temperature"]
QUANTITIES: Final = ("counts", "radiance", "temperature")


@dataclass(frozen=True)
class PlanckConversion:
    """A factory conversion between counts and the temperature of a blackbody.

    T = b / ln(r1 / (r2 (S + o)) + f): counts S, temperature T in K.

    Parameters
    ----------
    r1, r2, b, f, o : float
        The maker's constants; b in K.

    Raises
    ------
    ValueError
        If r1, r2 or b is not positive, or a constant is not finite.
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

    def temperature(self, counts: NDArray[Any]) -> NDArray[np.float64]:
        """Temperature in K of the blackbody that gives these counts; NaN where there is none."""
        signal = np.asarray(counts, np.float64) + self.o
        with np.errstate(divide="ignore", invalid="ignore"):
            logarithm = np.log(self.r1 / (self.r2 * signal) + self.f)
            temperature = self.b / logarithm
        return np.where((signal > 0) & (logarithm > 0), temperature, np.nan)


@dataclass(frozen=True)
class Recording:
    """Frames as a camera wrote them.

    Parameters
    ----------
    signal : ndarray
        Frames, shape (time, y, x), of any real type; row 0 at the top.
    quantity : {"counts", "radiance", "temperature"}
        What the numbers are: counts of the detector, in-band radiance in W/(m² sr), or temperature
        in K. Radiance and temperature are as the file has them: its object parameters included.
    times : ndarray
        When each frame was taken in s, shape (time,).
    camera : str
        Which camera, for people.
    integration_time : float, optional
        In s.
    saturation : float, optional
        The greatest signal that is not saturated.
    band : Band, optional
        The camera's band.
    pitch : float, optional
        Distance between pixels on the object in m.
    conversion : PlanckConversion, optional
        The factory conversion of counts.
    object_parameters : ObjectParameters, optional
        What was set in the camera of the object. Temperatures were computed with them; counts do
        not depend on them.
    range_name : str, optional
        The measuring range that was chosen, as the maker calls it.
    fill_factor : float, optional
        Portion of a pixel's square that takes light.
    notes : Notes
        Assumptions and warnings of reading the file, and what else the file states.

    Raises
    ------
    ValueError
        If shapes do not fit or a value is impossible.
    """

    signal: NDArray[Any]
    quantity: Quantity
    times: NDArray[np.float64]
    camera: str
    integration_time: float | None = None
    saturation: float | None = None
    band: Band | None = None
    pitch: float | None = None
    conversion: PlanckConversion | None = None
    object_parameters: ObjectParameters | None = None
    range_name: str | None = None
    fill_factor: float | None = None
    notes: Notes = field(default_factory=Notes)

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
