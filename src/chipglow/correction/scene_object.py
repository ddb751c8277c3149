"""A scene as an observed object: zones and emissivity during one exposure."""

from dataclasses import replace
from typing import Final

import numpy as np

from chipglow.camera import Camera, ImageFormation
from chipglow.correction.correction import Correction
from chipglow.correction.zones import NOTHING, SampledObject, Zone
from chipglow.quantities import Array
from chipglow.quantities.units import COLDEST
from chipglow.scene import Material, Scene
from chipglow.surface import FeatureSurface, Surface, UniformSurface, bare_surface
from chipglow.uncertainty import Estimate

METAL, TOOL = "chip and workpiece", "tool"
"""Zones of a scene."""

_GRAIN: Final = 20e-6
"""Length in m of the texture of a surface that states none: the paper's."""


def observed_scene(
    scene: Scene, camera: Camera, surface: Surface, start: float, uncertainty: float = 0.0
) -> SampledObject:
    """Return zones and emissivity of a scene during an exposure that begins at `start` in s."""
    plain = replace(camera, reflected=None)
    surfaces = surface.without_texture(), UniformSurface(1.0)
    fields = [plain.prepare(one, scene) for one in surfaces]
    seen, black = (one.mean_radiance for one in plain.expose_fields(scene, fields, start))
    material = scene.frame(scene.frame_at(start + camera.integration_time / 2)).material
    shines = (seen > 0) & (black > 0)
    emissivity = np.divide(seen, black, out=np.zeros_like(seen), where=shines)
    labels = np.where(material == Material.TOOL, 1, 0).astype(np.int16)
    labels[~shines] = NOTHING
    deviations = _texture(surface)
    zones = tuple(
        Zone(
            name,
            _mean_of(emissivity[labels == number]),
            None,
            uncertainty,
            deviation,
            getattr(bare_surface(surface), "grain", _GRAIN),
        )
        for number, (name, deviation) in enumerate(zip((METAL, TOOL), deviations, strict=True))
    )
    return SampledObject(zones, scene.raster, labels, emissivity)


def scene_truth(
    result: Correction, scene: Scene, camera: Camera, known: SampledObject, start: float
) -> Array:
    """Return the temperatures that a correction of one frame is to determine, from the scene.

    Parameters
    ----------
    result : Correction
        Correction of an exposure of the scene.
    scene : Scene
        The observed scene.
    camera : Camera
        Camera of the exposure.
    known : SampledObject
        Zones of the scene, of `observed_scene`.
    start : float
        Start of the exposure in s.

    Returns
    -------
    numpy.ndarray
        Temperature in K of the mean radiance over the exposure and over the part of each pixel in
        its zone, shape (y, x); NaN without a zone.
    """
    zone = result.data["zone"][0].values
    black = camera.expose(scene, UniformSurface(1.0), start).mean_radiance
    footprint = ImageFormation(scene.raster, result.raster, None, False, 1.0)
    radiance = np.full(zone.shape, np.nan)
    for number in range(len(known.zones)):
        own = known.labels == number
        light, area = (footprint.forward(np.where(own, one, 0.0)) for one in (black, 1.0))
        chosen = (zone == number) & (area > 0)
        radiance[chosen] = light[chosen] / area[chosen]
    return np.asarray(camera.band.temperature(radiance))


def surroundings_of(camera: Camera) -> Estimate:
    """Return the reflected temperature in K; dark surroundings hardly radiate at the lowest one."""
    return Estimate(np.array(COLDEST if camera.reflected is None else camera.reflected))


def _mean_of(values: Array) -> float | None:
    return float(values.mean()) if values.size else None


def _texture(surface: Surface) -> tuple[float, float]:
    """Return the standard deviations of the emissivity of chip and tool."""
    bare = bare_surface(surface)
    if not isinstance(bare, FeatureSurface):
        return 0.0, 0.0
    return bare.chip.standard_deviation, bare.tool.standard_deviation
