"""Meshes over time, from the programs that compute them."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Annotated, ClassVar, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chipglow.io.sources import mesh_meshio, mesh_tecplot, mesh_vtk
from chipglow.io.sources.conventions import Placement, Units, match_names, simple
from chipglow.io.sources.file_order import files_of
from chipglow.io.sources.mesh_abaqus import AbaqusReader
from chipglow.io.sources.mesh_block import Block, FlatMesh, check_grid, fields_of, flatten
from chipglow.io.sources.mesh_dyna import DynaReader
from chipglow.io.sources.mesh_reader import MeshReader
from chipglow.io.sources.mesh_restricted import RestrictedFields
from chipglow.io.sources.source import (
    Source,
    SourceError,
    Survey,
    even_times,
    naming,
    required,
    span_of,
)
from chipglow.quantities import Parameter, Part
from chipglow.quantities.units import POSITION
from chipglow.scene import READABLE, Material, Raster, SampledFrame
from chipglow.scene.rasterise import NOTHING, rasterise
from chipglow.text import Notes

_PART_FIELDS: Final = (
    "part", "part_id", "partid", "parts", "material_id", "materialid", "materialids", "material",
    "region", "region_id", "regionid", "object_id", "objectid", "elementblockids", "block_id",
    "gmsh_physical", "cell_tags",
)  # fmt: skip
MESH_READERS: Final[Mapping[str, Callable[[Sequence[Path]], MeshReader]]] = {
    **dict.fromkeys(mesh_vtk.KINDS, mesh_vtk.VtkReader),
    **dict.fromkeys(mesh_meshio.KINDS, mesh_meshio.MeshioReader),
    **dict.fromkeys(mesh_tecplot.ENDINGS, mesh_tecplot.TecplotReader),
    ".inp": AbaqusReader,
}
"""Readers of meshes by the ending of the file's name; LS-DYNA's d3plot has none."""

_VECTOR: Final = "velocity"
_COMPONENTS: Final = ("velocity_x", "velocity_y")
_VECTOR_SIZES: Final = (2, 3)
_TENSOR_SIZES: Final = (6, 9)


@dataclass(frozen=True)
class MeshSource(Source, Part):
    """Finite-element results: meshes with fields, one for each time.

    Elements are sampled exactly as they are: fields of nodes by the element's own shape, fields of
    elements constant in each. Where there is no element there is no material. Every frame may have
    a mesh of its own. Where elements lie over one another the later one in the file is taken.

    Parameters
    ----------
    files : Path
        A file with one mesh or with meshes over time, an LS-DYNA d3plot, or a pattern such as
        ``chip_*.vtu`` with a file for each time.
    names : mapping
        The file's names of fields, by those of a scene; guessed where nothing is given.
        ``velocity`` is a vector along the file's axes; ``velocity_x`` and ``velocity_y`` are
        components along the placement's two axes.
    units : Units
        Units of the file.
    placement : Placement
        How the file's axes lie in the scene.
    times : tuple of float
        Times of the frames in s, in the place of the file's.
    interval : float, optional
        Time from frame to frame in s, in the place of the file's.

    Raises
    ------
    ValueError
        If a time is not finite, an interval is not positive, or both are given.
    """

    title: ClassVar[str] = "a mesh"
    endings: ClassVar[tuple[str, ...]] = (*MESH_READERS, "d3plot")
    files: Path = Path()
    names: Mapping[str, str] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    placement: Placement = field(default_factory=Placement)
    times: tuple[float, ...] = ()
    interval: float | None = None
    section: Annotated[
        float | Literal["facing"] | None,
        Parameter(
            "Of solid elements: where to cut along the axis of depth, such as 0 mm; facing: the "
            "surface that faces the camera, which looks at the scene's x and y from the front.",
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
        if self.interval is not None and not (isfinite(self.interval) and self.interval > 0):
            raise ValueError(f"interval: must be finite and over 0 s, got {self.interval!r}")
        if self.times and self.interval is not None:
            raise ValueError("interval: times are given too, expected one of them")
        if isinstance(self.section, str) and self.section != "facing":
            raise ValueError(f"section: {self.section!r}, expected a position or facing")

    @property
    def inputs(self) -> tuple[str, ...]:
        """The path or pattern; with its folder if such files name others."""
        suffix = self.files.suffix.lower()
        alone = suffix in (*mesh_vtk.ALONE, *mesh_meshio.KINDS, *mesh_tecplot.ENDINGS)
        return (str(self.files),) if alone else (str(self.files), str(self.files.parent))

    def survey(self) -> Survey:
        """Look at the first and the last mesh; see `Source.survey`."""
        reader = self._reader()
        ends, restricted = self._ends(reader)
        blocks = ends[0]
        found = self._found(reader, blocks, restricted)
        flat = [self._flat(reader, number, there, found) for number, there in ends.items()]
        notes = Notes(
            self._assumed(blocks, found),
            remarks=[*self._lacking(blocks, found), *_lacking_values(found, tuple(ends.values()))],
        )
        times = self._times(reader, notes)
        every = fields_of(blocks)
        return Survey(
            reader.kind,
            times,
            self._extent(reader, flat),
            {ours: found[ours] for ours in READABLE if ours in found},
            tuple(sorted(set(every) - set(found.values()))),
            temperatures=self._temperatures(flat, found),
            notes=notes,
        )

    def frames(self, raster: Raster, start: int = 0) -> Iterator[SampledFrame]:
        """Sample the meshes one after the other; see `Source.frames`."""
        reader = self._reader()
        times = self._times(reader, Notes())
        ends, restricted = self._ends(reader)
        found = self._found(reader, ends[0], restricted)
        for number in range(start, reader.count):
            blocks = restricted.of_blocks(self._read(reader, number))
            mesh = self._flat(reader, number, blocks, found)
            yield self._sampled(mesh, float(times[number]), raster, found)

    def _ends(self, reader: MeshReader) -> tuple[dict[int, tuple[Block, ...]], RestrictedFields]:
        """The first and the last mesh, and whose fields are whose in them."""
        ends = {number: self._read(reader, number) for number in sorted({0, reader.count - 1})}
        restricted = RestrictedFields.of(tuple(ends.values()), self.names)
        return {number: restricted.of_blocks(there) for number, there in ends.items()}, restricted

    def _reader(self) -> MeshReader:
        required("pyvista", self.files, "mesh", "PyVista")
        suffix = self.files.suffix.lower()
        dyna = suffix in ("", ".d3plot") or "d3plot" in self.files.name.lower()
        reader = MESH_READERS.get(suffix, DynaReader if dyna else None)
        if reader is None:
            known = " ".join(sorted(MESH_READERS))
            raise SourceError(
                f"{self.files}: {suffix} is no mesh, expected d3plot or one of {known}"
            )
        return reader(files_of(self.files, gaps_allowed=bool(self.times)))

    def _read(self, reader: MeshReader, number: int) -> tuple[Block, ...]:
        blocks = reader.read(number)
        for block in blocks:
            check_grid(reader.file(number), block.grid)
        return tuple(self._moved(block, reader.file(number)) for block in blocks)

    def _moved(self, block: Block, file: Path) -> Block:
        if self.displacement is None:
            return block
        if self.displacement not in block.grid.point_data:
            raise SourceError(f"{file}: displacement: no node has {self.displacement!r}")
        by = np.asarray(block.grid.point_data[self.displacement], np.float64)
        if by.ndim != 2 or by.shape[1] not in _VECTOR_SIZES:
            raise SourceError(f"{file}: displacement: {self.displacement!r} is no vector")
        points = np.array(block.grid.points, np.float64)
        points[:, : by.shape[1]] += by
        grid = block.grid.copy(deep=False)
        grid.points = points
        return Block(block.names, grid, block.sets)

    def _found(
        self, reader: MeshReader, blocks: Sequence[Block], restricted: RestrictedFields
    ) -> dict[str, str]:
        """The file's fields by the names of a scene; a vector of velocity is both components."""
        sizes, file = fields_of(blocks), reader.file(0)
        known_here = {ours: theirs for ours, theirs in reader.known.items() if theirs in sizes}
        given = {**known_here, **restricted.names, **self.names}
        for ours, theirs in given.items():
            _check_size(file, ours, theirs, sizes)
        fitting = {name: size for name, size in sizes.items() if size not in _TENSOR_SIZES}
        vectors = [name for name, size in fitting.items() if size in _VECTOR_SIZES]
        scalars = [name for name, size in fitting.items() if size not in _VECTOR_SIZES]
        known = [name for name in READABLE if name not in _COMPONENTS]
        if not {_VECTOR, *_COMPONENTS} & set(given) and self.placement.axes == (0, 1):
            known += _COMPONENTS
        with naming(file):
            found = match_names(sizes, given, ())
            found |= match_names(scalars, {k: v for k, v in given.items() if v in scalars}, known)
            if not set(_COMPONENTS) & set(given):
                found |= match_names(
                    vectors, {k: v for k, v in given.items() if v in vectors}, (_VECTOR,)
                )
        if _VECTOR in found:
            found |= dict.fromkeys(_COMPONENTS, found.pop(_VECTOR))
        elif not set(_COMPONENTS) <= set(found):
            found = {ours: theirs for ours, theirs in found.items() if ours not in _COMPONENTS}
        return found

    def _flat(
        self,
        reader: MeshReader,
        number: int,
        blocks: Sequence[Block],
        found: Mapping[str, str],
    ) -> FlatMesh:
        file = reader.file(number)
        missing = set(found.values()) - set(fields_of(blocks))
        if missing:
            name = sorted(missing)[0]
            raise SourceError(f"{file}: frame {number} has no field {name!r}, the first one has")
        try:
            with mesh_vtk.reading(file):
                known, tool = _with_temperature(blocks, self._tool(blocks), found)
                return flatten(
                    known,
                    found.values(),
                    tool,
                    self.placement,
                    self.section,
                    self.units.length.scale,
                )
        except SourceError as error:
            raise error if str(file) in str(error) else SourceError(f"{file}: {error}") from None

    def _tool(self, blocks: Sequence[Block]) -> list[NDArray[np.bool_]]:
        """Which elements of each block are of the tool."""
        parts = [_parts(block, self.part_field) for block in blocks]
        known = {name for block in parts for name in block}
        tool_parts = [str(part) for part in self.tool_parts]
        for name in tool_parts:
            if name not in known:
                listed = ", ".join(sorted(known)) or "none"
                raise SourceError(f"tool_parts: there is no part {name!r}, it has {listed}")
        return [
            np.any(
                [block[name] for name in tool_parts if name in block]
                or [np.zeros(grid.n_cells, np.bool_)],
                axis=0,
            )
            for block, grid in zip(parts, (block.grid for block in blocks), strict=True)
        ]

    def _lacking(self, blocks: Sequence[Block], found: Mapping[str, str]) -> Iterator[str]:
        """Describe blocks without a temperature."""
        for block, is_tool in zip(blocks, self._tool(blocks), strict=True):
            name = found.get("temperature")
            if block.grid.n_cells and name and not _has_field(block, name):
                named = block.names[0] if block.names else "a block"
                what = "tool at the surroundings' temperature" if is_tool.any() else "void"
                yield f"{named} has no temperature: it is treated as {what}."

    def _times(self, reader: MeshReader, notes: Notes) -> NDArray[np.float64]:
        count = reader.count
        if self.times:
            if len(self.times) != count:
                raise SourceError(
                    f"{self.files}: times: {len(self.times)} for {count} frames, expected {count}"
                )
            return np.array(self.times, np.float64)
        if self.interval is None and reader.times is not None:
            return np.array(reader.times, np.float64) * self.units.time.scale
        return even_times(count, self.interval, notes)

    def _assumed(self, blocks: Sequence[Block], found: Mapping[str, str]) -> list[str]:
        sentences = []
        sizes = fields_of(blocks)
        for ours, theirs in found.items():
            if ours not in _COMPONENTS and sizes[theirs] > 1:
                sentences.append(
                    f"{ours}: {theirs} has {sizes[theirs]} values for each place, such as those "
                    "of integration points; their mean is used."
                )
        names = {simple(name): name for name in sizes}
        moving = [
            names[name]
            for name in ("displacement", "u")
            if name in names and names[name] not in found.values()
        ]
        if moving and self.displacement is None and not _is_exodus(self.files):
            sentences.append(f"Positions are those of the file; {moving[0]} is not added.")
        if not self.tool_parts:
            sentences.append("No part is named as tool: all elements are workpiece.")
        return sentences

    def _extent(
        self, reader: MeshReader, meshes: Sequence[FlatMesh]
    ) -> tuple[float, float, float, float]:
        used = [mesh.points[np.unique(mesh.triangles)] for mesh in meshes]
        placed = self.placement.place(np.concatenate(used) * self.units.length.scale)
        placed = placed[np.isfinite(placed).all(axis=1)]
        if not len(placed):
            raise SourceError(f"{reader.file(0)}: no element has finite positions")
        (left, bottom), (right, top) = placed.min(axis=0), placed.max(axis=0)
        return float(left), float(right), float(bottom), float(top)

    def _temperatures(
        self, meshes: Sequence[FlatMesh], found: Mapping[str, str]
    ) -> tuple[float, float] | None:
        """Least and greatest temperature of what is not tool."""
        if "temperature" not in found:
            return None
        name = found["temperature"]
        values = [np.empty(0, np.float32)]
        for mesh in meshes:
            if name in mesh.of_nodes:
                used = np.unique(mesh.triangles[~mesh.tool])
                values.append(self._values("temperature", mesh.of_nodes[name][used]))
            if name in mesh.of_elements:
                values.append(self._values("temperature", mesh.of_elements[name][~mesh.tool]))
        return span_of(np.concatenate(values))

    def _sampled(
        self, mesh: FlatMesh, time: float, raster: Raster, found: Mapping[str, str]
    ) -> SampledFrame:
        """The mesh on the raster; a field may be of nodes in some blocks, of elements in others."""
        names = [name for name in READABLE if name in found]
        nodes = [name for name in names if found[name] in mesh.of_nodes]
        elements = [name for name in names if found[name] in mesh.of_elements]
        sampled = rasterise(
            raster,
            self.placement.place(mesh.points * self.units.length.scale),
            mesh.triangles,
            _columns([self._values(name, mesh.of_nodes[found[name]]) for name in nodes]),
            _columns([self._values(name, mesh.of_elements[found[name]]) for name in elements]),
            self._height(mesh) if self.section == "facing" else None,
        )
        fields: dict[str, NDArray[np.float32]] = {}
        for name, values in zip((*nodes, *elements), sampled.fields, strict=True):
            before = fields.get(name, values)
            fields[name] = np.where(np.isfinite(before), before, values)
        tool = np.append(mesh.tool, False)[sampled.element]
        material = np.where(tool, Material.TOOL, Material.WORKPIECE)
        material[sampled.element == NOTHING] = Material.VOID
        return SampledFrame(time, fields, material.astype(np.uint8))

    def _values(self, name: str, values: NDArray[np.float64]) -> NDArray[np.float32]:
        """One value for each place, in SI."""
        unit = self.units.of(name)
        if name not in _COMPONENTS:
            return unit.to_si(values.mean(axis=1))
        along = _COMPONENTS.index(name)
        if values.shape[1] == 1:
            return unit.to_si(values[:, 0] * self.placement.signs[along])
        vectors = np.zeros((len(values), 3))
        vectors[:, : values.shape[1]] = values
        return unit.to_si(self.placement.turn(vectors)[:, along])

    def _height(self, mesh: FlatMesh) -> NDArray[np.float64]:
        """How far the nodes are toward the camera; x, y and this are right-handed."""
        axes = (*self.placement.axes, self.placement.depth)
        parity = float(np.linalg.det(np.eye(3)[list(axes)]))
        sign = np.prod(self.placement.signs) * parity
        height: NDArray[np.float64] = sign * mesh.points[:, self.placement.depth]
        return height


