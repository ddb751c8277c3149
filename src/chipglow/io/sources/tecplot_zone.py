"""A zone of Tecplot as a block of a mesh, from either kind of file."""

from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import simple
from chipglow.io.sources.mesh_reader import Block

ORDERED: Final = "ORDERED"
ELEMENTS: Final[Mapping[str, tuple[int, int]]] = {
    "LINESEG": (2, 3), "TRIANGLE": (3, 5), "QUADRILATERAL": (4, 9), "TETRAHEDRON": (4, 10),
    "BRICK": (8, 12),
}  # fmt: skip
"""Number of nodes of the elements, and their type in VTK."""


class Zone(NamedTuple):
    """A zone in a file."""

    time: float | None
    """Its time; None if it exists at all times."""
    load: Callable[[], Block]
    """Reads its mesh and fields."""


def block_of(
    names: tuple[str, ...],
    columns: Mapping[str, NDArray[np.float64]],
    centred: set[str],
    kind: str,
    cells: NDArray[np.int64] | tuple[int, int, int],
) -> Block:
    """Return a block with the variables of a zone, its positions among them.

    Some variables are ``centred`` in elements. The cells are the nodes of each element, from 0, or
    the numbers of points along i, j and k.
    """
    import pyvista

    fields = dict(columns)
    points = _points(fields)
    if isinstance(cells, tuple):
        grid: Any = pyvista.StructuredGrid()
        grid.points = points
        grid.dimensions = cells
        grid = grid.cast_to_unstructured_grid()
    else:
        size, vtk = ELEMENTS[kind]
        if cells.min() < 0 or cells.max() >= len(points):
            raise ValueError(f"elements have nodes {cells.min() + 1} to {cells.max() + 1}")
        table = np.insert(cells, 0, size, axis=1)
        grid = pyvista.UnstructuredGrid(table.ravel(), np.full(len(cells), vtk, np.uint8), points)
    for name, values in fields.items():
        (grid.cell_data if name in centred else grid.point_data)[name] = values
    return Block(names, grid)


def _points(fields: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Take the positions of the nodes out of the fields."""
    found: list[NDArray[np.float64]] = []
    for axis in "xyz":
        own = next((own for own in fields if simple(own) in (axis, f"coordinate{axis}")), None)
        if own is None and axis != "z":
            raise ValueError(f"there is no {axis.upper()}")
        found.append(np.zeros_like(found[0]) if own is None else fields.pop(own))
    return np.stack(found, axis=1)
