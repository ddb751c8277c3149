"""Readings of places in images: statistics, true temperatures, curves, profiles, histograms."""

from chipglow.laboratory.readings.curves import (
    Histogram as Histogram,
    PlaceCurves as PlaceCurves,
    Profile as Profile,
    histogram as histogram,
    isotherm as isotherm,
    place_curves as place_curves,
    profile as profile,
)
from chipglow.laboratory.readings.readings import (
    PlaceReading as PlaceReading,
    PlaceReadings as PlaceReadings,
    Statistics as Statistics,
    read_place as read_place,
    read_places as read_places,
    statistics as statistics,
)
