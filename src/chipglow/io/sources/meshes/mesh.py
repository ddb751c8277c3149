"""Meshes over time, from the programs that compute them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources.conventions import (
    OTHER_NAMES,
    NamedSource,
    known_unit,
    match_names,
    simple,
    unit_in_name,
    unit_of,
)
from chipglow.io.sources.file_names import files_of
from chipglow.io.sources.meshes import meshio_formats, tecplot, vtk
from chipglow.io.sources.meshes.abaqus import AbaqusReader
from chipglow.io.sources.meshes.dyna import DynaReader
from chipglow.io.sources.meshes.flat import FlatMesh, flatten
from chipglow.io.sources.meshes.reader import Block, MeshReader, check_grid, fields_of
from chipglow.io.sources.meshes.triangles import NOTHING, rasterise
from chipglow.io.sources.source import (
    SourceError,
    Survey,
    even_times,
    naming,
    reading,
    required,
    span_of,
)
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import POSITION, Unit
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.text import Notes

MESH_READERS: Final[Mapping[str, Callable[[Sequence[Path]], MeshReader]]] = {
    **dict.fromkeys(vtk.KINDS, vtk.VtkReader),
    **dict.fromkeys(meshio_formats.KINDS, meshio_formats.MeshioReader),
    **dict.fromkeys(tecplot.ENDINGS, tecplot.TecplotReader),
    ".inp": AbaqusReader,
}
"""Readers of meshes by the ending of the file's name; LS-DYNA's d3plot has none."""

_VECTOR: Final = "velocity"
_COMPONENTS: Final = ("velocity_x", "velocity_y")

_VECTOR_SIZES: Final = (2, 3)
"""Numbers of components of vectors."""

_COMPOUND_SIZES: Final = (*_VECTOR_SIZES, 6, 9)
"""Numbers of components of vectors, symmetric tensors and tensors."""

_MOST_PARTS: Final = 1000
"""Most parts of a mesh."""


@dataclass(frozen=True)
class MeshSource(NamedSource, Part):
    """Finite-element results: meshes with fields, one for each time.

    Elements are sampled exactly as they are: fields of nodes by the element's own shape, fields of
    elements constant in each. Where there is no element there is no material. Every frame may have
    its own mesh. Where elements overlap the later one in the file is taken. ``files`` are a
    file with one mesh or with meshes over time, an LS-DYNA d3plot, or a pattern such as
    ``chip_*.vtu``; ``times`` in s or an ``interval`` replace the times of the files. ``names`` are
    the file's names of fields by those of a scene: ``velocity`` is a vector along the file's axes,
    ``velocity_x`` and ``velocity_y`` are components along the placement's axes.
    """

    title: ClassVar[str] = "a mesh"
    endings: ClassVar[tuple[str, ...]] = (
        *(ending for ending in MESH_READERS if ending not in vtk.OTHER_HDF),
        "d3plot",
    )
    files: Path = Path()
    times: tuple[float, ...] = ()
    section: Annotated[
        float | Literal["facing"] | None,
        Parameter(
            "Solid elements: position of the cut along the axis of depth, such as 0 mm; facing: "
            "the surface that faces the camera, which looks at the scene's x and y from the front.",
            POSITION,
        ),
    ] = None
    tool_parts: Annotated[
        tuple[str | int, ...],
        Parameter(
            "Names of the blocks, parts or sets of elements that are tool, such as [TOOL], or "
            "their numbers in the field of parts, such as [2]."
        ),
    ] = ()
    part_field: Annotated[
        str | None, Parameter("Field of elements that numbers the parts; none: it is guessed.")
    ] = None
    displacement: Annotated[
        str | None, Parameter("Field of node vectors to be added to the positions.")
    ] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "files", Path(self.files))
        if not all(isfinite(time) for time in self.times):
            raise ValueError(f"times: expected finite times, got {self.times!r}")
        if self.times and self.interval is not None:
            raise ValueError("interval: times are given too, expected one of them")

    def survey(self) -> Survey:
        meshes = Meshes(self)
        flat = [meshes.flat(number, blocks) for number, blocks in meshes.ends.items()]
        found, notes = meshes.found, Notes(meshes.assumptions(), remarks=meshes.remarks())
        notes += meshes.unit_notes
        return Survey(
            meshes.reader.kind,
            meshes.times(notes),
            meshes.extent(flat),
            {ours: found[ours] for ours in READABLE if ours in found},
            tuple(sorted(set(fields_of(meshes.ends[0])) - set(found.values()))),
            temperatures=meshes.temperatures(flat),
            notes=notes,
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        meshes = Meshes(self)
        times = meshes.times(Notes())
        for number in range(start, meshes.reader.count):
            mesh = meshes.flat(number, meshes.read(number))
            yield meshes.sampled(mesh, float(times[number]), raster)


class Meshes:
    """A source that is open."""

    def __init__(self, source: MeshSource) -> None:
        self._source = source
        self.reader = _reader(source)
        self.ends = {number: self.read(number) for number in sorted({0, self.reader.count - 1})}
        """The first and the last mesh."""
        self.found = self._find()
        """The file's fields by the names of a scene; a vector of velocity is both components."""
        self.unit_notes = Notes()
        self._units = {name: self._unit(name, theirs) for name, theirs in self.found.items()}

    def read(self, number: int) -> list[Block]:
        file = self.reader.file(number)
        with reading(file):
            blocks = self.reader.read(number)
        for block in blocks:
            check_grid(file, block.grid)
        return [self._displaced(block, file) for block in blocks]

    def _displaced(self, block: Block, file: Path) -> Block:
        name = self._source.displacement
        if name is None:
            return block
        if name not in block.grid.point_data:
            raise SourceError(f"{file}: displacement: no node has {name!r}")
        by = np.asarray(block.grid.point_data[name], np.float64)
        if by.ndim != 2 or by.shape[1] not in _VECTOR_SIZES:
            raise SourceError(f"{file}: displacement: {name!r} is not a vector")
        points = np.array(block.grid.points, np.float64)
        points[:, : by.shape[1]] += by
        grid = block.grid.copy(deep=False)
        grid.points = points
        return replace(block, grid=grid)

    def _find(self) -> dict[str, str]:
        sizes, file = fields_of(self.ends[0]), self.reader.file(0)
        given = {ours: theirs for ours, theirs in self.reader.known.items() if theirs in sizes}
        given |= self._source.names
        for ours, theirs in given.items():
            _check_size(file, ours, theirs, sizes)
        vectors = [name for name, size in sizes.items() if size in _VECTOR_SIZES]
        scalars = [name for name, size in sizes.items() if size not in _COMPOUND_SIZES]
        by_components = bool(set(_COMPONENTS) & set(given))
        known = [name for name in READABLE if name not in _COMPONENTS]
        if not by_components and _VECTOR not in given and self._source.placement.axes == (0, 1):
            known += _COMPONENTS
        with naming(file):
            found = match_names(sizes, given, known, scalars)
            if not by_components:
                found = match_names(sizes, found, (_VECTOR,), vectors)
        if _VECTOR in found:
            found |= dict.fromkeys(_COMPONENTS, found.pop(_VECTOR))
        elif not set(_COMPONENTS) <= set(found):
            found = {ours: theirs for ours, theirs in found.items() if ours not in _COMPONENTS}
        return found

    def _unit(self, name: str, theirs: str) -> Unit:
        """Return and note the unit of a field: the one given, that of its name, or SI."""
        label, given = f"{self.reader.file(0)}: {theirs}", self._source.units.unit_given(name)
        text = unit_in_name(theirs, name)
        if text and name == "plastic_strain" and known_unit(text, name) is None:
            text = None  # a remark, such as (Avg: 75%)
        return unit_of(name, label, text, given, self.unit_notes)

    def flat(self, number: int, blocks: Sequence[Block]) -> FlatMesh:
        """Return the triangles of a mesh, without workpiece that has no temperature."""
        source, file = self._source, self.reader.file(number)
        missing = sorted(set(self.found.values()) - set(fields_of(blocks)))
        if missing:
            raise SourceError(
                f"{file}: frame {number} has no field {missing[0]!r}, the first one has"
            )
        with vtk.reading_vtk(file), naming(file):
            known, of_tool = [], []
            for block, is_tool in zip(blocks, self._tool(blocks), strict=True):
                if self._has_temperature(block):
                    known.append(block)
                    of_tool.append(is_tool)
                elif is_tool.any():
                    grid = block.grid.extract_cells(np.flatnonzero(is_tool))
                    known.append(Block(block.names, grid))
                    of_tool.append(is_tool[is_tool])
            return flatten(
                known,
                self.found.values(),
                of_tool,
                source.placement,
                source.section,
                source.units.length.scale,
            )

    def _has_temperature(self, block: Block) -> bool:
        return "temperature" not in self.found or block.has(self.found["temperature"])

    def _tool(self, blocks: Sequence[Block]) -> list[NDArray[np.bool_]]:
        """Return which elements of each block belong to the tool."""
        parts = [_parts(block, self._source.part_field) for block in blocks]
        known = {name for block in parts for name in block}
        wanted = [str(part) for part in self._source.tool_parts]
        for name in wanted:
            if name not in known:
                listed = ", ".join(sorted(known)) or "none"
                raise SourceError(f"tool_parts: there is no part {name!r}, it has {listed}")
        tool = [np.zeros(block.grid.n_cells, np.bool_) for block in blocks]
        for of_block, masks in zip(tool, parts, strict=True):
            for name in set(wanted) & set(masks):
                of_block |= masks[name]
        return tool

    def times(self, notes: Notes) -> NDArray[np.float64]:
        source, count = self._source, self.reader.count
        if source.times:
            if len(source.times) != count:
                raise SourceError(
                    f"{source.files}: times: {len(source.times)} for {count} frames, expected "
                    f"{count}"
                )
            return np.array(source.times, np.float64)
        if source.interval is None and self.reader.times is not None:
            return np.array(self.reader.times, np.float64) * source.units.time.scale
        return even_times(count, source.interval, notes)

    def assumptions(self) -> list[str]:
        sizes, sentences = fields_of(self.ends[0]), []
        for ours, theirs in self.found.items():
            if ours not in _COMPONENTS and sizes[theirs] > 1:
                sentences.append(
                    f"{ours}: {theirs} has {sizes[theirs]} values for each place, such as those "
                    "of integration points; their mean is used."
                )
        moving = [
            name
            for name in sizes
            if simple(name) in ("displacement", "u") and name not in self.found.values()
        ]
        # The reader of Exodus adds the displacement by itself.
        by_reader = vtk.kind_of(self._source.files) == "Exodus II"
        if moving and self._source.displacement is None and not by_reader:
            sentences.append(f"Positions are taken from the file; {moving[0]} is not added.")
        if not self._source.tool_parts:
            sentences.append("No part is named as tool: all elements are workpiece.")
        return sentences

    def remarks(self) -> list[str]:
        """Describe blocks without a temperature, and missing values in the first and last mesh."""
        blocks, sentences = self.ends[0], list(self.reader.remarks)
        for block, is_tool in zip(blocks, self._tool(blocks), strict=True):
            if block.grid.n_cells and not self._has_temperature(block):
                named = block.names[0] if block.names else "a block"
                what = "tool at the surroundings' temperature" if is_tool.any() else "void"
                sentences.append(f"{named} has no temperature: it is treated as {what}.")
        for when, mesh in zip(("first", "last"), self.ends.values(), strict=False):
            for theirs in self.found.values():
                for of in ("nodes", "elements"):
                    lacking, count = _without_value(mesh, theirs, of)
                    if lacking:
                        sentences.append(
                            f"{theirs}: {lacking} of {count} {of} have no value in the {when} "
                            "frame; adjacent samples are filled from the nearest and marked in "
                            "quality."
                        )
        if any("STATUS" in block.grid.cell_data for mesh in self.ends.values() for block in mesh):
            sentences.append("Elements whose STATUS is 0 are deleted.")
        return list(dict.fromkeys(sentences))

    def extent(self, meshes: Sequence[FlatMesh]) -> tuple[float, float, float, float]:
        """Return left, right, bottom and top of meshes in m."""
        used = [mesh.points[np.unique(mesh.triangles)] for mesh in meshes]
        source = self._source
        placed = source.placement.place(np.concatenate(used) * source.units.length.scale)
        placed = placed[np.isfinite(placed).all(axis=1)]
        if not len(placed):
            raise SourceError(f"{self.reader.file(0)}: no element has finite positions")
        (left, bottom), (right, top) = placed.min(axis=0), placed.max(axis=0)
        return float(left), float(right), float(bottom), float(top)

    def temperatures(self, meshes: Sequence[FlatMesh]) -> tuple[float, float] | None:
        """Return the smallest and the largest temperature of the workpiece."""
        if "temperature" not in self.found:
            return None
        name = self.found["temperature"]
        values = [np.empty(0, np.float32)]
        for mesh in meshes:
            if name in mesh.of_nodes:
                used = np.unique(mesh.triangles[~mesh.tool])
                values.append(self._values("temperature", mesh.of_nodes[name][used]))
            if name in mesh.of_elements:
                values.append(self._values("temperature", mesh.of_elements[name][~mesh.tool]))
        return span_of(np.concatenate(values))

    def sampled(self, mesh: FlatMesh, time: float, raster: Raster) -> SampledFrame:
        """Sample a mesh; a field may be of nodes in some blocks and of elements in others."""
        source = self._source
        names = [name for name in READABLE if name in self.found]
        nodes = [name for name in names if self.found[name] in mesh.of_nodes]
        elements = [name for name in names if self.found[name] in mesh.of_elements]
        sampled, element = rasterise(
            raster,
            source.placement.place(mesh.points * source.units.length.scale),
            mesh.triangles,
            np.transpose([self._values(n, mesh.of_nodes[self.found[n]]) for n in nodes]),
            np.transpose([self._values(n, mesh.of_elements[self.found[n]]) for n in elements]),
            self._height(mesh) if source.section == "facing" else None,
        )
        fields: dict[str, NDArray[np.float32]] = {}
        for name, values in zip((*nodes, *elements), sampled, strict=True):
            before = fields.get(name, values)
            fields[name] = np.where(np.isfinite(before), before, values)
        tool = np.append(mesh.tool, False)[element]
        material = np.where(tool, Material.TOOL, Material.WORKPIECE)
        material[element == NOTHING] = Material.VOID
        return SampledFrame(time, fields, material.astype(np.uint8))

    def _values(self, name: str, values: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return one value for each place, in SI."""
        placement, unit = self._source.placement, self._units[name]
        if name not in _COMPONENTS:
            return unit.to_si(values.mean(axis=1))
        along = _COMPONENTS.index(name)
        if values.shape[1] == 1:
            return unit.to_si(values[:, 0] * placement.signs[along])
        vectors = np.zeros((len(values), 3))
        vectors[:, : values.shape[1]] = values
        return unit.to_si(placement.turn(vectors)[:, along])

    def _height(self, mesh: FlatMesh) -> NDArray[np.float64]:
        """Return how far the nodes are toward the camera; x, y and this are right-handed."""
        placement = self._source.placement
        axes = (*placement.axes, placement.depth)
        sign = np.prod(placement.signs) * float(np.linalg.det(np.eye(3)[list(axes)]))
        return np.asarray(sign * mesh.points[:, placement.depth])


def _reader(source: MeshSource) -> MeshReader:
    required("pyvista", source.files, "mesh", "PyVista")
    suffix = source.files.suffix.lower()
    dyna = suffix in ("", ".d3plot") or "d3plot" in source.files.name.lower()
    reader = MESH_READERS.get(suffix, DynaReader if dyna else None)
    if reader is None:
        known = " ".join(sorted(MESH_READERS))
        raise SourceError(f"{source.files}: {suffix} is not a mesh, expected d3plot or {known}")
    with reading(source.files):
        return reader(files_of(source.files, gaps_allowed=bool(source.times)))


def _check_size(file: Path, ours: str, theirs: str, sizes: Mapping[str, int]) -> None:
    size = sizes.get(theirs)
    is_vector = ours == _VECTOR
    fits = size in _VECTOR_SIZES if is_vector else size not in _COMPOUND_SIZES
    if size is not None and not fits:
        expected = "2 or 3" if is_vector else "one value"
        raise SourceError(
            f"{file}: fields: {ours}: {theirs!r} has {size} components, expected {expected}"
        )


def _without_value(blocks: Iterable[Block], name: str, of: str) -> tuple[int, int]:
    """Return how many nodes or elements have no finite value of a field, and how many have it."""
    lacking = count = 0
    for block in blocks:
        data = block.grid.point_data if of == "nodes" else block.grid.cell_data
        if name in data:
            values = np.asarray(data[name], np.float64).reshape(len(data[name]), -1)
            lacking += int((~np.isfinite(values)).any(axis=1).sum())
            count += len(values)
    return lacking, count


def _parts(block: Block, part_field: str | None) -> dict[str, NDArray[np.bool_]]:
    """Return elements of a block by the names of its parts."""
    grid = block.grid
    parts = dict(block.sets)
    for name in block.names:
        parts[name] = np.ones(grid.n_cells, np.bool_)
    for name in list(grid.cell_data.keys()):
        if name == part_field or (part_field is None and simple(name) in OTHER_NAMES["part"]):
            values = np.asarray(grid.cell_data[name])
            if values.ndim == 1 and np.isfinite(values).all():
                for number in np.unique(values)[:_MOST_PARTS]:
                    parts[f"{number:g}"] = values == number
    return parts
