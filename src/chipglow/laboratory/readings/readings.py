"""Statistics of the pixels of places in one frame, and their true temperatures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import nan
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement
from chipglow.camera.measurement import WHOLE
from chipglow.laboratory.emissivity import EmissivityLine, true_temperature
from chipglow.laboratory.emissivity.observations import deviation_of
from chipglow.quantities import ZERO_CELSIUS, Array, Brief
from chipglow.scene import Area, Circle, Pixel, Polygon, Polyline, Region
from chipglow.scene.regions import named_value
from chipglow.text import Notes, result_html
from chipglow.uncertainty import Estimate

OUT_OF_RANGE: Final = Flag.UNDER_RANGE | Flag.SATURATED
"""Flags of pixels that the camera's range does not contain."""

_SHAPES: Final = {Polygon: "polygon", Circle: "circle", Pixel: "point", Polyline: "line"}

_MARGIN: Final = 2
"""Pixels around a place that are kept with it: they show the noise of a single pixel."""


@dataclass(frozen=True)
class Statistics:
    """Radiance temperatures in K of the usable pixels of a place; NaN without any."""

    pixels: int
    """Number of usable pixels."""
    out_of_range: float
    """Fraction of the place's pixels that are below the range or saturated."""
    mean: float
    standard_deviation: float
    """Sample standard deviation over the pixels; NaN of a single one."""
    minimum: float
    maximum: float


def statistics(
    kelvins: Array, out_of_range: NDArray[np.bool_], mask: NDArray[np.bool_]
) -> Statistics:
    """Return the statistics of a place.

    Parameters
    ----------
    kelvins : ndarray
        Radiance temperatures in K, NaN where unusable, shape (y, x).
    out_of_range : ndarray of bool
        Pixels that the camera's range does not contain, shape (y, x).
    mask : ndarray of bool
        The pixels of the place, shape (y, x).
    """
    values = kelvins[mask]
    usable = values[np.isfinite(values)]
    outside = float(out_of_range[mask].mean())
    if usable.size == 0:
        return Statistics(0, outside, nan, nan, nan, nan)
    least, largest = float(usable.min()), float(usable.max())
    mean, deviation = float(usable.mean()), deviation_of(usable)
    return Statistics(usable.size, outside, mean, deviation, least, largest)


@dataclass(frozen=True, eq=False, repr=False)
class PlaceReading(Brief):
    """Reading of one place in one frame."""

    place: Region
    statistics: Statistics
    emissivity: float = nan
    true: Estimate | None = None
    """True temperature in K, if it is determined."""
    notes: Notes = field(default_factory=Notes)

    def row(self) -> dict[str, str | float]:
        """Return the row of the table: temperatures in °C, differences of temperature in K."""
        values = self.statistics
        true = Estimate(np.array(nan)) if self.true is None else self.true
        return {
            "place": self.place.name,
            "shape": _SHAPES[type(self.place.shape)],
            "pixels": values.pixels,
            "out_of_range": values.out_of_range,
            "mean_degC": values.mean - ZERO_CELSIUS,
            "standard_deviation_K": values.standard_deviation,
            "minimum_degC": values.minimum - ZERO_CELSIUS,
            "maximum_degC": values.maximum - ZERO_CELSIUS,
            "emissivity": self.emissivity,
            "true_temperature_degC": float(true.values) - ZERO_CELSIUS,
            "expanded_uncertainty_K": nan
            if self.true is None
            else float(true.expanded_uncertainty()),
            "coverage_factor": nan if self.true is None else float(true.coverage_factor()),
        }


@dataclass(frozen=True, eq=False)
class PlaceReadings:
    """Readings of places in one frame; made by `read_places`."""

    rows: tuple[PlaceReading, ...]

    @property
    def notes(self) -> Notes:
        """Assumptions and warnings of the true temperatures."""
        return sum((row.notes for row in self.rows), Notes())

    def to_frame(self) -> pd.DataFrame:
        """Return one row for each place."""
        return pd.DataFrame(row.row() for row in self.rows)

    def _repr_html_(self) -> str:
        return result_html("PlaceReadings", self.to_frame(), self.notes)


def read_places(
    image: Measurement,
    places: Sequence[Region],
    emissivities: Mapping[str, EmissivityLine] | EmissivityLine | None = None,
    surroundings: Estimate | None = None,
    frame: int = 0,
) -> PlaceReadings:
    """Read places in one frame of a measurement.

    Parameters
    ----------
    image : Measurement
        Frames of a camera.
    places : sequence of Region
        Regions, points and lines.
    emissivities : mapping of str to EmissivityLine, or EmissivityLine, optional
        Emissivities by the names of places or features, or one for all. A place without an
        emissivity has no true temperature.
    surroundings : Estimate, optional
        Temperature in K of the reflected surroundings (`reflected_temperature`).
    frame : int
        Index of the frame.
    """
    one = image.part(slice(frame, frame + 1))

    def line_of(place: Region) -> EmissivityLine | None:
        if emissivities is None or isinstance(emissivities, EmissivityLine):
            return emissivities
        return named_value(emissivities, place)

    masks = [place.mask(image.raster) for place in places]
    rows = (
        read_place(one, place, mask, line_of(place), surroundings)
        for place, mask in zip(places, masks, strict=True)
    )
    return PlaceReadings(tuple(rows))


def read_place(
    image: Measurement,
    place: Region,
    mask: NDArray[np.bool_],
    emissivity: EmissivityLine | None = None,
    surroundings: Estimate | None = None,
) -> PlaceReading:
    """Read a place in a measurement of one frame; `mask` are its pixels, shape (y, x)."""
    near = window(mask, _MARGIN)
    part, mask = image.part(WHOLE, *near), mask[near]
    kelvins, outside = part.radiance_temperature()[0], part.flags[0] & OUT_OF_RANGE > 0
    found = statistics(kelvins, outside, mask)
    if emissivity is None:
        return PlaceReading(place, found)
    area = Area(place.name, place.feature, mask, True)
    try:
        true = true_temperature([part], area, emissivity, surroundings)
    except ValueError as error:
        return PlaceReading(place, found, notes=Notes(warnings=[str(error)]))
    notes = Notes(warnings=list(true.estimate.warnings))
    return PlaceReading(place, found, true.emissivity, true.estimate, notes)


def window(mask: NDArray[np.bool_], margin: int = 0) -> tuple[slice, slice]:
    """Return rows and columns around the pixels of a mask, with a margin within the image."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return tuple(  # type: ignore[return-value]
        slice(max(int(one[0]) - margin, 0), int(one[-1]) + margin + 1) for one in (rows, columns)
    )
