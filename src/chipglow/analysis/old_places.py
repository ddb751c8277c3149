"""Where the error is read: points, lines, regions, the rake face, the hottest pixel."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from chipglow.analysis.error_images import ErrorImages
from chipglow.analysis.rake_error import rake_errors
from chipglow.laboratory.chip import ShearBand
from chipglow.scene import Line, Raster, Region, Tool, sample
from chipglow.scene.lines import nearest
from chipglow.scene.regions import Point


@dataclass(frozen=True)
class Reading:
    """What is read from error images at a place, in K of radiance temperature.

    Parameters
    ----------
    reference : float
        What a camera without error would say.
    error : float
        With everything: the paper's case 1.
    psf_portion : float
        The part of it that the point spread function makes.
    """

    reference: float
    error: float
    psf_portion: float


@dataclass(frozen=True)
class Place(ABC):
    """Somewhere in the images, with a name.

    Parameters
    ----------
    name : str
        What the user calls it.

    Raises
    ------
    ValueError
        If the name is empty.
    """

    name: str

    def __post_init__(self) -> None:
        if not self.name.strip():
            raise ValueError("place: the name is empty, expected one such as melt pool")

    @abstractmethod
    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """Readings by what they are; a number is NaN where the images show nothing.

        Parameters
        ----------
        errors : ErrorImages
            Of one exposure.
        """

    def outline(self) -> NDArray[np.float64] | None:
        """Points to draw it, x and y in m, shape (n, 2); None for what is everywhere."""
        return None

    def check_within(self, raster: Raster) -> None:
        """Refuse what the images do not hold.

        Parameters
        ----------
        raster : Raster
            The pixels.

        Raises
        ------
        ValueError
            If a part of the place is outside.
        """
        outline = self.outline()
        if outline is None:
            return
        left, right, bottom, top = raster.extent
        x, y = outline.T
        if x.min() < left or x.max() > right or y.min() < bottom or y.max() > top:
            raise ValueError(
                f"{self.name}: reaches over x {_microns(x)}, y {_microns(y)}, expected within the "
                f"pixels' x {1e6 * left:.4g} to {1e6 * right:.4g} um, y {1e6 * bottom:.4g} to "
                f"{1e6 * top:.4g} um"
            )


@dataclass(frozen=True)
class PointPlace(Place):
    """The pixel that holds a point.

    Parameters
    ----------
    point : tuple
        x and y in m.
    """

    point: Point

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        images = (errors.reference, errors.case_1, errors.psf_portion)
        found = (float(nearest(image, errors.raster, self.point)) for image in images)
        return {"pixel": Reading(*found)}

    def outline(self) -> NDArray[np.float64]:
        """See `Place.outline`."""
        return np.array([self.point])


@dataclass(frozen=True)
class LinePlace(Place):
    """A polyline, read every half pixel.

    Parameters
    ----------
    corners : tuple of tuple
        x and y in m, two or more.

    Raises
    ------
    ValueError
        If there are under two corners, or two that follow are the same.
    """

    corners: tuple[Point, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.corners) < 2:
            raise ValueError(f"{self.name}: has {len(self.corners)} corners, expected 2 or more")
        if not (np.hypot(*np.diff(np.array(self.corners), axis=0).T) > 0).all():
            raise ValueError(f"{self.name}: two corners are the same, expected a line")

    def line(self, pitch: float) -> Line:
        """Points along it, the distance in m from its first corner.

        Parameters
        ----------
        pitch : float
            Distance between pixels in m.
        """
        corners = np.array(self.corners)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
        distance = np.linspace(0.0, along[-1], max(round(2 * along[-1] / pitch), 1) + 1)
        points = [np.interp(distance, along, coordinate) for coordinate in corners.T]
        return Line(distance, np.stack(points, axis=1))

    def profile(self, errors: ErrorImages) -> NDArray[np.float64]:
        """Reference, error and the PSF's portion along it in K, shape (3, n); NaN off the image."""
        points = self.line(errors.raster.spacing).points
        images = (errors.reference, errors.case_1, errors.psf_portion)
        return np.array([sample(image, errors.raster, points) for image in images])

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        return _mean_and_worst(self.profile(errors))

    def outline(self) -> NDArray[np.float64]:
        """See `Place.outline`."""
        return np.array(self.corners)


