"""A part of a mesh at one time, and how it is made flat: cut, or seen from the side."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import Placement
from chipglow.io.sources.source import SourceError
from chipglow.scene.triangulate import Shape, triangulate

Arrays: TypeAlias = Mapping[str, NDArray[Any]]
Section: TypeAlias = float | Literal["facing"] | None

_FLAT: Final[Mapping[int, Shape]] = {
    5: "triangle", 8: "quad", 9: "quad", 22: "triangle6", 23: "quad8", 28: "quad9",
}  # fmt: skip
_OTHER_FLAT: Final = (6, 7, 34, 35, 63, 69, 70, 76, 77)
_PIXEL: Final = 8
_LINES_AND_POINTS: Final = (0, 1, 2, 3, 4, 21, 36, 60, 61, 68, 75)
_NUDGE: Final = 1e-7
_SIZES: Final[Mapping[int, int]] = {
    5: 3, 8: 4, 9: 4, 10: 4, 11: 8, 12: 8, 13: 6, 14: 5, 22: 6, 23: 8, 24: 10, 25: 20, 26: 15,
    27: 13, 28: 9, 29: 27, 34: 7,
}  # fmt: skip
"""Nodes of VTK's types of elements."""
_TOOL: Final = "chipglow: tool"
_HIDDEN_GHOST: Final = 32


@dataclass(frozen=True)
class Block:
    """A part of a mesh.

    Parameters
    ----------
    names : tuple of str
        What it is called: name, number, path.
    grid : pyvista.UnstructuredGrid
        Positions and fields in the file's units.
    sets : mapping
        Which elements are in a named set, shape (elements,), bool.
    """

    names: tuple[str, ...]
    grid: Any
    sets: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)


@dataclass(frozen=True)
class FlatMesh:
    """Triangles with fields, in the file's units.

    Parameters
    ----------
    points : ndarray
        Positions of the nodes, shape (nodes, 3).
    triangles : ndarray
        Numbers of the nodes, shape (triangles, 3).
    of_nodes, of_elements : mapping
        Fields of nodes and of triangles, shape (nodes, components) and (triangles, components).
    tool : ndarray
        Whether a triangle is of the tool, shape (triangles,), bool.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    of_nodes: Arrays
    of_elements: Arrays
    tool: NDArray[np.bool_]


def grid_of(
    cells: NDArray[Any],
    kinds: NDArray[np.uint8],
    points: NDArray[np.float64],
    of_nodes: Arrays,
    of_elements: Arrays,
) -> Any:
    """A pyvista.UnstructuredGrid of positions, elements as VTK keeps them, and fields of both."""
    import pyvista

    grid = pyvista.UnstructuredGrid(cells, kinds, points)
    grid.point_data.update(of_nodes, copy=False)
    grid.cell_data.update(of_elements, copy=False)
    return grid


def offsets_of(grid: Any) -> NDArray[np.int64]:
    """Where the nodes of each element begin, and where those of the last one end."""
    # PyVista gave it another name in 0.49.
    offsets = grid.cell_offsets if hasattr(grid, "cell_offsets") else grid.offset
    return np.asarray(offsets, np.int64)


def check_grid(file: Path, grid: Any) -> None:
    """Find what would make VTK read beyond its arrays.

    Raises
    ------
    SourceError
        If an element has nodes that do not exist, or tables do not fit together.
    """
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


def fields_of(blocks: Iterable[Block]) -> dict[str, int]:
    """Names of all fields, with the number of their components."""
    fields: dict[str, int] = {}
    for block in blocks:
        for data in (block.grid.point_data, block.grid.cell_data):
            for name in data.keys():  # noqa: SIM118  a pyvista object
                if np.issubdtype(data[name].dtype, np.number):
                    values = data[name]
                    fields[name] = values.shape[1] if values.ndim > 1 else 1
    return fields


def flatten(
    blocks: Sequence[Block],
    fields: Iterable[str],
    tool: Sequence[NDArray[np.bool_]],
    placement: Placement,
    section: Section,
    unit: float,
) -> FlatMesh:
    """Triangles of all blocks with the fields that are wanted.

    Of a mesh with solid elements, flat ones are not seen in a cut, and where they have the nodes of
    solid ones they are their boundary and left out.

    Parameters
    ----------
    blocks : sequence of Block
        The mesh.
    fields : iterable of str
        Names of the fields to keep.
    tool : sequence of ndarray
        Whether an element of each block is of the tool, shape (elements,), bool.
    placement : Placement
        Which axis is the depth.
    section : float, "facing" or None
        Where along the depth to cut a solid mesh, in m, or its visible surface.
    unit : float
        The file's unit of length in m.

    Raises
    ------
    SourceError
        If the mesh is solid and no section is given, or flat and one is, or nothing is cut.
    """
    wanted = set(fields)
    grids = [
        grid
        for block, is_tool in zip(blocks, tool, strict=True)
        if (grid := _with_only(block.grid, wanted, is_tool)).n_cells
    ]
    solids = [grid for grid in grids if _is_solid(grid).any()]
    if not solids:
        if section is not None and section != "facing":
            raise SourceError("mesh.section: a position in a mesh that is flat, expected none")
        flat = [part for grid in grids for part in _flat(grid)]
    elif section is None:
        raise SourceError(
            f"mesh.section: none for a solid mesh, expected {_range(solids, placement, unit)}, or "
            "facing for the surface that the camera sees"
        )
    elif section == "facing":
        flat = [part for grid in _without_boundary(grids) for part in _seen(grid)]
    else:
        flat = [part for grid in solids for part in _sections(grid, placement, section / unit)]
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


def _is_solid(grid: Any) -> NDArray[np.bool_]:
    return np.asarray(np.isin(grid.celltypes, (*_FLAT, *_OTHER_FLAT), invert=True))


def _without_boundary(grids: Sequence[Any]) -> Iterator[Any]:
    """Grids without flat elements on the nodes of solid ones; flat elements are seen, too."""
    solid = [_used_nodes(grid, _is_solid(grid)) for grid in grids]
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


def _used_nodes(grid: Any, chosen: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Keys of the nodes of chosen elements."""
    nodes = np.asarray(grid.cell_connectivity)[np.repeat(chosen, np.diff(offsets_of(grid)))]
    return _keys(np.asarray(grid.points)[np.unique(nodes)])


