"""How the headline errors depend on the width of the point spread function."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.draws import BAND_READINGS, RAKE_READINGS, Site, pixel_phases
from chipglow.analysis.error_images import Unblurred
from chipglow.analysis.local_error import LocalError
from chipglow.camera import Camera, GaussianPSF, blur

PsfOrder: TypeAlias = Literal["detector", "optics"]
PSF_ORDERS: Final[tuple[PsfOrder, ...]] = ("detector", "optics")
"""Where the point spread function acts: on the pixels' grid as in the paper, or before them."""


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Headline errors against the width of a Gaussian point spread function, for one order.

    Parameters
    ----------
    psf_order : {"detector", "optics"}
        Where the point spread function acts.
    widths : ndarray
        Full widths at half maximum in m, shape (n,).
    errors, psf_portions : mapping
        Errors in K of radiance temperature and the point spread function's part of them, by the
        names of `RAKE_READINGS` and `BAND_READINGS`; each over all segments and pixel phases, with
        one texture: shape (n, segments × phases).
    """

    psf_order: PsfOrder
    widths: NDArray[np.float64]
    errors: Mapping[str, NDArray[np.float64]]
    psf_portions: Mapping[str, NDArray[np.float64]]

    def error(self, name: str) -> NDArray[np.float64]:
        """Mean error over the draws in K, shape (n,)."""
        return np.asarray(self.errors[name].mean(axis=1))

    def psf_fraction(self, name: str) -> NDArray[np.float64]:
        """Mean over the draws of the point spread function's part, of 1, shape (n,)."""
        return np.asarray((self.psf_portions[name] / self.errors[name]).mean(axis=1))


def sensitivity(
    camera: Camera,
    sites: Sequence[Site],
    widths: Sequence[float],
    phases: int,
    progress: Callable[[float], None],
) -> tuple[Sensitivity, ...]:
    """Headline errors with Gaussian point spread functions of several widths, in either order.

    Parameters
    ----------
    camera : Camera
        The camera, whose point spread function and its order are replaced.
    sites : sequence of Site
        Where the errors are read, one for every segment.
    widths : sequence of float
        Full widths at half maximum in m.
    phases : int
        Positions of the pixels along each axis, see `pixel_phases`.
    progress : callable
        Called with how much is done, 0 to 1.
    """
    found: dict[PsfOrder, list[list[dict[str, LocalError]]]] = {order: [] for order in PSF_ORDERS}
    number = count()
    for i, site in enumerate(sites):
        places = [
            _Place.of(one.redrawn(next(number)), one.redrawn(next(number)), site)
            for one in pixel_phases(camera, phases)
        ]
        for psf in (GaussianPSF(width) for width in widths):
            found["detector"].append([place.blurred_on_pixels(psf) for place in places])
            blurred = [
                blur(one.mean_radiance, psf, one.raster.spacing)
                for one in (site.rake_exposure, site.band_exposure)
            ]
            found["optics"].append([place.ideal(*blurred) for place in places])
        progress((i + 1) / len(sites))
    return tuple(_gathered(order, widths, found[order], len(sites)) for order in PSF_ORDERS)


@dataclass(frozen=True)
class _Place:
    """One position of the pixels on both exposures of a site."""

    site: Site
    rake: Unblurred
    band: Unblurred

    @classmethod
    def of(cls, rake_camera: Camera, band_camera: Camera, site: Site) -> "_Place":
        rake, band = (
            Unblurred.of(replace(camera, psf=None), exposure, site.reference)
            for camera, exposure in (
                (rake_camera, site.rake_exposure),
                (band_camera, site.band_exposure),
            )
        )
        return cls(site, rake, band)

    def blurred_on_pixels(self, psf: GaussianPSF) -> dict[str, LocalError]:
        """Readings of a camera whose point spread function acts from pixel to pixel."""
        camera = replace(self.rake.camera, psf=psf, psf_order="detector")
        exposures = self.site.rake_exposure, self.site.band_exposure
        return self._readings(camera, *(one.mean_radiance for one in exposures))

    def ideal(self, rake: NDArray[np.float64], band: NDArray[np.float64]) -> dict[str, LocalError]:
        """Readings of a camera without point spread function, on blurred radiance."""
        return self._readings(self.rake.camera, rake, band)

    def _readings(
        self, camera: Camera, rake: NDArray[np.float64], band: NDArray[np.float64]
    ) -> dict[str, LocalError]:
        """Readings on radiance of the scene's samples at the rake face and in the band."""
        site = self.site
        rake_image = camera.form_image(rake, site.rake_exposure.raster)
        band_image = camera.form_image(band, site.band_exposure.raster)
        rake_errors = site.rake_errors(self.rake.errors(rake_image))
        band_errors = site.band_errors(self.band.errors(band_image))
        return {
            **{name: read(rake_errors) for name, read in RAKE_READINGS.items()},
            **{name: read(band_errors) for name, read in BAND_READINGS.items()},
        }


def _gathered(
    order: PsfOrder,
    widths: Sequence[float],
    found: Sequence[Sequence[Mapping[str, LocalError]]],
    segments: int,
) -> Sensitivity:
    """Readings of every segment and width, and in each of every phase, as arrays by name."""

    def values(read: Callable[[LocalError], float], name: str) -> NDArray[np.float64]:
        rows = np.array([[read(phase[name]) for phase in row] for row in found])
        by_segment = rows.reshape(segments, len(widths), -1)
        return np.moveaxis(by_segment, 0, 1).reshape(len(widths), -1)

    names = list(found[0][0])
    return Sensitivity(
        psf_order=order,
        widths=np.asarray(widths, dtype=np.float64),
        errors={name: values(lambda reading: reading.error, name) for name in names},
        psf_portions={name: values(lambda reading: reading.psf_portion, name) for name in names},
    )
