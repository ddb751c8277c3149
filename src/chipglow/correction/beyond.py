"""Light from beyond the image: the radiance continues in each zone, and falls back."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from chipglow.camera import ImageFormation, PointSpreadFunction
from chipglow.correction.cells import CELLS_PER_PIXEL, Parts, cut_cells
from chipglow.correction.prior import Curvature, slopes_within
from chipglow.correction.zones import ObservedObject
from chipglow.quantities import Array
from chipglow.scene import Raster

_REACH: Final = 12
"""Pixels to which the radiance is continued; beyond them it is constant."""

_LOW: Final = 0.1
"""Quantile of the logarithm of radiance in the image to which it falls back beyond."""

_FADING: Final = 16.0
"""Pixels over which slopes at the border fade, and the radiance falls back.

One looks at what is hot. In 32 views of cuts and 40 analytic scenes for tuning of
``benchmarks/correction.py``, images were then wrong by 0.6 K and 0.3 K (root mean square). Without
the fall it was 1.5 K and 0.35 K: where only the end of a zone is in the image, such as the hot edge
of the workpiece under a tool, all of it beyond was taken as hot.
"""

_DOUBT: Final = 1.0
"""Relative standard uncertainty of the light from beyond each side of the image: nothing in an
image shows what is there.

In the views of cuts, the intervals of known scenes then held 94 % to 99 % of the pixels of a place;
with 0.8, 93 % to 98 %.
"""

_LARGEST_RISE: Final = 1.5
"""Most by which the logarithm of radiance beyond the image exceeds the largest within it: a factor
of 4.5."""


@dataclass(frozen=True, eq=False)
class Beyond:
    """The parts of an image and those around it."""

    solved: Parts
    """Parts of the image and its margin, on the cells of `outer`."""
    inner: Parts
    """Parts of the image."""
    chosen: NDArray[np.intp]
    """Index of each inner part among those that are solved for.

    The image hardly determines those in the margin: they are not continued.
    """
    outer: Parts
    formation: ImageFormation
    """From the cells of `outer` to the pixels that are solved for."""

    @classmethod
    def of(
        cls, observed: ObservedObject, parts: Parts, formation: ImageFormation, image: Raster
    ) -> "Beyond":
        """Return the continuation of an object beyond an image, and beyond `parts` around it."""
        outer = cut_cells(observed, parts.pixels.widened(_REACH))
        row, column = np.divmod(parts.cell, parts.cells.columns)
        first = CELLS_PER_PIXEL * (parts.pixels.rows - image.rows) // 2
        below, beside = row - first, column - first
        rows, columns = (CELLS_PER_PIXEL * count for count in image.shape)
        within = (below >= 0) & (below < rows) & (beside >= 0) & (beside < columns)
        chosen = np.flatnonzero(within)
        solved = parts.within(outer)
        inner = solved.chosen(chosen)
        whole = replace(formation, samples=outer.cells, beyond="edge")
        return cls(solved, inner, chosen, outer, whole)

    def continuation(self, x: Array) -> Array:
        """Return the values of the outer parts that bend, slope and depart from a low level least.

        `x` is the logarithm of radiance of the parts that are solved for; those in the margin do
        not count.
        """
        own = x[self.chosen]
        level = np.quantile(own, _LOW)
        departure = np.zeros(self.outer.size)
        departure[self._is_known] = own[self._known] - level
        unknown = ~self._is_known
        departure[unknown] = self._factor.solve(-(self._roughness @ departure)[unknown])
        return np.asarray(np.minimum(level + departure, own.max() + _LARGEST_RISE))

    def image(self, values: Array, psf: PointSpreadFunction | None = None) -> Array:
        """Return the image of the light from outside the solved parts, (y, x).

        `values` are those of the outer parts; a `psf` replaces that of the formation.
        """
        return self._seen(self._light(values), self._outside, psf)

    def with_margin(self, x: Array, continuation: Array) -> Array:
        """Return a solution whose values in the margin are those of a continuation."""
        index = self.outer.index[self.solved.zone, self.solved.cell // self.outer.cells.columns,
                                 self.solved.cell % self.outer.cells.columns]  # fmt: skip
        margin = index >= 0
        margin[self.chosen] = False
        values = x.copy()
        values[margin] = continuation[index[margin]]
        return values

    def errors(self, values: Array) -> list[Array]:
        """Return the changes of the image by one standard uncertainty of each side's light."""
        light = _DOUBT * self._light(values)
        return [self._seen(light, self._outside & (self._side == side)) for side in range(4)]

    @cached_property
    def _known(self) -> NDArray[np.intp]:
        """Index of the inner part of each outer one that has one."""
        return self._matches[self._is_known]

    @cached_property
    def _is_known(self) -> NDArray[np.bool_]:
        return self._matches >= 0

    @cached_property
    def _matches(self) -> NDArray[np.intp]:
        """Index of the inner part of each outer one; −1 without one."""
        index = self.inner.index.reshape(len(self.inner.index), -1)
        found = np.full(self.outer.size, -1, np.intp)
        shared = self.outer.zone < len(index)
        found[shared] = index[self.outer.zone[shared], self.outer.cell[shared]]
        return found

    @cached_property
    def _roughness(self) -> Any:
        """Sparse array (part, part) of squared curvatures and slopes."""
        curvature, slope = Curvature.of(self.outer).matrix, slopes_within(self.outer)
        length = CELLS_PER_PIXEL * _FADING
        return sparse.csr_array(curvature.T @ curvature + slope.T @ slope / length**2)

    @cached_property
    def _factor(self) -> Any:
        unknown = np.flatnonzero(~self._is_known)
        own = self._roughness[unknown][:, unknown]
        fall = (CELLS_PER_PIXEL * _FADING) ** -4
        return splu(sparse.csc_array(own + fall * sparse.eye_array(unknown.size)))

    @cached_property
    def _outside(self) -> NDArray[np.bool_]:
        reach = CELLS_PER_PIXEL * _REACH
        outside = np.ones(self.outer.cells.shape, np.bool_)
        outside[reach:-reach, reach:-reach] = False
        return outside

    @cached_property
    def _side(self) -> NDArray[np.intp]:
        """Side beyond which each cell is: 0 to 3, by the larger distance at a corner."""
        rows, columns = self.outer.cells.shape
        row, column = np.indices((rows, columns))
        inward = np.stack([row, rows - 1 - row, column, columns - 1 - column])
        return np.asarray(inward.argmin(axis=0), np.intp)

    def _light(self, values: Array) -> Array:
        """Return the light that the outer cells send, (row, column)."""
        sent = self.outer.area * self.outer.emissivity * np.exp(values)
        shape = self.outer.cells.shape
        return np.asarray(np.bincount(self.outer.cell, sent, shape[0] * shape[1]).reshape(shape))

    def _seen(
        self, light: Array, chosen: NDArray[np.bool_], psf: PointSpreadFunction | None = None
    ) -> Array:
        formation = self.formation if psf is None else replace(self.formation, psf=psf)
        return formation.forward(np.where(chosen, light, 0.0))
