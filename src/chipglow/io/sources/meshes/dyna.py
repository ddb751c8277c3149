"""Meshes of LS-DYNA: d3plot files, read by lasso-python."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.meshes.reader import Block, MeshReader, grid_of
from chipglow.io.sources.source import SourceError, reading, required

_KIND: Final = "LS-DYNA d3plot"

_TRIANGLE, _QUAD, _TETRA, _HEXA = 5, 9, 10, 12
"""VTK's cell types."""


class DynaReader(MeshReader):
    """States of a d3plot file and of those that follow it, ``d3plot01`` and so on."""

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, _KIND)
        arrays = self._arrays(state_array_filter=["timesteps"])
        self.times = tuple(float(time) for time in arrays.get("timesteps", ()))
        self.count = len(self.times)
        self.kind = f"mesh, {_KIND} with {self.count} states"
        if not self.count:
            raise SourceError(f"{files[0]}: has no state, expected a d3plot with one or more")

    def read(self, number: int) -> Sequence[Block]:
        blocks = tuple(_blocks(self._arrays(state_filter={number})))
        if not blocks:
            raise SourceError(f"{self.files[0]}: has no shells or solids, expected a mesh")
        return blocks

    def _arrays(self, **filters: Any) -> Mapping[str, Any]:
        file = self.files[0]
        dyna = required("lasso.dyna", file, "dyna", "lasso-python")
        logging.getLogger("lasso").setLevel(logging.CRITICAL)
        with reading(file, _KIND):
            arrays: Mapping[str, Any] = dyna.D3plot(
                str(file), buffered_reading=True, **filters
            ).arrays
        return arrays


def _blocks(arrays: Mapping[str, Any]) -> Iterator[Block]:
    points, of_nodes = _of_nodes(arrays)
    for family in ("shell", "solid"):
        prefix = f"element_{family}_"
        nodes = arrays.get(prefix + "node_indexes")
        if nodes is None or not len(nodes):
            continue
        of_elements = _of_elements(arrays, prefix)
        alive = arrays.get(prefix + "is_alive", [np.ones(len(nodes))])[0] > 0
        cells, kinds = _cells(np.asarray(nodes)[alive], family)
        living = {name: values[alive] for name, values in of_elements.items()}
        grid = grid_of(cells, kinds, points, of_nodes, living)
        yield Block((family,), grid, _parts(arrays, prefix, alive))


def _of_nodes(arrays: Mapping[str, Any]) -> tuple[NDArray[Any], dict[str, NDArray[Any]]]:
    # lasso's displacement is the position of the nodes.
    points = arrays.get("node_displacement", [arrays["node_coordinates"]])[0]
    of_nodes = {}
    for name in ("temperature", "velocity"):
        if f"node_{name}" in arrays:
            values = arrays[f"node_{name}"][0]
            layered = name == "temperature" and values.ndim > 1
            of_nodes[name] = values.mean(axis=1) if layered else values
    return np.asarray(points, np.float64), of_nodes


def _of_elements(arrays: Mapping[str, Any], prefix: str) -> dict[str, NDArray[Any]]:
    """Return fields of elements, means over integration points and layers."""
    found: dict[str, NDArray[Any]] = {}
    for name in ("effective_plastic_strain", "thermal_data"):
        if prefix + name in arrays:
            values = arrays[prefix + name][0]
            found[name] = values.reshape(len(values), -1).mean(axis=1)
    for name in ("history_vars", "history_variables"):
        if prefix + name in arrays:
            values = arrays[prefix + name][0]
            values = values.reshape(len(values), -1, values.shape[-1]).mean(axis=1)
            for at in range(values.shape[1]):
                found[f"history_variable_{at + 1}"] = values[:, at]
    return found


def _cells(nodes: NDArray[Any], family: str) -> tuple[NDArray[Any], NDArray[np.uint8]]:
    """Return cells in VTK's form; triangles and tetrahedra repeat their last node."""
    full, less, least = (_QUAD, _TRIANGLE, 3) if family == "shell" else (_HEXA, _TETRA, 4)
    repeated = (nodes[:, least:] == nodes[:, least - 1 : least]).all(axis=1)
    counts = np.where(repeated, least, nodes.shape[1])
    table = np.concatenate((counts[:, None], nodes), axis=1)
    used = np.arange(table.shape[1]) <= counts[:, None]
    return table[used], np.where(repeated, less, full).astype(np.uint8)


def _parts(
    arrays: Mapping[str, Any], prefix: str, alive: NDArray[np.bool_]
) -> dict[str, NDArray[np.bool_]]:
    """Return the elements of each part, by its number and its title."""
    index = arrays.get(prefix + "part_indexes")
    if index is None:
        return {}
    ids = arrays.get("part_titles_ids", arrays.get("part_ids", np.unique(index) + 1))
    parts = {str(int(number)): index[alive] == at for at, number in enumerate(ids)}
    for at, title in enumerate(arrays.get("part_titles", ())):
        text = title.decode(errors="replace") if isinstance(title, bytes) else str(title)
        parts.setdefault(text.strip(), index[alive] == at)
    return parts
