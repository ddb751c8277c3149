"""Meshes in the formats that VTK reads."""

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from chipglow.io.sources.meshes.reader import Block, MeshReader
from chipglow.io.sources.source import SourceError, check_hdf5, head_of, reading

OTHER_HDF: Final = (".hdf", ".h5", ".hdf5")
"""Endings of HDF5 files, which are VTK's only if they have its group."""

KINDS: Final[Mapping[str, str]] = {
    ending: kind
    for kind, endings in (
        ("VTK XML", (".vtu", ".pvtu", ".vtp", ".vts", ".vtr", ".vti")),
        ("VTK XML multi-block", (".vtm", ".vtmb")),
        ("VTK HDF", (".vtkhdf", *OTHER_HDF)),
        ("VTK legacy", (".vtk",)),
        ("ParaView collection", (".pvd",)),
        ("XDMF", (".xdmf", ".xmf")),
        ("Exodus II", (".e", ".ex2", ".exo", ".exii")),
        ("EnSight", (".case", ".encas")),
        ("CGNS", (".cgns",)),
        ("OpenFOAM", (".foam",)),
    )
    for ending in endings
}
"""Formats by the ending of a file's name."""

_AS: Final[Mapping[str, str]] = {
    ".xmf": ".xdmf", ".encas": ".case", **dict.fromkeys(OTHER_HDF, ".vtkhdf"),
}  # fmt: skip
_INSIDES: Final = ("Element Blocks", "internalMesh", "Internal")
"""VTK's names for the elements of Exodus, OpenFOAM and CGNS, beside sets and boundaries."""

_HEAD: Final = 100_000
"""Bytes of a file in which its time is searched; VTK writes it before the arrays."""

_MOST_XDMF: Final = 10_000_000
"""Most bytes of an XDMF file that are searched: numbers may stand in it as text."""

_TIME: Final = rb'Name="(?:TimeValue|TIME)"[^>]*RangeMin="([-+.eE\d]+)"'


class VtkReader(MeshReader):
    """One file for each frame, or one file with times in it."""

    def __init__(self, files: Sequence[Path]) -> None:
        super().__init__(files, kind_of(files[0]))
        if kind_of(files[0]) == "OpenFOAM":
            self.known = {"velocity": "U"}  # which means another thing in other formats
        self._opened: Any = None
        if len(files) == 1:
            opened = _open(files[0])
            self.times = _times_inside(opened, files[0])
            if self.times:
                self._opened, self.count = opened, len(self.times)
        if self.times is None:
            heads = [re.search(_TIME, head_of(file, _HEAD)) for file in files]
            found = tuple(float(head[1]) for head in heads if head)
            self.times = found if len(found) == len(files) else None

    def read(self, number: int) -> Sequence[Block]:
        file = self.file(number)
        if self._opened is None or self.times is None:
            data = read_data(file)
        else:
            with reading_vtk(file):
                data = _at_time(self._opened, number, self.times[number])
        # The state of an unfinished reader may crash the next one.
        with reading_vtk(file):
            blocks = tuple(_blocks(file, data, ()))
        if kind_of(file) == "XDMF":
            blocks = _of_time_series(file, blocks)
        if not any(block.grid.n_cells for block in blocks):
            raise SourceError(f"{file}: has no elements, expected a mesh")
        return blocks


