"""The error of the ratio temperature against the true one, cause by cause."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera, Exposure, RatioCamera, expose_views
from chipglow.camera.ratio_camera import views_of
from chipglow.scene import Material, Raster, Scene, sample
from chipglow.surface import Surface

RATIO_CAUSES: Final = (
    "emissivity",
    "motion",
    "footprint",
    "optics",
    "misregistration",
    "delay",
    "noise",
)
"""What makes the error, in the order in which they come one upon the other."""


@dataclass(frozen=True, eq=False)
class RatioErrors:
    """The error of the ratio temperature in one exposure, in K, on the raster of the pixels.

    `truth` is the true temperature at every pixel's centre, linear between the samples, in the
    middle of the first channel's exposure; NaN where there is no material. `causes` holds by the
    names of `RATIO_CAUSES` what each adds to the error: ``emissivity`` where its ratio is another
    than it is taken to be, or something is reflected; ``motion`` during the exposures; the pixels'
    ``footprint``; point spread functions and the rest of the ``optics``; ``misregistration``; the
    ``delay``; and ``noise`` with all that detectors do.
    """

    raster: Raster
    truth: NDArray[np.float64]
    causes: Mapping[str, NDArray[np.float64]]

    @property
    def error(self) -> NDArray[np.float64]:
        """Ratio temperature less the true one, in K: the sum of the causes."""
        return np.asarray(np.sum(list(self.causes.values()), axis=0), np.float64)

    @property
    def measured(self) -> NDArray[np.float64]:
        """Ratio temperature in K, whether a channel's lower range limit flags it or not."""
        return self.truth + self.error


def ratio_errors(camera: RatioCamera, scene: Scene, surface: Surface, start: float) -> RatioErrors:
    """Errors of the ratio temperature of one exposure, and what makes them.

    Parameters
    ----------
    camera : RatioCamera
        The camera.
    scene : Scene
        What is truly there.
    surface : Surface
        Its emissivity.
    start : float
        When the first channel begins to integrate in s.

    Raises
    ------
    ValueError
        If an integration reaches beyond the scene, or the pixels do not fit it.

    Notes
    -----
    Differences of ratio temperatures, each with one cause more than the one before: of the samples
    at the pixel's centre in the middle of the exposure; of their means over the exposure; of ideal
    pixels; with the optics; with the second channel's pixels where they truly are; with its
    exposure when it truly is; and as the detectors read them.
    """
    first, second = camera.placed(scene.raster)
    aligned = replace(second, offset=first.offset)
    duration, of_second = first.integration_time, second.integration_time
    views = views_of(surface, scene, (first, second))
    one, two = alike = expose_views(scene, views, start, duration)
    if of_second != duration:
        (two,) = expose_views(scene, views[1:], start, of_second)
    late = two
    if camera.delay:
        (late,) = expose_views(scene, views[1:], start + camera.delay, of_second)
    formed = first.form_image(one.mean_radiance, scene.raster)
    delayed = second.form_image(late.mean_radiance, scene.raster)
    pixels = first.pixels(scene.raster)
    points = np.stack(np.meshgrid(pixels.x, pixels.y), axis=-1)
    told = [
        sample(on_samples, scene.raster, points)
        for on_samples in (
            true_temperature(scene, start + duration / 2),
            camera.thermometer.temperature(*(e.centre_radiance for e in alike)),
            camera.thermometer.temperature(one.mean_radiance, two.mean_radiance),
        )
    ]
    images = [
        (ideal_image(first, one), ideal_image(aligned, two)),
        (formed, aligned.form_image(two.mean_radiance, scene.raster)),
        (formed, second.form_image(two.mean_radiance, scene.raster)),
        (formed, delayed),
        (_read(first, formed, one.start), _read(second, delayed, late.start)),
    ]
    told += [camera.thermometer.temperature(*pair) for pair in images]
    steps = zip(RATIO_CAUSES, told[1:], told[:-1], strict=True)
    causes = {name: after - before for name, after, before in steps}
    return RatioErrors(pixels, told[0], causes)


def ideal_image(camera: Camera, exposure: Exposure) -> NDArray[np.float64]:
    """Radiance of a camera's pixels in W/(m² sr) without its optics, shape (y, x)."""
    ideal = replace(camera, psf=None, optics=())
    return ideal.form_image(exposure.mean_radiance, exposure.raster)


def true_temperature(scene: Scene, time: float) -> NDArray[np.float64]:
    """True temperature of a scene's samples at a time in K, shape (y, x); NaN in the void."""
    number = np.searchsorted(scene.times, time + 1e-6 * scene.frame_spacing, side="right") - 1
    frame = scene.frame(max(int(number), 0), ())
    void = frame.material == Material.VOID
    return np.where(void, np.nan, np.asarray(frame.temperature, np.float64))


def _read(camera: Camera, image: NDArray[np.float64], start: float) -> NDArray[np.float64]:
    """What the camera's detector makes of an image."""
    return np.asarray(camera.read(image[None], np.array([start]))[0][0], np.float64)
