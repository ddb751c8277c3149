"""Heated chips and tool, and the emissivity that their images give back (Figures 3, 4, Table 1)."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera
from chipglow.laboratory.emissivity import (
    EmissivityMap,
    Heating,
    RegionEmissivity,
    determine_emissivity,
)
from chipglow.laboratory.emissivity.emissivity import LABORATORY
from chipglow.quantities import Brief
from chipglow.scene import Area, Material, Polygon, Raster, Region, Scene, Tool, areas
from chipglow.surface import Emissivity, FeatureSurface, Surface

CHIP_TEMPERATURES: Final[Mapping[str, float]] = {"chip 1": 664.15, "chip 2": 843.15}
"""True temperatures of the paper's heated chips in K (Figure 3); of others the first."""

TOOL_TEMPERATURE: Final = 565.15
"""True temperature of the paper's heated tool in K (its section Tool emissivity)."""

THERMOCOUPLE: Final = 2.0
"""Standard uncertainty of the true temperature in K: an assumption, the paper gives none."""

_SAMPLES: Final = 3
"""Samples along a pixel."""

_ROWS: Final = 50
"""Pixels along the image's height."""

_COLUMNS: Final = 80
"""Pixels of an image, which is wider where a chip's regions are."""

_CHIP_ROWS: Final = (8, 42)
"""First and last row of the body in pixels."""

_REGION_MARGIN: Final = 2
"""Pixels between the ends of a body and its region."""

_TOOL_MARGIN: Final = 3.0
"""Pixels at the edge of chip and tool that are not read."""


@dataclass(frozen=True, eq=False, repr=False)
class HeatedRow(Brief):
    """Emissivity of a feature as put in and as determined: a row of Table 1."""

    feature: str
    true: Emissivity
    found: RegionEmissivity  # of the first texture
    means: NDArray[np.float64]  # over the pixels, shape (texture,)


@dataclass(frozen=True, eq=False, repr=False)
class HeatedObject(Brief):
    """A heated chip or tool, its image of the first texture and the results by region."""

    name: str
    map: EmissivityMap
    regions: tuple[Region, ...]  # none of the tool, which is read as a whole
    rows: tuple[HeatedRow, ...]


def heated_objects(
    camera: Camera,
    surfaces: Mapping[str, Surface],
    tool: Tool,
    band_width: float,
    band_spacing: float,
    textures: int,
) -> tuple[HeatedObject, ...]:
    """Heat a chip of each `FeatureSurface`, then a tool, and determine their emissivity.

    A chip is a strip with straight bands across it, `band_spacing` apart in m.
    """
    # The laboratory's camera has neither the cut's range nor a detector that may saturate.
    oven = replace(
        camera, lower_limit=None, reflected=LABORATORY, shape=None, offset=(0.0, 0.0), detector=None
    )
    known = {name: s for name, s in surfaces.items() if isinstance(s, FeatureSurface)}
    width = max(band_width, camera.pitch)
    chips = [
        _heated_chip(oven, name, surface, width, band_spacing, textures)
        for name, surface in known.items()
    ]
    tools = [_heated_tool(oven, surface, tool, textures) for surface in known.values()]
    return (*chips, *tools[:1])


