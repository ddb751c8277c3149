from . import scenes as scenes
from .frame import (
    FIELD_UNITS as FIELD_UNITS,
    FILLED as FILLED,
    MATERIAL_COORDINATE_UNITS as MATERIAL_COORDINATE_UNITS,
    QUALITY as QUALITY,
    READABLE as READABLE,
    Frame as Frame,
    Material as Material,
    SampledFrame as SampledFrame,
    SceneError as SceneError,
)
from .lines import Line as Line, sample as sample, straight_line as straight_line
from .raster import Raster as Raster
from .regions import (
    Area as Area,
    Circle as Circle,
    Pixel as Pixel,
    Polygon as Polygon,
    Polyline as Polyline,
    Region as Region,
    areas as areas,
    shared_pixels as shared_pixels,
)
from .scene import ENERGY_UNITS as ENERGY_UNITS, Scene as Scene, is_gap as is_gap
from .scene_figure import draw_scene as draw_scene
from .scene_summary import (
    QualitySummary as QualitySummary,
    SceneSummary as SceneSummary,
    scene_summary as scene_summary,
)
from .tool import (
    Chamfer as Chamfer,
    Hone as Hone,
    Tool as Tool,
    ToolGeometry as ToolGeometry,
    Wedge as Wedge,
)
from .tool_outline import ToolOutline as ToolOutline, ToolOutlineError as ToolOutlineError