def _keys(points: Any) -> NDArray[np.uint64]:
    """A number for each place, the same for the same place and for hardly any other."""
    bits = (np.asarray(points, np.float64) + 0.0).view(np.uint64)
    factors = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
    mixed = (bits ^ (bits >> np.uint64(29))) * factors
    return np.asarray(np.bitwise_xor.reduce(mixed ^ (mixed >> np.uint64(32)), axis=1))


def _with_only(grid: Any, wanted: set[str], is_tool: NDArray[np.bool_]) -> Any:
    """The grid without lines, points, deleted elements and fields that nobody wants."""
    kept = grid.copy(deep=False)
    keep = ~np.isin(grid.celltypes, _LINES_AND_POINTS)
    for name, dead in (("vtkGhostType", _HIDDEN_GHOST), ("STATUS", 0)):
        if name in grid.cell_data.keys():  # noqa: SIM118
            values = np.asarray(grid.cell_data[name])
            keep &= (values.astype(np.int64) & dead) == 0 if dead else values != 0
    for data in (kept.point_data, kept.cell_data):
        for name in list(data.keys()):
            if name not in wanted:
                del data[name]
    kept.cell_data[_TOOL] = is_tool.astype(np.uint8)
    return kept if keep.all() else kept.extract_cells(np.flatnonzero(keep))


def _sections(grid: Any, placement: Placement, position: float) -> list[FlatMesh]:
    """A cut through solid elements; position in the file's unit."""
    low, high = grid.bounds[2 * placement.depth :][:2]
    # A plane in the outermost face would cut the elements on one side of the mesh only.
    edge = _NUDGE * (high - low)
    if low - edge <= position <= high + edge:
        position = float(np.clip(position, low + edge, high - edge))
    return _polygons(_cut(grid, placement.depth, position))


def _seen(grid: Any) -> list[FlatMesh]:
    return _polygons(_surface(grid)) if _is_solid(grid).any() else _flat(grid)


