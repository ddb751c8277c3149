"""Frames as quadratic B-splines on a grid coarser than the samples: a cut's, as it is stored."""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chipglow.scene.frame import Frame, Material
from chipglow.scene.kernels import INNER
from chipglow.scene.raster import Raster, check_shape

SPLINE_FIELDS: Final = (
    "temperature",
    "plastic_strain",
    "plastic_strain_rate",
    "velocity_x",
    "velocity_y",
    "material_x",
    "material_y",
    "filled",
    "tool_temperature",
)
"""Quantities of the coefficients: the workpiece's fields, the fraction of the area that chip and
tool fill, and the tool's temperature."""

FILLED_SPLINE: Final = SPLINE_FIELDS.index("filled")
TOOL_SPLINE: Final = SPLINE_FIELDS.index("tool_temperature")
_SAMPLED: Final = SPLINE_FIELDS[:FILLED_SPLINE]
_VOID, _WORKPIECE, _TOOL = int(Material.VOID), int(Material.WORKPIECE), int(Material.TOOL)
_FAST: Final[Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True}


@dataclass(frozen=True, eq=False)
class Lattice:
    """The nodes of splines, and the samples that they give; row 0 is at the top."""

    raster: Raster
    left: float
    top: float
    """Place of the first node in m."""
    cell: float
    """Distance between nodes in m."""
    rows: int
    columns: int
    in_tool: NDArray[np.bool_]
    """Which samples show the tool, bool of shape `raster.shape`."""
    ambient: float
    """Temperature in K of samples that show nothing."""

    def __post_init__(self) -> None:
        check_shape("lattice: in_tool", self.in_tool.shape, self.raster.shape)
        for name, (first, _), nodes in (
            ("rows", self.down, self.rows),
            ("columns", self.across, self.columns),
        ):
            # A quadratic spline has three nodes.
            if first.min() < 0 or first.max() + 3 > nodes:
                raise ValueError(f"lattice: {nodes} {name} of nodes must extend beyond the samples")

    @classmethod
    def within(
        cls,
        raster: Raster,
        corner: tuple[float, float],
        cell: float,
        in_tool: NDArray[np.bool_],
        ambient: float,
    ) -> "Lattice":
        """Return the part of a larger grid, of this lower left node in m, that a raster needs."""
        left, bottom = corner
        # A node more on each side, so that rounding takes none away.
        beyond = np.array((-1.0, 3.0))
        first, last = np.floor((raster.x[[0, -1]] - left) / cell - 0.5) + beyond
        lowest, highest = np.floor((raster.y[[-1, 0]] - bottom) / cell - 0.5) + beyond
        node = float(left + cell * first), float(bottom + cell * highest)
        shape = int(highest - lowest) + 1, int(last - first) + 1
        return cls(raster, *node, cell, *shape, in_tool, ambient)

    def coarser(self, step: int) -> "Lattice":
        """Return the same nodes with samples `step` times as large, each valued at its centre."""
        fine = self.raster
        rows, columns = fine.rows // step, fine.columns // step
        if step < 1 or min(rows, columns) < 2:
            raise ValueError(f"step: {step}, expected 1 to {min(fine.shape) // 2}")
        middles = slice(step // 2, None, step)
        return replace(
            self,
            raster=replace(fine, spacing=fine.spacing * step, rows=rows, columns=columns),
            in_tool=self.in_tool[middles, middles][:rows, :columns].copy(),
        )

    @cached_property
    def across(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """First node of each column of samples, and the weights of three nodes, (3, columns)."""
        return _placement((self.raster.x - self.left) / self.cell)

    @cached_property
    def down(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """The same for the rows of samples, (3, rows)."""
        return _placement((self.top - self.raster.y) / self.cell)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of the coefficients of a frame: fields, rows and columns."""
        return len(SPLINE_FIELDS), self.rows, self.columns


@dataclass(frozen=True, eq=False)
class SplineFrame:
    """The splines of one frame.

    A sample has the value Σ w_a(y) w_b(x) c_ab of the three by three nodes about it, with w the
    quadratic B-spline: (3/2 − d)²/2, 3/4 − d², (3/2 − d)²/2 at the distances d in cells. It shows
    the workpiece where ``filled`` is over one half and the tool is not there; there the value is
    kept within the limits. The tool has its own temperature and nothing else, the void the
    lattice's.
    """

    lattice: Lattice
    time: float
    nodes: NDArray[np.float32]
    """Coefficients of `SPLINE_FIELDS`, float32 of shape `lattice.shape`."""
    limits: NDArray[np.float32]
    """Smallest and largest value of the fields before ``filled``, which splines can overshoot:
    float32 of shape (fields, 2)."""

    def frame(self, names: Collection[str] | None = None) -> "SplineSamples":
        """Return the samples of temperature, material and the named fields, by default all."""
        material = self.material()
        fields: dict[str, Any] = {
            name: self.values(name, material)
            for name in _SAMPLED
            if names is None or name in names or name == "temperature"
        }
        return SplineSamples(time=self.time, material=material, splines=self, **fields)

    def material(self) -> NDArray[np.uint8]:
        """Return what each sample shows, shape (y, x)."""
        filled = np.empty(self.lattice.raster.shape, np.float32)
        self._evaluate(FILLED_SPLINE, filled)
        seen = np.where(filled > 0.5, np.uint8(_WORKPIECE), np.uint8(_VOID))
        seen[self.lattice.in_tool] = _TOOL
        return seen

    def values(self, name: str, material: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Return one field of `SPLINE_FIELDS` before ``filled``, shape (y, x)."""
        number = _SAMPLED.index(name)
        result = np.empty(self.lattice.raster.shape, np.float32)
        self._evaluate(number, result)
        elsewhere = np.float32(self.lattice.ambient if name == "temperature" else 0.0)
        _within(result, material, *self.limits[number], elsewhere)
        if name == "temperature":
            tool = np.empty_like(result)
            self._evaluate(TOOL_SPLINE, tool)
            np.copyto(result, tool, where=self.lattice.in_tool)
        return result

    def _evaluate(self, number: int, result: NDArray[np.float32]) -> None:
        _evaluate(self.nodes[number], *self.lattice.down, *self.lattice.across, result)


@dataclass(frozen=True, repr=False)
class SplineSamples(Frame):
    """The samples of splines, with the splines."""

    splines: SplineFrame = field(kw_only=True, repr=False)


def _placement(position: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    first = np.floor(position - 0.5)
    s = position - first - 0.5
    weights = np.stack([(1.0 - s) ** 2 / 2, 0.5 + s * (1.0 - s), s**2 / 2])
    return first.astype(np.int64), weights.astype(np.float32)


@njit(**_FAST, **INNER)
def spread(nodes, first, weights, begin, end, result):  # type: ignore[no-untyped-def]
    """Return a row of nodes on the columns of samples from `begin` to `end`."""
    for c in range(begin, end):
        i = first[c]
        result[c - begin] = (
            weights[0, c] * nodes[i] + weights[1, c] * nodes[i + 1] + weights[2, c] * nodes[i + 2]
        )


@njit(cache=True, **_FAST)
def _evaluate(nodes, first_down, down, first_across, across, result):  # type: ignore[no-untyped-def]
    rows, columns = result.shape
    wide = np.empty((nodes.shape[0], columns), np.float32)
    for j in range(nodes.shape[0]):
        spread(nodes[j], first_across, across, 0, columns, wide[j])
    for r in range(rows):
        j = first_down[r]
        upper, middle, lower = wide[j], wide[j + 1], wide[j + 2]
        u, v, w = down[0, r], down[1, r], down[2, r]
        for c in range(columns):
            result[r, c] = u * upper[c] + v * middle[c] + w * lower[c]


@njit(cache=True, **_FAST)
def _within(values, material, least, largest, elsewhere):  # type: ignore[no-untyped-def]
    rows, columns = values.shape
    for r in range(rows):
        for c in range(columns):
            value = min(max(values[r, c], least), largest)
            values[r, c] = value if material[r, c] == _WORKPIECE else elsewhere
