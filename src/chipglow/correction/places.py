"""Corrected temperatures of named places, as a table."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.camera import Measurement
from chipglow.correction.correction import UNDETERMINED, Correction, CorrectionFlag
from chipglow.scene import Region

_CONTRIBUTIONS: Final = 3
"""Contributions that the table of places names."""


def places_of(
    result: Correction, measurement: Measurement, regions: Sequence[Region] = ()
) -> dict[str, NDArray[np.bool_]]:
    """Return the pixels of places by their names: regions, hottest pixel, rake face.

    The rake face is the row of pixels of the chip whose centres are within a pixel of the tool.
    """
    places = {region.name: region.mask(measurement.raster) for region in regions}
    temperature = result.data["temperature"][0].values
    border = result.data["flags"][0].values & CorrectionFlag.BORDER > 0
    inside = np.where(border, np.nan, temperature)
    if np.isfinite(inside).any():
        places["hottest pixel"] = inside == np.nanmax(inside)
    if measurement.tool is not None:
        x, y = np.meshgrid(measurement.raster.x, measurement.raster.y)
        distance = measurement.tool.signed_distance(x, y)
        beside = (distance > 0) & (distance < measurement.raster.spacing)
        contact = beside & np.isfinite(inside)
        if contact.any():
            places["rake face"] = contact
    return places


def place_frame(result: Correction, places: Mapping[str, NDArray[np.bool_]]) -> pd.DataFrame:
    """Return one row for each place and frame: measured and true temperature, U, contributions."""
    rows = []
    for frame, time in enumerate(result.data["time"].values.tolist()):
        for name, mask in places.items():
            usable = mask & (result.data["flags"][frame].values & UNDETERMINED == 0)
            if not usable.any():
                continue
            estimate = result.at(usable, frame)
            budget = result.budget(usable, frame).head(_CONTRIBUTIONS)
            largest = zip(budget["cause"], budget["standard_uncertainty"], strict=True)
            rows.append(
                {
                    "place": name,
                    "time_s": time,
                    "pixels": int(usable.sum()),
                    "measured_K": float(np.nanmean(result.data["measured"][frame].values[usable])),
                    "true_temperature_K": float(estimate.values),
                    "standard_uncertainty_K": float(estimate.standard_uncertainty),
                    "coverage_factor": float(estimate.coverage_factor()),
                    "expanded_uncertainty_K": float(estimate.expanded_uncertainty()),
                    "contributions": ", ".join(f"{cause} {part:.2g}" for cause, part in largest),
                }
            )
    return pd.DataFrame(rows)