def _surface(grid: Any) -> Any:
    """Flat elements and the outside of solid ones; those with curved edges in small pieces."""
    from vtkmodules.vtkFiltersGeometry import vtkDataSetSurfaceFilter

    surface = vtkDataSetSurfaceFilter()
    surface.SetNonlinearSubdivisionLevel(2)
    surface.SetInputData(grid)
    return surface


def _cut(grid: Any, axis: int, position: float) -> Any:
    from vtkmodules.vtkCommonDataModel import vtkPlane
    from vtkmodules.vtkFiltersCore import vtkCutter

    normal = np.eye(3)[axis]
    plane = vtkPlane()
    plane.SetNormal(*normal)
    plane.SetOrigin(*(normal * position))
    cutter = vtkCutter()
    cutter.SetCutFunction(plane)
    cutter.SetInputData(grid)
    return cutter


def _polygons(source: Any) -> list[FlatMesh]:
    """What a filter of VTK makes, as triangles."""
    import pyvista
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    split = vtkTriangleFilter()
    split.PassVertsOff()
    split.PassLinesOff()
    split.SetInputConnection(source.GetOutputPort())
    split.Update()
    surface = pyvista.wrap(split.GetOutput())
    if surface.n_cells == 0:
        return []
    triangles = np.asarray(surface.faces, np.int64).reshape(-1, 4)[:, 1:]
    of_nodes, of_elements = _arrays(surface.point_data), _arrays(surface.cell_data)
    tool = of_elements.pop(_TOOL)[:, 0] > 0
    points = np.asarray(surface.points, np.float64)
    return [FlatMesh(points, triangles, of_nodes, of_elements, tool)]


def _flat(grid: Any) -> list[FlatMesh]:
    others = np.flatnonzero(np.isin(grid.celltypes, _OTHER_FLAT))
    flat: list[FlatMesh] = []
    if others.size:
        flat += _polygons(_surface(grid.extract_cells(others)))
    of_nodes, of_elements = _arrays(grid.point_data), _arrays(grid.cell_data)
    points = np.asarray(grid.points, np.float64)
    for kind, shape in _FLAT.items():
        cells = np.flatnonzero(grid.celltypes == kind)
        if cells.size:
            nodes = _nodes(grid, kind, cells)
            flat.append(
                _triangles(
                    shape,
                    points,
                    nodes,
                    of_nodes,
                    {name: values[cells] for name, values in of_elements.items()},
                )
            )
    return flat


def _nodes(grid: Any, kind: int, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    offsets = offsets_of(grid)
    count = int(offsets[cells[0] + 1] - offsets[cells[0]])
    nodes = np.asarray(grid.cell_connectivity)[offsets[cells][:, None] + np.arange(count)]
    ordered: NDArray[np.int64] = nodes[:, (0, 1, 3, 2)] if kind == _PIXEL else nodes
    return ordered.astype(np.int64)


def _triangles(
    shape: Shape,
    points: NDArray[np.float64],
    nodes: NDArray[np.int64],
    of_nodes: dict[str, NDArray[np.float64]],
    of_elements: dict[str, NDArray[np.float64]],
) -> FlatMesh:
    widths = [values.shape[1] for values in of_nodes.values()]
    values = np.concatenate([np.empty((len(points), 0)), *of_nodes.values()], axis=1)
    pieces = triangulate(shape, points, values, nodes)
    columns = np.split(pieces.values, np.cumsum(widths), axis=1)
    elements = {name: values[pieces.element] for name, values in of_elements.items()}
    tool = elements.pop(_TOOL)[:, 0] > 0
    return FlatMesh(
        pieces.points,
        pieces.triangles,
        dict(zip(of_nodes, columns, strict=False)),
        elements,
        tool,
    )


def _arrays(data: Any) -> dict[str, NDArray[np.float64]]:
    return {
        name: np.asarray(data[name], np.float64).reshape(len(data[name]), -1)
        for name in data.keys()  # noqa: SIM118
        if np.issubdtype(data[name].dtype, np.number)
    }


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
    """The same field of all parts, NaN in those that lack it."""
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
