"""The headline errors drawn anew: over segments, textures and positions of the pixels.

Where the pixels lie on the features, how the emissivity happens to vary there and which segment is
looked at are chance in every experiment: one frame is one draw. A detector's noise is another in
each of them, and counts to what the pixel phases make.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, count
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.band_error import BandErrors, band_errors
from chipglow.analysis.distribution import Distribution, ratio
from chipglow.analysis.error_images import ErrorImages, ReferenceKind, error_images
from chipglow.analysis.local_error import LocalError
from chipglow.analysis.rake_error import RakeErrors, rake_errors
from chipglow.camera import Camera, Exposure
from chipglow.laboratory.chip import ShearBand
from chipglow.radiometry import Band
from chipglow.scene import Line, Tool, sample
from chipglow.scene.lines import nearest

Errors = TypeVar("Errors")

CAUSES: Final = ("segment", "texture", "pixel phase")
"""What is drawn anew: the axes of every `Distribution` of a study."""

RAKE_READINGS: Final[Mapping[str, Callable[[RakeErrors], LocalError]]] = {
    "rake": lambda rake: rake.face,
    "rake_extremum": lambda rake: rake.extremum,
    "rake_mean": lambda rake: rake.along_contact,
}
"""What is read at the rake face."""

BAND_READINGS: Final[Mapping[str, Callable[[BandErrors], LocalError]]] = {
    "band": lambda band: band.centre,
    "band_measured": lambda band: band.measured_centre,
    "band_worst": lambda band: band.worst,
}
"""What is read at the shear band."""


@dataclass(frozen=True, eq=False)
class Headline:
    """One headline error over all draws, in K of radiance temperature.

    Parameters
    ----------
    error : Distribution
        With everything: the paper's case 1.
    psf_portion : Distribution
        The part of it that the point spread function makes.
    """

    error: Distribution
    psf_portion: Distribution

    @property
    def psf_fraction(self) -> Distribution | None:
        """The point spread function's part, of 1, draw by draw.

        None where some draws of the error are negative and some are not: near 0 a part of it says
        nothing.
        """
        low, high = self.error.range
        return None if low <= 0 <= high else ratio(self.psf_portion, self.error)


@dataclass(frozen=True, eq=False)
class LineDraws:
    """Errors along one analysis line over all draws, in K of radiance temperature.

    Parameters
    ----------
    distance : ndarray
        As that of the line in m, shape (n,).
    case_1, psf_portion : ndarray
        With everything, and the point spread function's part of it; shape (segment, texture,
        pixel phase, n); NaN off the image.
    scene : ndarray
        Radiance temperature of the scene's samples in the middle of the exposure in K, shape
        (segment, texture, n).
    motion : ndarray
        Error that the motion during the exposure alone makes at the line's middle, without
        footprint and point spread function; shape (segment, texture).
    """

    distance: NDArray[np.float64]
    case_1: NDArray[np.float64]
    psf_portion: NDArray[np.float64]
    scene: NDArray[np.float64]
    motion: NDArray[np.float64]

    def mean_change(self, near: float, far: float) -> float:
        """Mean change of the scene's radiance temperature in K between two distances in m."""
        ends = [np.interp([near, far], self.distance, line) for line in self._scene_lines]
        return float(np.mean([last - first for first, last in ends]))

    def mean_steepest(self, length: float) -> float:
        """Greatest change of the scene's radiance temperature in K over a length in m: mean."""
        changes = [
            np.nanmax(np.abs(np.interp(self.distance + length, self.distance, line) - line))
            for line in self._scene_lines
        ]
        return float(np.mean(changes))

    @property
    def _scene_lines(self) -> NDArray[np.float64]:
        return self.scene.reshape(-1, self.distance.size)


@dataclass(frozen=True, eq=False)
class Draws:
    """The errors of a study over segments, textures and positions of the pixels.

    Parameters
    ----------
    headlines : mapping
        By the names of `RAKE_READINGS` and `BAND_READINGS`; without those that the image does not
        show in every draw.
    rake_line, band_line : LineDraws
        Across the rake face and the shear band.
    """

    headlines: Mapping[str, Headline]
    rake_line: LineDraws
    band_line: LineDraws


