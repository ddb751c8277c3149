"""A heated chip as a camera sees it: the emissivities of the paper's chip 1, with a texture."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera, Measurement
from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Polygon, Raster, Region, Scene
from chipglow.surface import Emissivity, MapSurface, Texture

BAND = Band(3.8e-6, 5.1e-6)
RASTER = Raster(left=0.0, top=0.0, spacing=2e-6, rows=240, columns=390)
PITCH, LABORATORY = 6e-6, 293.0
BANDS, LEAN = (232e-6, 502e-6), 8 / 60
FRAMES, NOISE, DRIFT = 10, 3.0, 1.0
REGIONS = (
    Region("body left", Polygon(((6, 12), (26, 12), (34, 72), (14, 72))), "chip body"),
    Region("body right", Polygon(((50, 12), (72, 12), (80, 72), (58, 72))), "chip body"),
    Region("shear band 1", Polygon(((38, 12), (42, 12), (50, 72), (46, 72))), "shear band"),
    Region("shear band 2", Polygon(((83, 12), (87, 12), (95, 72), (91, 72))), "shear band"),
)


def chip_emissivity() -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Emissivity of chip 1 of Table 1 with leaning shear bands, and where nothing is."""
    x, y = np.meshgrid(RASTER.x, -RASTER.y)
    body = Texture.random(
        Emissivity(0.42, 0.07), 20e-6, np.random.default_rng(1), restore_standard_deviation=True
    )
    band = Texture.random(
        Emissivity(0.53, 0.05), 20e-6, np.random.default_rng(2), restore_standard_deviation=True
    )
    leaning = x - LEAN * y
    values = np.where(in_shear_band(48e-6), band.at(x, y), body.at(x, y))
    teeth = 40e-6 * np.abs(np.cos(np.pi * (leaning - BANDS[0]) / (BANDS[1] - BANDS[0])))
    return values.astype(np.float64), y < 20e-6 + teeth


def in_shear_band(width: float) -> NDArray[np.bool_]:
    """Which samples are in one of the leaning shear bands."""
    x, y = np.meshgrid(RASTER.x, -RASTER.y)
    leaning = x - LEAN * y
    return np.any([np.abs(leaning - middle) < width / 2 for middle in BANDS], axis=0)


def heated(
    emissivity: NDArray[np.float64],
    background: NDArray[np.bool_],
    temperature: float,
    camera: Camera | None = None,
    frames: int = FRAMES,
) -> Measurement:
    """Frames of the chip at one temperature, with noise and drift."""
    scene = heated_scene(background, temperature)
    camera = camera or Camera(pitch=PITCH, lower_limit=473.15, reflected=LABORATORY)
    image = camera.measure(scene, MapSurface(emissivity, RASTER), 0.0)
    generator = np.random.default_rng(3)
    radiance = image.radiance + NOISE * generator.standard_normal((frames, *image.raster.shape))
    radiance += DRIFT * generator.standard_normal((frames, 1, 1))
    times = np.arange(frames) / camera.frame_rate
    return Measurement.from_radiance(radiance, BAND, times, image.raster, camera.lower_limit)


def heated_scene(background: NDArray[np.bool_], temperature: float) -> Scene:
    """Return a scene as long as an exposure in which nothing happens."""
    fields = {name: np.zeros((11, *RASTER.shape), np.float32) for name in FIELD_UNITS}
    fields["material"][:] = ~background
    fields["temperature"][:] = np.where(background, LABORATORY, temperature)
    return Scene.from_fields(RASTER, np.arange(11) * 1e-6, fields)


def fine(regions: tuple[Region, ...]) -> tuple[Region, ...]:
    """Return the same regions in the scene's coordinates."""
    return tuple(
        replace(
            region,
            shape=Polygon(tuple((PITCH * c, -PITCH * r) for c, r in region.shape.corners)),
            unit="m",
        )
        for region in regions
    )


def shear_band(half_width: float) -> Region:
    """Region of the first shear band, to this distance from its centre."""
    places = [(side * half_width, -height) for side, height in ((-1, 72e-6), (1, 72e-6))]
    places += [(side * half_width, -height) for side, height in ((1, 432e-6), (-1, 432e-6))]
    corners = tuple((BANDS[0] + x - LEAN * y, y) for x, y in places)
    return Region("shear band", Polygon(corners), unit="m")
