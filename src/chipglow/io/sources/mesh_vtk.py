"""Meshes in the formats that VTK reads."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from xml.parsers.expat import ExpatError, ParserCreate

from chipglow.io.sources.mesh_block import Block
from chipglow.io.sources.mesh_reader import MeshReader
from chipglow.io.sources.source import SourceError, check_hdf5

KINDS: Final[Mapping[str, str]] = {
    ".vtu": "VTK XML",
    ".pvtu": "VTK XML",
    ".vtp": "VTK XML",
    ".vts": "VTK XML",
    ".vtr": "VTK XML",
    ".vti": "VTK XML",
    ".vtm": "VTK XML multi-block",
    ".vtmb": "VTK XML multi-block",
    ".vtkhdf": "VTK HDF",
    ".vtk": "VTK legacy",
    ".pvd": "ParaView collection",
    ".xdmf": "XDMF",
    ".xmf": "XDMF",
    ".e": "Exodus II",
    ".ex2": "Exodus II",
    ".exo": "Exodus II",
    ".exii": "Exodus II",
    ".case": "EnSight",
    ".encas": "EnSight",
    ".cgns": "CGNS",
    ".foam": "OpenFOAM",
}
"""Formats by the ending of a file's name."""

ALONE: Final = (
    ".vtu", ".vtp", ".vts", ".vtr", ".vti", ".vtk", ".vtkhdf", ".e", ".ex2", ".exo", ".exii",
    ".cgns",
)  # fmt: skip
"""Those whose files name no others."""

_NAMES: Final[Mapping[str, Mapping[str, str]]] = {"OpenFOAM": {"velocity": "U"}}
"""What fields are called in one format, though another thing is called so in others."""

_AS: Final[Mapping[str, str]] = {".xmf": ".xdmf", ".encas": ".case"}
_INSIDES: Final = ("Element Blocks", "internalMesh", "Internal")
"""What VTK calls the elements of Exodus, OpenFOAM and CGNS; beside them lie sets and boundaries."""
_HEAD: Final = 100_000
_CLAIMS: Final = (
    rb'NumberOf(?:Points|Cells|Verts|Lines|Polys)="(\d+)"',
    rb"\n(?:POINTS|CELLS|POLYGONS|CELL_TYPES|POINT_DATA|CELL_DATA) +(\d+)",
)
_MOST_PER_BYTE: Final = 1100
"""Deflate makes no more than 1032 bytes of one."""

_MOST_XDMF: Final = 10_000_000
_TIME: Final = rb'Name="(?:TimeValue|TIME)"[^>]*RangeMin="([-+.eE\d]+)"'


class VtkReader(MeshReader):
    """One file for each frame, or one file with times in it."""

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, _kind(files[0]))
        self.known = _NAMES.get(_kind(files[0]), {})
        self._opened: Any = None
        if len(files) == 1:
            self._opened = _opened(files[0])
            self.times = _times_inside(self._opened, files[0])
            self.count = len(self.times) if self.times else 1
            if not self.times:
                self._opened = None
        if self.times is None:
            times = [_time_in_head(file) for file in files]
            found = tuple(time for time in times if time is not None)
            self.times = found if len(found) == len(files) else None

    def read(self, number: int) -> tuple[Block, ...]:
        """The mesh of a frame; see `MeshReader.read`."""
        file = self.file(number)
        if self._opened is None:
            data = read_data(file)
        else:
            assert self.times is not None
            with reading(file):
                data = _at_time(self._opened, number, self.times[number])
        # What a reader left half done may crash what comes next.
        with reading(file):
            blocks = tuple(_blocks(file, data, ()))
        if _kind(file) == "XDMF":
            blocks = _of_time_series(file, blocks)
        if not any(block.grid.n_cells for block in blocks):
            raise SourceError(f"{file}: has no elements, expected a mesh")
        return blocks


@contextmanager
def reading(file: Path) -> Iterator[None]:
    """Turn all that VTK says, to the console or by raising, into one error.

    Raises
    ------
    SourceError
        If VTK reports an error.
    """
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    loud = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkOutputWindow.SetInstance(window)
    raised: Exception | None = None
    try:
        yield
    except (SourceError, OSError, MemoryError):
        raise
    except Exception as error:  # PyVista raises what it likes
        raised = error
    finally:
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(loud)
    said = _error_in(window.GetOutput() or "")
    if said or raised:
        text = said or f"{type(raised).__name__}: {raised}"
        raise SourceError(
            f"{file}: cannot be read as {_kind(file)}, it is damaged or of another kind "
            f"({' '.join(text.split())[:200]})"
        ) from raised


def _error_in(output: str | bytes) -> str:
    # VTK gives bytes for what is no UTF-8.
    text = output.decode(errors="replace") if isinstance(output, bytes) else output
    found = re.search(r"ERROR[^\n]*\n(?:[^\n]*?\): )?(.+?)(?:\n\n|\Z)", text, re.DOTALL)
    return found.group(1) if found else ""


def _kind(file: Path) -> str:
    return KINDS.get(file.suffix.lower(), "a mesh")


def _opened(file: Path) -> Any:
    _check_head(file)
    with reading(file):
        import pyvista

        if _kind(file) == "XDMF":
            return _opened_xdmf(file)
        suffix = file.suffix.lower()
        reader_for: Any = pyvista.get_reader
        reader = reader_for(str(file), force_ext=_AS.get(suffix, suffix))
        if _kind(file) == "OpenFOAM":
            reader.cell_to_point_creation = False  # the case has values of cells alone
        if _kind(file) == "Exodus II":
            reader.reader.SetGenerateGlobalNodeIdArray(True)
        return reader


