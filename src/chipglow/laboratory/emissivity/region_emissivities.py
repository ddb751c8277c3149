"""Emissivity of the regions of an image, at one true temperature or several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from chipglow.camera import Flag, Measurement
from chipglow.laboratory.emissivity.emissivity import (
    BUDGET,
    EmissivityLine,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    determine_emissivity,
    emissivity_line,
)
from chipglow.laboratory.emissivity.observations import check_same_pixels, uncertainty_columns
from chipglow.quantities import ZERO_CELSIUS, Brief
from chipglow.scene import Region, areas, shared_pixels
from chipglow.surface import Origin
from chipglow.text import Notes, result_html

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False, repr=False)
class RegionEmissivities(Brief):
    """Emissivity of the regions of an image; made by `determine_emissivities`."""

    maps: tuple[EmissivityMap, ...]
    rows: tuple[tuple[RegionEmissivity, ...], ...]
    lines: tuple[EmissivityLine, ...] = ()
    """Each area over the temperature; empty for one heating."""
    notes: Notes = field(default_factory=Notes)
    metal: str = ""
    """Material of the object, if known."""

    @property
    def origin(self) -> Origin:
        """Band and metal of the measurement."""
        return Origin((self.maps[0].band.lower, self.maps[0].band.upper), self.metal)

    def to_frame(self) -> pd.DataFrame:
        """Return every region at every temperature; one row each."""
        return pd.DataFrame(_row(row) for of in self.rows for row in of)

    def plot(self, ax: "Axes | None" = None) -> "Axes":
        """Draw the mean emissivity of each region with 2 standard uncertainties.

        With several heatings, over the true temperature. New axes are made by default.
        """
        from chipglow.laboratory.emissivity.figure import plot_region_emissivities

        return plot_region_emissivities(self, ax)

    def _repr_html_(self) -> str:
        return result_html("RegionEmissivities", self.to_frame(), self.notes)

    def line_frame(self) -> pd.DataFrame:
        """Return the emissivity over the temperature; a row for each region."""
        return pd.DataFrame(map(_line_row, self.lines))


def determine_emissivities(
    measurements: Sequence[Measurement],
    heatings: Sequence[Heating],
    regions: Sequence[Region],
    names: Sequence[str] = (),
    metal: str = "",
) -> RegionEmissivities:
    """Determine the emissivity of regions of a heated object."""
    if len(heatings) != len(measurements):
        raise ValueError(
            f"{len(heatings)} heatings for {len(measurements)} images; each image needs one"
        )
    check_same_pixels(measurements, "emissivity", names)
    groups: dict[Heating, list[Measurement]] = {}
    for measurement, heating in zip(measurements, heatings, strict=True):
        groups.setdefault(heating, []).append(measurement)
    maps = tuple(determine_emissivity(group, heating) for heating, group in groups.items())
    found = areas(regions, maps[0].raster)
    rows = tuple(tuple(one.of(area) for area in found) for one in maps)
    by_area = zip(*rows, strict=True) if len(maps) > 1 else ()
    lines = tuple(emissivity_line([row.line for row in of]) for of in by_area)
    notes = _notes(maps, rows)
    notes.assumed.extend(
        f"{one} and {other} share {count} pixels, which count in both."
        for (one, other), count in shared_pixels(regions, maps[0].raster).items()
    )
    return RegionEmissivities(maps, rows, lines, notes, metal)


def _row(row: RegionEmissivity) -> Mapping[str, float | str]:
    return {
        "region": row.name,
        "feature": row.feature,
        "reference_K": row.heating.reference,
        "reflected_K": row.heating.reflected,
        "pixels": row.used.count,
        "under_range": row.used.flagged[Flag.UNDER_RANGE],
        "saturated": row.used.flagged[Flag.SATURATED],
        "dead": row.used.flagged[Flag.DEAD],
        "under_0": row.outside[0],
        "over_1": row.outside[1],
        "mean": row.mean,
        "standard_deviation": row.standard_deviation,
        **uncertainty_columns(row.estimate, BUDGET),
    }


def _line_row(line: EmissivityLine) -> Mapping[str, float | str]:
    middle, slope = line.estimate.values
    of_middle, of_slope = line.estimate.standard_uncertainty
    return {
        "region": line.name,
        "temperature_degC": line.middle - ZERO_CELSIUS,
        "emissivity": middle,
        "emissivity_uncertainty": of_middle,
        "change_in_100_K": 100 * slope,
        "change_in_100_K_uncertainty": 100 * of_slope,
        "residual": line.residual,
    }


def _notes(maps: Sequence[EmissivityMap], rows: Sequence[Sequence[RegionEmissivity]]) -> Notes:
    heating = maps[0].heating
    reflects, change = f"{heating.reflected - ZERO_CELSIUS:.4g}", _of_reflected(maps[0])
    if heating.reflected_uncertainty:
        reflects += f" ± {heating.reflected_uncertainty:.3g} degC and nothing hotter"
    else:
        reflects = f"exactly {reflects} degC"
    texts = {
        "The true temperature is exact (reference_uncertainty).": not heating.reference_uncertainty,
        f"The object reflects {reflects}; 100 K more would shift the emissivity by {change:+.2g} "
        "(reflected, reflected_uncertainty).": True,
        "The camera does not drift between recordings: a single image does not show it, and u "
        "does not include it (drift).": (
            heating.drift is None and any(one.recordings == 1 for one in maps)
        ),
        "The camera's calibration is exact, as the measurement states no uncertainty of it "
        "(camera_uncertainty).": any(one.calibration is None for one in maps),
        "Nothing changes between frames, as there is only one; noise is at most the standard "
        "deviation over the pixels.": any(len(one.radiance) == 1 for one in maps),
    }
    notes = Notes([text for text, applies in texts.items() if applies])
    for of in rows:
        own = Notes(warnings=[warning for row in of for warning in row.estimate.warnings])
        several = f"Object at {of[0].heating.reference - ZERO_CELSIUS:.6g} °C"
        notes += own.about(several) if len(rows) > 1 else own
    return notes


def _of_reflected(one: EmissivityMap) -> float:
    """Return the change of the mean emissivity by surroundings that are 100 K hotter."""
    heating = one.heating
    hotter = min(heating.reflected + 100.0, (heating.reflected + heating.reference) / 2)
    exact = replace(heating, reflected=hotter, reflected_uncertainty=0.0, reference_uncertainty=0.0)
    return float(np.nanmean(replace(one, heating=exact).emissivity) - np.nanmean(one.emissivity))
