"""The measurement error across the shear band's middle (the paper's Figure 11b)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error_images import ErrorImages
from chipglow.analysis.local_error import LocalError, lowest_near
from chipglow.laboratory.chip import ShearBand
from chipglow.scene import Line, sample


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
    measured : ndarray
        Measured radiance temperature on the line in K.
    pitch : float
        Distance between pixels in m.
    """

    line: Line
    case_1: NDArray[np.float64]
    psf_portion: NDArray[np.float64]
    measured: NDArray[np.float64]
    pitch: float

    @property
    def centre(self) -> LocalError:
        """On the ridge of the strain rate: the paper's figure."""
        return self._at(self._centre)

    @property
    def measured_centre(self) -> LocalError:
        """Where the measured temperature is greatest within two pixels of the ridge.

        A camera shows no strain rate: there somebody who has the image alone sees the centre.
        """
        return self._at(lowest_near(self.line, -self.measured, self.pitch))

    @property
    def beside(self) -> tuple[float, float]:
        """Most negative error on the workpiece's and on the chip's side in K."""
        centre = self._centre
        return float(np.nanmin(self.case_1[: centre + 1])), float(np.nanmin(self.case_1[centre:]))

    @property
    def worst(self) -> LocalError:
        """The most negative error on either side."""
        return self._at(int(np.nanargmin(self.case_1)))

    @property
    def _centre(self) -> int:
        return int(np.argmin(np.abs(self.line.distance)))

    def _at(self, index: int) -> LocalError:
        return LocalError(float(self.case_1[index]), float(self.psf_portion[index]))


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
        measured=sample(errors.measured, errors.raster, line.points),
        pitch=errors.raster.spacing,
    )
