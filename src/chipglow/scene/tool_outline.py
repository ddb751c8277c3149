"""A tool whose outline is a row of points, and any tool as attributes of a dataset."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import cos
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.scene.tool import SMALLEST_WEDGE, Chamfer, Hone, Tool, ToolGeometry, check_angles
from chipglow.scene.tool_surface import FACE_LENGTH

MOST_OUTLINE_POINTS: Final = 1000
"""Most points of a tool's outline."""

_LARGEST_SPAN: Final = 20e-3
"""Largest extent of an outline in m."""

_SHORTEST_PIECE: Final = 1e-9
"""Shortest piece of an outline in m; shorter ones have no direction."""

_STRAIGHT: Final = 0.2e-6
"""Height of points over the line between their ends, as a length in m, up to which a face is
straight."""

_TOUCHING: Final = 1e-10
"""Distance in m of a point from a line that is taken for 0: rounding."""

_LEVEL: Final = 1e-12
"""Height in m of the lowest point that counts as 0."""

_WEDGE: Final = ("rake_angle", "clearance_angle", "edge_radius")
_EDGES: Final[Mapping[str, type[Chamfer | Hone]]] = {"chamfer": Chamfer, "hone": Hone}
_ORDER: Final = (
    "points go from the rake face round the edge to the flank face, the tool on their left"
)


class ToolOutlineError(ValueError):
    """An outline that no tool can have; `point` is the number of the first wrong point, from 0."""

    def __init__(self, message: str, point: int = 0) -> None:
        super().__init__(message)
        self.point = point


@dataclass(frozen=True)
class ToolOutline(Tool):
    """A tool with straight lines between given points and straight faces beyond the outer ones.

    The straight rake face is the longest stretch from the first point on that stays within 0.2 um
    of the line through its ends; the flank face is the same from the last point back. They give
    rake and clearance angle and continue straight beyond the outer points. The part between them is
    the edge. Distances up the rake face count from the lower end of the straight rake face.
    """

    points: tuple[tuple[float, float], ...]
    """x and y in m from the rake face round the edge to the flank face, the tool on their left, the
    lowest point on y = 0; `placed` moves an outline there."""
    tip: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _check_points(self.own_corners)
        try:
            check_angles(self.rake_angle, self.clearance_angle)
        except ValueError as error:
            raise ToolOutlineError(f"{error}; {_ORDER}") from None
        lowest = float(self.own_corners[:, 1].min())
        if abs(lowest) > _LEVEL:
            raise ToolOutlineError(f"lowest point at y {lowest * 1e6:g} um, expected 0 um")
        self._check_crossing()

    @classmethod
    def placed(cls, points: ArrayLike) -> "ToolOutline":
        """Move an outline: its lowest point to y = 0, the leftmost of the edge to x = 0."""
        line = np.asarray(points, dtype=np.float64)
        _check_points(line)
        edge = line[_straight_end(line) : len(line) - _straight_end(line[::-1])]
        moved = line - [edge[:, 0].min(), line[:, 1].min()]
        return cls(tuple((float(x), float(y)) for x, y in moved))

    @cached_property
    def own_corners(self) -> NDArray[np.float64]:
        """The points in m, shape (n, 2)."""
        return np.array(self.points, dtype=np.float64)

    @property
    def corner_radius(self) -> float:
        """0: the corners are as sharp as they are given."""
        return 0.0

    @cached_property
    def rake_angle(self) -> float:
        """Rake angle of the straight rake face in rad."""
        x, y = self.corners[0] - self.rake_foot
        return float(np.arctan2(x, y))

    @cached_property
    def clearance_angle(self) -> float:
        """Clearance angle of the straight flank face in rad."""
        x, y = self.corners[-1] - self.corners[-1 - _straight_end(self.corners[::-1])]
        return float(np.arctan2(y, x))

    @cached_property
    def rake_foot(self) -> NDArray[np.float64]:
        """Lower end of the straight rake face in m, shape (2,)."""
        return np.asarray(self.corners[_straight_end(self.corners)])

    def _check_crossing(self) -> None:
        """No two pieces may cross, those of the straight faces beyond the points included."""
        first = self.corners[0] + FACE_LENGTH * np.array(self.rake_direction)
        last = self.corners[-1] + FACE_LENGTH * np.array(self.clearance_direction)
        side = _sides(np.concatenate([[first], self.corners, [last]]))
        # Points on one line are on neither side of it, whatever the rounding.
        side[np.abs(side) < _TOUCHING] = 0.0
        apart = side[:, :-1] * side[:, 1:] < 0
        crossing = np.argwhere(np.triu(apart & apart.T, 2))
        if crossing.size:
            first, second = (max(int(piece) - 1, 0) for piece in crossing[0])
            raise ToolOutlineError(
                f"the piece from point {first + 1} crosses that from point {second + 1}, "
                "expected an outline that does not cross itself",
                second,
            )


