"""Geometry of the cutting tool: a wedge with a rounded edge."""

from dataclasses import dataclass
from math import cos, isfinite, pi, radians, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

_RIGHT_ANGLE: Final = pi / 2


@dataclass(frozen=True)
class ToolGeometry:
    """Cross-section of the tool: rake face, clearance face and the arc between them.

    The edge touches the lines x = 0 and y = 0: the cut surface is y = 0, the chip is to the left
    of the rake face.

    Parameters
    ----------
    rake_angle : float
        Rake angle in rad; negative where the rake face leans over the chip, as the paper's −7°.
    clearance_angle : float
        Clearance angle in rad.
    edge_radius : float
        Radius of the cutting edge in m.

    Raises
    ------
    ValueError
        If an angle or the radius is impossible.
    """

    rake_angle: float = radians(-7.0)
    clearance_angle: float = radians(7.0)
    edge_radius: float = 20e-6

    def __post_init__(self) -> None:
        if not abs(self.rake_angle) < radians(60.0):
            raise ValueError(
                "rake_angle: expected -60 to 60 degrees, "
                f"got {np.degrees(self.rake_angle):g} degrees"
            )
        if not 0 < self.clearance_angle < radians(45.0):
            raise ValueError(
                "clearance_angle: expected over 0 and under 45 degrees, "
                f"got {np.degrees(self.clearance_angle):g} degrees"
            )
        if self.rake_angle + self.clearance_angle > _RIGHT_ANGLE - radians(5.0):
            raise ValueError("rake_angle and clearance_angle leave a wedge of less than 5 degrees")
        if not (isfinite(self.edge_radius) and self.edge_radius > 0):
            raise ValueError(f"edge_radius: expected over 0 m, got {self.edge_radius!r} m")

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
        """Unit vector along the clearance face, away from the edge."""
        return cos(self.clearance_angle), sin(self.clearance_angle)

    @property
    def clearance_normal(self) -> tuple[float, float]:
        """Unit normal of the clearance face, from the tool toward the cut surface."""
        return sin(self.clearance_angle), -cos(self.clearance_angle)

    @property
    def edge_centre(self) -> tuple[float, float]:
        """Centre of the edge's arc in m."""
        return self.edge_radius, self.edge_radius

    @property
    def coefficients(self) -> tuple[float, ...]:
        """Centre, radius, normals and directions as kernels take them: see `wedge_distance`."""
        return (
            *self.edge_centre,
            self.edge_radius,
            *self.rake_normal,
            *self.rake_direction,
            *self.clearance_normal,
            *self.clearance_direction,
        )

    def rake_point(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Points on the rake face.

        Parameters
        ----------
        distance : array_like
            Distance in m up the rake face from where it leaves the edge's arc, shape (...).

        Returns
        -------
        ndarray
            x and y in m, shape (..., 2).
        """
        foot = np.array(self.edge_centre) + self.edge_radius * np.array(self.rake_normal)
        along = np.asarray(distance, dtype=np.float64)[..., None]
        return np.asarray(foot + along * np.array(self.rake_direction), dtype=np.float64)

    def signed_distance(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        """Distance to the tool's surface in m, negative inside the tool.

        Parameters
        ----------
        x, y : array_like
            Positions in m, broadcast against each other.
        """
        x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
        distance = _distances(
            np.ascontiguousarray(x).ravel(), np.ascontiguousarray(y).ravel(), self.coefficients
        )
        return np.asarray(distance, dtype=np.float64).reshape(x.shape)

    def outline(self, length: float) -> NDArray[np.float64]:
        """Polyline from the rake face round the edge to the clearance face.

        Parameters
        ----------
        length : float
            Length of either face in m.

        Returns
        -------
        ndarray
            x and y in m, shape (n, 2).
        """
        start = np.arctan2(self.rake_normal[1], self.rake_normal[0]) % (2 * pi)
        end = np.arctan2(self.clearance_normal[1], self.clearance_normal[0]) % (2 * pi)
        angle = np.linspace(start, end, 33)
        centre = np.array(self.edge_centre)
        arc = centre + self.edge_radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        top = arc[0] + length * np.array(self.rake_direction)
        right = arc[-1] + length * np.array(self.clearance_direction)
        return np.concatenate([top[None], arc, right[None]])


@njit
def wedge_distance(x, y, tool):  # type: ignore[no-untyped-def]
    """Signed distance to a rounded wedge and its outward normal, for kernels."""
    cx, cy, radius, n1x, n1y, t1x, t1y, n2x, n2y, t2x, t2y = tool
    px, py = x - cx, y - cy
    if t1x * px + t1y * py < 0.0 and t2x * px + t2y * py < 0.0:
        length = np.sqrt(px * px + py * py)
        if length < 1e-12:
            return -radius, n1x, n1y
        return length - radius, px / length, py / length
    rake, clearance = n1x * px + n1y * py, n2x * px + n2y * py
    if rake > clearance:
        return rake - radius, n1x, n1y
    return clearance - radius, n2x, n2y


@njit(cache=True)
def _distances(x, y, tool):  # type: ignore[no-untyped-def]
    result = np.empty(x.size)
    for i in range(x.size):
        result[i] = wedge_distance(x[i], y[i], tool)[0]
    return result
