"""A mesh as triangles: flat elements, a cut through solid ones, or their visible surface."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import Placement
from chipglow.io.sources.meshes.reader import Block, numeric_arrays, offsets_of
from chipglow.io.sources.meshes.triangles import split_quads
from chipglow.io.sources.source import SourceError

Arrays: TypeAlias = Mapping[str, NDArray[np.float64]]

_TRIANGLE, _PIXEL, _QUAD = 5, 8, 9
"""VTK's cell types."""

_OTHER_FLAT: Final = (6, 7, 22, 23, 28, 34, 35, 63, 69, 70, 76, 77)
"""Strips, polygons and curved elements, which VTK cuts into pieces of a quarter of their edges.

A field with second derivative f'' along an edge of length h is then off by up to f'' h^2 / 128.
"""

_LINES_AND_POINTS: Final = (0, 1, 2, 3, 4, 21, 36, 60, 61, 68, 75)
"""VTK's cell types without an area."""

_NUDGE: Final = 1e-7
"""Part of the mesh by which a cut in its outermost face is moved inwards."""

_FLAT: Final = 1e-3  # depth of a mesh by its longest side, up to which it is flat
_TOOL: Final = "chipglow: tool"

_HIDDEN_GHOST: Final = 32
"""VTK's bit of hidden cells, HIDDENCELL."""


@dataclass(frozen=True)
class FlatMesh:
    """Triangles with fields, in the file's units."""

    points: NDArray[np.float64]
    """Positions of the nodes, shape (nodes, 3)."""
    triangles: NDArray[np.int64]
    """Indices of the nodes, shape (triangles, 3)."""
    of_nodes: Arrays
    """Fields of nodes, shape (nodes, components)."""
    of_elements: Arrays
    """Fields of triangles, shape (triangles, components)."""
    tool: NDArray[np.bool_]
    """Whether a triangle belongs to the tool, shape (triangles,)."""


def flatten(
    blocks: Sequence[Block],
    fields: Collection[str],
    tool: Sequence[NDArray[np.bool_]],
    placement: Placement,
    section: float | Literal["facing"] | None,
    unit: float,
) -> FlatMesh:
    """Return the triangles of all blocks, with some fields; `unit` is the file's unit of length.

    In a mesh with solid elements flat ones are not seen in a cut, and those on the nodes of solid
    ones are their boundary and left out.
    """
    parts = [_with_only(block.grid, fields, of) for block, of in zip(blocks, tool, strict=True)]
    grids = [grid for grid in parts if grid.n_cells]
    solids = [grid for grid in grids if _is_solid(grid).any()]
    if not solids:
        if section is not None and section != "facing":
            raise SourceError("mesh.section: a flat mesh has no section position")
        if section is None:
            _check_flat(grids, placement, unit)
        flat = [part for grid in grids for part in _flat(grid)]
    elif section is None:
        raise SourceError(
            f"mesh.section: none for a solid mesh, expected {_range(solids, placement, unit)}, or "
            "facing for the surface that the camera sees"
        )
    elif section == "facing":
        flat = [part for grid in _without_boundary(grids) for part in _seen(grid)]
    else:
        flat = [part for grid in solids for part in _cut(grid, placement.depth, section / unit)]
        if not flat:
            raise SourceError(
                f"mesh.section: nothing at {section:g} m, expected "
                f"{_range(solids, placement, unit)}"
            )
    if not flat:
        raise SourceError("the mesh has no elements with an area")
    return _joined(flat)


def _range(solids: Sequence[Any], placement: Placement, unit: float) -> str:
    ends = [grid.bounds[2 * placement.depth :][:2] for grid in solids]
    low, high = unit * min(end[0] for end in ends), unit * max(end[1] for end in ends)
    return f"a position along {'xyz'[placement.depth]} from {low:g} m to {high:g} m"


def _check_flat(grids: Sequence[Any], placement: Placement, unit: float) -> None:
    """Refuse flat elements in front of each other, such as the surface of a solid."""
    bounds = np.array([np.reshape(grid.bounds, (3, 2)) for grid in grids])
    sides = bounds[:, :, 1].max(axis=0, initial=0) - bounds[:, :, 0].min(axis=0, initial=0)
    depth = sides[placement.depth]
    if depth > _FLAT * sides.max(initial=0):
        raise SourceError(
            f"mesh.section: none for flat elements that extend over {unit * depth:g} m along "
            f"{'xyz'[placement.depth]}, expected facing for those that the camera sees, or another "
            "placement"
        )


def _is_solid(grid: Any) -> NDArray[np.bool_]:
    return np.isin(grid.celltypes, (_TRIANGLE, _PIXEL, _QUAD, *_OTHER_FLAT), invert=True)


def _without_boundary(grids: Sequence[Any]) -> Iterator[Any]:
    """Yield grids without flat elements on the nodes of solid ones."""
    solid = []
    for grid in grids:
        of_solids = np.repeat(_is_solid(grid), np.diff(offsets_of(grid)))
        nodes = np.unique(np.asarray(grid.cell_connectivity)[of_solids])
        solid.append(_keys(np.asarray(grid.points)[nodes]))
    taken = np.unique(np.concatenate(solid))
    for grid in grids:
        is_solid = _is_solid(grid)
        if is_solid.all():
            yield grid
            continue
        free = ~np.isin(_keys(grid.points), taken)[np.asarray(grid.cell_connectivity)]
        before = np.append(0, np.cumsum(free))[offsets_of(grid)]
        kept = np.flatnonzero(is_solid | (np.diff(before) > 0))
        if kept.size:
            yield grid.extract_cells(kept)