def _with_temperature(
    blocks: Sequence[Block], tool: Sequence[NDArray[np.bool_]], found: Mapping[str, str]
) -> tuple[list[Block], list[NDArray[np.bool_]]]:
    """What has a temperature, and the tool: of what has none the scene can say nothing."""
    kept: list[Block] = []
    of_tool: list[NDArray[np.bool_]] = []
    for block, is_tool in zip(blocks, tool, strict=True):
        if "temperature" not in found or _has_field(block, found["temperature"]):
            kept.append(block)
            of_tool.append(is_tool)
        elif is_tool.any():
            kept.append(Block(block.names, block.grid.extract_cells(np.flatnonzero(is_tool))))
            of_tool.append(is_tool[is_tool])
    return kept, of_tool


def _has_field(block: Block, name: str) -> bool:
    return name in block.grid.point_data or name in block.grid.cell_data


def _check_size(file: Path, ours: str, theirs: str, sizes: Mapping[str, int]) -> None:
    size = sizes.get(theirs, 1)
    if ours == _VECTOR:
        if theirs in sizes and size not in _VECTOR_SIZES:
            raise SourceError(
                f"{file}: fields: velocity: {theirs!r} has {size} components, expected 2 or 3"
            )
    elif size in (*_VECTOR_SIZES, *_TENSOR_SIZES):
        raise SourceError(
            f"{file}: fields: {ours}: {theirs!r} has {size} components, expected one value"
        )