def _check_head(file: Path) -> None:
    with file.open("rb") as stream:
        head = stream.read(_HEAD)
    size = file.stat().st_size
    if size == 0 and file.suffix.lower() != ".foam":
        raise SourceError(f"{file}: is empty, expected {_kind(file)}")
    if _kind(file) == "XDMF":
        _check_references(file)
    claims = [int(digits[:30]) for claim in _CLAIMS for digits in re.findall(claim, head)]
    if max(claims, default=0) > _MOST_PER_BYTE * size:
        raise SourceError(f"{file}: says it has {max(claims)} values in {size} bytes")


def _check_references(file: Path) -> None:
    """VTK crashes where the HDF5 file is not there, and its XML library writes to the console."""
    with file.open("rb") as stream:
        try:
            ParserCreate().ParseFile(stream)
        except ExpatError as error:
            raise SourceError(
                f"{file}: cannot be read as XDMF, it is damaged or of another kind ({error})"
            ) from None
    with file.open("rb") as stream:
        text = stream.read(_MOST_XDMF)
    for name in sorted(set(re.findall(rb">\s*([^<>:\"]+\.(?:h5|hdf5)):", text))):
        heavy = file.parent / name.decode(errors="replace").strip()
        if not heavy.is_file():
            raise SourceError(f"{file}: its data should be in {heavy.name}, which is not there")
        check_hdf5(heavy)


def _opened_xdmf(file: Path) -> Any:
    """PyVista's own takes no file without times."""
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    reader = vtkXdmfReader()
    reader.SetFileName(str(file))
    reader.UpdateInformation()
    return reader


def _of_time_series(file: Path, blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    """Without the grid that only lends its nodes to a time series beside it.

    VTK gives it the fields of some time.
    """
    with file.open("rb") as stream:
        grids = re.findall(rb"<Grid\b[^>]*>", stream.read(_MOST_XDMF))
    series = [grid for grid in grids if b'CollectionType="Temporal"' in grid]
    names = [re.search(rb'Name="([^"]*)"', grid) for grid in series]
    wanted = {name.group(1).decode(errors="replace") for name in names if name}
    kept = tuple(block for block in blocks if wanted & set("/".join(block.names).split("/")))
    return kept or blocks


def _times_inside(reader: Any, file: Path) -> tuple[float, ...] | None:
    from pyvista import TimeReader
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    with reading(file):
        if isinstance(reader, TimeReader):
            times = reader.time_values
        else:
            algorithm = getattr(reader, "reader", reader)
            algorithm.UpdateInformation()
            information = algorithm.GetOutputInformation(0)
            times = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
        return tuple(float(time) for time in times or ()) or None


def read_data(file: Path) -> Any:
    """A pyvista object of what a file holds, at its first time if it has several.

    Raises
    ------
    SourceError
        If it cannot be read.
    OSError
        If it is missing or not accessible.
    """
    import pyvista

    reader = _opened(file)
    with reading(file):
        if hasattr(reader, "read"):
            return reader.read()
        reader.Update()
        return pyvista.wrap(reader.GetOutputDataObject(0))


def _at_time(reader: Any, number: int, time: float) -> Any:
    import pyvista

    algorithm = getattr(reader, "reader", reader)
    if not hasattr(algorithm, "UpdateTimeStep"):
        reader.set_active_time_point(number)
        return reader.read()
    # PyVista reads without saying the time again, which XDMF's reader takes for the first.
    algorithm.UpdateTimeStep(time)
    return pyvista.wrap(algorithm.GetOutputDataObject(0))


def _time_in_head(file: Path) -> float | None:
    with file.open("rb") as stream:
        found = re.search(_TIME, stream.read(_HEAD))
    return float(found.group(1)) if found else None


def _blocks(file: Path, data: Any, path: tuple[str, ...]) -> Iterator[Block]:
    """All grids in a tree of blocks, without surfaces of them that lie in it too."""
    import pyvista

    if data is None:
        return
    if isinstance(data, pyvista.MultiBlock):
        parts = [
            data.get_block_name(number) or f"block {number}" for number in range(data.n_blocks)
        ]
        inside = [number for number, name in enumerate(parts) if name in _INSIDES]
        for number in inside or range(data.n_blocks):
            yield from _blocks(file, data[number], path if inside else (*path, parts[number]))
    elif isinstance(data, pyvista.PartitionedDataSet):
        for number in range(data.n_partitions):
            yield from _blocks(file, data[number], (*path, str(number)))
    elif isinstance(data, pyvista.DataSet):
        names = (path[-1], "/".join(path)) if path else ()
        if isinstance(data, pyvista.PolyData):
            _check_polygons(file, data)
        is_grid = isinstance(data, pyvista.UnstructuredGrid)
        yield Block(names, data if is_grid else data.cast_to_unstructured_grid())


def _check_polygons(file: Path, surface: Any) -> None:
    for cells in (surface.GetVerts(), surface.GetLines(), surface.GetPolys(), surface.GetStrips()):
        low, high = cells.GetConnectivityArray().GetRange() if cells.GetNumberOfCells() else (0, 0)
        if low < 0 or high >= max(surface.n_points, 1):
            raise SourceError(f"{file}: polygons with nodes that do not exist, it is damaged")
