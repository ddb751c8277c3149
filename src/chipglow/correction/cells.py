"""The unknowns: parts of square cells that the outlines of the zones cut."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt, maximum_filter, minimum_filter

from chipglow.correction.zones import NOTHING, Labels, ObservedObject
from chipglow.quantities import Array
from chipglow.scene import Raster

CELLS_PER_PIXEL: Final = 2
"""Cells along the side of a pixel: the finest detail of which a pixel image contains data."""

_LINES: Final = 8
"""Lines through a cell that an outline may cut, along which the outline is located."""

_HALVINGS: Final = 8
"""Halvings of the interval between two points with an outline between: to 1/4096 of a cell."""

_FEW_POINTS: Final = 4
"""Points along the side of the cells at which outlines are searched."""

_LEAST_AREA: Final = 2e-3
"""Smallest fraction of a cell for a part: a smaller one emits less than the model's error."""

_BESIDE: Final = 3.0
"""Distance in cells over which an outline at a wrong place bends the radiance: 1.5 pixels."""

_ORDERS: Final = (3, 0), (2, 1), (1, 2), (0, 3), (4, 0), (2, 2), (0, 4)
"""Powers of the places to the right and down in the moments of third and fourth order."""

_POWERS: Final = (0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), *_ORDERS
"""Powers in the moments that the light of a part has."""

_OFFSETS: Final = np.array(
    [(below, beside) for below in range(-2, 3) for beside in range(abs(below) - 2, 3 - abs(below))]
)
"""Offsets, (down, right), of the cells over which the light of a part is distributed."""

_FROM_MOMENTS: Final = np.linalg.inv(
    [[float(beside) ** r * float(below) ** d for below, beside in _OFFSETS] for r, d in _POWERS]
)
"""Weights at `_OFFSETS` from moments in the order of `_POWERS`."""


