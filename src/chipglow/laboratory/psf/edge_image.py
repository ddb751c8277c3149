"""Images of edges, and which of their pixels can be used."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import sqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from chipglow.camera import Flag, Measurement, Recording
from chipglow.laboratory.psf.edge_line import EdgeLine, NoEdgeError, find_edge
from chipglow.laboratory.psf.psf_fit import EdgePixels, ModelFit, fit_model
from chipglow.laboratory.psf.psf_models import GaussianModel
from chipglow.quantities import TINY, Array, Brief
from chipglow.radiometry import Band
from chipglow.scene import Raster
from chipglow.text import Notes
from chipglow.uncertainty.component import MAD_FACTOR

_LEAST_STEP: Final = 7.0
"""Smallest step of an edge in its standard uncertainties."""

_OUTLIER: Final = 7.0
"""Residual of an outlier in standard deviations: fewer than one of 10¹¹ normal ones."""

_SECOND_EDGE: Final = 0.12
"""Residual of a block over the step, from which there may be a second edge."""

_BLOCK_SIDE: Final = 5
"""Side in pixels of the blocks over which residuals are averaged."""

_COARSE_TOLERANCE: Final = 1e-5
"""Relative change of the sum of squares at which the fit that finds outliers ends."""

_LEAST_PILE: Final = 10
"""Fewest pixels of the largest value that show a limit of the range."""

_MANY_CLIPPED: Final = 0.02
"""Fraction of clipped pixels of a distance from the edge, above which this distance is left out."""

_SMALLEST_SIDE: Final = 8
"""Smallest side of a region in pixels."""

_FEWEST_PIXELS: Final = 40
"""Fewest pixels of an edge: ten for each of its four parameters."""

_PILE_RATIO: Final = 3
"""Ratio of the pixels of the largest value to those of the next and the smallest at a limit."""

_LEAST_OUTLIER: Final = 0.2
"""Smallest residual of an outlier over the step: a wrong model leaves less."""

_MOST_OUTLIERS: Final = 0.01
"""Largest fraction of outliers; more are not dead pixels but an object that is not an edge."""

_CLEAR_BLOCK: Final = 7
"""Residual of a block, in units of its noise, that noise does not explain."""

_CLEAR_BEND: Final = 4
"""Sagitta in standard uncertainties that is not noise: one straight edge in 16 000 has it."""

_LEAST_BEND: Final = 0.05
"""Smallest sagitta in pitches of which a warning is given."""

_WHOLE_SQUARE: Final = "The whole square of a pixel takes light (fill factor 1)."


@dataclass(frozen=True, eq=False, repr=False)
class EdgeImage(Brief):
    """An image of an edge."""

    radiance: Array
    """In W/(m² sr), or counts that are a straight line over it, shape (y, x)."""
    x: Array
    y: Array
    """Positions of columns and rows in m; x ascends, y descends."""
    dead: NDArray[np.bool_]
    saturated: NDArray[np.bool_]
    below: NDArray[np.bool_]
    """Which pixels have no value, are too bright or are too dark for the camera, shape (y, x)."""
    footprint: float
    """Side of a pixel's sensitive square in m."""
    band: Band | None
    """The camera's band."""
    name: str
    """Its name in messages."""
    unit: str = "W/(m² sr)"
    """Unit of the radiance: counts if no calibration is needed."""
    notes: Notes = field(default_factory=Notes)

    @property
    def pitch(self) -> float:
        """Distance between pixels in m."""
        return float(self.x[1] - self.x[0])

    @property
    def wavelength(self) -> float | None:
        """Middle of the camera's band in m."""
        return (self.band.lower + self.band.upper) / 2 if self.band else None

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Which pixels can be trusted, shape (y, x)."""
        return ~(self.dead | self.saturated | self.below)

    @cached_property
    def places(self) -> tuple[Array, Array]:
        """Places x and y of all pixels in m from the image's centre, each of shape (y, x)."""
        across, down = np.meshgrid(self.x - self.x.mean(), self.y - self.y.mean())
        return across, down


