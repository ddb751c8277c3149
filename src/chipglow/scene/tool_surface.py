"""Distance to the tool's surface, for kernels: a rounded wedge, or a chain of corners."""

from math import sqrt
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.scene.kernels import INNER

FACE_LENGTH: Final = 0.1
"""Length in m to which kernels draw the straight faces of a chain: far beyond any cut."""

X, Y, TANGENT_X, TANGENT_Y, LENGTH, NORMAL_X, NORMAL_Y, REACH = range(8)
"""Columns of a chain: a corner, direction and length of the piece to the next corner, the corner's
normal, and (in every `stride`-th row) how far the next `stride` pieces reach from the corner."""


class ToolSurface(NamedTuple):
    """The tool's surface as kernels take it: see `surface_distance`.

    Centre of the edge's arc and its radius (m); direction, away from the edge, of the rake face and
    of the flank face; how far the chain's corners stand out from the two lines through the centre
    along the faces (m); the chain and the length of its stretches.
    """

    x: float
    y: float
    radius: float
    rake_x: float
    rake_y: float
    clearance_x: float
    clearance_y: float
    rake_offset: float
    clearance_offset: float
    stride: int
    chain: NDArray[np.float64]


def surface_of(
    corners: NDArray[np.float64],
    radius: float,
    rake: tuple[float, float],
    clearance: tuple[float, float],
) -> ToolSurface:
    """Return the surface at a distance in m from a chain of corners between two straight faces.

    Corners (n, 2) go from the rake face round the edge; faces are unit vectors away from it.
    """
    normals = (-rake[1], rake[0]), (clearance[1], -clearance[0])
    offsets = ((corners - corners[-1]) @ np.array(normals).T).max(axis=0)
    chain = np.zeros((0, REACH + 1))
    if len(corners) > 1:
        first = corners[0] + FACE_LENGTH * np.array(rake)
        last = corners[-1] + FACE_LENGTH * np.array(clearance)
        chain = _chain(np.concatenate([[first], corners, [last]]))
    centre, stride = corners[-1].tolist(), _stride(len(chain))
    return ToolSurface._make((*centre, radius, *rake, *clearance, *offsets.tolist(), stride, chain))


def _stride(pieces: int) -> int:
    return max(round(sqrt(pieces)), 2)


def _chain(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows of a chain, one for every piece: columns as `X` and so on name."""
    pieces = np.diff(corners, axis=0)
    length = np.hypot(pieces[:, 0], pieces[:, 1])
    tangent = pieces / length[:, None]
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    # At a corner the sign follows the mean of its pieces' normals: Baerentzen and Aanaes (2005).
    normal[1:] = normal[1:] + normal[:-1]
    stride, reach = _stride(len(pieces)), np.zeros(len(pieces))
    for k in range(0, len(pieces), stride):
        reach[k] = np.hypot(*(corners[k : k + stride + 1] - corners[k]).T).max()
    return np.column_stack([corners[:-1], tangent, length, normal, reach])


@njit(cache=True)
def surface_distance(x, y, tool):  # type: ignore[no-untyped-def]
    """Return the signed distance to a `ToolSurface`, negative inside, and its outward normal."""
    if tool.chain.shape[0] == 0:
        return _wedge_distance(x, y, tool)
    return _chain_distance(x, y, tool)


@njit
def surface_bound(x, y, tool):  # type: ignore[no-untyped-def]
    """Return a lower bound of the signed distance, cheaper than it."""
    px, py = x - tool.x, y - tool.y
    rake = tool.rake_x * py - tool.rake_y * px - tool.rake_offset
    clearance = tool.clearance_y * px - tool.clearance_x * py - tool.clearance_offset
    return max(rake, clearance) - tool.radius


@njit(**INNER)
def _wedge_distance(x, y, tool):  # type: ignore[no-untyped-def]
    px, py = x - tool.x, y - tool.y
    if (
        tool.rake_x * px + tool.rake_y * py < 0.0
        and tool.clearance_x * px + tool.clearance_y * py < 0.0
    ):
        length = np.sqrt(px * px + py * py)
        if length < 1e-12:  # m: at the tip any normal will do
            return -tool.radius, -tool.rake_y, tool.rake_x
        return length - tool.radius, px / length, py / length
    rake = tool.rake_x * py - tool.rake_y * px
    clearance = tool.clearance_y * px - tool.clearance_x * py
    if rake > clearance:
        return rake - tool.radius, -tool.rake_y, tool.rake_x
    return clearance - tool.radius, tool.clearance_y, -tool.clearance_x


@njit(**INNER)
def _chain_distance(x, y, tool):  # type: ignore[no-untyped-def]
    """Distance to the nearest piece; stretches that are farther than a known corner are skipped."""
    chain, stride = tool.chain, tool.stride
    rows = chain.shape[0]
    nearest = np.inf
    for k in range(0, rows, stride):
        nearest = min(nearest, (x - chain[k, X]) ** 2 + (y - chain[k, Y]) ** 2)
    limit = np.sqrt(nearest)
    nearest = np.inf
    piece, place = 0, 0.0
    for k in range(0, rows, stride):
        within = limit + chain[k, REACH]
        if (x - chain[k, X]) ** 2 + (y - chain[k, Y]) ** 2 > within * within:
            continue
        for i in range(k, min(k + stride, rows)):
            px, py = x - chain[i, X], y - chain[i, Y]
            along = px * chain[i, TANGENT_X] + py * chain[i, TANGENT_Y]
            along = min(max(along, 0.0), chain[i, LENGTH])
            px -= along * chain[i, TANGENT_X]
            py -= along * chain[i, TANGENT_Y]
            square = px * px + py * py
            if square < nearest:
                nearest, piece, place = square, i, along
        limit = min(limit, np.sqrt(nearest))
    return _side(x, y, tool, piece, place)


@njit(**INNER)
def _side(x, y, tool, piece, place):  # type: ignore[no-untyped-def]
    """Signed distance and normal, from the nearest piece and the place on it."""
    chain = tool.chain
    tx, ty = chain[piece, TANGENT_X], chain[piece, TANGENT_Y]
    px, py = x - chain[piece, X], y - chain[piece, Y]
    nx, ny = ty, -tx
    if 0.0 < place < chain[piece, LENGTH]:
        distance = nx * px + ny * py
        return distance - tool.radius, nx, ny
    if place > 0.0:
        px -= place * tx
        py -= place * ty
        piece = min(piece + 1, chain.shape[0] - 1)
    distance = np.sqrt(px * px + py * py)
    if distance < 1e-12:  # m: on a corner of the chain
        return -tool.radius, nx, ny
    if chain[piece, NORMAL_X] * px + chain[piece, NORMAL_Y] * py < 0.0:
        distance = -distance
    return distance - tool.radius, px / distance, py / distance


@njit(cache=True)
def surface_distances(x, y, tool):  # type: ignore[no-untyped-def]
    """Return the signed distances of many places, shape (n,)."""
    result = np.empty(x.size)
    for i in range(x.size):
        result[i] = surface_distance(x[i], y[i], tool)[0]
    return result
