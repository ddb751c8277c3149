"""The scene: fields on a regular grid over time, and the tool in it."""

from chipglow.scene.raster import Raster
from chipglow.scene.scene import ENERGY_UNITS, FIELD_UNITS, Frame, Material, Scene, SceneError
from chipglow.scene.tool import Chamfer, Hone, Tool, ToolGeometry
from chipglow.scene.tool_outline import ToolOutline, ToolOutlineError

__all__ = [
    "ENERGY_UNITS",
    "FIELD_UNITS",
    "Chamfer",
    "Frame",
    "Hone",
    "Material",
    "Raster",
    "Scene",
    "SceneError",
    "Tool",
    "ToolGeometry",
    "ToolOutline",
    "ToolOutlineError",
]
