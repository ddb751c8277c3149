"""A tool somewhere else than at the origin, as in a real camera's image."""

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from chipglow.scene.tool import Tool


@dataclass(frozen=True)
class PlacedTool(Tool):
    """A tool whose tip is where a measurement's coordinates have it."""

    tool: Tool
    """The tool with its tip at the origin, as scenes have it."""
    tip: tuple[float, float]
    """Place of that origin in m: x of the edge's leftmost point and y of its lowest one."""

    def __post_init__(self) -> None:
        if isinstance(self.tool, PlacedTool):
            raise ValueError(f"tool: it is at {self.tool.tip} m already, expected one at 0, 0")
        if len(self.tip) != 2 or not all(map(isfinite, self.tip)):
            raise ValueError(f"tip: {self.tip!r}, expected two finite positions in m")

    @property
    def rake_angle(self) -> float:
        """Rake angle of the straight rake face in rad."""
        return self.tool.rake_angle

    @property
    def clearance_angle(self) -> float:
        """Clearance angle of the straight flank face in rad."""
        return self.tool.clearance_angle

    @property
    def corners(self) -> NDArray[np.float64]:
        """Centres of the rounded corners from the rake to the flank face, in m, (n, 2)."""
        return np.asarray(self.tool.corners + self.tip, dtype=np.float64)

    @property
    def corner_radius(self) -> float:
        """Radius of the rounded corners in m."""
        return self.tool.corner_radius

    @property
    def rake_foot(self) -> NDArray[np.float64]:
        """Lower end of the straight rake face in m, shape (2,)."""
        return np.asarray(self.tool.rake_foot + self.tip, dtype=np.float64)

    @property
    def edge_point(self) -> NDArray[np.float64]:
        """The place on the surface that is nearest to the tip: the middle of a round edge."""
        return np.asarray(self.tool.edge_point + self.tip, dtype=np.float64)