def _heated_chip(
    camera: Camera, name: str, surface: FeatureSurface, width: float, spacing: float, textures: int
) -> HeatedObject:
    pitch, (first, last) = camera.pitch, _CHIP_ROWS
    between, half_band = 0.5 * spacing / pitch, 0.5 * width / pitch
    # The body between two bands, without the parts near them; at most half of the usual image.
    half_body = min(0.3 * spacing / pitch, _COLUMNS / 4)
    columns = max(_COLUMNS, 2 * ceil(max(between + half_body, half_band)))
    raster = _raster(pitch, columns)
    away = np.abs(raster.x - spacing * np.round(raster.x / spacing))
    inside = np.abs(raster.y - (raster.top - pitch * _ROWS / 2)) < pitch * (last - _ROWS / 2)
    material = np.where(inside, Material.WORKPIECE, Material.VOID)[:, None]
    # Wholly shear band within its width, by the rate, as in the developing band.
    rate = np.where(away < width / 2, 1e6, 0.0)
    temperature = CHIP_TEMPERATURES.get(name, CHIP_TEMPERATURES["chip 1"])
    images = _images(camera, surface, textures, raster, temperature, material, rate)
    regions = tuple(
        Region(
            f"{name} {title}",
            Polygon.rectangle(
                (at - half, first + _REGION_MARGIN), (at + half, last - _REGION_MARGIN)
            ),
            feature,
        )
        for title, feature, at, half in (
            ("body", "chip body", columns / 2 + between, half_body),
            ("shear band", "shear band", columns / 2, half_band),
        )
    )
    true = {"chip body": surface.chip, "shear band": surface.shear_band}
    rows = tuple(
        _row(f"{name} {area.feature}", true[area.feature], images, area)
        for area in areas(regions, images[0].raster)
    )
    return HeatedObject(name, images[0], regions, rows)


def _heated_tool(
    camera: Camera, surface: FeatureSurface, tool: Tool, textures: int
) -> HeatedObject:
    pitch, (x, y) = camera.pitch, tool.edge_point
    # The edge is 30 % of the width from the left and 10 % of the height above the bottom.
    raster = _raster(pitch, _COLUMNS, (x - 0.3 * _COLUMNS * pitch, y + 0.9 * _ROWS * pitch))

    def depth(of: Raster) -> NDArray[np.float64]:
        return tool.signed_distance(*np.meshgrid(of.x, of.y))

    material = np.where(depth(raster) < 0, Material.TOOL, Material.VOID)
    images = _images(camera, surface, textures, raster, TOOL_TEMPERATURE, material, 0.0)
    inside = depth(images[0].raster) < -_TOOL_MARGIN * pitch
    area = Area("tool", "tool", inside, whole=True)
    return HeatedObject("tool", images[0], (), (_row("tool", surface.tool, images, area),))


def _raster(pitch: float, columns: int, corner: tuple[float, float] | None = None) -> Raster:
    """Return samples of pixels around the origin, or from an upper left corner on."""
    spacing, rows, columns = pitch / _SAMPLES, _SAMPLES * _ROWS, _SAMPLES * columns
    left, top = corner or (-columns * spacing / 2, rows * spacing / 2)
    return Raster(left, top, spacing, rows, columns)


def _images(
    camera: Camera,
    surface: FeatureSurface,
    textures: int,
    raster: Raster,
    temperature: float,
    material: NDArray[np.integer],
    rate: NDArray[np.float64] | float,
) -> list[EmissivityMap]:
    """Return emissivity maps of an object of one temperature, at rest, with each texture."""
    x, y = np.meshgrid(raster.x, raster.y)
    fields = {
        "temperature": temperature,
        "plastic_strain": 1.0,
        "plastic_strain_rate": rate,
        "velocity_x": 0.0,
        "velocity_y": 0.0,
        "material": material.astype(np.uint8),
        "material_x": x,
        "material_y": y,
    }
    frames = {name: np.broadcast_to(of, (1, *raster.shape)) for name, of in fields.items()}
    scene = Scene.from_fields(raster, [0.0], frames)
    heating = Heating(temperature, reference_uncertainty=THERMOCOUPLE)
    at_rest = [replace(surface.redrawn(k), follow="material") for k in range(textures)]
    return [determine_emissivity([camera.measure(scene, one, 0.0)], heating) for one in at_rest]


def _row(feature: str, true: Emissivity, images: list[EmissivityMap], area: Area) -> HeatedRow:
    rows = [image.of(area) for image in images]
    return HeatedRow(feature, true, rows[0], np.array([row.mean for row in rows]))
