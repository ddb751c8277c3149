"""A chip in closed form as a camera sees it, with and without noise."""

from math import radians

import numpy as np
from analytic_chip import AnalyticChip

from chipglow.camera import Camera, GaussianPSF, Measurement
from chipglow.radiometry import Band
from chipglow.scene import ToolGeometry

BAND = Band(3.8e-6, 5.1e-6)
FLOOR = 573.15
STARTS = [0.0, 10e-6]


def look(angle, surface):
    """Two frames of a chip on a tool of this rake angle in degrees."""
    chip = AnalyticChip(tool=ToolGeometry(rake_angle=radians(angle)), frames=31)
    camera = Camera(integration_time=5e-6, lower_limit=FLOOR, psf=GaussianPSF(8e-6))
    return camera.measure(chip.scene(), surface, STARTS)


def noisy(measurement, seed):
    """The same with noise of 1 % and of 3 W/(m² sr), and without knowledge of the tool."""
    rng = np.random.default_rng(seed)
    clean = measurement.radiance
    noise = rng.normal(0.0, 0.01 * clean) + rng.normal(0.0, 3.0, clean.shape)
    return Measurement.from_radiance(
        clean + noise, BAND, measurement.times, measurement.raster, FLOOR
    )