def _keys(points: Any) -> NDArray[Any]:
    """Return positions as bytes, which can be compared as a whole."""
    rows = np.ascontiguousarray(np.asarray(points, np.float64) + 0.0)
    return rows.view(np.dtype((np.void, 24))).ravel()  # three float64


def _with_only(grid: Any, wanted: Collection[str], is_tool: NDArray[np.bool_]) -> Any:
    """Return the grid without lines, points, deleted elements and fields that are not wanted."""
    kept = grid.copy(deep=False)
    keep = ~np.isin(grid.celltypes, _LINES_AND_POINTS)
    if "vtkGhostType" in grid.cell_data:
        keep &= (np.asarray(grid.cell_data["vtkGhostType"]).astype(np.int64) & _HIDDEN_GHOST) == 0
    if "STATUS" in grid.cell_data:
        keep &= np.asarray(grid.cell_data["STATUS"]) != 0
    for data in (kept.point_data, kept.cell_data):
        for name in set(data.keys()).difference(wanted):
            del data[name]
    kept.cell_data[_TOOL] = is_tool.astype(np.uint8)
    return kept if keep.all() else kept.extract_cells(np.flatnonzero(keep))


def _seen(grid: Any) -> list[FlatMesh]:
    return _polygons(_surface(grid)) if _is_solid(grid).any() else _flat(grid)


def _surface(grid: Any) -> Any:
    """Return flat elements and the outside of solid ones, curved edges in pieces."""
    import pyvista
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    surface = vtkDataSetSurfaceFilter()
    surface.SetNonlinearSubdivisionLevel(2)
    surface.SetInputData(grid)
    surface.Update()
    return pyvista.wrap(surface.GetOutput())


def _cut(grid: Any, axis: int, position: float) -> list[FlatMesh]:
    """Return a cut through solid elements; position in the file's unit."""
    low, high = grid.bounds[2 * axis :][:2]
    # A plane in the outermost face would cut the elements on one side of the mesh only.
    edge = _NUDGE * (high - low)
    if low - edge <= position <= high + edge:
        position = float(np.clip(position, low + edge, high - edge))
    normal = np.eye(3)[axis]
    return _polygons(grid.slice(normal, origin=normal * position, generate_triangles=True))


def _polygons(polygons: Any) -> list[FlatMesh]:
    surface = polygons.triangulate()
    if surface.n_cells == 0:
        return []
    triangles = np.asarray(surface.faces, np.int64).reshape(-1, 4)[:, 1:]
    of_nodes, of_elements = _arrays(surface.point_data), _arrays(surface.cell_data)
    tool = of_elements.pop(_TOOL)[:, 0] > 0
    points = np.asarray(surface.points, np.float64)
    return [FlatMesh(points, triangles, of_nodes, of_elements, tool)]


def _flat(grid: Any) -> list[FlatMesh]:
    flat: list[FlatMesh] = []
    others = np.flatnonzero(np.isin(grid.celltypes, _OTHER_FLAT))
    if others.size:
        flat += _polygons(_surface(grid.extract_cells(others)))
    of_nodes, of_elements = _arrays(grid.point_data), _arrays(grid.cell_data)
    points = np.asarray(grid.points, np.float64)
    for kind in (_TRIANGLE, _PIXEL, _QUAD):
        cells = np.flatnonzero(grid.celltypes == kind)
        if cells.size:
            nodes = _nodes(grid, kind, cells)
            triangles = nodes if kind == _TRIANGLE else split_quads(points, nodes)
            pieces = np.repeat(cells, len(triangles) // len(cells))
            elements = {name: values[pieces] for name, values in of_elements.items()}
            tool = elements.pop(_TOOL)[:, 0] > 0
            flat.append(FlatMesh(points, triangles, of_nodes, elements, tool))
    return flat


def _nodes(grid: Any, kind: int, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    offsets = offsets_of(grid)
    count = int(offsets[cells[0] + 1] - offsets[cells[0]])
    nodes = np.asarray(grid.cell_connectivity)[offsets[cells][:, None] + np.arange(count)]
    return np.asarray(nodes[:, (0, 1, 3, 2)] if kind == _PIXEL else nodes, np.int64)


def _arrays(data: Any) -> dict[str, NDArray[np.float64]]:
    return {name: values.astype(np.float64) for name, values in numeric_arrays(data).items()}


def _joined(parts: Sequence[FlatMesh]) -> FlatMesh:
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    return FlatMesh(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.triangles + at for part, at in zip(parts, first, strict=False)]),
        _stacked([part.of_nodes for part in parts], [len(part.points) for part in parts]),
        _stacked([part.of_elements for part in parts], [len(part.triangles) for part in parts]),
        np.concatenate([part.tool for part in parts]),
    )


def _stacked(arrays: Sequence[Arrays], lengths: Sequence[int]) -> Arrays:
    """Return the same fields of all parts one behind the other, NaN in parts that lack one."""
    widths = {name: values.shape[1] for part in arrays for name, values in part.items()}
    return {
        name: np.concatenate(
            [
                part[name] if name in part else np.full((length, width), np.nan)
                for part, length in zip(arrays, lengths, strict=True)
            ]
        )
        for name, width in widths.items()
    }
