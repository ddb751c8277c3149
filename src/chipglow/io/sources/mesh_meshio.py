"""Meshes in the formats that meshio reads and VTK does not."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.mesh_reader import MeshReader
from chipglow.io.sources.source import SourceError, damaged, required

KINDS: Final[Mapping[str, str]] = {
    ".msh": "Gmsh",
    ".med": "MED",
    ".avs": "AVS-UCD",
}
"""Formats by the ending of a file's name."""


class MeshioReader(MeshReader):
    """One file for each frame."""

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, KINDS[files[0].suffix.lower()])

    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame; see `MeshReader.read`."""
        file = self.file(number)
        meshio = required("meshio", file, "mesh")
        import pyvista

        try:
            mesh = meshio.read(file)
            sets = _sets(mesh)
            # PyVista stumbles over sets that are none of elements, such as Gmsh's.
            mesh.cell_sets, mesh.point_sets = {}, {}
            grid = pyvista.from_meshio(mesh)
        except (FileNotFoundError, MemoryError):
            raise
        except (Exception, SystemExit) as error:  # meshio ends the program for some files
            raise damaged(file, error, KINDS[file.suffix.lower()]) from error
        if not grid.n_cells:
            raise SourceError(f"{file}: has no elements, expected a mesh")
        return (Block((), grid, sets),)


def _sets(mesh: Any) -> dict[str, NDArray[np.bool_]]:
    """Named sets of elements: those of the file, Gmsh's physical groups, MED's families."""
    first = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    sets: dict[str, NDArray[np.bool_]] = {}
    for name, members in mesh.cell_sets.items():
        if name.startswith("gmsh:"):  # numbers of entities
            continue
        sets[name] = np.zeros(first[-1], np.bool_)
        for at, inside in zip(first, members, strict=False):
            if inside is not None:
                sets[name][at + np.asarray(inside, np.int64)] = True
    for field, names in (
        ("gmsh:physical", {name: tag[0] for name, tag in mesh.field_data.items()}),
        (
            "cell_tags",
            {n: tag for tag, all_ in getattr(mesh, "cell_tags", {}).items() for n in all_},
        ),
    ):
        if field in mesh.cell_data:
            tags = np.concatenate(mesh.cell_data[field])
            sets |= {name: tags == tag for name, tag in names.items()}
    return sets
