"""The scene: fields on a regular grid over time, and the tool in it."""

from chipglow.scene.lines import (
    Line as Line,
    sample as sample,
    straight_line as straight_line,
)
from chipglow.scene.placed_tool import (
    PlacedTool as PlacedTool,
)
from chipglow.scene.raster import (
    Raster as Raster,
)
from chipglow.scene.regions import (
    Area as Area,
    Circle as Circle,
    Polygon as Polygon,
    Region as Region,
    areas as areas,
    shared_pixels as shared_pixels,
)
from chipglow.scene.sampled import (
    READABLE as READABLE,
    SampledFrame as SampledFrame,
)
from chipglow.scene.scene import (
    ENERGY_UNITS as ENERGY_UNITS,
    FIELD_UNITS as FIELD_UNITS,
    FILLED as FILLED,
    MATERIAL_COORDINATE_UNITS as MATERIAL_COORDINATE_UNITS,
    QUALITY as QUALITY,
    Frame as Frame,
    Material as Material,
    Scene as Scene,
    SceneError as SceneError,
    is_gap as is_gap,
)
from chipglow.scene.tool import (
    Chamfer as Chamfer,
    Hone as Hone,
    Tool as Tool,
    ToolGeometry as ToolGeometry,
)
from chipglow.scene.tool_outline import (
    ToolOutline as ToolOutline,
    ToolOutlineError as ToolOutlineError,
)
