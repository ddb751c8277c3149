"""Geometry of the cutting tool: two straight faces and the edge between them."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from math import ceil, cos, degrees, isfinite, pi, radians, sin, tan
from typing import Annotated, Any, Final, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import ANGLE, LENGTH
from chipglow.scene.tool_surface import ToolSurface, surface_distance, surface_distances, surface_of

SMALLEST_WEDGE: Final = radians(5.0)
"""Smallest wedge angle in rad; a thinner tool is a mistake."""

STEEPEST_RAKE: Final = radians(60.0)
"""Largest rake angle in rad of either sign."""

LARGEST_CLEARANCE: Final = radians(45.0)
"""Largest clearance angle in rad."""

DRAWN_FACE: Final = 3e-3
"""Length in m of the faces of a tool in figures: they end outside the image of a cut."""

_RIGHT_ANGLE: Final = pi / 2

_ARC_STEP: Final = pi / 64
"""Angle in rad between two points of an arc."""

_HONE_PIECES: Final = 64
"""Pieces of a honed edge."""

_LARGEST_FORM_FACTOR: Final = 10.0
"""Largest form factor of a hone, and one over the smallest."""


class Tool(ABC):
    """Cross-section of a tool: a rake face, a flank face and the edge between them.

    The edge's lowest point is on the cut surface; the chip is to the left of the rake face. The
    surface is at one distance, `corner_radius`, from the chain of `corners`.
    """

    tip: tuple[float, float]
    """x of the edge's leftmost point and y of its lowest one in m: 0, 0 in scenes."""

    @property
    @abstractmethod
    def rake_angle(self) -> float:
        """Rake angle of the straight rake face in rad; negative: it leans over the chip."""

    @property
    @abstractmethod
    def clearance_angle(self) -> float:
        """Clearance angle of the straight flank face in rad."""

    @property
    @abstractmethod
    def own_corners(self) -> NDArray[np.float64]:
        """The `corners` of the tool with its tip at 0, 0."""

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Centres of the rounded corners from the rake to the flank face, in m, (n, 2)."""
        return np.asarray(self.own_corners + self.tip, dtype=np.float64)

    def at(self, tip: tuple[float, float]) -> Self:
        """Return the same tool with its tip elsewhere, such as in a measurement's coordinates."""
        if len(tip) != 2 or not all(map(isfinite, tip)):
            raise ValueError(f"tip: {tip!r}, expected two finite positions in m")
        tool: Any = self
        return replace(tool, tip=tip)  # type: ignore[no-any-return]

    @property
    @abstractmethod
    def corner_radius(self) -> float:
        """Radius of the rounded corners in m; 0 where they are sharp."""

    @property
    def rake_foot(self) -> NDArray[np.float64]:
        """Lower end of the straight rake face in m, shape (2,)."""
        foot = self.corners[0] + self.corner_radius * np.array(self.rake_normal)
        return np.asarray(foot, dtype=np.float64)

    @property
    def rake_direction(self) -> tuple[float, float]:
        """Unit vector up the rake face, away from the edge."""
        return sin(self.rake_angle), cos(self.rake_angle)

    @property
    def rake_normal(self) -> tuple[float, float]:
        """Unit normal of the rake face, from the tool into the chip."""
        return -cos(self.rake_angle), sin(self.rake_angle)

    @property
    def clearance_direction(self) -> tuple[float, float]:
        """Unit vector along the flank face, away from the edge."""
        return cos(self.clearance_angle), sin(self.clearance_angle)

    @property
    def edge_point(self) -> NDArray[np.float64]:
        """The place on the surface that is nearest to the tip: the middle of a round edge."""
        distance, *normal = surface_distance(*self.tip, self.surface)
        return np.asarray(np.array(self.tip) - distance * np.array(normal), np.float64)

    @cached_property
    def surface(self) -> ToolSurface:
        """The surface as kernels take it."""
        return surface_of(
            self.corners, self.corner_radius, self.rake_direction, self.clearance_direction
        )

    def rake_point(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return x and y in m, shape (..., 2), at distances in m up the rake face from its foot."""
        along = np.asarray(distance, dtype=np.float64)[..., None]
        return np.asarray(self.rake_foot + along * np.array(self.rake_direction), dtype=np.float64)

    def face_coordinates(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return distances of points (..., 2) up the rake face from its foot, and into the chip."""
        offset = points - self.rake_foot
        return offset @ np.array(self.rake_direction), offset @ np.array(self.rake_normal)

    def signed_distance(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Return the distance of places in m to the tool's surface, negative inside the tool."""
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        distance = surface_distances(x.ravel(), y.ravel(), self.surface)
        return np.asarray(distance, dtype=np.float64).reshape(x.shape)

    def outline(self, length: float) -> NDArray[np.float64]:
        """Return points (n, 2) round the edge, and on the faces this far beyond it, in m."""
        rake, clearance = np.array(self.rake_direction), np.array(self.clearance_direction)
        pieces = np.concatenate([[-rake], np.diff(self.corners, axis=0), [clearance]])
        heading = np.unwrap(np.arctan2(pieces[:, 1], pieces[:, 0]))
        radius = self.corner_radius
        arcs = [radius * _right_of(*turn, radius > 0) for turn in pairwise(heading)]
        round_edge = np.concatenate([c + arc for c, arc in zip(self.corners, arcs, strict=True)])
        top, right = round_edge[0] + length * rake, round_edge[-1] + length * clearance
        return np.concatenate([top[None], round_edge, right[None]])


def _right_of(start: float, end: float, curved: bool) -> NDArray[np.float64]:
    """Return unit vectors to the right of headings from start to end, shape (n, 2)."""
    steps = ceil(abs(end - start) / _ARC_STEP) if curved else 0
    heading = np.linspace(start, end, steps + 1)
    return np.stack([np.sin(heading), -np.cos(heading)], axis=1)


@dataclass(frozen=True)
class Chamfer(Part):
    """A chamfer of the cutting edge: a flat land between the faces, a T-land, a negative land.

    The land's rake angle is the rake angle minus the chamfer's angle.
    """

    width: Annotated[float, Parameter("Width of the land, between its sharp corners.", LENGTH)]
    angle: Annotated[
        float,
        Parameter("Angle between the land and the rake face.", ANGLE, over=0.0, under=_RIGHT_ANGLE),
    ]


@dataclass(frozen=True)
class Hone(Part):
    """A hone of the cutting edge: a rounding that need not be symmetric.

    Denkena et al. describe an edge by these two distances, S_gamma and S_alpha; their ratio
    S_gamma / S_alpha is the form factor K: over 1 is a waterfall hone, 1 a symmetric one. They
    leave the curve between open. Here it is the arc of an ellipse that touches both faces there;
    for K = 1 that is the arc of a circle. K is 0.1 to 10.
    """

    rake: Annotated[
        float, Parameter("Where it begins on the rake face, from the sharp edge.", LENGTH)
    ]
    clearance: Annotated[float, Parameter("The same on the flank face.", LENGTH)]

    def __post_init__(self) -> None:
        super().__post_init__()
        factor = self.form_factor
        if not 1 / _LARGEST_FORM_FACTOR <= factor <= _LARGEST_FORM_FACTOR:
            raise ValueError(
                f"hone: its form factor rake / clearance is {factor:g}, "
                f"expected {1 / _LARGEST_FORM_FACTOR:g} to {_LARGEST_FORM_FACTOR:g}"
            )

    @property
    def form_factor(self) -> float:
        """K = S_gamma / S_alpha."""
        return self.rake / self.clearance


@dataclass(frozen=True)
class Wedge(Part):
    """Angles and edge of a tool."""

    rake_angle: Annotated[
        float,
        Parameter(
            "Rake angle; negative: the rake face leans over the chip.",
            ANGLE,
            over=-STEEPEST_RAKE,
            under=STEEPEST_RAKE,
            allowed="more than -60 deg, less than 60 deg; a wedge of 5 deg or more must be left",
        ),
    ] = radians(-7.0)
    clearance_angle: Annotated[
        float,
        Parameter(
            "Angle between the tool's flank and the cut surface.",
            ANGLE,
            over=0.0,
            under=LARGEST_CLEARANCE,
        ),
    ] = radians(7.0)
    edge_radius: Annotated[
        float, Parameter("Radius of the cutting edge, or of a chamfer's corners.", LENGTH)
    ] = 20e-6
    chamfer: Annotated[
        Chamfer | None,
        Parameter(
            "Chamfer of the edge: the width between sharp corners, the angle from the rake face.",
            allowed="none, or {width: 100 um, angle: 20 deg}",
        ),
    ] = None
    hone: Annotated[
        Hone | None,
        Parameter(
            "Hone instead of the edge's radius: how far from the sharp edge it begins on either "
            "face.",
            allowed="none, or {rake: 40 um, clearance: 20 um}",
        ),
    ] = None


@dataclass(frozen=True)
class ToolGeometry(Wedge, Tool):
    """A wedge with a prepared edge: rounded, chamfered or honed.

    The circle of the rounded edge touches the lines x = 0 and y = 0; so do the circle of a
    chamfer's lower corner and the ellipse of a hone.

    Raises
    ------
    ValueError
        If an angle or a length is impossible, if no land is left between the rounded corners of
        the chamfer, or if there are both a chamfer and a hone.
    """

    tip: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_angles(self.rake_angle, self.clearance_angle)
        if self.chamfer and self.hone:
            raise ValueError("chamfer and hone: cannot be combined")
        if self.chamfer:
            self._check_chamfer(self.chamfer)

    @property
    def land(self) -> float:
        """Length in m of the chamfer's flat between its rounded corners; 0 without a chamfer."""
        if self.chamfer is None:
            return 0.0
        turn = self.chamfer.angle
        rest = _RIGHT_ANGLE + self.rake_angle + self.clearance_angle - turn
        return self.chamfer.width - self.edge_radius * (tan(turn / 2) + tan(rest / 2))

    @property
    def own_corners(self) -> NDArray[np.float64]:
        """Centres of the rounded corners with the tip at 0, 0, in m, (n, 2)."""
        if self.hone:
            return self._honed[0]
        lower = np.array([[self.edge_radius, self.edge_radius]])
        if self.chamfer is None:
            return lower
        rake = self.rake_angle - self.chamfer.angle
        return np.concatenate([lower + self.land * np.array([sin(rake), cos(rake)]), lower])

    @property
    def corner_radius(self) -> float:
        """Radius of the rounded corners in m."""
        return self._honed[1] if self.hone else self.edge_radius

    @cached_property
    def _honed(self) -> tuple[NDArray[np.float64], float]:
        """Curve inside the hone at a distance from it, and that distance.

        The hone is the image of the circle that touches both faces one unit from the sharp edge.
        The distance is half of its smallest radius of curvature: the chain round which it runs is
        smooth, and the surface has a normal that does not jump.
        """
        assert self.hone is not None
        faces = np.array([self.rake_direction, self.clearance_direction]).T
        image = faces @ np.diag([self.hone.rake, self.hone.clearance]) @ np.linalg.inv(faces)
        radius = tan((_RIGHT_ANGLE - self.rake_angle - self.clearance_angle) / 2)
        angle = np.linspace(
            pi - self.rake_angle, 3 * _RIGHT_ANGLE + self.clearance_angle, _HONE_PIECES + 1
        )
        circle = np.stack([np.cos(angle), np.sin(angle)])
        speed = np.hypot(*(image @ np.stack([-np.sin(angle), np.cos(angle)])))
        inset = float((radius * speed**3 / np.linalg.det(image)).min()) / 2
        normal = np.linalg.inv(image).T @ circle
        normal /= np.hypot(*normal)
        centre = radius * np.hypot(*image.T)
        return centre + (radius * image @ circle - inset * normal).T, inset

    def _check_chamfer(self, chamfer: Chamfer) -> None:
        if not chamfer.angle < _RIGHT_ANGLE + self.rake_angle:
            raise ValueError(
                f"chamfer angle: expected less than {degrees(_RIGHT_ANGLE + self.rake_angle):g} "
                f"degrees, so that the land faces the chip, got {degrees(chamfer.angle):g} degrees"
            )
        if not self.land > 0:
            raise ValueError(
                f"chamfer width: more than {(chamfer.width - self.land) * 1e6:.4g} um, so that "
                f"a land is left between corners of {self.edge_radius * 1e6:g} um, "
                f"got {chamfer.width * 1e6:g} um"
            )


def check_angles(rake_angle: float, clearance_angle: float) -> None:
    """Raise a ValueError if the angles of a tool's faces, in rad, are impossible."""
    if not abs(rake_angle) < STEEPEST_RAKE:
        raise ValueError(
            f"rake_angle: expected -60 to 60 degrees, got {degrees(rake_angle):g} degrees"
        )
    if not 0 < clearance_angle < LARGEST_CLEARANCE:
        raise ValueError(
            "clearance_angle: expected more than 0 and less than 45 degrees, "
            f"got {degrees(clearance_angle):g} degrees"
        )
    if rake_angle + clearance_angle > _RIGHT_ANGLE - SMALLEST_WEDGE:
        raise ValueError("rake_angle and clearance_angle leave a wedge of less than 5 degrees")
