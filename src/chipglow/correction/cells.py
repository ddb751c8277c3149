"""The unknowns: parts of square cells that the outlines of the zones cut."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.ndimage import distance_transform_edt, maximum_filter, minimum_filter

from chipglow.correction.zones import NOTHING, ObservedObject
from chipglow.quantities import Array
from chipglow.scene import Raster

CELLS_PER_PIXEL: Final = 2
"""Cells along the side of a pixel: the finest detail of which a pixel image contains data."""

_POINTS: Final = 8
"""Points along the side of a cell that an outline may cut: it is cut to 1/64."""

_FEW_POINTS: Final = 4
"""Points along the side of the cells at which outlines are searched."""

_LEAST_AREA: Final = 1e-9


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

        The light of a part is distributed over its cell and the eight around it with its area,
        centroid and second moments. `x`, the logarithm of radiance, shifts the centroid toward the
        brighter side. Cells half as wide as a pixel then form an image with an error of the third
        order.
        """
        right_slope, down_slope = (slope @ x for slope in self.slopes)
        right = self.right + self.across * right_slope + self.mixed * down_slope
        down = self.down + self.along * down_slope + self.mixed * right_slope
        across, along = _three_weights(right, self.across), _three_weights(down, self.along)
        row, column = np.divmod(self.cell, self.cells.columns)
        weights, places = [], []
        for below, beside in np.ndindex(3, 3):
            corner = (below - 1) * (beside - 1) * self.mixed / 4
            weights.append(along[below] * across[beside] + corner)
            at_row = (row + below - 1).clip(0, self.cells.rows - 1)
            at_column = (column + beside - 1).clip(0, self.cells.columns - 1)
            places.append(at_row * self.cells.columns + at_column)
        entries = (
            np.concatenate(weights),
            (np.concatenate(places), np.tile(np.arange(self.size), 9)),
        )
        return sparse.csr_array(entries, shape=(self.cells.rows * self.cells.columns, self.size))

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

    @cached_property
    def pixel(self) -> NDArray[np.intp]:
        """Index of each part's pixel, in rows from the top."""
        row, column = np.divmod(self.cell, self.cells.columns)
        pixel = row // CELLS_PER_PIXEL * self.pixels.columns + column // CELLS_PER_PIXEL
        return np.asarray(pixel, np.intp)


def cut_cells(observed: ObservedObject, pixels: Raster) -> Parts:
    """Cut the cells of an image by the outlines of zones."""
    rows, columns = (CELLS_PER_PIXEL * count for count in pixels.shape)
    cells = Raster(pixels.left, pixels.top, pixels.spacing / CELLS_PER_PIXEL, rows, columns)
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
        *(joined[name] for name in ("right", "down", "across", "along", "mixed")),
    )


@dataclass(frozen=True, eq=False)
class _Points:
    """Labels and emissivities at points within cells, (cell, point), and the points' places.

    Places are to the right of and below a cell's centre, in widths of a cell.
    """

    cell: NDArray[np.intp]
    labels: NDArray[np.int16]
    """Index of the zone; `NOTHING` for points that do not emit."""
    emissivity: Array
    right: Array
    down: Array

    @classmethod
    def looked_up(
        cls, observed: ObservedObject, cells: Raster, cell: NDArray[np.intp], count: int
    ) -> "_Points":
        """Look up `count` points along the side of each of the cells."""
        offset = (np.arange(count) + 0.5) / count - 0.5
        down, right = (grid.ravel() for grid in np.meshgrid(offset, offset, indexing="ij"))
        row, column = np.divmod(cell[:, None], cells.columns)
        x = cells.left + cells.spacing * (column + 0.5 + right)
        y = cells.top - cells.spacing * (row + 0.5 + down)
        labels, emissivity = observed.look_up(x, y)
        return cls(cell, np.where(emissivity > 0, labels, NOTHING), emissivity, right, down)

    def chosen(self, mask: NDArray[np.bool_]) -> "_Points":
        """Return some of the cells."""
        labels, emissivity = self.labels[mask], self.emissivity[mask]
        return replace(self, cell=self.cell[mask], labels=labels, emissivity=emissivity)

    def of_zone(self, number: int) -> dict[str, Array]:
        """Return area, emissivity, centroid and second moments of a zone's part of each cell."""
        within = (self.labels == number).astype(np.float64)
        area = within.mean(axis=1)
        lit = np.flatnonzero(area > _LEAST_AREA)
        within = within[lit] / within[lit].sum(axis=1, keepdims=True)
        right, down = within @ self.right, within @ self.down
        own = 1 / (12 * self.right.size)
        """Second moment of the square that each point stands for."""
        return {
            "cell": self.cell[lit].astype(np.float64),
            "area": area[lit],
            "emissivity": (within * self.emissivity[lit]).sum(axis=1),
            "right": right,
            "down": down,
            "across": within @ self.right**2 + own - right**2,
            "along": within @ self.down**2 + own - down**2,
            "mixed": within @ (self.right * self.down) - right * down,
        }


def _looked_up(observed: ObservedObject, cells: Raster) -> tuple[_Points, _Points]:
    """Return points in the cells within a zone, and closer ones in those at outlines."""
    few = _Points.looked_up(observed, cells, np.arange(cells.rows * cells.columns), _FEW_POINTS)
    least, most = (end(few.labels, axis=1).reshape(cells.shape) for end in (np.min, np.max))
    whole = (minimum_filter(least, 3) == maximum_filter(most, 3)).ravel()
    return few.chosen(whole), _Points.looked_up(observed, cells, few.cell[~whole], _POINTS)


def _zone_parts(number: int, points: Sequence[_Points]) -> dict[str, Array]:
    """Return the parts of a zone in the order of their cells."""
    found = [some.of_zone(number) for some in points]
    joined = {name: np.concatenate([one[name] for one in found]) for name in found[0]}
    order = np.argsort(joined["cell"])
    return {name: values[order] for name, values in joined.items()}


def _three_weights(centroid: Array, variance: Array) -> tuple[Array, Array, Array]:
    """Return weights of the places −1, 0 and 1 with this centroid and variance, of sum 1."""
    square = variance + centroid**2
    return (square - centroid) / 2, 1 - square, (square + centroid) / 2