@dataclass(frozen=True)
class RegionPlace(Place):
    """The pixels whose middle is in a region.

    Parameters
    ----------
    region : Region
        In m.

    Raises
    ------
    ValueError
        If the region is in pixels: which are they, on a scene?
    """

    region: Region

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.region.unit != "m":
            raise ValueError(f"{self.name}: is in pixels, expected lengths such as 120 um")

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        x, y = np.meshgrid(errors.raster.x, errors.raster.y)
        inside = self.region.shape.holds(x, y)
        images = (errors.reference, errors.case_1, errors.psf_portion)
        return _mean_and_worst(np.array([image[inside] for image in images]))

    def outline(self) -> NDArray[np.float64]:
        """See `Place.outline`."""
        corners = self.region.shape.outline
        return np.concatenate([corners, corners[:1]])


@dataclass(frozen=True)
class HottestPlace(Place):
    """The greatest temperature of the image, wherever it is: the error of a peak temperature."""

    name: str = "hottest pixel"

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        without_psf = errors.reference + errors.case_2
        reference, measured, ideal = (
            float(np.nanmax(image)) if np.isfinite(image).any() else nan
            for image in (errors.reference, errors.measured, without_psf)
        )
        return {"peak": Reading(reference, measured - reference, measured - ideal)}


@dataclass(frozen=True)
class RakePlace(Place):
    """The rake face, as far as the chip touches it.

    Parameters
    ----------
    tool : Tool
        The tool.
    contact_length : float
        How far the chip touches it, in m.
    half_length, step : float
        Reach to either side of the line across it, and distance between its points, in m.
    """

    tool: Tool
    contact_length: float
    half_length: float
    step: float

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        found = rake_errors(errors, self.contact_length, self.tool, self.half_length, self.step)
        reference = sample(errors.reference, errors.raster, found.contact.points)
        middle = float(
            sample(errors.reference, errors.raster, found.line.points)[
                int(np.argmin(np.abs(found.line.distance)))
            ]
        )
        return {
            "mid-contact": Reading(middle, found.face.error, found.face.psf_portion),
            "mean along the contact": Reading(
                float(np.nanmean(reference)),
                found.along_contact.error,
                found.along_contact.psf_portion,
            ),
        }

    def outline(self) -> NDArray[np.float64]:
        """See `Place.outline`."""
        return np.asarray(self.tool.rake_point(np.array([0.0, self.contact_length])))


@dataclass(frozen=True)
class BandPlace(Place):
    """The shear band, read across its middle.

    Parameters
    ----------
    band : ShearBand
        The band.
    half_length, step : float
        Reach to either side of the line across it, and distance between its points, in m.
    """

    band: ShearBand
    half_length: float
    step: float

    def read(self, errors: ErrorImages) -> Mapping[str, Reading]:
        """See `Place.read`."""
        raise NotImplementedError

    def outline(self) -> NDArray[np.float64]:
        """See `Place.outline`."""
        return self.band.ridge.points


def _mean_and_worst(values: NDArray[np.float64]) -> dict[str, Reading]:
    """Mean, and where the error is most negative and greatest, of three rows of numbers."""
    known = values[:, np.isfinite(values).all(axis=0)]
    if known.shape[1] == 0:
        return {"mean": Reading(nan, nan, nan)}
    return {
        "mean": Reading(*map(float, known.mean(axis=1))),
        "most negative": Reading(*map(float, known[:, known[1].argmin()])),
        "greatest": Reading(*map(float, known[:, known[1].argmax()])),
    }


def _microns(values: NDArray[np.float64]) -> str:
    return f"{1e6 * values.min():.4g} to {1e6 * values.max():.4g} um"
