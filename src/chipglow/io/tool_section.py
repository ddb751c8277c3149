"""The cutting tool as a section of YAML files, and its outline as a file."""

import os
from pathlib import Path
from typing import Annotated, Self

from pydantic import field_validator, model_validator

from chipglow.cutting import material_names, tool_material
from chipglow.io.column_file import read_polyline
from chipglow.quantities import FileBeside, Parameter, Settings
from chipglow.scene import Chamfer, Hone, Tool, ToolGeometry, ToolOutline, ToolOutlineError


class ToolSection(Settings[Tool]):
    """The cutting tool."""

    rake_angle: Annotated[float, ToolGeometry.parameter("rake_angle")] = ToolGeometry.rake_angle
    clearance_angle: Annotated[float, ToolGeometry.parameter("clearance_angle")] = (
        ToolGeometry.clearance_angle
    )
    edge_radius: Annotated[float, ToolGeometry.parameter("edge_radius")] = ToolGeometry.edge_radius
    chamfer: Annotated[Chamfer | None, ToolGeometry.parameter("chamfer")] = None
    hone: Annotated[Hone | None, ToolGeometry.parameter("hone")] = None
    outline: Annotated[
        FileBeside | None,
        Parameter(
            "File of an outline instead of all these: its first line x_um,y_um, then a point "
            "a line, from the rake face round the edge to the flank face.",
            allowed="none, or a file such as edge.csv",
        ),
    ] = None
    material: Annotated[
        str, Parameter("Material of the tool.", allowed=", ".join(material_names("tool")))
    ] = "carbide"

    @field_validator("material")
    @classmethod
    def _known(cls, name: str) -> str:
        tool_material(name)
        return name

    @model_validator(mode="after")
    def _nothing_unused(self) -> Self:
        if self.outline:
            self._refuse_beside("outline", set(ToolSection.model_fields) - {"outline", "material"})
        elif self.hone:
            self._refuse_beside("hone", {"edge_radius"})
        return self

    def _refuse_beside(self, given: str, unused: set[str]) -> None:
        default = type(self)()
        for name in type(self).model_fields:
            if name in unused and getattr(self, name) != getattr(default, name):
                raise ValueError(f"{name}: is not used beside {given}, expected one or the other")

    def build(self) -> Tool:
        """The tool's outline."""
        if self.outline:
            try:
                return read_tool_outline(self.outline)
            except ValueError as error:
                raise ValueError(f"outline: {error}") from None
        return ToolGeometry(**{name: getattr(self, name) for name in ToolGeometry.parameters()})


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