@dataclass(frozen=True, eq=False)
class Parts:
    """Parts of cells, one for each zone that a cell contains; arrays of shape (part,)."""

    cells: Raster
    pixels: Raster
    cell: NDArray[np.intp]
    """Index of the cell, in rows from the top."""
    zone: NDArray[np.intp]
    """Index of the zone."""
    area: Array
    """Fraction of the cell."""
    emissivity: Array
    """Mean emissivity."""
    right: Array
    """Centroid, to the right of the centre of the cell in widths of a cell."""
    down: Array
    """Centroid, below the centre of the cell."""
    across: Array
    """Variance of the places in the part to the right of its centroid, in squares of a cell."""
    along: Array
    """Variance of the places in the part below its centroid."""
    mixed: Array
    """Covariance of both."""
    moments: Array
    """Central moments of the places of third and fourth order, (part, moment): `_ORDERS`."""

    @property
    def size(self) -> int:
        """Number of parts."""
        return self.cell.size

    @cached_property
    def index(self) -> NDArray[np.intp]:
        """Index of the part of each zone in each cell, (zone, row, column); −1 without one."""
        zones = int(self.zone.max()) + 1
        found = np.full((zones, self.cells.rows * self.cells.columns), -1, np.intp)
        found[self.zone, self.cell] = np.arange(self.size)
        return found.reshape(zones, *self.cells.shape)

    @cached_property
    def beside_outline(self) -> NDArray[np.bool_]:
        """Parts within `_BESIDE` cells of a cell without their zone."""
        beside = np.zeros(self.size, np.bool_)
        for zone, index in enumerate(self.index):
            if (index < 0).any():
                own = self.zone == zone
                distance = distance_transform_edt(index >= 0).ravel()
                beside[own] = distance[self.cell[own]] <= _BESIDE
        return beside

    @cached_property
    def at_centroids(self) -> Any:
        """Sparse array (part, part): values at centroids from those at the centres of cells.

        It is linear between the cell and its neighbours of the same zone. The centroid of a cut
        part may be half a cell from the centre, where a field with a slope has another value.
        """
        row, column = np.divmod(self.cell, self.cells.columns)
        part, whole = np.arange(self.size), np.ones(self.size)
        columns, weights = [part], [whole]
        for offset, step in ((self.right, (0, 1)), (self.down, (1, 0))):
            toward = np.sign(offset).astype(np.intp)
            beside = (row + step[0] * toward).clip(0, self.cells.rows - 1)
            below = (column + step[1] * toward).clip(0, self.cells.columns - 1)
            neighbour = self.index[self.zone, beside, below]
            weight = np.where(neighbour >= 0, np.abs(offset), 0.0)
            columns += [np.maximum(neighbour, 0), part]
            weights += [weight, -weight]
        rows = np.tile(part, len(columns))
        entries = np.concatenate(weights), (rows, np.concatenate(columns))
        interpolation = sparse.csr_array(entries, shape=(self.size, self.size))
        interpolation.eliminate_zeros()
        return interpolation

    @cached_property
    def slopes(self) -> tuple[Any, Any]:
        """Sparse arrays (part, part): the change of values from cell to cell, right and down."""
        return self._slope((0, 1)), self._slope((1, 0))

    def _slope(self, step: tuple[int, int]) -> Any:
        row, column = np.divmod(self.cell, self.cells.columns)
        padded = np.pad(self.index, ((0, 0), (1, 1), (1, 1)), constant_values=-1)
        after = padded[self.zone, row + 1 + step[0], column + 1 + step[1]]
        before = padded[self.zone, row + 1 - step[0], column + 1 - step[1]]
        part = np.arange(self.size)
        after, before = (np.where(one >= 0, one, part) for one in (after, before))
        distance = np.maximum((after != part).astype(float) + (before != part), 1.0)
        entries = np.concatenate([1 / distance, -1 / distance])
        places = np.tile(part, 2), np.concatenate([after, before])
        return sparse.csr_array((entries, places), shape=(self.size, self.size))

    def spread(self, x: Array) -> Any:
        """Return where the light of parts is sent from, a sparse array (cell, part).

        The light of a part is distributed over the cells around it with its area and its moments
        up to the fourth order, without those of odd order in both directions. `x`, the logarithm of
        radiance, shifts the centroid toward the brighter side. Images of analytic scenes by cells
        half as wide as a pixel then err by less than 0.1 K beside an outline.
        """
        row, column = np.divmod(self.cell, self.cells.columns)
        at_row = _mirrored(row + _OFFSETS[:, :1], self.cells.rows)
        at_column = _mirrored(column + _OFFSETS[:, 1:], self.cells.columns)
        cells = at_row * self.cells.columns + at_column
        weights = _FROM_MOMENTS @ self._moments_about_centres(x)
        parts = np.tile(np.arange(self.size), len(_OFFSETS))
        shape = self.cells.rows * self.cells.columns, self.size
        return sparse.csr_array((weights.ravel(), (cells.ravel(), parts)), shape=shape)

    def _moments_about_centres(self, x: Array) -> Array:
        """Return the moments of the light about the centres of the cells, (`_POWERS`, part)."""
        right_slope, down_slope = (slope @ x for slope in self.slopes)
        rr, dd, rd = self.across, self.along, self.mixed
        r = self.right + rr * right_slope + rd * down_slope
        d = self.down + dd * down_slope + rd * right_slope
        rrr, rrd, rdd, ddd, rrrr, rrdd, dddd = self.moments.T
        moments = [
            np.ones(r.shape),
            r,
            d,
            rr + r**2,
            rd + r * d,
            dd + d**2,
            rrr + 3 * r * rr + r**3,
            rrd + 2 * r * rd + d * (rr + r**2),
            rdd + 2 * d * rd + r * (dd + d**2),
            ddd + 3 * d * dd + d**3,
            rrrr + 4 * r * rrr + 6 * r**2 * rr + r**4,
            rrdd + 2 * (d * rrd + r * rdd) + d**2 * rr + 4 * r * d * rd + r**2 * (dd + d**2),
            dddd + 4 * d * ddd + 6 * d**2 * dd + d**4,
        ]
        return np.stack(moments)

    def continued(self, values: Array, others: "Parts") -> Array:
        """Return values of parts at the parts of other outlines, from the nearest of each zone."""
        found = np.full(others.size, float(np.median(values)))
        for zone, index in enumerate(self.index):
            own = others.zone == zone
            if (index >= 0).any():
                nearest = distance_transform_edt(
                    index < 0, return_distances=False, return_indices=True
                )
                found[own] = values[index[tuple(nearest)]].ravel()[others.cell[own]]
        return found

    def displacement(self, others: "Parts") -> float:
        """Return the mean distance in pixels between these outlines and those of `others`.

        Where an outline crosses a cell, the areas of the cell's parts change.
        """
        cells = self.cells.rows * self.cells.columns
        zones = 1 + max(self.zone.max(), others.zone.max())
        before, after = (
            np.bincount(one.zone * cells + one.cell, one.area, zones * cells)
            for one in (self, others)
        )
        changed = np.abs(after - before)
        cut = np.minimum(before, after) < 1 - _LEAST_AREA
        cut &= np.maximum(before, after) > _LEAST_AREA
        return float(changed[cut].mean()) / CELLS_PER_PIXEL if cut.any() else 0.0

    def within(self, others: "Parts") -> "Parts":
        """Return the parts on the cells of `others`, which contain their cells."""
        row, column = np.divmod(self.cell, self.cells.columns)
        down = round((others.cells.top - self.cells.top) / self.cells.spacing)
        right = round((self.cells.left - others.cells.left) / self.cells.spacing)
        cell = (row + down) * others.cells.columns + column + right
        return replace(self, cells=others.cells, pixels=others.pixels, cell=cell)

    def chosen(self, parts: NDArray[np.intp]) -> "Parts":
        """Return some of the parts."""
        names = [field.name for field in fields(self) if field.name not in ("cells", "pixels")]
        return replace(self, **{name: getattr(self, name)[parts] for name in names})

    @cached_property
    def pixel(self) -> NDArray[np.intp]:
        """Index of each part's pixel, in rows from the top."""
        row, column = np.divmod(self.cell, self.cells.columns)
        pixel = row // CELLS_PER_PIXEL * self.pixels.columns + column // CELLS_PER_PIXEL
        return np.asarray(pixel, np.intp)


