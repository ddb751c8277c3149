"""Pictures and numbers of the page on emissivity: ``python docs/emissivity_pictures.py``."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera, Measurement
from chipglow.laboratory.emissivity import (
    EmissivityMap,
    Heating,
    determine_emissivity,
    emissivity_line,
)
from chipglow.laboratory.emissivity.figure import draw_emissivity
from chipglow.radiometry import Band
from chipglow.scene import FIELD_UNITS, Polygon, Raster, Region, Scene, areas
from chipglow.surface import Emissivity, MapSurface, Texture

HERE = Path(__file__).parent
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


def main() -> None:
    """Draw both pictures."""
    heating = Heating(391.0 + 273.15, LABORATORY, 2.0, 1.0, 2.0)
    chip, background = chip_emissivity()
    found = determine_emissivity([heated(chip, background, heating.reference)], heating)
    draw_emissivity(found, REGIONS).savefig(HERE / "emissivity.png", dpi=150)
    table(found, chip)
    over_temperature(chip, background)
    widths()


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
    """A scene as long as an exposure in which nothing happens."""
    fields = {name: np.zeros((11, *RASTER.shape), np.float32) for name in FIELD_UNITS}
    fields["material"][:] = ~background
    fields["temperature"][:] = np.where(background, LABORATORY, temperature)
    return Scene.from_fields(RASTER, np.arange(11) * 1e-6, fields)


def table(found: EmissivityMap, chip: NDArray[np.float64]) -> None:
    """Print the table of regions."""
    samples = {area.name: area.mask for area in areas(fine(REGIONS), RASTER)}
    for area in areas(REGIONS, found.raster):
        row, put_in = found.of(area), chip[samples[area.name]]
        print(f"{row.name}: put in {put_in.mean():.4f}, sd {put_in.std():.4f}")
        parts = row.estimate.budget().standard_uncertainty.to_series()
        budget = ", ".join(f"{cause} {part:.2g}" for cause, part in parts.items())
        print(
            f"{row.name}: n {row.pixels}, mean {row.mean:.4f}, sd {row.standard_deviation:.4f}, "
            f"u {row.estimate.standard_uncertainty:.2g}, "
            f"U {row.estimate.expanded_uncertainty():.2g}; {budget}"
        )


def fine(regions: tuple[Region, ...]) -> tuple[Region, ...]:
    """The same regions in the scene's coordinates."""
    return tuple(
        replace(
            region,
            shape=Polygon(tuple((PITCH * c, -PITCH * r) for c, r in region.shape.corners)),
            unit="m",
        )
        for region in regions
    )


def over_temperature(chip: NDArray[np.float64], background: NDArray[np.bool_]) -> None:
    """A chip that oxidises no further and has 0.02 more emissivity each 100 K."""
    maps = []
    for celsius in (391.0, 470.0, 570.0):
        heating = Heating(celsius + 273.15, LABORATORY, 2.0, 1.0, 2.0)
        values = chip + 2e-4 * (celsius - 391.0)
        maps.append(determine_emissivity([heated(values, background, heating.reference)], heating))
    found = [area for area in areas(REGIONS, maps[0].raster) if area.whole]
    lines = [emissivity_line([one.of(area) for one in maps]) for area in found]
    for line in lines:
        middle, slope = line.estimate.values
        of_middle, of_slope = line.estimate.standard_uncertainty
        print(
            f"{line.name}: {100 * slope:.4f} ± {100 * of_slope:.4f} in 100 K, "
            f"{middle:.4f} ± {of_middle:.4f} at {line.middle - 273.15:.0f} °C"
        )
    draw_emissivity(maps[0], REGIONS, lines).savefig(HERE / "emissivity-temperature.png", dpi=150)


def widths() -> None:
    """Print what the blur of the optics makes of shear bands of several widths."""
    heating = Heating(391.0 + 273.15)
    background = chip_emissivity()[1]
    for width in (12e-6, 24e-6, 36e-6, 48e-6, 72e-6, 96e-6):
        flat = np.where(in_shear_band(width), 0.53, 0.42)
        found = determine_emissivity([heated(flat, background, heating.reference)], heating)
        means = [
            found.of(areas((shear_band(width / 2 - inset),), found.raster)[0]).mean
            for inset in (0.0, PITCH, 2 * PITCH)
            if width / 2 - inset > 5e-6
        ]
        print(f"{width * 1e6:.0f} um:", ", ".join(f"{mean:.3f}" for mean in means))


def shear_band(half_width: float) -> Region:
    """Region of the first shear band, so far to either side of its middle."""
    places = [(side * half_width, -height) for side, height in ((-1, 72e-6), (1, 72e-6))]
    places += [(side * half_width, -height) for side, height in ((1, 432e-6), (-1, 432e-6))]
    corners = tuple((BANDS[0] + x - LEAN * y, y) for x, y in places)
    return Region("shear band", Polygon(corners), unit="m")


if __name__ == "__main__":
    main()
