"""Tools on the command line: told, described in a file, or found in the image."""

from math import degrees

from chipglow.analysis import FoundTool, find_tool
from chipglow.camera import Measurement
from chipglow.scene import Tool
from chipglow.study import tool_of


def chosen_tool(measurement: Measurement, tool: str | None) -> tuple[Tool, list[str]]:
    """The tool that an option ``--tool`` chooses, and what is to be said of it.

    Parameters
    ----------
    measurement : Measurement
        Tells its tool, or shows it.
    tool : str, optional
        A tool's YAML file; ``found``, to look for the rake face in the image; by default what the
        measurement tells.

    Raises
    ------
    ValueError
        If there is no such tool.
    OSError
        If the file cannot be read.
    """
    if tool != "found":
        return tool_of(measurement, tool), []
    found = find_tool(measurement)
    return found.tool, [*_found(found), *(f"Doubtful: {doubt}" for doubt in found.doubts)]


def _found(found: FoundTool) -> list[str]:
    """What was found, with standard uncertainties, and what was assumed."""
    shape, (x, y) = found.tool.tool, (1e6 * part for part in found.tool.tip)
    return [
        f"Found: rake angle {degrees(found.tool.rake_angle):.1f} ± "
        f"{degrees(found.angle_uncertainty):.1f} deg; the rake face to "
        f"± {1e6 * found.position_uncertainty:.1f} um across itself; tip at x {x:.1f} um, "
        f"y {y:.1f} um, to ± {1e6 * found.tip_uncertainty:.0f} um along the face (standard "
        "uncertainties).",
        f"Assumed: clearance angle {degrees(shape.clearance_angle):.3g} deg, edge radius "
        f"{1e6 * shape.corner_radius:.3g} um.",
    ]
