"""Meshes in the formats that meshio reads and VTK does not."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.meshes.reader import Block, MeshReader
from chipglow.io.sources.source import SourceError, reading, required

KINDS: Final[Mapping[str, str]] = {".msh": "Gmsh", ".med": "MED", ".avs": "AVS-UCD"}
"""Formats by the ending of a file's name."""


class MeshioReader(MeshReader):
    """One file for each frame."""

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, KINDS[files[0].suffix.lower()])

    def read(self, number: int) -> Sequence[Block]:
        file = self.file(number)
        meshio = required("meshio", file, "mesh")
        import pyvista

        with reading(file, KINDS[file.suffix.lower()]):
            mesh = meshio.read(file)
            sets = _sets(mesh)
            # PyVista stumbles over sets that are none of elements, such as Gmsh's.
            mesh.cell_sets, mesh.point_sets = {}, {}
            grid = pyvista.from_meshio(mesh)
        if not grid.n_cells:
            raise SourceError(f"{file}: has no elements, expected a mesh")
        return (Block((), grid, sets),)


def _sets(mesh: Any) -> dict[str, NDArray[np.bool_]]:
    """Return named sets of elements: those of the file, Gmsh's groups, MED's families."""
    first = np.cumsum([0, *(len(block.data) for block in mesh.cells)])
    sets: dict[str, NDArray[np.bool_]] = {}
    for name, members in mesh.cell_sets.items():
        if name.startswith("gmsh:"):  # numbers of entities
            continue
        sets[name] = np.zeros(first[-1], np.bool_)
        for at, inside in zip(first, members, strict=False):
            if inside is not None:
                sets[name][at + np.asarray(inside, np.int64)] = True
    groups = {name: tag[0] for name, tag in mesh.field_data.items()}
    families = {
        name: tag for tag, names in getattr(mesh, "cell_tags", {}).items() for name in names
    }
    for field, names in (("gmsh:physical", groups), ("cell_tags", families)):
        if field in mesh.cell_data:
            tags = np.concatenate(mesh.cell_data[field])
            sets |= {name: tags == tag for name, tag in names.items()}
    return sets