def edge_image(
    measurement: Measurement, name: str, region: tuple[slice, slice] | None = None
) -> EdgeImage:
    """Return the mean of a measurement's frames as an image of an edge.

    Parameters
    ----------
    measurement : Measurement
        One frame or several of the same edge.
    name : str
        Its name in messages.
    region : tuple of slice, optional
        Rows and columns that show the edge; all by default.

    Raises
    ------
    ValueError
        If the region is not within the image.
    """
    attributes = measurement.data.attrs
    frames = measurement.radiance, measurement.flags, measurement.raster
    band = measurement.band if "band_lower" in attributes else None
    optics = attributes.get("fill_factor"), band
    image = _mean_image(*frames, name, region, *optics, measurement.notes)
    assumed, below = image.notes.assumed, image.below
    if attributes.get("psf_order") == "detector":
        assumed.append(
            "Each pixel's square acts once; this camera was simulated with psf_order pixel, "
            "where it acts twice, and the second time is counted as optics."
        )
    if not below.any() or not np.isfinite(image.radiance[below]).all():
        return image
    # An edge needs radiance, which the optics add up, and no temperature.
    assumed.append(
        f"{100 * np.mean(below):.2g} % of the pixels of {name} are below the range of the "
        "camera or its calibration; their radiance is used as it is."
    )
    return replace(image, below=np.zeros_like(below))


def counts_image(
    recording: Recording,
    signal: Array,
    flags: NDArray[np.uint8],
    name: str,
    region: tuple[slice, slice] | None = None,
) -> EdgeImage:
    """Return the mean of frames of counts, linear in radiance, as an image of an edge."""
    if recording.pitch is None:
        raise ValueError(
            "pitch: is missing, the file does not state it, expected the distance between pixels "
            "on the object such as 6 um"
        )
    raster = Raster(0.0, 0.0, recording.pitch, *signal.shape[1:])
    # No camera counts less than nothing: there, the dark side is cut off.
    cut = np.where(recording.signal <= 0, Flag.UNDER_RANGE, 0).astype(np.uint8)
    assumed = [
        "The counts are linear in the radiance, without a gamma: an edge needs no calibration."
    ]
    if recording.saturation is None:
        assumed.append(
            "No pixel is saturated: neither the file nor the description states the limit."
        )
    notes = recording.notes + Notes(assumed)
    optics = recording.fill_factor, recording.band
    image = _mean_image(signal, flags | cut, raster, name, region, *optics, notes)
    return replace(image, unit="counts")


def _mean_image(
    frames: Array,
    flags: NDArray[np.uint8],
    raster: Raster,
    name: str,
    region: tuple[slice, slice] | None,
    fill_factor: float | None,
    band: Band | None,
    notes: Notes,
) -> EdgeImage:
    """Return the mean and flags of a region of frames."""
    part = region or np.s_[:, :]
    found = np.bitwise_or.reduce(flags, axis=0)[part]
    radiance = np.asarray(frames.mean(axis=0)[part], np.float64)
    if min(radiance.shape) < _SMALLEST_SIDE:
        raise ValueError(
            f"{name}: the region has {radiance.shape[0]} x {radiance.shape[1]} pixels, expected "
            f"{_SMALLEST_SIDE} x {_SMALLEST_SIDE} or more of the image's {raster.rows} x "
            f"{raster.columns}"
        )
    return EdgeImage(
        radiance,
        raster.x[part[1]],
        raster.y[part[0]],
        ((found & (Flag.DEAD | Flag.REPLACED)) != 0) | ~np.isfinite(radiance),
        (found & Flag.SATURATED) != 0,
        (found & Flag.UNDER_RANGE) != 0,
        raster.spacing * sqrt(fill_factor or 1.0),
        band,
        name,
        notes=notes if fill_factor else notes + Notes([_WHOLE_SQUARE]),
    )


