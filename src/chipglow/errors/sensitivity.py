"""How the headline errors depend on the width of the point spread function."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera, Exposure, GaussianPSF, blur
from chipglow.errors.draws import BAND_READINGS, RAKE_READINGS, Site, pixel_phases
from chipglow.errors.error_images import ErrorImages, Unblurred
from chipglow.errors.local_error import LocalError

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
    for i, site in enumerate(sites):
        places = [_Place.of(one, site) for one in pixel_phases(camera, phases)]
        for psf in (GaussianPSF(width) for width in widths):
            found["detector"].append([place.blurred_on_pixels(psf) for place in places])
            rake, band = _spread(site.rake_exposure, psf), _spread(site.band_exposure, psf)
            found["optics"].append([place.of_exposures(rake, band) for place in places])
        progress((i + 1) / len(sites))
    return tuple(_gathered(order, widths, found[order], len(sites)) for order in PSF_ORDERS)


@dataclass(frozen=True)
class _Place:
    """One position of the pixels on both exposures of a site."""

    site: Site
    rake: Unblurred
    band: Unblurred

    @classmethod
    def of(cls, camera: Camera, site: Site) -> "_Place":
        ideal = replace(camera, psf=None)
        rake, band = (
            Unblurred.of(ideal, exposure, site.reference)
            for exposure in (site.rake_exposure, site.band_exposure)
        )
        return cls(site, rake, band)

    def blurred_on_pixels(self, psf: GaussianPSF) -> dict[str, LocalError]:
        """Readings of a camera whose point spread function acts from pixel to pixel."""
        camera = replace(self.rake.camera, psf=psf, psf_order="detector")
        return self._readings(
            self.rake.errors(camera.form_image(self.site.rake_exposure)),
            self.band.errors(camera.form_image(self.site.band_exposure)),
        )

    def of_exposures(self, rake: Exposure, band: Exposure) -> dict[str, LocalError]:
        """Readings on exposures that are blurred already."""
        return self._readings(
            self.rake.errors(self.rake.camera.form_image(rake)),
            self.band.errors(self.band.camera.form_image(band)),
        )

    def _readings(self, rake: ErrorImages, band: ErrorImages) -> dict[str, LocalError]:
        rake_errors, band_errors = self.site.rake_errors(rake), self.site.band_errors(band)
        return {
            **{name: read(rake_errors) for name, read in RAKE_READINGS.items()},
            **{name: read(band_errors) for name, read in BAND_READINGS.items()},
        }


def _spread(exposure: Exposure, psf: GaussianPSF) -> Exposure:
    """The exposure behind optics with a point spread function."""
    radiance = blur(exposure.mean_radiance, psf, exposure.raster.spacing)
    return replace(exposure, mean_radiance=radiance)


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
