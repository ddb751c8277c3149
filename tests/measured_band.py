"""Images of a shear band whose curve and temperature are known."""

from dataclasses import dataclass

import numpy as np

from chipglow.camera import CalibrationErrors, Measurement
from chipglow.radiometry import Band
from chipglow.scene import Raster, ToolGeometry

BAND = Band(3.8e-6, 5.1e-6)
TOOL = ToolGeometry()
RASTER = Raster(left=-420e-6, top=360e-6, spacing=6e-6, rows=66, columns=80)
LENGTH = 400e-6


@dataclass(frozen=True)
class BandImage:
    """A warm chip with a hot band of Gaussian profile along a circle from the edge outward.

    The temperature on the ridge falls linearly with the distance from the edge: 800 K at the edge,
    700 K at `LENGTH`. `shift` moves the band up its normal.
    """

    angle: float = 0.7
    bend: float = 600.0
    deviation: float = 15e-6
    shift: float = 0.0
    base: float = 600.0
    raster: Raster = RASTER

    @property
    def axes(self):
        """Tangent and normal of the band at the edge."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return np.array([[-cosine, sine], [sine, cosine]])

    def curve(self, along):
        """Points of the ridge at distances from the edge in m."""
        turned = self.bend * along
        away = np.sin(turned) / self.bend, self.shift - (1 - np.cos(turned)) / self.bend
        return TOOL.edge_point + np.transpose(away) @ self.axes

    def place(self, points):
        """Distance along and, positive toward the chip, across of points."""
        forward, up = np.moveaxis((points - TOOL.edge_point) @ self.axes.T, -1, 0)
        up = up - self.shift
        along = np.arctan2(forward, 1 / self.bend + up) / self.bend
        return along, np.hypot(forward, 1 / self.bend + up) - 1 / self.bend

    def ridge_temperature(self, along):
        return 800.0 - 100.0 * along / LENGTH

    def temperature(self):
        """Radiance temperature of every pixel's middle, shape (y, x)."""
        x, y = np.meshgrid(self.raster.x, self.raster.y)
        image = self.at(np.stack([x, y], axis=-1))
        return np.where(TOOL.signed_distance(x, y) > 0, image, 500.0)

    def at(self, points):
        """Radiance temperature of points of the chip."""
        along, across = self.place(points)
        rise = self.ridge_temperature(along) - self.base
        fade = 1 / (1 + np.exp((along - LENGTH) / 6e-6))
        profile = np.exp(-0.5 * (across / self.deviation) ** 2)
        return self.base + rise * fade * profile


def measured(images, noise=0.0, seed=1, relative_uncertainty=None, raster=RASTER, **attributes):
    """Measurement of radiance temperatures in K, with noise of a standard deviation in K."""
    temperature = np.stack(images)
    noise = noise * np.random.default_rng(seed).standard_normal(temperature.shape)
    known = None
    if relative_uncertainty is not None:
        # A straight line from no radiance to more than any here.
        effects = np.array([[0.0, relative_uncertainty * 1e6]])
        known = CalibrationErrors(np.array([0.0, 1e6]), effects)
    times = 1e-5 * np.arange(len(images))
    radiance = BAND.radiance(temperature + noise)
    return Measurement.from_radiance(
        radiance, BAND, times, raster, 573.15, None, known, attributes
    ).with_tool(TOOL)
