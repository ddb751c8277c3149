"""What is read from error images at one place: the error, and the part that the blur makes."""

from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.scene import Line

NEAR: Final = 2.0
"""Distance in pixels within which an extremum of an image belongs to a place."""


@dataclass(frozen=True)
class LocalError:
    """A measurement error at one place, in K of radiance temperature.

    Parameters
    ----------
    error : float
        With everything: the paper's case 1.
    psf_portion : float
        The part of it that the point spread function makes.
    """

    error: float
    psf_portion: float

    @property
    def psf_fraction(self) -> float:
        """The part of the error that the point spread function makes, of 1; NaN for no error."""
        return self.psf_portion / self.error if self.error else nan


def lowest_near(line: Line, values: NDArray[np.float64], pitch: float) -> int:
    """Number of the lowest value within `NEAR` pixels of where the line's distance is 0.

    Parameters
    ----------
    line : Line
        The line.
    values : ndarray
        On the line, shape (n,); NaN does not count.
    pitch : float
        Distance between pixels in m.
    """
    near = np.abs(line.distance) <= NEAR * pitch
    return int(np.argmin(np.where(near & np.isfinite(values), values, np.inf)))
