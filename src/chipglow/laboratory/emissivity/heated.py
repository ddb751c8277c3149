"""Chips and a tool that are heated evenly, and the emissivity that an image of them gives back.

The paper's Figures 3 and 4 and its Table 1: the laboratory's procedure on objects of which the
emissivity is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chipglow.camera import Camera
from chipglow.laboratory.emissivity.emissivity import (
    LABORATORY,
    EmissivityMap,
    Heating,
    RegionEmissivity,
    determine_emissivity,
)
from chipglow.scene import Area, Material, Polygon, Raster, Region, Scene, Tool, areas
from chipglow.surface import Emissivity, FeatureSurface, Surface

CHIP_TEMPERATURES: Final[Mapping[str, float]] = {"chip 1": 664.15, "chip 2": 843.15}
"""True temperatures of the paper's heated chips in K (Figure 3); of others the first."""

TOOL_TEMPERATURE: Final = 565.15
"""True temperature of the paper's heated tool in K (its section Tool emissivity)."""

THERMOCOUPLE: Final = 2.0
"""Standard uncertainty of the true temperature in K: an assumption, the paper gives none."""

_SAMPLES_A_PIXEL: Final = 3
_PIXELS: Final = (50, 80)
_CHIP_ROWS: Final = (8, 42)
_BODY: Final = "chip body"
_BAND: Final = "shear band"
_CHIP_STRAIN: Final = 1.0
_EDGE_OF_TOOL: Final = 3.0


@dataclass(frozen=True, eq=False)
class HeatedRow:
    """Emissivity of one feature, as it was put in and as it comes back: a row of Table 1.

    Parameters
    ----------
    feature : str
        The feature.
    true : Emissivity
        What was put in.
    found : RegionEmissivity
        What the procedure gives of the first texture, with its uncertainty.
    means, deviations : ndarray
        Means and standard deviations over the pixels of every texture, shape (textures,).
    """

    feature: str
    true: Emissivity
    found: RegionEmissivity
    means: NDArray[np.float64]
    deviations: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class HeatedObject:
    """A heated object, its image of the first texture and what comes back.

    Parameters
    ----------
    name : str
        The surface, or the tool.
    map : EmissivityMap
        Its image as emissivity and radiance temperature.
    regions : tuple of Region
        Where the emissivity was read; none of the tool, which was read as a whole.
    rows : tuple of HeatedRow
        What came back.
    """

    name: str
    map: EmissivityMap
    regions: tuple[Region, ...]
    rows: tuple[HeatedRow, ...]


def heated_objects(
    camera: Camera,
    surfaces: Mapping[str, Surface],
    tool: Tool,
    band_width: float,
    band_spacing: float,
    textures: int,
) -> tuple[HeatedObject, ...]:
    """Heat a chip of each surface, and the tool, and determine their emissivity from an image.

    Parameters
    ----------
    camera : Camera
        The camera; as for heated objects in the laboratory, without the lower limit of its range
        at the exposure of the cut, and without its detector, which may saturate then.
    surfaces : mapping
        Surfaces by name; those that are no `FeatureSurface` are left out.
    tool : Tool
        The tool.
    band_width, band_spacing : float
        Width of the chip's shear bands and their distance along the chip in m.
    textures : int
        How many textures the means are taken of.

    Returns
    -------
    tuple of HeatedObject
        The chips, then the tool; empty without a `FeatureSurface`.

    Notes
    -----
    The chip is a strip with straight bands across it, of one temperature. It reflects the paper's
    laboratory of 293 K (Equation 2), which the procedure takes into account.
    """
    oven = replace(
        camera,
        lower_limit=None,
        reflected=LABORATORY,
        shape=None,
        offset=(0.0, 0.0),
        detector=None,
    )
    known = {name: s for name, s in surfaces.items() if isinstance(s, FeatureSurface)}
    chips = [
        _heated_chip(oven, name, surface, max(band_width, camera.pitch), band_spacing, textures)
        for name, surface in known.items()
    ]
    of_tool = [_heated_tool(oven, surface, tool, textures) for surface in known.values()]
    return (*chips, *of_tool[:1])


