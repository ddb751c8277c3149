"""A tool as a file of its own, for the commands that need to know where the rake face is."""

from pathlib import Path
from typing import Annotated

from chipglow.camera import Measurement
from chipglow.io import ToolSection
from chipglow.quantities import Parameter
from chipglow.quantities.units import Position
from chipglow.scene import PlacedTool, Tool
from chipglow.text import load_described


class ToolDescription(ToolSection):
    """A cutting tool and where it is."""

    tip: Annotated[
        tuple[Position, Position] | None,
        Parameter(
            "Where the tip is in the measurement's coordinates: x of the edge's leftmost point, y "
            "of its lowest one; at the origin by default.",
            allowed="none, or [-12 um, 3.5 um]",
        ),
    ] = None

    def build(self) -> Tool:
        """The tool in the measurement's coordinates."""
        tool = super().build()
        return tool if self.tip is None else PlacedTool(tool, self.tip)


def load_tool(path: str | Path) -> Tool:
    """Read a tool from a YAML file."""
    return load_described(ToolDescription, path).build()


def tool_of(measurement: Measurement, path: str | Path | None) -> Tool:
    """Tool of a file or, without one, the tool that a measurement states."""
    if path is not None:
        return load_tool(path)
    tool = measurement.tool
    if tool is None:
        raise ValueError(
            "--tool: the measurement states no tool, expected a tool's YAML file, or 'found' to "
            "look for the rake face in the image"
        )
    return tool
