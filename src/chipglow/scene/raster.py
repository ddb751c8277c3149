"""The regular grid of a scene's samples (the paper's sub-pixels)."""

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import LENGTH, POSITION

MOST_SAMPLES: Final = 100_000
"""Samples along an axis: an image of half as many in both takes 20 GB in double precision."""


def check_shape(name: str, found: tuple[int, ...], expected: tuple[int, ...]) -> None:
    """Raise a ValueError with the name of an array if it has another shape than expected."""
    if found != expected:
        raise ValueError(f"{name} has shape {found}, expected {expected}")


@dataclass(frozen=True)
class Raster(Part):
    """A regular grid of square samples, row 0 at the top.

    Raises
    ------
    ValueError
        If a number is not finite, or spacing or a count is not positive.
    """

    left: Annotated[float, Parameter("Left edge of the scene.", POSITION)]
    top: Annotated[float, Parameter("Upper edge of the scene.", POSITION)]
    spacing: Annotated[float, Parameter("Side of a sample.", LENGTH, least=1e-12)]
    rows: Annotated[int, Parameter("Samples from top to bottom.", least=1, most=MOST_SAMPLES)]
    columns: Annotated[int, Parameter("Samples from left to right.", least=1, most=MOST_SAMPLES)]

    @property
    def x(self) -> NDArray[np.float64]:
        """Centres of the columns in m, ascending."""
        return self.left + self.spacing * (np.arange(self.columns, dtype=np.float64) + 0.5)

    @property
    def y(self) -> NDArray[np.float64]:
        """Centres of the rows in m, descending: row 0 is at the top."""
        return self.top - self.spacing * (np.arange(self.rows, dtype=np.float64) + 0.5)

    @property
    def centres(self) -> NDArray[np.float64]:
        """Centres of all samples, x and y in m, shape (y, x, 2)."""
        return np.stack(np.meshgrid(self.x, self.y), axis=-1)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top edge in m."""
        right, bottom = self.left + self.spacing * self.columns, self.top - self.spacing * self.rows
        return self.left, right, bottom, self.top

    @property
    def border(self) -> NDArray[np.float64]:
        """Corners of the outer edge in m, the first again at the end, shape (5, 2)."""
        left, right, bottom, top = self.extent
        corners = (left, bottom), (right, bottom), (right, top), (left, top), (left, bottom)
        return np.array(corners)

    def widened(self, samples: int) -> "Raster":
        """Return the raster with a margin of some samples on each side."""
        away, more = samples * self.spacing, 2 * samples
        left, top = self.left - away, self.top + away
        return Raster(left, top, self.spacing, self.rows + more, self.columns + more)

    def index(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return fractional row and column of points (..., 2) in m, shape (2, ...)."""
        places = np.asarray(points, dtype=np.float64)
        column = (places[..., 0] - self.left) / self.spacing - 0.5
        row = (self.top - places[..., 1]) / self.spacing - 0.5
        return np.stack([row, column])

    def covers(self, index: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which rows and columns, shape (2, ...), are between the outermost centres."""
        row, column = index
        inside = (row >= 0) & (row <= self.rows - 1) & (column >= 0) & (column <= self.columns - 1)
        return np.asarray(inside)