@dataclass(frozen=True)
class Site:
    """Where the errors of one segment are read, on the exposures of one texture.

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

    def rake_errors(self, errors: ErrorImages) -> RakeErrors:
        """Errors at the rake face in the error images of `rake_exposure`."""
        return rake_errors(errors, self.contact_length, self.tool, self.half_length, self.step)

    def band_errors(self, errors: ErrorImages) -> BandErrors:
        """Errors at the shear band in the error images of `band_exposure`."""
        return band_errors(errors, self.band, self.half_length, self.step)


def pixel_phases(camera: Camera, count: int) -> list[Camera]:
    """The camera with its pixels at other places of the scene, spread evenly over a pixel.

    Parameters
    ----------
    camera : Camera
        The camera; the first phase is its own.
    count : int
        Places along each axis: `count`² cameras, each with as many whole pixels as fit the scene.
    """
    right, down = camera.offset
    steps = camera.pitch * np.arange(count) / count
    return [
        replace(camera, shape=None, offset=(right + float(x), down + float(y)))
        for y in steps
        for x in steps
    ]


def draw_errors(
    camera: Camera,
    sites: Sequence[Sequence[Site]],
    phases: int,
    progress: Callable[[float], None],
) -> Draws:
    """Form the images of every exposure anew at every phase of the pixels, and read the errors.

    Parameters
    ----------
    camera : Camera
        The camera.
    sites : sequence of sequence of Site
        For every segment, one for each texture.
    phases : int
        Positions of the pixels along each axis, see `pixel_phases`.
    progress : callable
        Called with how much is done, 0 to 1.
    """
    cameras = pixel_phases(camera, phases)
    rake: list[RakeErrors] = []
    band: list[BandErrors] = []
    number = count()
    for i, segment in enumerate(sites):
        for site in segment:
            for one in cameras:
                of_rake, of_band = (one.redrawn(next(number)) for _ in range(2))
                rake.append(
                    site.rake_errors(error_images(of_rake, site.rake_exposure, site.reference))
                )
                band.append(
                    site.band_errors(error_images(of_band, site.band_exposure, site.reference))
                )
        progress((i + 1) / len(sites))
    shape = (len(sites), len(sites[0]), len(cameras))
    exposed = [[site.rake_exposure for site in segment] for segment in sites]
    rake_line = _line_draws(camera.band, rake, shape, exposed, _inside_chip(sites[0][0]))
    exposed = [[site.band_exposure for site in segment] for segment in sites]
    return Draws(
        headlines=_headlines(rake, RAKE_READINGS, shape) | _headlines(band, BAND_READINGS, shape),
        rake_line=rake_line,
        band_line=_line_draws(camera.band, band, shape, exposed, 0.0),
    )


def _inside_chip(site: Site) -> float:
    """Distance from the rake face in m at which a sample shows the chip alone."""
    return 1.5 * site.rake_exposure.raster.spacing


def _headlines(
    errors: Sequence[Errors],
    readings: Mapping[str, Callable[[Errors], LocalError]],
    shape: tuple[int, int, int],
) -> dict[str, Headline]:
    headlines = {}
    for name, read in readings.items():
        found = [read(one) for one in errors]
        error = np.array([reading.error for reading in found]).reshape(shape)
        portion = np.array([reading.psf_portion for reading in found]).reshape(shape)
        if np.isfinite(error).all() and np.isfinite(portion).all():
            headlines[name] = Headline(Distribution(error, CAUSES), Distribution(portion, CAUSES))
    return headlines


def _line_draws(
    band: Band,
    errors: Sequence[RakeErrors] | Sequence[BandErrors],
    shape: tuple[int, int, int],
    exposures: Sequence[Sequence[Exposure]],
    place: float,
) -> LineDraws:
    """Lines of all draws; `errors` come phase by phase, the motion is read at `place` in m."""
    lines = [one.line for one in errors[:: shape[2]]]
    of_line = list(zip(chain.from_iterable(exposures), lines, strict=True))
    scene = [
        sample(band.temperature(exposure.centre_radiance), exposure.raster, line.points)
        for exposure, line in of_line
    ]
    motion = [_motion(band, exposure, line, place) for exposure, line in of_line]
    distance = lines[0].distance
    return LineDraws(
        distance=distance,
        case_1=np.array([one.case_1 for one in errors]).reshape(*shape, -1),
        psf_portion=np.array([one.psf_portion for one in errors]).reshape(*shape, -1),
        scene=np.array(scene).reshape(*shape[:2], -1),
        motion=np.array(motion).reshape(shape[:2]),
    )


def _motion(band: Band, exposure: Exposure, line: Line, place: float) -> float:
    """Mean over the exposure less its peak, as radiance temperatures, at one sample."""
    point = line.points[np.argmin(np.abs(line.distance - place))]
    mean = nearest(exposure.mean_radiance, exposure.raster, point)
    peak = nearest(exposure.peak_radiance, exposure.raster, point)
    return float(band.temperature(mean)) - float(band.temperature(peak))
