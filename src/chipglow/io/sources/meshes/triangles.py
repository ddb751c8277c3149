"""Quads as triangles, and the fields of triangles on the samples of a raster."""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from chipglow.scene import Raster

NOTHING: Final = -1
"""Element number of samples without an element."""

FARTHEST: Final = 1e100
"""Samples from the corner that a node may be away; beyond, products of lengths would overflow."""

SMALLEST: Final = 1e-200
"""Twice the area in samples from which on a triangle covers something; its inverse is finite."""


def rasterise(
    raster: Raster,
    points: ArrayLike,
    triangles: ArrayLike,
    node_values: ArrayLike | None = None,
    element_values: ArrayLike | None = None,
    height: ArrayLike | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Sample the fields of a mesh of triangles at the centres of a raster's samples.

    Returns the fields of nodes, then of elements, float32 (fields, y, x), NaN without an element,
    and the index of the triangle at each sample, int32 of shape (y, x), `NOTHING` without one.

    Points (nodes, 2) and `height` in m; values of nodes and elements have shape (n, fields). A
    sample on an edge that two triangles share belongs to one of them. A triangle without area, or
    with a position that is not finite or absurdly far away, covers nothing. Where triangles lie
    over one another the highest is taken, of those as high the last.
    """
    points = np.ascontiguousarray(points, np.float64)
    triangles = np.ascontiguousarray(triangles, np.int64)
    if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise ValueError(
            f"triangles: nodes {triangles.min()} to {triangles.max()}, expected 0 to "
            f"{len(points) - 1}"
        )
    of_nodes = _columns(node_values, len(points))
    of_elements = _columns(element_values, len(triangles))
    heights = np.empty(0) if height is None else np.ascontiguousarray(height, np.float64)
    fields = np.full((of_nodes.shape[1] + of_elements.shape[1], *raster.shape), np.nan, np.float32)
    element = np.full(raster.shape, NOTHING, np.int32)
    highest = np.full(raster.shape if len(heights) else (0, 0), -np.inf)
    corner = np.array((raster.left, raster.top))
    # Samples are at whole numbers of columns and rows.
    with np.errstate(over="ignore", invalid="ignore"):
        places = (points - corner) * np.array((1.0, -1.0)) / raster.spacing - 0.5
    _fill(places, triangles, of_nodes, of_elements, heights, fields, element, highest)
    return fields, element


def _columns(values: ArrayLike | None, count: int) -> NDArray[np.float64]:
    array = np.ascontiguousarray(() if values is None else values, np.float64)
    return array.reshape(count, -1) if array.size else np.empty((count, 0))


@njit(cache=True)
def _fill(  # type: ignore[no-untyped-def]
    places, triangles, of_nodes, of_elements, heights, fields, element, highest
):
    rows, columns = element.shape
    for number in range(len(triangles)):
        a, b, c = triangles[number]
        # In ascending order of rows.
        if places[b, 1] < places[a, 1]:
            a, b = b, a
        if places[c, 1] < places[b, 1]:
            b, c = c, b
        if places[b, 1] < places[a, 1]:
            a, b = b, a
        xa, ya = places[a]
        xb, yb = places[b]
        xc, yc = places[c]
        area = (xb - xa) * (yc - ya) - (xc - xa) * (yb - ya)
        farthest = max(abs(xa), abs(xb), abs(xc), abs(ya), abs(yc))
        if not (abs(area) > SMALLEST and farthest < FARTHEST):
            continue
        scale = 1.0 / area
        slope_ab = _slope(xa, ya, xb, yb)
        slope_bc = _slope(xb, yb, xc, yc)
        slope_ac = _slope(xa, ya, xc, yc)
        first = int(max(np.ceil(ya), 0.0))
        last = int(min(np.ceil(yc), float(rows)))
        for row in range(first, last):
            long = _crossing(xa, ya, xc, slope_ac, row)
            if row < yb:
                short = _crossing(xa, ya, xb, slope_ab, row)
            else:
                short = _crossing(xb, yb, xc, slope_bc, row)
            left, right = (long, short) if area > 0.0 else (short, long)
            begin = int(min(max(np.ceil(left), 0.0), float(columns)))
            end = int(min(max(np.ceil(right), 0.0), float(columns)))
            for column in range(begin, end):
                # Rounding may put a weight outside of 0 to 1, far so in a triangle like a needle.
                u = ((column - xa) * (yc - ya) - (xc - xa) * (row - ya)) * scale
                u = min(max(u, 0.0), 1.0)
                v = ((xb - xa) * (row - ya) - (column - xa) * (yb - ya)) * scale
                v = min(max(v, 0.0), 1.0 - u)
                w = 1.0 - u - v
                if len(heights):
                    height = w * heights[a] + u * heights[b] + v * heights[c]
                    if not height >= highest[row, column]:
                        continue
                    highest[row, column] = height
                element[row, column] = number
                for field in range(of_nodes.shape[1]):
                    fields[field, row, column] = (
                        w * of_nodes[a, field] + u * of_nodes[b, field] + v * of_nodes[c, field]
                    )
                for field in range(of_elements.shape[1]):
                    fields[of_nodes.shape[1] + field, row, column] = of_elements[number, field]


@njit(cache=True, inline="always")
def _slope(x0, y0, x1, y1):  # type: ignore[no-untyped-def]
    """Columns per row; that of an edge along a row is not used, but has to be finite."""
    return (x1 - x0) / max(y1 - y0, SMALLEST)


@njit(cache=True, inline="always")
def _crossing(x0, y0, x1, slope, row):  # type: ignore[no-untyped-def]
    """Where an edge crosses a row, the lower end first: the same for both of its triangles."""
    x = x0 + (row - y0) * slope
    return min(max(x, min(x0, x1)), max(x0, x1))


def split_quads(points: NDArray[np.float64], quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Split quads along their shorter diagonals into pairs of triangles, shape (2 n, 3).

    The linear part of a quad's field is exact, and the rest is off by up to a quarter of the
    difference of the sums of opposite corners.
    """
    a, b, c, d = (points[quads[:, corner]] for corner in range(4))
    with np.errstate(over="ignore", invalid="ignore"):
        other = ((d - b) ** 2).sum(axis=1) < ((c - a) ** 2).sum(axis=1)
    turned = np.where(other[:, None], np.roll(quads, -1, axis=1), quads)
    return np.stack((turned[:, (0, 1, 2)], turned[:, (0, 2, 3)]), axis=1).reshape(-1, 3)
