"""A zone of Tecplot as a block of a mesh, whichever kind of file it was in."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.source import SourceError, damaged

ORDERED: Final = "ORDERED"
ELEMENTS: Final[Mapping[str, tuple[int, int]]] = {
    "LINESEG": (2, 3), "TRIANGLE": (3, 5), "QUADRILATERAL": (4, 9), "TETRAHEDRON": (4, 10),
    "BRICK": (8, 12),
}  # fmt: skip
"""Number of nodes of the elements, and their type in VTK."""


class Zone(ABC):
    """A zone in a file.

    Attributes
    ----------
    file : Path
        The file.
    number : int
        Its place among the file's zones, from 1.
    """

    file: Path
    number: int

    @property
    @abstractmethod
    def time(self) -> float | None:
        """Its time; None if it is there at all times."""

    @abstractmethod
    def _block(self) -> Block: ...

    def read(self) -> Block:
        """Its mesh and fields.

        Raises
        ------
        SourceError
            If it cannot be read.
        """
        try:
            return self._block()
        except SourceError:
            raise
        except (ValueError, KeyError, IndexError) as error:
            raise damaged(f"{self.file}: zone {self.number}", error) from None


def block_of(
    names: tuple[str, ...],
    columns: Mapping[str, NDArray[np.float64]],
    centred: set[str],
    kind: str,
    cells: NDArray[np.int64] | tuple[int, int, int],
) -> Block:
    """A block with the fields of a zone.

    Parameters
    ----------
    names : tuple of str
        What the zone is called.
    columns : mapping
        Values of the variables, those of positions among them.
    centred : set of str
        Variables whose values are those of elements.
    kind : str
        `ORDERED` or one of `ELEMENTS`.
    cells : ndarray or tuple of int
        Numbers of the nodes of each element from 0, or how many points are along i, j and k.

    Raises
    ------
    ValueError
        If there are no positions, or elements have nodes that do not exist.
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
    """Positions of the nodes, taken out of the fields."""
    found: list[NDArray[np.float64]] = []
    for axis in "XYZ":
        own = next((own for own in fields if _simple(own) in (axis, f"COORDINATE{axis}")), None)
        if own is None and axis != "Z":
            raise ValueError(f"there is no {axis}")
        found.append(np.zeros_like(found[0]) if own is None else fields.pop(own))
    return np.stack(found, axis=1)


def _simple(name: str) -> str:
    return name.split("[")[0].split("(")[0].strip().upper()
