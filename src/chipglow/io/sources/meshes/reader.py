"""Meshes over time in files of one kind, and the parts that they consist of."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from errno import ENOENT
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.source import SourceError, check_hdf5

_SIZES: Final[Mapping[int, int]] = {
    5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15,
    27: 13, 28: 9, 29: 27, 34: 7,
}  # fmt: skip
"""Numbers of nodes of VTK's types of elements."""


_FORTRAN_EXPONENT: Final = re.compile(r"([-+]?(?:\d+\.\d*|\.\d+|\d+(?=[dDqQ])))[dDqQ]?([-+]?\d+)")


@dataclass(frozen=True)
class Block:
    """Part of a mesh."""

    names: tuple[str, ...]
    """Name, number and path of the part."""
    grid: Any
    """A pyvista.UnstructuredGrid with positions and fields in the file's units."""
    sets: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    """Membership of the elements in named sets, shape (elements,), bool."""

    def has(self, name: str) -> bool:
        return name in self.grid.point_data or name in self.grid.cell_data


class MeshReader(ABC):
    """Meshes over time in files of one kind: a frame per file, or one file with all frames."""

    kind: str
    times: tuple[float, ...] | None = None
    """Times of the frames in the file's unit; None if the files contain none."""
    count: int
    known: Mapping[str, str] = MappingProxyType({})
    """Names that fields have in this format alone, by the names of a scene."""
    remarks: list[str]
    """Remarks on data that are left out or missing in the files read so far."""

    def __init__(self, files: Sequence[Path], kind: str) -> None:
        for file in files:
            if not file.is_file():
                raise FileNotFoundError(ENOENT, "there is no such file", str(file))
            check_hdf5(file)
        self.files = files
        self.count = len(files)
        self.remarks = []
        self.kind = f"mesh, {len(files)} file{'s' * (len(files) > 1)} of {kind}"

    def file(self, number: int) -> Path:
        """Return the file of a frame, or the first of several, for messages."""
        return self.files[min(number, len(self.files) - 1)]

    @abstractmethod
    def read(self, number: int) -> Sequence[Block]:
        """Return the parts of the mesh of a frame."""


def number_of(word: str) -> float:
    """Return a number of a text file; Fortran writes exponents as 0.3D+03 or 0.3+103."""
    try:
        return float(word)
    except ValueError:
        exponent = _FORTRAN_EXPONENT.fullmatch(word)
        if exponent is None:
            raise ValueError(f"{word!r} is not a number") from None
        return float(f"{exponent[1]}e{exponent[2]}")


def grid_of(
    cells: NDArray[Any],
    kinds: NDArray[np.uint8],
    points: NDArray[np.float64],
    of_nodes: Mapping[str, NDArray[Any]],
    of_elements: Mapping[str, NDArray[Any]],
) -> Any:
    """Return a pyvista.UnstructuredGrid of elements in VTK's form, positions and fields."""
    import pyvista

    grid = pyvista.UnstructuredGrid(cells, kinds, points)
    grid.point_data.update(of_nodes, copy=False)
    grid.cell_data.update(of_elements, copy=False)
    return grid


def offsets_of(grid: Any) -> NDArray[np.int64]:
    """Return where the nodes of each element begin, and where those of the last one end."""
    return np.asarray(grid.cell_offsets, np.int64)


def check_grid(file: Path, grid: Any) -> None:
    """Refuse a grid that would make VTK read beyond its arrays."""
    offset = offsets_of(grid)
    nodes = np.asarray(grid.cell_connectivity)
    kinds = np.asarray(grid.celltypes)
    sizes = np.diff(offset)
    if len(offset) != len(kinds) + 1 or (sizes < 0).any() or offset[-1] != len(nodes):
        raise SourceError(f"{file}: its tables of elements do not fit together, it is damaged")
    if nodes.size and (nodes.min() < 0 or nodes.max() >= grid.n_points):
        raise SourceError(
            f"{file}: elements with the nodes {nodes.min()} to {nodes.max()}, expected 0 to "
            f"{grid.n_points - 1}"
        )
    expected = np.array([_SIZES.get(kind, 0) for kind in range(256)])[kinds]
    if ((expected > 0) & (sizes != expected)).any():
        raise SourceError(f"{file}: elements with a wrong number of nodes, it is damaged")
    for data, count in ((grid.point_data, grid.n_points), (grid.cell_data, grid.n_cells)):
        for name in list(data.keys()):
            if len(data[name]) != count:
                raise SourceError(
                    f"{file}: {name!r} has {len(data[name])} values, expected {count}"
                )


def numeric_arrays(data: Any) -> dict[str, NDArray[Any]]:
    """Return numeric fields of nodes or elements, shape (places, components)."""
    arrays = {name: np.asarray(data[name]) for name in data.keys()}  # noqa: SIM118  of pyvista
    return {
        name: values[:, None] if values.ndim == 1 else values
        for name, values in arrays.items()
        if np.issubdtype(values.dtype, np.number)
    }


def fields_of(blocks: Iterable[Block]) -> dict[str, int]:
    """Return names of all numeric fields with their numbers of components."""
    return {
        name: values.shape[1]
        for block in blocks
        for data in (block.grid.point_data, block.grid.cell_data)
        for name, values in numeric_arrays(data).items()
    }