def _heated_chip(
    camera: Camera, name: str, surface: FeatureSurface, width: float, spacing: float, textures: int
) -> HeatedObject:
    pitch, (rows, columns) = camera.pitch, _PIXELS
    raster = _raster(pitch)
    x, y = np.meshgrid(raster.x, raster.y)
    away = np.abs(x - spacing * np.round(x / spacing))
    inside = np.abs(y - (raster.top - pitch * rows / 2)) < pitch * (_CHIP_ROWS[1] - rows / 2)
    scene = _scene(
        raster,
        CHIP_TEMPERATURES.get(name, CHIP_TEMPERATURES["chip 1"]),
        np.where(inside, Material.WORKPIECE, Material.VOID),
        # Wholly shear band within its width: the rate says so, as in the developing band.
        np.where(away < width / 2, 1e6, 0.0),
    )
    middle = columns / 2
    half_body = min(0.3 * spacing / pitch, middle / 2)
    between = 0.5 * spacing / pitch
    half_band = 0.5 * width / pitch
    top, bottom = _CHIP_ROWS[0] + 2, _CHIP_ROWS[1] - 2
    regions = (
        _box(f"{name} body", _BODY, middle + between, half_body, top, bottom),
        _box(f"{name} shear band", _BAND, middle, half_band, top, bottom),
    )
    true = {_BODY: surface.chip, _BAND: surface.shear_band}
    found = [
        _determined(camera, scene, surface.redrawn(k), CHIP_TEMPERATURES.get(name, 664.15))
        for k in range(textures)
    ]
    rows_ = tuple(
        _row(f"{name} {area.feature}", true[area.feature], found, area)
        for area in areas(regions, found[0].raster)
    )
    return HeatedObject(name, found[0], regions, rows_)


def _heated_tool(
    camera: Camera, surface: FeatureSurface, tool: Tool, textures: int
) -> HeatedObject:
    pitch, (rows, columns) = camera.pitch, _PIXELS
    edge = tool.edge_point
    corner = (float(edge[0]) - 0.3 * columns * pitch, float(edge[1]) + 0.9 * rows * pitch)
    raster = _raster(pitch, corner)
    depth = tool.signed_distance(*np.meshgrid(raster.x, raster.y))
    material = np.where(depth < 0, Material.TOOL, Material.VOID)
    scene = _scene(raster, TOOL_TEMPERATURE, material, np.zeros(raster.shape))
    found = [
        _determined(camera, scene, surface.redrawn(k), TOOL_TEMPERATURE) for k in range(textures)
    ]
    pixels = found[0].raster
    inside = tool.signed_distance(*np.meshgrid(pixels.x, pixels.y)) < -_EDGE_OF_TOOL * pitch
    area = Area("tool", "tool", inside, whole=True)
    return HeatedObject("tool", found[0], (), (_row("tool", surface.tool, found, area),))


def _raster(pitch: float, corner: tuple[float, float] | None = None) -> Raster:
    rows, columns = (_SAMPLES_A_PIXEL * count for count in _PIXELS)
    spacing = pitch / _SAMPLES_A_PIXEL
    left, top = corner or (-columns * spacing / 2, rows * spacing / 2)
    return Raster(left, top, spacing, rows, columns)


def _scene(
    raster: Raster, temperature: float, material: NDArray[np.integer], rate: NDArray[np.float64]
) -> Scene:
    """One frame of one temperature, at rest."""
    x, y = np.meshgrid(raster.x, raster.y)
    zero = np.zeros(raster.shape)
    fields: dict[str, NDArray[np.generic]] = {
        "temperature": zero + temperature,
        "plastic_strain": zero + _CHIP_STRAIN,
        "plastic_strain_rate": rate,
        "velocity_x": zero,
        "velocity_y": zero,
        "material": material.astype(np.uint8),
        "material_x": x,
        "material_y": y,
    }
    frames = {name: np.stack([values]) for name, values in fields.items()}
    return Scene.from_fields(raster, [0.0], frames)


def _determined(
    camera: Camera, scene: Scene, surface: FeatureSurface, reference: float
) -> EmissivityMap:
    at_rest = replace(surface, follow="material")
    image = camera.measure(scene, at_rest, 0.0)
    return determine_emissivity([image], Heating(reference, reference_uncertainty=THERMOCOUPLE))


def _box(
    name: str, feature: str, middle: float, half_width: float, top: float, bottom: float
) -> Region:
    shape = Polygon.rectangle((middle - half_width, top), (middle + half_width, bottom))
    return Region(name, shape, feature)


def _row(feature: str, true: Emissivity, found: list[EmissivityMap], area: Area) -> HeatedRow:
    rows = [image.of(area) for image in found]
    return HeatedRow(
        feature=feature,
        true=true,
        found=rows[0],
        means=np.array([row.mean for row in rows]),
        deviations=np.array([row.standard_deviation for row in rows]),
    )
