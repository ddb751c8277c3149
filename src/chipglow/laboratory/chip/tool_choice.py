"""The tool as commands and the app name it: in a file, or found in the image."""

from math import degrees, hypot
from typing import Final

import numpy as np

from chipglow.camera import Measurement
from chipglow.io import load_tool
from chipglow.laboratory.chip.find_tool import FoundTool, find_tool
from chipglow.laboratory.chip.tool_position import ToolUncertainty, tool_of
from chipglow.laboratory.emissivity.places import FOUND
from chipglow.quantities import uncertainty_text
from chipglow.scene import Tool
from chipglow.text import Notes

_FACE: Final = 200e-6
"""Length of the face in m on which a given tool is compared with the detected one."""
_CLEARLY: Final = 4.0
"""Two places of the face differ if they are this many standard uncertainties apart, or more."""


def with_chosen_tool(
    measurement: Measurement, tool: str | None
) -> tuple[Measurement, Notes, float]:
    """Return a measurement with a tool, and the tool's standard uncertainty in m if found.

    Without a choice it keeps its own tool, or none.
    """
    if tool is None:
        return measurement, Notes(), 0.0
    chosen, known, notes = chosen_tool(measurement, tool)
    return measurement.with_tool(chosen), notes, 0.0 if known is None else known.across


def chosen_tool(
    measurement: Measurement, tool: str | None, position: float | None = None
) -> tuple[Tool, ToolUncertainty | None, Notes]:
    """Return a tool: the measurement's, of a file, or `FOUND`; and its uncertainty if found."""
    if tool is None:
        return tool_of(measurement, None), None, Notes()
    if tool != FOUND:
        given = load_tool(tool)
        return given, None, Notes(warnings=_contradictions(measurement, given))
    found = find_tool(measurement)
    used = found.uncertainty if position is None else None
    return found.tool, used, found.notes + Notes(remarks=_found(found, position))


def _contradictions(measurement: Measurement, given: Tool) -> list[str]:
    """Warn if the image clearly shows a rake face away from that of the given tool."""
    try:
        found = find_tool(measurement)
    except ValueError:
        return []
    seen = found.tool.rake_point(np.array([0.0, _FACE]))
    offsets = (seen - given.rake_point(np.array([0.0, _FACE]))) @ np.array(given.rake_normal)
    allowed = hypot(found.uncertainty.across, _FACE / 2.0 * found.uncertainty.angle)
    offset = float(np.abs(offsets).max())
    if offset <= _CLEARLY * allowed:
        return []
    spread = uncertainty_text(degrees(found.uncertainty.angle))
    return [
        f"The rake face that shows in the image is {1e6 * offset:.0f} um from that "
        f"of the tool file (its rake angle is {degrees(given.rake_angle):.1f} deg, the "
        f"image's {degrees(found.tool.rake_angle):.1f} ± {spread} "
        "deg): the tip, the origin of coordinates, or which way the image is up may be wrong."
    ]


def _found(found: FoundTool, position: float | None) -> list[str]:
    """Describe a detected tool and the uncertainty of its position."""
    (x, y), known = (1e6 * part for part in found.tool.tip), found.uncertainty
    spread = (
        f"± {uncertainty_text(1e6 * known.along)} um along the face, "
        f"± {uncertainty_text(1e6 * known.across)} um across it and "
        f"± {uncertainty_text(degrees(known.angle))} deg (standard uncertainties)"
    )
    used = "found, "
    if position is not None:
        used = f"--position {1e6 * position:g} um instead of the detected one, "
    return [
        f"Found: rake angle {degrees(found.tool.rake_angle):.1f} deg, tip at x {x:.1f} um, "
        f"y {y:.1f} um.",
        f"Position of the tool: {used}{spread}.",
    ]