@contextmanager
def reading_vtk(file: Path) -> Iterator[None]:
    """Turn all errors of VTK, raised or written to the console, into one `SourceError`."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    loud = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    vtkOutputWindow.SetInstance(window)
    with reading(file, kind_of(file)):
        try:
            yield
        finally:
            vtkOutputWindow.SetInstance(before)
            vtkLogger.SetStderrVerbosity(loud)
        if said := _error_in(window.GetOutput() or ""):
            raise RuntimeError(said)


def _error_in(output: str | bytes) -> str:
    # VTK gives bytes for text that is not UTF-8.
    text = output.decode(errors="replace") if isinstance(output, bytes) else output
    found = re.search(r"ERROR[^\n]*\n(?:[^\n]*?\): )?(.+?)(?:\n\n|\Z)", text, re.DOTALL)
    return found.group(1) if found else ""


def kind_of(file: Path) -> str:
    """Return the format of a file by its name."""
    return KINDS.get(file.suffix.lower(), "a mesh")


def _open(file: Path) -> Any:
    import pyvista

    suffix, kind = file.suffix.lower(), kind_of(file)
    if file.stat().st_size == 0 and kind != "OpenFOAM":
        raise SourceError(f"{file}: is empty, expected {kind}")
    if kind == "XDMF":
        return _open_xdmf(file)
    with reading_vtk(file):
        reader = pyvista.get_reader(str(file), force_ext=_AS.get(suffix, suffix))
        if kind == "OpenFOAM":
            reader.cell_to_point_creation = False  # the case has values of cells alone
    return reader


def _open_xdmf(file: Path) -> Any:
    """Return VTK's own reader: PyVista's takes no file without times."""
    from vtkmodules.vtkIOXdmf2 import vtkXdmfReader

    # VTK crashes where the HDF5 file is missing.
    named = re.findall(rb">\s*([^<>:\"]+\.(?:h5|hdf5)):", head_of(file, _MOST_XDMF))
    for name in sorted(set(named)):
        heavy = file.parent / name.decode(errors="replace").strip()
        if not heavy.is_file():
            raise SourceError(f"{file}: its data should be in {heavy.name}, which is not there")
        check_hdf5(heavy)
    with reading_vtk(file):
        reader = vtkXdmfReader()
        reader.SetFileName(str(file))
        reader.UpdateInformation()
    return reader


def _of_time_series(file: Path, blocks: tuple[Block, ...]) -> tuple[Block, ...]:
    """Leave out the grid that only lends its nodes to a time series beside it.

    VTK gives it the fields of some time.
    """
    grids = re.findall(rb"<Grid\b[^>]*>", head_of(file, _MOST_XDMF))
    series = [grid for grid in grids if b'CollectionType="Temporal"' in grid]
    names = [re.search(rb'Name="([^"]*)"', grid) for grid in series]
    wanted = {name.group(1).decode(errors="replace") for name in names if name}
    kept = tuple(block for block in blocks if wanted & set("/".join(block.names).split("/")))
    return kept or blocks


def _times_inside(reader: Any, file: Path) -> tuple[float, ...] | None:
    from pyvista import TimeReader
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

    with reading_vtk(file):
        if isinstance(reader, TimeReader):
            times = reader.time_values
        else:
            algorithm = getattr(reader, "reader", reader)
            algorithm.UpdateInformation()
            information = algorithm.GetOutputInformation(0)
            times = information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS())
    return tuple(float(time) for time in times or ()) or None


def read_data(file: Path) -> Any:
    """Return a pyvista object of a file, at its first time if it has several."""
    import pyvista

    reader = _open(file)
    with reading_vtk(file):
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


def _blocks(file: Path, data: Any, path: tuple[str, ...]) -> Iterator[Block]:
    """Yield all grids in a tree of blocks, without the surfaces of them that are in it too."""
    import pyvista

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
        if isinstance(data, pyvista.PolyData):
            _check_polygons(file, data)
        is_grid = isinstance(data, pyvista.UnstructuredGrid)
        names = (path[-1], "/".join(path)) if path else ()
        yield Block(names, data if is_grid else data.cast_to_unstructured_grid())


def _check_polygons(file: Path, surface: Any) -> None:
    for cells in (surface.GetVerts(), surface.GetLines(), surface.GetPolys(), surface.GetStrips()):
        low, high = cells.GetConnectivityArray().GetRange() if cells.GetNumberOfCells() else (0, 0)
        if low < 0 or high >= max(surface.n_points, 1):
            raise SourceError(f"{file}: polygons with nodes that do not exist, it is damaged")
