"""Two cameras, or two channels of one, that measure temperature by the ratio of radiances."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated

import numpy as np

from chipglow.camera.camera import Camera
from chipglow.camera.exposure import Exposure, View, expose
from chipglow.camera.measurement import Measurement
from chipglow.quantities import Array, Brief, Parameter, Part
from chipglow.quantities.units import INSTANT, Position
from chipglow.radiometry import RatioThermometer
from chipglow.scene import Raster, Scene
from chipglow.surface import Surface


@dataclass(frozen=True, eq=False, repr=False)
class RatioMeasurement(Brief):
    """Frames of two channels, pixel upon pixel, and their ratio temperature."""

    first: Measurement
    second: Measurement
    """Its places are those where its pixels truly look."""
    temperature: Array
    """In K, shape (time, y, x); NaN where a channel is unusable or no temperature fits."""

    @property
    def raster(self) -> Raster:
        """Assumed positions of the pixels: the first channel's."""
        return self.first.raster


@dataclass(frozen=True)
class RatioCamera(Part):
    """A camera of two bands.

    Parameters
    ----------
    first, second : Camera
        The channels, that of the shorter wavelengths first. Each has its own band, point spread
        function, integration time, detector and seed; pitch, offset and shape are the same.

    Raises
    ------
    ValueError
        If the channels differ in pitch, offset or shape, or a value is impossible.
    """

    first: Camera
    second: Camera
    emissivity_ratio: Annotated[
        float, Parameter("Assumed emissivity in the first band over that in the second.", over=0.0)
    ] = 1.0
    shift: Annotated[
        tuple[Position, Position],
        Parameter(
            "Misregistration: how far right of and above the first's pixels those of the second "
            "look on the scene, though they are taken to look at the same places."
        ),
    ] = (0.0, 0.0)
    delay: Annotated[float, Parameter("Delay of the second channel's integration.", INSTANT)] = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("pitch", "offset", "shape"):
            one, other = getattr(self.first, name), getattr(self.second, name)
            if one != other:
                raise ValueError(
                    f"ratio camera: {name} is {one!r} and {other!r}, both must be the same"
                )
        self.thermometer.range  # noqa: B018 - refuses bands without a ratio now, not later

    @cached_property
    def thermometer(self) -> RatioThermometer:
        """Thermometer of the two bands."""
        return RatioThermometer(self.first.band, self.second.band, self.emissivity_ratio)

    def with_common_pixels(self, scene: Raster) -> tuple[Camera, Camera]:
        """Return the channels with the pixels that both have on a scene."""
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
        """Return the exposures of both channels, of one pass if they integrate at the same time."""
        views = views_of(surface, scene, (self.first, self.second))
        first = start, self.first.integration_time
        second = start + self.delay, self.second.integration_time
        if first == second:
            one, other = expose(scene, views, *first)
        else:
            (one,), (other,) = expose(scene, views[:1], *first), expose(scene, views[1:], *second)
        return one, other

    def measure(
        self, scene: Scene, surface: Surface, start: float | Sequence[float] | Array
    ) -> RatioMeasurement:
        """Measure a scene; `start` is when the first channel begins to integrate frames in s."""
        starts = np.atleast_1d(np.asarray(start, np.float64)).tolist()
        exposed = [self.expose(scene, surface, at) for at in starts]
        one, other = self.with_common_pixels(scene.raster)
        first = one.form_measurement(of_both[0] for of_both in exposed)
        second = other.form_measurement(of_both[1] for of_both in exposed)
        told = self.thermometer.temperature(first.radiance, second.radiance)
        usable = np.isfinite(first.radiance_temperature() + second.radiance_temperature())
        return RatioMeasurement(first, second, np.where(usable, told, np.nan))


def views_of(surface: Surface, scene: Scene, cameras: Sequence[Camera]) -> list[View]:
    """Return a surface as several cameras of a global shutter see it.

    Where the band does not matter to the surface, it is laid on the scene once.
    """
    for camera in cameras:
        if camera.line_time is not None:
            raise ValueError(
                f"camera: line_time is {camera.line_time!r}, expected None where bands are "
                "compared: a global shutter"
            )
    if surface.is_grey:
        fields = [surface.prepare(scene)] * len(cameras)
    else:
        fields = [camera.prepare(surface, scene) for camera in cameras]
    return [View(f, c.band, c.reflected) for f, c in zip(fields, cameras, strict=True)]