def _mirrored(index: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Return indices of 0 to `count` - 1; one beyond an end is as far from it as its mirror image.

    The light of a uniform field is then uniform to the edge of the image.
    """
    from_first = np.maximum(index, -1 - index)
    return np.asarray(np.minimum(from_first, 2 * count - 1 - from_first), np.intp)


def cells_of(pixels: Raster) -> Raster:
    """Return the cells of pixels."""
    rows, columns = (CELLS_PER_PIXEL * count for count in pixels.shape)
    return Raster(pixels.left, pixels.top, pixels.spacing / CELLS_PER_PIXEL, rows, columns)


def cut_cells(observed: ObservedObject, pixels: Raster) -> Parts:
    """Cut the cells of an image by the outlines of zones."""
    cells = cells_of(pixels)
    points = _looked_up(observed, cells)
    found = [_zone_parts(number, points) for number in range(len(observed.zones))]
    zone = np.repeat(np.arange(len(found)), [one["cell"].size for one in found])
    joined = {name: np.concatenate([one[name] for one in found]) for name in found[0]}
    if not zone.size:
        raise ValueError("zones: none of them is within the image")
    return Parts(
        cells,
        pixels,
        joined["cell"].astype(np.intp),
        zone,
        joined["area"],
        joined["emissivity"],
        *(joined[name] for name in ("right", "down", "across", "along", "mixed", "moments")),
    )


@dataclass(frozen=True, eq=False)
class _Points:
    """Labels and emissivities at points within cells, (cell, point), and the area of each.

    Places are to the right of and below a cell's centre, in widths of a cell.
    """

    cell: NDArray[np.intp]
    labels: NDArray[np.int16]
    """Index of the zone; `NOTHING` for points that do not emit."""
    emissivity: Array
    right: Array
    down: Array
    """Centroid of the rectangle that each point stands for."""
    width: Array
    height: Array
    """Sides of the rectangle in widths of a cell."""

    def chosen(self, mask: NDArray[np.bool_]) -> "_Points":
        """Return some of the cells."""
        return _Points(*(getattr(self, field.name)[mask] for field in fields(self)))

    def whole(self, number: int) -> dict[str, Array]:
        """Return the same as `of_zone` of cells that are within one zone."""
        own = np.flatnonzero(self.labels[:, 0] == number)
        zero, one, third, fourth = np.zeros(own.size), np.ones(own.size), 1 / 12, 1 / 80
        even = {(4, 0): fourth, (2, 2): third**2, (0, 4): fourth}
        return {
            "cell": self.cell[own].astype(np.float64),
            "area": one,
            "emissivity": self.emissivity[own].mean(axis=1),
            "right": zero,
            "down": zero,
            "across": third * one,
            "along": third * one,
            "mixed": zero,
            "moments": np.stack([even.get(powers, 0.0) * one for powers in _ORDERS], axis=1),
        }

    def of_zone(self, number: int) -> dict[str, Array]:
        """Return area, emissivity, centroid and moments of a zone's part of each cell."""
        within = np.where(self.labels == number, self.width * self.height, 0.0)
        area = within.sum(axis=1)
        lit = np.flatnonzero(area > _LEAST_AREA)
        within, (x, y) = within[lit] / area[lit, None], (self.right[lit], self.down[lit])
        right, down = (within * x).sum(axis=1), (within * y).sum(axis=1)
        from_right = _powers(x - right[:, None], self.width[lit])
        from_down = _powers(y - down[:, None], self.height[lit])

        def moment(r: int, d: int) -> Array:
            return np.asarray((within * from_right[r] * from_down[d]).sum(axis=1))

        return {
            "cell": self.cell[lit].astype(np.float64),
            "area": area[lit],
            "emissivity": (within * self.emissivity[lit]).sum(axis=1),
            "right": right,
            "down": down,
            "across": moment(2, 0),
            "along": moment(0, 2),
            "mixed": moment(1, 1),
            "moments": np.stack([moment(*powers) for powers in _ORDERS], axis=1),
        }


def _powers(distance: Array, length: Array) -> tuple[Array | float, ...]:
    """Return the means of the powers 0 to 4 of the distance over intervals of a length."""
    spread = length**2 / 12
    square = distance**2
    return (
        1.0,
        distance,
        square + spread,
        distance * (square + 3 * spread),
        square**2 + 6 * square * spread + length**4 / 80,
    )


def _looked_up(observed: ObservedObject, cells: Raster) -> tuple[_Points, ...]:
    """Return points in the cells within one zone, and outlines in the others."""
    few = _few_points(observed, cells)
    least, most = (end(few.labels, axis=1).reshape(cells.shape) for end in (np.min, np.max))
    whole = (minimum_filter(least, 3) == maximum_filter(most, 3)).ravel()
    cut = few.cell[~whole]
    (by_rows, crossings), (by_columns, others) = (
        _located(observed, cells, cut, along) for along in ("rows", "columns")
    )
    # Lines are best that the outline crosses: those along its normal.
    rows_are_best = crossings >= others
    return few.chosen(whole), by_rows.chosen(rows_are_best), by_columns.chosen(~rows_are_best)


def _few_points(observed: ObservedObject, cells: Raster) -> _Points:
    """Look up points on a square grid in every cell."""
    cell, offset = np.arange(cells.rows * cells.columns), _middles(_FEW_POINTS)
    down, right = (grid.ravel() for grid in np.meshgrid(offset, offset, indexing="ij"))
    labels, emissivity = _at(observed, cells, cell[:, None], right, down)
    sides = np.full(labels.shape, 1 / _FEW_POINTS)
    right, down = (np.broadcast_to(one, labels.shape) for one in (right, down))
    return _Points(cell, labels, emissivity, right, down, sides, sides)


def _located(
    observed: ObservedObject,
    cells: Raster,
    cell: NDArray[np.intp],
    along: Literal["rows", "columns"],
) -> tuple[_Points, NDArray[np.intp]]:
    """Look up points on lines through cells; return them and the crossings of outlines per cell.

    Between two points with different labels, the outline is located by halving.
    """

    def look_up(cell: NDArray[np.intp], line: Array, place: Array) -> tuple[Labels, Array]:
        right, down = (place, line) if along == "rows" else (line, place)
        return _at(observed, cells, cell, right, down)

    lines, places = _middles(_LINES), np.arange(_LINES + 1) / _LINES - 0.5
    labels, emissivity = look_up(cell[:, None, None], lines[:, None], places)
    crossed = np.nonzero(labels[..., :-1] != labels[..., 1:])
    low, high = places[crossed[2]], places[crossed[2] + 1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        found = look_up(cell[crossed[0]], lines[crossed[1]], middle)[0]
        before = found == labels[crossed]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    ends = np.empty((cell.size, _LINES, _LINES + 2))
    ends[..., 0], ends[..., -1], ends[..., 1:-1] = -0.5, 0.5, (places[:-1] + places[1:]) / 2
    ends[crossed[0], crossed[1], crossed[2] + 1] = (low + high) / 2
    flat = cell.size, _LINES * (_LINES + 1)
    middles = ((ends[..., :-1] + ends[..., 1:]) / 2).reshape(flat)
    lengths = np.diff(ends, axis=-1).reshape(flat)
    line = np.broadcast_to(lines[:, None], labels.shape).reshape(flat)
    thickness = np.full(lengths.shape, 1 / _LINES)
    centroids = (middles, line) if along == "rows" else (line, middles)
    sides = (lengths, thickness) if along == "rows" else (thickness, lengths)
    points = _Points(cell, labels.reshape(flat), emissivity.reshape(flat), *centroids, *sides)
    return points, np.bincount(crossed[0], minlength=cell.size)


def _middles(count: int) -> Array:
    """Return the middles of equal parts of the side of a cell."""
    return (np.arange(count) + 0.5) / count - 0.5


def _at(
    observed: ObservedObject, cells: Raster, cell: NDArray[np.intp], right: Array, down: Array
) -> tuple[Labels, Array]:
    """Return label and emissivity of points of cells."""
    row, column = np.divmod(cell, cells.columns)
    x = cells.left + cells.spacing * (column + 0.5 + right)
    y = cells.top - cells.spacing * (row + 0.5 + down)
    labels, emissivity = observed.look_up(x, y)
    return np.where(emissivity > 0, labels, NOTHING), emissivity


def _zone_parts(number: int, points: Sequence[_Points]) -> dict[str, Array]:
    """Return the parts of a zone in the order of their cells."""
    whole, *cut = points
    found = [whole.whole(number), *(some.of_zone(number) for some in cut)]
    joined = {name: np.concatenate([one[name] for one in found]) for name in found[0]}
    order = np.argsort(joined["cell"])
    return {name: values[order] for name, values in joined.items()}
