"""What two cameras recorded, put on one clock."""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from chipglow.camera import Flag, Measurement, Recording
from chipglow.laboratory.registration.registration import Registration
from chipglow.laboratory.registration.time_alignment import (
    TimeAlignment,
    align_times,
    region_signals,
    simultaneous_frames,
)
from chipglow.quantities import Array
from chipglow.text import Notes


@dataclass(frozen=True, eq=False)
class RecordingAlignment:
    """The clocks of two recordings; made by `align_recordings`."""

    clocks: TimeAlignment
    """How they go by each other."""
    infrared_times: Array
    """When each infrared integration began in s, shape (n,)."""
    visible_frames: list[NDArray[np.int64]]
    """Numbers of the visible frames that were exposed within each, from 0."""
    notes: Notes = field(default_factory=Notes)

    def to_frame(self) -> pd.DataFrame:
        """Every infrared frame, a row each."""
        return pd.DataFrame(
            {
                "infrared_frame": np.arange(self.infrared_times.size),
                "infrared_time_us": 1e6 * self.infrared_times,
                "visible_frames": [" ".join(map(str, found)) for found in self.visible_frames],
            }
        )


def align_recordings(
    registration: Registration,
    infrared: Measurement,
    visible: Recording,
    region: tuple[float, float, float, float],
) -> RecordingAlignment:
    """Find the offset of two cameras' clocks by the mean brightness of a region."""
    if "integration_time" not in infrared.data.attrs:
        raise ValueError("the measurement does not state its integration_time")
    integration = float(infrared.data.attrs["integration_time"])
    hot, bright = region_signals(
        registration, infrared.radiance, infrared.raster, visible.signal, region
    )
    exposure = visible.integration_time or float(np.median(np.diff(visible.times)))
    notes = Notes()
    if visible.integration_time is None:
        notes.assumed.append(
            f"A visible exposure lasts as long as its frame, {1e6 * exposure:.4g} us."
        )
    times = infrared.times
    clocks = align_times(times + integration / 2, hot, visible.times + exposure / 2, bright)
    within = simultaneous_frames(clocks, times, integration, visible.times, exposure)
    notes.warnings.extend(clocks.warnings)
    return RecordingAlignment(clocks, times, within, notes)


def infrared_radiance(measurement: Measurement, frame: int) -> Array:
    """Radiance of a frame as `fit_images` and `fit_dots` take it: NaN where a pixel is dead."""
    dead = measurement.flags[frame] & Flag.DEAD > 0
    return np.where(dead, np.nan, measurement.radiance[frame])
