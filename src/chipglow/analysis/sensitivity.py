"""How the headline errors depend on the width of the point spread function."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.error import ReferenceKind, error_images
from chipglow.analysis.rake import RakeErrors, rake_errors
from chipglow.analysis.shear_band import ShearBand
from chipglow.camera import Camera, Exposure, GaussianPSF
from chipglow.scene import Tool

PsfOrder: TypeAlias = Literal["sensor", "optics"]
PSF_ORDERS: Final[tuple[PsfOrder, ...]] = ("sensor", "optics")
"""Where the point spread function acts: on the sensors' grid as in the paper, or before them."""


@dataclass(frozen=True)
class Sensitivity:
    """Headline errors against the width of a Gaussian point spread function, for one order.

    Parameters
    ----------
    psf_order : {"sensor", "optics"}
        Where the point spread function acts.
    widths : ndarray
        Full widths at half maximum in m, shape (n,).
    rake_error, rake_share : ndarray
        Error at the rake face at mid-contact in K and the point spread function's part of it.
    rake_mean_error : ndarray
        Mean error along the contact in K.
    band_error, band_share : ndarray
        Error at the centre of the shear band in K and the point spread function's part of it.
    band_worst : ndarray
        Most negative error beside the centre of the shear band in K.
    """

    psf_order: PsfOrder
    widths: NDArray[np.float64]
    rake_error: NDArray[np.float64]
    rake_share: NDArray[np.float64]
    rake_mean_error: NDArray[np.float64]
    band_error: NDArray[np.float64]
    band_share: NDArray[np.float64]
    band_worst: NDArray[np.float64]


@dataclass(frozen=True)
class Setting:
    """Where the headline errors are read: two exposures and the lines on them.

    Parameters
    ----------
    rake_exposure, band_exposure : Exposure
        What the camera received, with the surfaces used at the rake face and at the shear band.
    contact_length : float
        Length of contact in m.
    tool : Tool
        The tool.
    band : ShearBand
        The shear band.
    half_length, step : float
        Reach of the lines to either side and distance between their points in m.
    reference : ReferenceKind
        What the measured temperatures are compared with.
    """

    rake_exposure: Exposure
    band_exposure: Exposure
    contact_length: float
    tool: Tool
    band: ShearBand
    half_length: float
    step: float
    reference: ReferenceKind

    def rake_errors(self, camera: Camera) -> RakeErrors:
        """Errors at the rake face with a camera."""
        errors = error_images(camera, self.rake_exposure, self.reference)
        return rake_errors(errors, self.contact_length, self.tool, self.half_length, self.step)

    def band_errors(self, camera: Camera) -> BandErrors:
        """Errors at the shear band with a camera."""
        errors = error_images(camera, self.band_exposure, self.reference)
        return band_errors(errors, self.band, self.half_length, self.step)


def sensitivity(
    camera: Camera, setting: Setting, widths: Sequence[float], psf_order: PsfOrder
) -> Sensitivity:
    """Headline errors with Gaussian point spread functions of several widths.

    Parameters
    ----------
    camera : Camera
        The camera, whose point spread function is replaced.
    setting : Setting
        Where the errors are read.
    widths : sequence of float
        Full widths at half maximum in m.
    psf_order : {"sensor", "optics"}
        Where the point spread function acts.
    """
    cameras = [replace(camera, psf=GaussianPSF(w), psf_order=psf_order) for w in widths]
    rake = [setting.rake_errors(camera) for camera in cameras]
    band = [setting.band_errors(camera) for camera in cameras]
    return Sensitivity(
        psf_order=psf_order,
        widths=np.asarray(widths, dtype=np.float64),
        rake_error=np.array([line.error for line in rake]),
        rake_share=np.array([line.psf_share for line in rake]),
        rake_mean_error=np.array([line.mean_error for line in rake]),
        band_error=np.array([line.error for line in band]),
        band_share=np.array([line.psf_share for line in band]),
        band_worst=np.array([line.worst for line in band]),
    )
