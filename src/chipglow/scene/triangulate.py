"""Flat elements as triangles: those with straight edges split, quadratic ones subdivided."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

Shape = Literal["triangle", "quad", "triangle6", "quad8", "quad9"]

NODES: Final[Mapping[Shape, int]] = {
    "triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8, "quad9": 9,
}  # fmt: skip
"""Nodes of an element: corners in order around it, then middles of edges, then its centre."""

DIVISIONS: Final = 4
"""Pieces of an edge of a quadratic element."""


@dataclass(frozen=True)
class Triangulated:
    """Elements as triangles (n, 3) of nodes (nodes, axes) with values (nodes, fields)."""

    points: NDArray[np.float64]
    values: NDArray[np.float64]
    triangles: NDArray[np.int64]
    element: NDArray[np.int64]
    """Number of the element that each triangle is a piece of, shape (triangles,)."""


def triangulate(
    shape: Shape,
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    elements: NDArray[np.int64],
) -> Triangulated:
    """Split elements of one shape into triangles.

    A quad is split along its shorter diagonal, so the linear part of its field is exact and the
    rest is off by up to a quarter of the difference of the sums of opposite corners. A quadratic
    element is mapped by its own shape functions, edges too, and cut into pieces of a quarter of
    its edges: a field with second derivative f'' along an edge of length h is off by up to
    f'' h^2 / 128 in a triangle's edge, a quarter of that for every doubling of the mesh.
    """
    if shape == "triangle":
        return Triangulated(points, values, elements, np.arange(len(elements)))
    if shape == "quad":
        return _split(points, values, elements)
    return _subdivide(shape, points, values, elements)


def _split(
    points: NDArray[np.float64], values: NDArray[np.float64], quads: NDArray[np.int64]
) -> Triangulated:
    a, b, c, d = (points[quads[:, corner]] for corner in range(4))
    with np.errstate(over="ignore", invalid="ignore"):
        other = ((d - b) ** 2).sum(axis=1) < ((c - a) ** 2).sum(axis=1)
    turned = np.where(other[:, None], np.roll(quads, -1, axis=1), quads)
    triangles = np.stack((turned[:, (0, 1, 2)], turned[:, (0, 2, 3)]), axis=1)
    return Triangulated(points, values, triangles.reshape(-1, 3), np.arange(len(quads)).repeat(2))


def _subdivide(
    shape: Shape,
    points: NDArray[np.float64],
    values: NDArray[np.float64],
    elements: NDArray[np.int64],
) -> Triangulated:
    lattice, pieces = _lattice(three=shape == "triangle6")
    weights = _FUNCTIONS[shape](lattice[:, 0], lattice[:, 1])
    corners = 3 if shape == "triangle6" else 4
    nodes = [_combine(weights, of_nodes, elements, corners) for of_nodes in (points, values)]
    first = np.arange(len(elements))[:, None, None] * len(lattice)
    return Triangulated(
        nodes[0],
        nodes[1],
        (first + pieces).reshape(-1, 3),
        np.arange(len(elements)).repeat(len(pieces)),
    )


def _combine(
    weights: NDArray[np.float64],
    of_nodes: NDArray[np.float64],
    elements: NDArray[np.int64],
    corners: int,
) -> NDArray[np.float64]:
    """Values at the lattice's points.

    On an edge two corners and one middle have a weight. Added in this order, and each product
    rounded before, two elements get the same bits on the edge that they share.
    """
    result = np.zeros((len(elements), len(weights), of_nodes.shape[1]))
    middles = np.zeros_like(result)
    for node in range(elements.shape[1]):
        total = result if node < corners else middles
        total += weights[:, node, None] * of_nodes[elements[:, node]][:, None, :]
    result += middles
    return result.reshape(len(elements) * len(weights), of_nodes.shape[1])


def _lattice(three: bool) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points in an element's own coordinates from 0 to 1, and the triangles between them."""
    count = DIVISIONS + 1
    number = np.arange(count * count).reshape(count, count)
    lower = np.stack((number[:-1, :-1], number[:-1, 1:], number[1:, :-1]), axis=-1)
    upper = np.stack((number[:-1, 1:], number[1:, 1:], number[1:, :-1]), axis=-1)
    row, column = np.divmod(np.arange(count * count), count)
    triangles = np.concatenate((lower.reshape(-1, 3), upper.reshape(-1, 3)))
    if three:
        triangles = triangles[((row + column)[triangles] <= DIVISIONS).all(axis=1)]
    return np.stack((column, row), axis=1) / DIVISIONS, triangles


def _triangle6(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    w = 1.0 - u - v
    return np.stack(
        (w * (2 * w - 1), u * (2 * u - 1), v * (2 * v - 1), 4 * w * u, 4 * u * v, 4 * v * w), axis=1
    )


def _quad8(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    s, t = 1.0 - u, 1.0 - v
    middles = (4 * u * s * t, 4 * v * t * u, 4 * u * s * v, 4 * v * t * s)
    corners = (s * t, u * t, u * v, s * v)
    halves = [(middles[corner - 1] + middles[corner]) / 2 for corner in range(4)]
    return np.stack(
        [corner - half for corner, half in zip(corners, halves, strict=True)] + list(middles),
        axis=1,
    )


def _quad9(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    (a, b, c), (d, e, f) = (
        ((1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)) for x in (u, v)
    )
    return np.stack((a * d, c * d, c * f, a * f, b * d, c * e, b * f, a * e, b * e), axis=1)


_FUNCTIONS: Final[
    Mapping[Shape, Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]]
] = {"triangle6": _triangle6, "quad8": _quad8, "quad9": _quad9}
