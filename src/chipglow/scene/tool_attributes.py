"""A tool as plain attributes of a dataset, and back."""

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from chipglow.scene.tool import Chamfer, Hone, PlacedTool, Tool, ToolGeometry
from chipglow.scene.tool_outline import ToolOutline

_WEDGE: Final = ("rake_angle", "clearance_angle", "edge_radius")
_CHAMFER: Final = ("tool_chamfer_width", "tool_chamfer_angle")
_HONE: Final = ("tool_hone_rake", "tool_hone_clearance")


def tool_attributes(tool: Tool) -> dict[str, Any]:
    """Return the tool as attributes of a dataset: angles in rad, lengths in m."""
    if isinstance(tool, PlacedTool):
        return {**tool_attributes(tool.tool), "tool_tip": np.array(tool.tip)}
    if isinstance(tool, ToolOutline):
        return {"tool_outline": tool.corners.ravel()}
    assert isinstance(tool, ToolGeometry)
    values = {f"tool_{name}": getattr(tool, name) for name in _WEDGE}
    if tool.chamfer:
        values |= zip(_CHAMFER, (tool.chamfer.width, tool.chamfer.angle), strict=True)
    if tool.hone:
        values |= zip(_HONE, (tool.hone.rake, tool.hone.clearance), strict=True)
    return values


def stored_tool(attributes: Mapping[str, Any]) -> Tool | None:
    """Return the tool that attributes of a dataset describe, if they do."""
    tool = _tool_at_origin(attributes)
    if tool is None or "tool_tip" not in attributes:
        return tool
    x, y = np.asarray(attributes["tool_tip"], dtype=np.float64).tolist()
    return PlacedTool(tool, (x, y))


def _tool_at_origin(attributes: Mapping[str, Any]) -> Tool | None:
    if "tool_outline" in attributes:
        line = np.asarray(attributes["tool_outline"], dtype=np.float64).reshape(-1, 2)
        return ToolOutline(tuple((float(x), float(y)) for x, y in line))
    if not all(f"tool_{name}" in attributes for name in _WEDGE):
        return None
    wedge = {name: float(attributes[f"tool_{name}"]) for name in _WEDGE}
    chamfer = [float(attributes[name]) for name in _CHAMFER if name in attributes]
    hone = [float(attributes[name]) for name in _HONE if name in attributes]
    return ToolGeometry(
        **wedge,
        chamfer=Chamfer(*chamfer) if len(chamfer) == len(_CHAMFER) else None,
        hone=Hone(*hone) if len(hone) == len(_HONE) else None,
    )
