"""The error of the ratio temperature of two cameras, effect by effect."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
import xarray as xr

from chipglow.camera import Camera
from chipglow.camera.chain import ExposedChain, chains_in_bands, expose_chains
from chipglow.camera.effect import EVERY, Effect
from chipglow.camera.measuring import read_radiance
from chipglow.quantities import Array
from chipglow.radiometry import RatioThermometer
from chipglow.scene import Material, Raster, Scene, sample
from chipglow.surface import Surface

CAUSES: Final[Mapping[str, frozenset[Effect]]] = {
    "emissivity": frozenset({Effect.EMISSIVITY, Effect.REFLECTION}),
    "motion": frozenset({Effect.MOTION}),
    "footprint": frozenset({Effect.FOOTPRINT}),
    "optics": frozenset({Effect.PSF, Effect.OPTICS}),
    "misregistration": frozenset({Effect.MISREGISTRATION}),
    "delay": frozenset({Effect.DELAY}),
    "noise": frozenset({Effect.DETECTOR, Effect.DIGITISER}),
}
"""Causes of the error of a ratio temperature, and their effects, in the order of switching on."""


@dataclass(frozen=True, eq=False)
class RatioPair:
    """Two cameras of one pitch that measure temperature by the ratio of their radiances.

    Parameters
    ----------
    first, second : Camera
        The channels, that of the shorter wavelengths first. Each has its own band, point spread
        function, integration time, detector and seed; pitch, offset and shape are the same.
    emissivity_ratio : float
        Assumed emissivity in the first band over that in the second.
    shift : (float, float)
        Misregistration: how far right of and above the first's pixels those of the second look on
        the scene, in m, though they are taken to look at the same places.
    delay : float
        Delay of the second channel's integration in s.

    Raises
    ------
    ValueError
        If the channels differ in pitch, offset or shape, or have no ratio.
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
                raise ValueError(f"ratio: {name} is {one!r} and {other!r}, both must be the same")
        if not np.isfinite([*self.shift, self.delay]).all():
            raise ValueError(
                f"ratio: shift {self.shift} m and delay {self.delay} s, expected finite numbers"
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


class RatioReadings:
    """Ratio temperatures of one exposure of each channel with some of the effects switched on.

    Without footprint, a pixel reads the samples around its centre, linear between them; without
    motion, the middle of the exposure; without the effects of the surface, the true temperature.
    """

    def __init__(self, pair: RatioPair, scene: Scene, surface: Surface, start: float) -> None:
        first, second = pair.with_common_pixels(scene.raster)
        one, two = chains_in_bands(surface, scene, (first, second))
        self.scene, self.start, self.thermometer = scene, start, pair.thermometer
        self.pixels = first.pixels(scene.raster)
        self.middle = start + first.integration_time / 2
        if first.integration_time == second.integration_time:
            exposures = expose_chains((one, two), start)
        else:
            exposures = *expose_chains([one], start), *expose_chains([two], start)
        self.first, self.second = one.exposed(exposures[0]), two.exposed(exposures[1])
        self.late = self.second
        if pair.delay:
            (delayed,) = expose_chains([two], start + pair.delay)
            self.late = two.exposed(delayed)
        self.aligned = replace(second, offset=first.offset)

    def reading(self, on: frozenset[Effect] = EVERY) -> Array:
        """Return the ratio temperature in K, (y, x), whether a range limit flags it or not."""
        if not on & CAUSES["emissivity"]:
            truth = true_temperature(self.scene, self.middle)
            return sample(truth, self.scene.raster, self.pixels.centres)
        second = self.late if Effect.DELAY in on else self.second
        if Effect.FOOTPRINT not in on:
            samples = self.thermometer.temperature(
                *(_on_samples(one, Effect.MOTION in on) for one in (self.first, second))
            )
            return sample(samples, self.scene.raster, self.pixels.centres)
        if Effect.MISREGISTRATION not in on:
            second = second.through(self.aligned)
        radiances = [_in_pixels(one, on) for one in (self.first, second)]
        return np.asarray(self.thermometer.temperature(*radiances))


def _on_samples(chain: ExposedChain, moves: bool) -> Array:
    exposure = chain.exposure
    return exposure.mean_radiance if moves else exposure.centre_radiance


def _in_pixels(chain: ExposedChain, on: frozenset[Effect]) -> Array:
    """Return the radiance that a channel's pixels receive, or that its detector reads."""
    radiance = chain.radiance(on)
    if not on & CAUSES["noise"]:
        return radiance
    read, _ = read_radiance(chain.camera, radiance[None], np.array([chain.exposure.start]))
    return np.asarray(read[0], np.float64)


def ratio_errors(pair: RatioPair, scene: Scene, surface: Surface, start: float) -> xr.Dataset:
    """Return the errors of the ratio temperature of one exposure, and their causes.

    Parameters
    ----------
    pair : RatioPair
        The two cameras.
    scene : Scene
        The true fields.
    surface : Surface
        Its emissivity.
    start : float
        Start time of the first channel's integration in s.

    Returns
    -------
    xarray.Dataset
        In K over ``y`` and ``x`` of the pixels: ``truth``, the true temperature at every pixel's
        centre, linear between the samples, in the middle of the first channel's exposure, NaN
        where there is no material; ``measured``, the ratio temperature, whether a channel's lower
        range limit flags it or not; ``step``, what each ``cause`` adds to the error:
        ``emissivity`` where its ratio is another than it is taken to be, or something is
        reflected; ``motion`` during the exposures; the pixels' ``footprint``; point spread
        functions and the rest of the ``optics``; ``misregistration``; the ``delay``; and
        ``noise`` with all that detectors do.

    Raises
    ------
    ValueError
        If an integration reaches beyond the scene, or the pixels do not fit it.
    """
    readings, on = RatioReadings(pair, scene, surface, start), frozenset[Effect]()
    waterfall = [readings.reading(on)]
    for effects in CAUSES.values():
        on |= effects
        waterfall.append(readings.reading(on))
    over, kelvin, pixels = ("y", "x"), {"units": "K"}, readings.pixels
    return xr.Dataset(
        {
            "truth": (over, waterfall[0], kelvin),
            "measured": (over, waterfall[-1], kelvin),
            "step": (("cause", *over), np.diff(waterfall, axis=0), kelvin),
        },
        coords={"cause": list(CAUSES), "y": pixels.y, "x": pixels.x},
    )


def true_temperature(scene: Scene, time: float) -> Array:
    """Return the true temperature of a scene's samples in K; NaN in the void."""
    frame = scene.frame(scene.frame_at(time), ())
    void = frame.material == Material.VOID
    return np.where(void, np.nan, np.asarray(frame.temperature, np.float64))
