"""The rake face: how far the chip touches it, and the measurement error along and across it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error import ErrorImages
from chipglow.analysis.lines import Line, nearest, sample, straight_line
from chipglow.analysis.local_error import LocalError, lowest_near
from chipglow.scene import Raster, Tool

_LONGEST_GAP: Final = 12e-6


class NoContactError(ValueError):
    """The chip does not touch the rake face."""


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


def contact_length(
    raster: Raster, workpiece: NDArray[np.bool_], tool: Tool, touching: float
) -> float:
    """Length over which the chip touches the rake face.

    Parameters
    ----------
    raster : Raster
        Where the samples are.
    workpiece : ndarray of bool
        Where there is workpiece or chip, shape (y, x).
    tool : Tool
        The tool.
    touching : float
        Distance from the rake face in m within which chip counts as touching it.

    Returns
    -------
    float
        Length in m from the end of the edge up to the first gap that is longer than two of
        the paper's sensors; 0 if the chip does not touch the rake face there.
    """
    step = raster.spacing / 2
    along = np.arange(0.0, np.hypot(raster.rows, raster.columns) * raster.spacing, step)
    foot = tool.rake_point(along)
    touches = np.zeros(along.size, dtype=np.bool_)
    for height in np.arange(raster.spacing / 4, touching + step, step):
        places = foot + height * np.array(tool.rake_normal)
        touches |= nearest(workpiece, raster, places) == 1
    contacts = along[touches]
    if contacts.size == 0 or contacts[0] > _LONGEST_GAP:
        return 0.0
    gaps = np.diff(contacts) > _LONGEST_GAP
    last = int(gaps.argmax()) if gaps.any() else contacts.size - 1
    return float(contacts[last])


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