def _lacking_values(found: Mapping[str, str], frames: Sequence[Sequence[Block]]) -> Iterable[str]:
    """Describe missing values in the first and the last frame."""
    sentences = []
    for when, blocks in zip(("first", "last"), frames, strict=False):
        for theirs in dict.fromkeys(found.values()):
            for of in ("nodes", "elements"):
                lacking, count = _without_value(blocks, theirs, of)
                if lacking:
                    sentences.append(
                        f"{theirs}: {lacking} of {count} {of} have no value in the {when} frame; "
                        "adjacent samples are filled from the nearest and marked in quality."
                    )
    if any("STATUS" in block.grid.cell_data for blocks in frames for block in blocks):
        sentences.append("Elements whose STATUS is 0 are deleted.")
    return dict.fromkeys(sentences)


def _without_value(blocks: Sequence[Block], name: str, of: str) -> tuple[int, int]:
    """How many nodes or elements of those that could have no value of a field."""
    lacking = count = 0
    for block in blocks:
        data = block.grid.point_data if of == "nodes" else block.grid.cell_data
        if name in data:
            values = np.asarray(data[name], np.float64).reshape(len(data[name]), -1)
            lacking += int((~np.isfinite(values)).any(axis=1).sum())
            count += len(values)
    return lacking, count


def _columns(columns: Sequence[NDArray[np.float32]]) -> NDArray[np.float64] | None:
    return np.stack(columns, axis=1).astype(np.float64) if columns else None


def _parts(block: Block, part_field: str | None) -> dict[str, NDArray[np.bool_]]:
    """Elements of a block by the names that a part may be called."""
    grid = block.grid
    parts = dict(block.sets)
    for name in block.names:
        parts[name] = np.ones(grid.n_cells, np.bool_)
    for name in list(grid.cell_data.keys()):
        if name == part_field or (part_field is None and simple(name) in _PART_FIELDS):
            values = np.asarray(grid.cell_data[name])
            if values.ndim == 1 and np.isfinite(values).all():
                for number in np.unique(values)[:_MOST_PARTS]:
                    parts[f"{number:g}"] = values == number
    return parts


_MOST_PARTS: Final = 1000


def _is_exodus(path: Path) -> bool:
    """Its reader adds the displacement by itself."""
    return mesh_vtk.KINDS.get(path.suffix.lower()) == "Exodus II"
