"""Two cameras, or two channels of one, whose radiances tell one temperature by their ratio."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import cast

import numpy as np
from numpy.typing import NDArray

from chipglow.camera.camera import Camera
from chipglow.camera.exposure import Exposure, View, expose_views
from chipglow.camera.measurement import Measurement
from chipglow.radiometry import RatioThermometer
from chipglow.scene import Raster, Scene
from chipglow.surface import Surface


@dataclass(frozen=True, eq=False)
class RatioMeasurement:
    """What two channels measured of a scene.

    Parameters
    ----------
    first, second : Measurement
        Frames of the channels, pixel upon pixel; the places of the second's are those where its
        pixels truly look.
    temperature : ndarray
        Ratio temperature in K, shape (time, y, x); NaN where either channel has no usable
        radiance and where no temperature has the ratio.
    """

    first: Measurement
    second: Measurement
    temperature: NDArray[np.float64]

    @property
    def raster(self) -> Raster:
        """Where the pixels are taken to look: the first channel's places."""
        return self.first.raster


@dataclass(frozen=True)
class RatioCamera:
    """A camera of two bands.

    Parameters
    ----------
    first, second : Camera
        The channels, that of the shorter wavelengths first. Each has its own band, point spread
        function, integration time, detector and seed; pitch, offset and shape are the same.
    emissivity_ratio : float
        Emissivity in the first band over that in the second, as it is taken to be.
    shift : tuple of float
        Misregistration: how far right of and above the first's pixels those of the second look,
        in m on the scene, though they are taken to look at the same places.
    delay : float
        How much later than the first the second begins to integrate, in s.

    Raises
    ------
    ValueError
        If the channels differ in pitch, offset or shape, or a value is impossible.
    """

    first: Camera
    second: Camera
    emissivity_ratio: float = 1.0
    shift: tuple[float, float] = (0.0, 0.0)
    delay: float = 0.0

    def __post_init__(self) -> None:
        for name in ("pitch", "offset", "shape"):
            one, other = getattr(self.first, name), getattr(self.second, name)
            if one != other:
                raise ValueError(
                    f"ratio camera: {name} is {one!r} and {other!r}, expected the same of both"
                )
        if not (len(self.shift) == 2 and all(isfinite(s) for s in self.shift)):
            raise ValueError(f"ratio camera: shift is {self.shift!r}, expected two lengths in m")
        if not isfinite(self.delay):
            raise ValueError(f"ratio camera: delay is {self.delay!r}, expected a time in s")
        self.thermometer.range  # noqa: B018 - refuses bands without a ratio now, not later

    @cached_property
    def thermometer(self) -> RatioThermometer:
        """What makes a temperature of the ratio."""
        return RatioThermometer(self.first.band, self.second.band, self.emissivity_ratio)

    def placed(self, scene: Raster) -> tuple[Camera, Camera]:
        """The channels with the pixels that both have on a scene.

        Parameters
        ----------
        scene : Raster
            The scene's samples.

        Raises
        ------
        ValueError
            If the pixels do not fit the scene.
        """
        right, up = self.shift
        corner = self.first.offset[0] + max(0.0, -right), self.first.offset[1] + max(0.0, up)
        cameras = (
            replace(self.first, offset=corner),
            replace(self.second, offset=(corner[0] + right, corner[1] - up)),
        )
        shapes = [camera.pixels(scene).shape for camera in cameras]
        shape = min(rows for rows, _ in shapes), min(columns for _, columns in shapes)
        first, second = (replace(camera, shape=shape) for camera in cameras)
        return first, second

    def expose(self, scene: Scene, surface: Surface, start: float) -> tuple[Exposure, Exposure]:
        """Let a scene shine on both channels; in one sweep, if they integrate at the same time.

        Parameters
        ----------
        scene : Scene
            What is truly there.
        surface : Surface
            Its emissivity.
        start : float
            When the first begins to integrate in s.

        Raises
        ------
        ValueError
            If an integration reaches beyond the scene.
        """
        cameras = self.first, self.second
        times = [
            (begin, camera.integration_time)
            for begin, camera in zip((start, start + self.delay), cameras, strict=True)
        ]
        views = views_of(surface, scene, cameras)
        if times[0] == times[1]:
            together = expose_views(scene, views, *times[0])
        else:
            together = tuple(
                expose_views(scene, [view], *time)[0]
                for view, time in zip(views, times, strict=True)
            )
        return cast(tuple[Exposure, Exposure], together)

    def measure(
        self, scene: Scene, surface: Surface, start: float | Sequence[float] | NDArray[np.float64]
    ) -> RatioMeasurement:
        """Measure a scene.

        Parameters
        ----------
        scene : Scene
            What is truly there.
        surface : Surface
            Its emissivity.
        start : float or sequence of float
            When the first channel begins to integrate each frame in s.

        Raises
        ------
        ValueError
            If an integration reaches beyond the scene, or the pixels do not fit it.
        """
        starts = np.atleast_1d(np.asarray(start, np.float64)).tolist()
        exposed = [self.expose(scene, surface, one) for one in starts]
        first, second = (
            camera.form_measurement(of_one)
            for camera, of_one in zip(
                self.placed(scene.raster), zip(*exposed, strict=True), strict=True
            )
        )
        told = self.thermometer.temperature(first.radiance, second.radiance)
        usable = np.isfinite(first.radiance_temperature() + second.radiance_temperature())
        return RatioMeasurement(first, second, np.where(usable, told, np.nan))


def views_of(surface: Surface, scene: Scene, cameras: Sequence[Camera]) -> list[View]:
    """A surface as several cameras of a global shutter look at it.

    Where the band does not matter to the surface, it is laid on the scene once.
    """
    for camera in cameras:
        if camera.line_time is not None:
            raise ValueError(
                f"camera: line_time is {camera.line_time!r}, expected None where bands are "
                "compared: a global shutter"
            )
    if surface.is_grey:
        fields = [surface.on(scene)] * len(cameras)
    else:
        fields = [camera.lay(surface, scene) for camera in cameras]
    return [View(f, c.band, c.reflected) for f, c in zip(fields, cameras, strict=True)]