def _check_points(line: NDArray[np.float64]) -> None:
    if not 3 <= len(line) <= MOST_OUTLINE_POINTS:
        last = min(max(len(line) - 1, 0), MOST_OUTLINE_POINTS)
        raise ToolOutlineError(f"{len(line)} points, expected 3 to {MOST_OUTLINE_POINTS}", last)
    if line.ndim != 2 or line.shape[1] != 2:
        raise ToolOutlineError(f"points of shape {line.shape}, expected (n, 2)")
    finite = np.isfinite(line).all(axis=1)
    if not finite.all():
        point = int(finite.argmin())
        raise ToolOutlineError(f"point {line[point]} m, expected finite numbers", point)
    span = float(np.ptp(line, axis=0).max())
    if span > _LARGEST_SPAN:
        raise ToolOutlineError(
            f"outline {span * 1e3:g} mm long, expected up to {_LARGEST_SPAN * 1e3:g} mm"
        )
    pieces = np.diff(line, axis=0)
    length = np.hypot(pieces[:, 0], pieces[:, 1])
    if (length < _SHORTEST_PIECE).any():
        point = int(length.argmin()) + 1
        raise ToolOutlineError("the same point as the one before, expected another", point)
    tangent = pieces / length[:, None]
    back = (tangent[1:] * tangent[:-1]).sum(axis=1) < -cos(SMALLEST_WEDGE)
    if back.any():
        point = int(back.argmax()) + 1
        raise ToolOutlineError("the line turns back, expected a corner of over 5 degrees", point)


def _straight_end(line: NDArray[np.float64]) -> int:
    """Index of the last point of the straight stretch that begins at the first point."""
    for end in range(2, len(line)):
        along = line[end] - line[0]
        away = line[1:end] - line[0]
        height = np.abs(away[:, 0] * along[1] - away[:, 1] * along[0])
        if height.max() > _STRAIGHT * np.hypot(*along):
            return end - 1
    return len(line) - 1


def _sides(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of every point from the line through every piece, signed, shape (n - 1, n)."""
    pieces = np.diff(line, axis=0)
    away = line[None] - line[:-1, None]
    cross = pieces[:, None, 0] * away[..., 1] - pieces[:, None, 1] * away[..., 0]
    return np.asarray(cross / np.hypot(pieces[:, 0], pieces[:, 1])[:, None])


def tool_attributes(tool: Tool) -> dict[str, Any]:
    """Return the tool as attributes of a dataset: angles in rad, lengths in m."""
    values: dict[str, Any] = {"tool_tip": np.array(tool.tip)} if tool.tip != (0.0, 0.0) else {}
    if isinstance(tool, ToolOutline):
        return values | {"tool_outline": tool.own_corners.ravel()}
    assert isinstance(tool, ToolGeometry)
    values |= {f"tool_{name}": getattr(tool, name) for name in _WEDGE}
    for name, kind in _EDGES.items():
        if edge := getattr(tool, name):
            values |= {f"tool_{name}_{field}": getattr(edge, field) for field in kind.declared()}
    return values


def stored_tool(attributes: Mapping[str, Any]) -> Tool | None:
    """Return the tool that attributes of a dataset describe, if they do."""
    tool = _tool_at_origin(attributes)
    if tool is None or "tool_tip" not in attributes:
        return tool
    x, y = np.asarray(attributes["tool_tip"], dtype=np.float64).tolist()
    return tool.at((x, y))


def _tool_at_origin(attributes: Mapping[str, Any]) -> Tool | None:
    if "tool_outline" in attributes:
        line = np.asarray(attributes["tool_outline"], dtype=np.float64).reshape(-1, 2)
        return ToolOutline(tuple((float(x), float(y)) for x, y in line))
    if not all(f"tool_{name}" in attributes for name in _WEDGE):
        return None
    values: dict[str, Any] = {name: float(attributes[f"tool_{name}"]) for name in _WEDGE}
    for name, kind in _EDGES.items():
        names = [f"tool_{name}_{field}" for field in kind.declared()]
        if all(one in attributes for one in names):
            values[name] = kind(*(float(attributes[one]) for one in names))
    return ToolGeometry(**values)