def usable_pixels(image: EdgeImage) -> tuple[EdgePixels, Notes]:
    """Find the edge in an image, and the pixels that show it.

    All pixels beyond saturated ones are left out: to leave out only those whose noise goes over the
    limit would shift the mean of the others.
    """
    image = replace(image, saturated=image.saturated | _piled_up(image))
    try:
        # Clipped pixels show the position of an edge too.
        seen = np.where(image.dead, np.nan, image.radiance)
        line, bend = find_edge(seen, image.x - image.x.mean(), image.y - image.y.mean())
        pixels = _pixels_of(image, line)
        quick = _quick_fit(pixels)
        warnings = list(_bent(bend, image))
        limits, clipped = _limits(image, line.distance(*image.places))
        warnings += clipped
        if clipped:
            distance = line.distance(pixels.x, pixels.y)
            pixels = _chosen(pixels, (distance > limits[0]) & (distance < limits[1]))
            quick = _quick_fit(pixels)
        else:
            _check_edge(pixels, quick)
        pixels, outliers = _without_outliers(pixels, quick)
        warnings += outliers
        _check_single(pixels, quick)
    except NoEdgeError as error:
        raise NoEdgeError(f"{image.name}: {error}") from None
    notes = Notes(warnings=[*image.notes.warnings, *warnings]).about(image.name)
    noise = float(np.std(pixels.radiance - quick.predicted(0, pixels)))
    pixels = replace(pixels, sigma=np.full(pixels.x.size, max(noise, TINY)))
    # A Gaussian with a free step can put the edge of a clipped image far away.
    return (pixels if clipped else replace(pixels, line=quick.edges[0].line)), notes


def _pixels_of(image: EdgeImage, line: EdgeLine) -> EdgePixels:
    x, y, radiance = (values[image.usable] for values in (*image.places, image.radiance))
    if radiance.size < _FEWEST_PIXELS:
        raise NoEdgeError(f"{radiance.size} usable pixels, expected {_FEWEST_PIXELS} or more")
    sigma = np.full(radiance.size, max(float(radiance.std()), TINY))
    return EdgePixels(x, y, radiance, sigma, image.pitch, image.footprint, line)


def _quick_fit(pixels: EdgePixels) -> ModelFit:
    """Return a Gaussian fitted to the pixels."""
    return fit_model(GaussianModel(), [pixels], tolerance=_COARSE_TOLERANCE)


def _check_edge(pixels: EdgePixels, quick: ModelFit) -> None:
    """Raise unless the step is significant and enough of both sides is seen."""
    edge = quick.edges[0]
    distance = edge.line.distance(pixels.x, pixels.y)
    dark, bright = -float(distance.min()), float(distance.max())
    if edge.step < _LEAST_STEP * edge.step_uncertainty:
        raise NoEdgeError(
            f"the step is {edge.step:.3g} with a standard uncertainty of "
            f"{edge.step_uncertainty:.2g}, expected {_LEAST_STEP:g} times as much or more"
        )
    if min(dark, bright) < max(quick.fwhm, 2 * pixels.pitch):
        raise NoEdgeError(
            f"the image reaches {dark * 1e6:.3g} um to the dark and {bright * 1e6:.3g} um to the "
            f"bright side of the edge, which is {quick.fwhm * 1e6:.3g} um wide, "
            "expected more of both"
        )


def _piled_up(image: EdgeImage) -> NDArray[np.bool_]:
    """Return pixels at a limit that no flag marks: many with just the largest value."""
    values, counts = np.unique(image.radiance[image.usable], return_counts=True)
    if values.size < 3:
        return np.zeros_like(image.dead)
    others = _PILE_RATIO * max(counts[-2], counts[0])
    piled = counts[-1] >= _LEAST_PILE and counts[-1] > others
    return np.asarray((image.radiance == values[-1]) & piled)


def _limits(image: EdgeImage, distance: Array) -> tuple[tuple[float, float], list[str]]:
    """Return the distances between which nothing is clipped, and warnings."""
    limits, said = [], []
    for sign, clipped, how, side in (
        (1.0, image.saturated, "saturated", "bright"),
        (-1.0, image.below, "below the camera's lower range limit", "dark"),
    ):
        limit = np.inf
        if clipped.any():
            limit = _first_clipped(sign * distance, clipped & ~image.dead, image.pitch)
            said.append(_clipped_text(clipped, how, side, limit))
        limits.append(sign * limit)
    return (limits[1], limits[0]), said


