"""The cutting tool as a section of YAML files, and its outline as a file."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator

from chipglow.cutting import material_names, tool_material
from chipglow.io.column_file import read_polyline
from chipglow.quantities import FileBeside, Parameter, made_from
from chipglow.quantities.units import Position
from chipglow.scene import Tool, ToolGeometry, ToolOutline, ToolOutlineError, Wedge
from chipglow.text import load_described


def _known(name: str) -> str:
    tool_material(name)
    return name


@dataclass(frozen=True)
class ToolSection(Wedge):
    """The cutting tool."""

    outline: Annotated[
        FileBeside | None,
        Parameter(
            "File of an outline instead of all these: its first line x_um,y_um, then a point "
            "a line, from the rake face round the edge to the flank face.",
            allowed="none, or a file such as edge.csv",
        ),
    ] = None
    material: Annotated[
        str,
        AfterValidator(_known),
        Parameter("Material of the tool.", allowed=", ".join(material_names("tool"))),
    ] = "carbide"

    def __post_init__(self) -> None:
        super().__post_init__()
        given = "outline" if self.outline else "hone" if self.hone else ""
        unused = {"outline": Wedge.declared(), "hone": ["edge_radius"]}.get(given, [])
        for name in unused:
            if getattr(self, name) != getattr(Wedge, name):
                raise ValueError(f"{name}: cannot be combined with {given}, give only one of them")
        self.build()

    def build(self) -> Tool:
        """Return the tool's outline."""
        if self.outline:
            try:
                return read_tool_outline(self.outline)
            except ValueError as error:
                raise ValueError(f"outline: {error}") from None
        return made_from(ToolGeometry, self)


@dataclass(frozen=True)
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
        """Return the tool in the measurement's coordinates."""
        tool = super().build()
        return tool if self.tip is None else tool.at(self.tip)


def load_tool(path: str | Path) -> Tool:
    """Read a tool from a YAML file."""
    return load_described(ToolDescription, path).build()


def read_tool_outline(path: str | os.PathLike[str]) -> ToolOutline:
    """Read a tool's outline from a CSV file and place it: see `ToolOutline.placed`.

    First line ``x_um,y_um``, or another unit of length; then one point per line from the rake face
    round the edge to the flank face, x along the workpiece's motion, y upward.
    """
    path = Path(path)
    points, lines = read_polyline(path)
    try:
        return ToolOutline.placed(points)
    except ToolOutlineError as error:
        raise ValueError(f"{path}, line {lines[error.point]}: {error}") from None
