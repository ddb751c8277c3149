"""The rake face: the measurement error along and across it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error_images import ErrorImages
from chipglow.analysis.local_error import LocalError, lowest_near
from chipglow.laboratory.chip import NoContactError
from chipglow.scene import Line, Tool, sample, straight_line


@dataclass(frozen=True)
class RakeErrors:
    """Measurement error at the rake face, in K of radiance temperature.

    Parameters
    ----------
    contact_length : float
        Length of contact of chip and tool in m, up the rake face from the edge.
    line : Line
        Across the rake face at mid-contact; the distance in m is 0 on the face, positive in the
        chip.
    case_1, psf_portion : ndarray
        On the line, with everything and the point spread function's part of it.
    contact : Line
        Along the rake face over the contact; the distance in m counts from the edge.
    contact_case_1, contact_psf_portion : ndarray
        The same along the contact.
    pitch : float
        Distance between pixels in m.
    """

    contact_length: float
    line: Line
    case_1: NDArray[np.float64]
    psf_portion: NDArray[np.float64]
    contact: Line
    contact_case_1: NDArray[np.float64]
    contact_psf_portion: NDArray[np.float64]
    pitch: float

    @property
    def face(self) -> LocalError:
        """On the rake face at mid-contact: the paper's figure."""
        return self._at(int(np.argmin(np.abs(self.line.distance))))

    @property
    def extremum(self) -> LocalError:
        """The most negative error on the line within two pixels of the face."""
        return self._at(lowest_near(self.line, self.case_1, self.pitch))

    @property
    def along_contact(self) -> LocalError:
        """The mean along the contact."""
        return LocalError(
            float(np.nanmean(self.contact_case_1)), float(np.nanmean(self.contact_psf_portion))
        )

    @property
    def contact_range(self) -> tuple[float, float]:
        """Least and greatest error along the contact in K."""
        return float(np.nanmin(self.contact_case_1)), float(np.nanmax(self.contact_case_1))

    def _at(self, index: int) -> LocalError:
        return LocalError(float(self.case_1[index]), float(self.psf_portion[index]))


def rake_errors(
    errors: ErrorImages, contact: float, tool: Tool, half_length: float, step: float
) -> RakeErrors:
    """Errors across the rake face at mid-contact and along the contact.

    Parameters
    ----------
    errors : ErrorImages
        Error images.
    contact : float
        Length of contact in m.
    tool : Tool
        The tool.
    half_length : float
        Reach of the line to either side of the rake face in m.
    step : float
        Distance between the points of the lines in m.

    Raises
    ------
    NoContactError
        If the chip does not touch the rake face.
    """
    if not contact > 0:
        raise NoContactError("rake face: the chip does not touch it, so it has no error there")
    count = round(half_length / step)
    distance = step * np.arange(-count, count + 1)
    line = straight_line(tool.rake_point(contact / 2), tool.rake_normal, distance)
    along = np.linspace(0.0, contact, max(round(contact / step) + 1, 2))
    face = Line(along, tool.rake_point(along))
    images = (errors.case_1, errors.psf_portion)
    on_line = [sample(image, errors.raster, line.points) for image in images]
    on_face = [sample(image, errors.raster, face.points) for image in images]
    return RakeErrors(
        contact_length=contact,
        line=line,
        case_1=on_line[0],
        psf_portion=on_line[1],
        contact=face,
        contact_case_1=on_face[0],
        contact_psf_portion=on_face[1],
        pitch=errors.raster.spacing,
    )
