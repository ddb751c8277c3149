"""A heated chip whose emissivity is known, as a camera sees it."""

import numpy as np

from chipglow.camera import Measurement
from chipglow.radiometry import Band
from chipglow.scene import Raster

BAND = Band(3.8e-6, 5.1e-6)
CELSIUS = 273.15
RASTER = Raster(left=-120e-6, top=90e-6, spacing=6e-6, rows=30, columns=40)
REGIONS = """
regions:
  body left: {rectangle: [[0, 0], [16, 30]], feature: chip body}
  body right: {rectangle: [[24, 0], [40, 30]], feature: chip body}
  shear band: {polygon: [[17, 0], [23, 0], [23, 30], [17, 30]]}
"""


def table_1(body=(0.42, 0.07), band=(0.53, 0.05), seed=1, raster=RASTER):
    """Emissivity of a chip whose columns 17 to 22 are a shear band."""
    generator = np.random.default_rng(seed)
    values = generator.normal(*body, raster.shape)
    values[:, 17:23] = generator.normal(*band, (raster.rows, 6))
    return values


def measured(
    emissivity,
    reference=391.0 + CELSIUS,
    reflected=293.0,
    frames=1,
    noise=0.0,
    gain=1.0,
    seed=2,
    drift=0.0,
    raster=RASTER,
    **more,
):
    """Frames of a heated object by Equation 2: emissivity of shape (y, x).

    Noise and drift are standard deviations in W/(m² sr), of pixels and of whole frames.
    """
    generator = np.random.default_rng(seed)
    hot, cold = BAND.radiance(np.array([reference, reflected]))
    radiance = gain * (emissivity * hot + (1 - emissivity) * cold)
    radiance = radiance + drift * generator.standard_normal((frames, 1, 1))
    radiance = radiance + noise * generator.standard_normal((frames, *raster.shape))
    times = np.arange(frames) / 600.0
    measurement = Measurement.from_radiance(radiance, BAND, times, raster, **more)
    vars(measurement)["band"] = BAND  # the same, with its tables: hundreds of images are quick
    return measurement
