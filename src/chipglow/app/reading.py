"""Readings of the drawn places in the frame that is shown."""

from collections.abc import Callable, Sequence
from math import nan
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.app.marks import Mark
from chipglow.app.opened import Opened
from chipglow.camera import Measurement
from chipglow.laboratory.emissivity import EmissivityLine, doubts, reflected_temperature
from chipglow.laboratory.readings import (
    Histogram,
    PlaceCurves,
    PlaceReading,
    Profile,
    histogram,
    isotherm,
    place_curves,
    profile,
    read_place,
    statistics,
)
from chipglow.quantities import Array
from chipglow.radiometry import Band
from chipglow.scene import Raster, Region
from chipglow.scene.regions import named_value
from chipglow.text import Notes
from chipglow.uncertainty import Estimate

MEASURED: Final = "measured"
"""Name of the image that places are read in."""

_MASKS: Final = 200
"""Masks that are kept, so that a new frame or place computes none again."""


class Reader:
    """Reads places in the open file of a page."""

    def __init__(self, opened: Opened) -> None:
        self._opened = opened
        self._masks: dict[tuple[Region, Raster], NDArray[np.bool_]] = {}
        self._readings: dict[tuple[Mark, tuple[float, float] | None], PlaceReading] = {}
        self._band: Band | None = None

    @property
    def is_ready(self) -> bool:
        """Whether a picture is shown."""
        return MEASURED in self._opened.images

    @property
    def raster(self) -> Raster:
        """Grid of the pixels that are shown."""
        return self._opened.images[MEASURED].raster

    @property
    def kelvins(self) -> Array:
        """Radiance temperature of the frame that is shown in K, NaN out of range."""
        return self._opened.images[MEASURED].values

    def mask(self, place: Region) -> NDArray[np.bool_]:
        """Return the pixels of a place; ValueError outside of the image."""
        key = place, self.raster
        if key not in self._masks:
            if len(self._masks) >= _MASKS:
                del self._masks[next(iter(self._masks))]
            self._masks[key] = place.mask(self.raster)
        return self._masks[key]

    def forget(self) -> None:
        """Forget the readings, as another frame is shown."""
        self._readings.clear()

    def read(self, mark: Mark) -> PlaceReading:
        """Read a place, with the true temperature by the correction that is shown, or emissivity.

        A place outside the image, which a change of the camera may cause, has no reading.
        """
        key = mark, self._opened.surroundings
        if key not in self._readings:
            stated = self._opened.surroundings
            surroundings = None if stated is None else reflected_temperature(*stated)
            self._readings[key] = self._read(mark, surroundings)
        return self._readings[key]

    def _read(self, mark: Mark, surroundings: Estimate | None) -> PlaceReading:
        place, measured = mark.region, self._opened.measured
        try:
            mask = self.mask(place)
        except ValueError as error:
            nothing = np.full(self.raster.shape, nan)
            whole = np.ones(self.raster.shape, np.bool_)
            empty = statistics(nothing, ~whole, whole)
            return PlaceReading(place, empty, notes=Notes(warnings=[str(error)]))
        corrected = self._corrected(place)
        line = None if corrected is not None else self._line(mark)
        if measured is not None:
            self._share_band(measured)
            reading = read_place(measured, place, mask, line, surroundings)
        else:
            flagged = np.isnan(self.kelvins)
            reading = PlaceReading(place, statistics(self.kelvins, flagged, mask))
        if corrected is None:
            return reading
        return PlaceReading(place, reading.statistics, true=corrected)

    def _line(self, mark: Mark) -> EmissivityLine | None:
        """Return the emissivity of a place, its own or the file's; None if it is not known."""
        stored = self._opened.emissivities
        if mark.line is not None or stored is None:
            return mark.line
        return named_value(stored.lines, mark.region)

    def emissivity(self, mark: Mark, reading: PlaceReading) -> tuple[float, float]:
        """Return the emissivity of a place at its true temperature, and its uncertainty."""
        if (line := self._line(mark)) is None:
            return nan, nan
        true = line.middle if reading.true is None else float(reading.true.values)
        found = line.at(true)
        return float(found.values), float(found.standard_uncertainty)

    @property
    def doubts(self) -> Notes:
        """Warnings of emissivities of another band or metal."""
        stored, measured = self._opened.emissivities, self._opened.measured
        if stored is None or measured is None or "band_lower" not in measured.data.attrs:
            return Notes()
        return doubts(stored.origin, [measured])

    def _share_band(self, measured: Measurement) -> None:
        """Let a frame have the band of the last one: its tables are computed once."""
        if "band_lower" not in measured.data.attrs:
            return
        if self._band != measured.band:
            self._band = measured.band
        measured.band = self._band

    def _corrected(self, place: Region) -> Estimate | None:
        """Return the mean true temperature of a place in K by the correction that is shown."""
        shown = self._opened.corrected
        if shown is None:
            return None
        try:
            return shown.correction.at(place, shown.frame)
        except ValueError:  # not within the part that is corrected
            return None

    def profile(self, mark: Mark) -> Profile:
        """Return the temperature along a line."""
        return profile(self.kelvins, self.raster, mark.region)

    def histogram(self, mark: Mark) -> Histogram:
        """Return the frequency of the temperatures of a place; without bins outside the image."""
        try:
            return histogram(self.kelvins, self.mask(mark.region), mark.name)
        except ValueError:
            return histogram(np.full(self.raster.shape, nan), np.ones(1, np.bool_), mark.name)

    def isotherm(self, level: float) -> list[Array]:
        """Return the lines of a temperature in K."""
        return isotherm(self.kelvins, self.raster, level)

    def curves(self, marks: Sequence[Mark], check: Callable[[float], None]) -> PlaceCurves:
        """Return the temperatures of places over all frames; `check` takes the fraction read."""
        frames = self._opened.frames
        places = [mark.region for mark in marks]
        return place_curves(frames.kelvins, frames.times, frames.raster, places, check)


def table_of(readings: Sequence[PlaceReading]) -> pd.DataFrame:
    """Return one row for each reading."""
    return pd.DataFrame([reading.row() for reading in readings])
