"""Images of a shear band whose curve and temperature are known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    def edge(self) -> NDArray[np.float64]:
        return TOOL.edge_point

    @property
    def _tangent(self) -> NDArray[np.float64]:
        return np.array([-np.cos(self.angle), np.sin(self.angle)])

    @property
    def _normal(self) -> NDArray[np.float64]:
        return np.array([np.sin(self.angle), np.cos(self.angle)])

    def curve(self, along: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points of the ridge at distances from the edge in m."""
        turned = self.bend * along
        away = np.sin(turned) / self.bend, (1 - np.cos(turned)) / self.bend - self.shift
        return self.edge + away[0][:, None] * self._tangent - away[1][:, None] * self._normal

    def place(self, points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Distance along and, positive toward the chip, across of points."""
        offset = points - self.edge
        forward = offset @ self._tangent
        up = offset @ self._normal - self.shift
        along = np.arctan2(forward, 1 / self.bend + up) / self.bend
        return along, np.hypot(forward, 1 / self.bend + up) - 1 / self.bend

    def ridge_temperature(self, along: NDArray[np.float64]) -> NDArray[np.float64]:
        return 800.0 - 100.0 * along / LENGTH

    def temperature(self) -> NDArray[np.float64]:
        """Radiance temperature of every pixel's middle, shape (y, x)."""
        x, y = np.meshgrid(self.raster.x, self.raster.y)
        image = self.at(np.stack([x, y], axis=-1))
        return np.asarray(np.where(TOOL.signed_distance(x, y) > 0, image, 500.0))

    def at(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radiance temperature of points of the chip."""
        along, across = self.place(points)
        rise = self.ridge_temperature(along) - self.base
        fade = 1 / (1 + np.exp((along - LENGTH) / 6e-6))
        profile = np.exp(-0.5 * (across / self.deviation) ** 2)
        return np.asarray(self.base + rise * fade * profile)


def measured(
    images: list[NDArray[np.float64]],
    noise: float = 0.0,
    seed: int = 1,
    relative_uncertainty: float | None = None,
    raster: Raster = RASTER,
    **attributes: float | str,
) -> Measurement:
    """Measurement of radiance temperatures in K, with noise of a standard deviation in K."""
    generator = np.random.default_rng(seed)
    temperature = np.stack(images)
    temperature = temperature + noise * generator.standard_normal(temperature.shape)
    radiance = np.asarray(BAND.radiance(temperature))
    known = None
    if relative_uncertainty is not None:
        # A straight line from no radiance to more than any here.
        known = CalibrationErrors(
            np.array([0.0, 1e6]), np.array([[0.0, relative_uncertainty * 1e6]])
        )
    return Measurement.from_radiance(
        radiance,
        BAND,
        1e-5 * np.arange(len(images)),
        raster,
        lower_limit=573.15,
        calibration_errors=known,
        attributes=attributes,
    ).with_tool(TOOL)
