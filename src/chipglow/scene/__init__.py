"""The scene: fields on a regular grid over time, and the tool in it."""

from chipglow.scene.lines import Line, sample, straight_line
from chipglow.scene.placed_tool import PlacedTool
from chipglow.scene.raster import Raster
from chipglow.scene.regions import Area, Circle, Polygon, Region, areas, shared_pixels
from chipglow.scene.sampled import READABLE, SampledFrame
from chipglow.scene.scene import (
    ENERGY_UNITS,
    FIELD_UNITS,
    FILLED,
    MATERIAL_COORDINATE_UNITS,
    QUALITY,
    Frame,
    Material,
    Scene,
    SceneError,
    is_gap,
)
from chipglow.scene.tool import Chamfer, Hone, Tool, ToolGeometry
from chipglow.scene.tool_outline import ToolOutline, ToolOutlineError

__all__ = [
    "ENERGY_UNITS",
    "FIELD_UNITS",
    "FILLED",
    "MATERIAL_COORDINATE_UNITS",
    "QUALITY",
    "READABLE",
    "Area",
    "Chamfer",
    "Circle",
    "Frame",
    "Hone",
    "Line",
    "Material",
    "PlacedTool",
    "Polygon",
    "Raster",
    "Region",
    "SampledFrame",
    "Scene",
    "SceneError",
    "Tool",
    "ToolGeometry",
    "ToolOutline",
    "ToolOutlineError",
    "areas",
    "is_gap",
    "sample",
    "shared_pixels",
    "straight_line",
]
