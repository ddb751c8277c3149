"""The measurement error across the shear band's middle (the paper's Figure 11b)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error import ErrorImages
from chipglow.analysis.lines import Line, sample
from chipglow.analysis.rake import share
from chipglow.analysis.shear_band import ShearBand


@dataclass(frozen=True)
class BandErrors:
    """Measurement error across the shear band, in K of radiance temperature.

    Parameters
    ----------
    line : Line
        Across the band's middle; the distance in m is 0 on the ridge, negative on the workpiece's
        side, positive in the chip.
    case_1, psf_portion : ndarray
        On the line, with everything and the point spread function's part of it.
    """

    line: Line
    case_1: NDArray[np.float64]
    psf_portion: NDArray[np.float64]

    @property
    def error(self) -> float:
        """Error at the centre of the band in K: the paper's headline figure."""
        return float(self.case_1[self._centre])

    @property
    def psf_error(self) -> float:
        """The part of `error` that the point spread function makes, in K."""
        return float(self.psf_portion[self._centre])

    @property
    def psf_share(self) -> float:
        """The part of `error` that the point spread function makes, of 1; NaN for no error."""
        return share(self.psf_error, self.error)

    @property
    def beside(self) -> tuple[float, float]:
        """Most negative error on the workpiece's and on the chip's side in K."""
        centre = self._centre
        return float(np.nanmin(self.case_1[: centre + 1])), float(np.nanmin(self.case_1[centre:]))

    @property
    def worst(self) -> float:
        """The most negative error on either side in K."""
        return min(self.beside)

    @property
    def _centre(self) -> int:
        return int(np.argmin(np.abs(self.line.distance)))


def band_errors(
    errors: ErrorImages, band: ShearBand, half_length: float, step: float
) -> BandErrors:
    """Errors across the shear band's middle.

    Parameters
    ----------
    errors : ErrorImages
        Error images.
    band : ShearBand
        The band at the same exposure.
    half_length : float
        Reach of the line to either side of the ridge in m.
    step : float
        Distance between the points of the line in m.
    """
    line = band.across(half_length, step)
    return BandErrors(
        line=line,
        case_1=sample(errors.case_1, errors.raster, line.points),
        psf_portion=sample(errors.psf_portion, errors.raster, line.points),
    )