def _first_clipped(distance: Array, clipped: NDArray[np.bool_], pitch: float) -> float:
    """Return the distance beyond which more than single pixels are clipped, minus a pitch."""
    first = float(distance.min())
    index = ((distance - first) / (pitch / 2)).astype(np.int64).ravel()
    count = np.bincount(index)
    fraction = np.bincount(index, clipped.ravel()) / np.maximum(count, 1)
    found = np.flatnonzero((fraction > _MANY_CLIPPED) & (fraction * count >= 2))
    return first + float(found[0]) * pitch / 2 if found.size else np.inf


def _clipped_text(clipped: NDArray[np.bool_], how: str, side: str, limit: float) -> str:
    fraction = 100 * np.count_nonzero(clipped) / clipped.size
    beyond = (
        f"; nothing is used beyond {limit * 1e6:.3g} um on the {side} side, so that the step and "
        "the tails are known less well"
        if np.isfinite(limit)
        else " and left out"
    )
    return f"{fraction:.2g} % of the pixels are {how}{beyond}."


def _chosen(pixels: EdgePixels, kept: NDArray[np.bool_]) -> EdgePixels:
    if kept.sum() < _FEWEST_PIXELS:
        raise NoEdgeError(f"{kept.sum()} pixels are not clipped, expected {_FEWEST_PIXELS} or more")
    each = {name: getattr(pixels, name)[kept] for name in ("x", "y", "radiance", "sigma")}
    return replace(pixels, **each)


def _without_outliers(pixels: EdgePixels, quick: ModelFit) -> tuple[EdgePixels, list[str]]:
    """Return the pixels without those that lie far from all others as near to the edge."""
    left = pixels.radiance - quick.predicted(0, pixels)
    spread = MAD_FACTOR * float(np.median(np.abs(left - np.median(left))))
    kept = np.abs(left) <= max(_OUTLIER * spread, _LEAST_OUTLIER * quick.edges[0].step)
    lost = int(np.count_nonzero(~kept))
    if lost == 0 or lost > _MOST_OUTLIERS * kept.size:
        return pixels, []
    text = f"{lost} pixels far from the others are left out; if they are dead, flag them."
    return _chosen(pixels, kept), [text]


def _check_single(pixels: EdgePixels, quick: ModelFit) -> None:
    """Raise unless the two sides of the edge are all there is."""
    left = pixels.radiance - quick.predicted(0, pixels)
    column = np.round((pixels.x - pixels.x.min()) / pixels.pitch).astype(np.int64)
    row = np.round((pixels.y - pixels.y.min()) / pixels.pitch).astype(np.int64)
    total, count = np.zeros((2, row.max() + 1, column.max() + 1))
    total[row, column], count[row, column] = left, 1.0
    weight = uniform_filter(count, _BLOCK_SIDE, mode="constant")
    mean = uniform_filter(total, _BLOCK_SIDE, mode="constant") / np.maximum(weight, 1e-9)
    fraction = np.abs(np.where(weight > 0.5, mean, 0.0)) / quick.edges[0].step
    change = np.diff(total, axis=1)[(count[:, 1:] * count[:, :-1]) > 0]
    noise = float(np.median(np.abs(change))) / (_BLOCK_SIDE * quick.edges[0].step)
    if fraction.max() > max(_SECOND_EDGE, _CLEAR_BLOCK * noise):
        where = np.unravel_index(int(np.argmax(fraction)), fraction.shape)
        raise NoEdgeError(
            f"more than one straight edge: near row {where[0]}, column {where[1]} the image is "
            f"{100 * fraction.max():.0f} % of the step away from a single edge's, expected a "
            "region with one edge and even sides"
        )


def _bent(bend: tuple[float, float] | None, image: EdgeImage) -> Iterator[str]:
    if bend is None:
        yield "The edge was found by its step only; its straightness could not be checked."
    elif bend[0] >= max(_CLEAR_BEND * bend[1], _LEAST_BEND * image.pitch):
        yield (
            f"The edge is bent by {bend[0] * 1e6:.2g} um over its length (standard uncertainty "
            f"{bend[1] * 1e6:.1g} um), which makes the point spread function too wide."
        )
