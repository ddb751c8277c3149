"""Frames of a hot spot that moves, as a measurement."""

import numpy as np

from chipglow.camera import Measurement
from chipglow.radiometry import Band
from chipglow.scene import Raster

BAND = Band(3.8e-6, 5.1e-6)
RASTER = Raster(left=0.0, top=384e-6, spacing=6e-6, rows=64, columns=80)
LIMIT = 470.0


def hot_frames(count=4):
    """A measurement with a background of 450 K, which is below its range."""
    x, y = np.meshgrid(1e6 * RASTER.x, 1e6 * RASTER.y)
    kelvins = [
        450.0 + 300.0 * np.exp(-((x - 240.0 - 20.0 * i) ** 2 + (y - 190.0) ** 2) / 100.0**2)
        for i in range(count)
    ]
    times = 1e-3 * np.arange(count)
    return Measurement.from_radiance(
        BAND.radiance(np.array(kelvins)), BAND, times, RASTER, lower_limit=LIMIT
    )
