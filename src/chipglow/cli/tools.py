"""Tools on the command line: told, described in a file, or found in the image."""

from dataclasses import dataclass
from math import degrees

from chipglow.analysis import FoundTool, find_tool
from chipglow.camera import Measurement
from chipglow.scene import Tool
from chipglow.study import tool_of


@dataclass(frozen=True)
class ChosenTool:
    """A tool, and what is to be said of it, sentences each.

    Parameters
    ----------
    tool : Tool
        The tool in the measurement's coordinates.
    found, assumptions, doubts : tuple of str
        What was found, what was assumed, and why it may not be relied on.
    """

    tool: Tool
    found: tuple[str, ...] = ()
    assumptions: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


def chosen_tool(measurement: Measurement, tool: str | None) -> ChosenTool:
    """The tool that an option ``--tool`` chooses.

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
        return ChosenTool(tool_of(measurement, tool))
    found = find_tool(measurement)
    shape = found.tool.tool
    assumed = (
        f"clearance angle {degrees(shape.clearance_angle):.3g} deg, edge radius "
        f"{1e6 * shape.corner_radius:.3g} um."
    )
    return ChosenTool(found.tool, (_found(found),), (assumed,), found.doubts)


def _found(found: FoundTool) -> str:
    """What was found, with standard uncertainties."""
    x, y = (1e6 * part for part in found.tool.tip)
    return (
        f"Found: rake angle {degrees(found.tool.rake_angle):.1f} ± "
        f"{degrees(found.angle_uncertainty):.1f} deg; the rake face to "
        f"± {1e6 * found.position_uncertainty:.1f} um across itself; tip at x {x:.1f} um, "
        f"y {y:.1f} um, to ± {1e6 * found.tip_uncertainty:.0f} um along the face (standard "
        "uncertainties)."
    )
