"""Whole meshes and clouds of points to damage."""

from pathlib import Path

import numpy as np
import pyvista as pv
from cgns_file import write_cgns
from lasso.dyna import D3plot
from tecplot_file import ZoneOfFile, extras_of_header, write_tecplot
from vtkmodules.vtkIOExodus import vtkExodusIIWriter
from vtkmodules.vtkIOParallel import vtkEnSightWriter

WRITTEN = (
    "chip.vtu", "chip.vtk", "chip.vtp", "chip.vtm", "chip.vtkhdf", "chip.e", "chip.case",
    "chip.xdmf", "chip.pvd", "chip.msh", "chip.med", "chip.avs", "chip.dat", "chip.inp", "d3plot",
    "chip.cgns", "chip.plt",
)  # fmt: skip
"""Names of the files that `write_meshes` writes, each of which is damaged."""


def write_meshes(folder: Path) -> None:
    """Write a mesh in every format; files that one of them names stay as they are."""
    grid = _grid()
    for name in ("chip.vtu", "chip.vtk", "chip.vtkhdf"):
        grid.save(folder / name)
    grid.extract_surface(algorithm=None).save(folder / "chip.vtp")
    pv.MultiBlock({"chip": grid}).save(folder / "chip.vtm")
    _exodus(grid, folder)
    _ensight(grid, folder)
    grid.save(folder / "part.vtu")
    (folder / "chip.pvd").write_text(
        '<VTKFile type="Collection" version="0.1"><Collection>'
        '<DataSet timestep="0" part="0" file="part.vtu"/>'
        '<DataSet timestep="1" part="0" file="part.vtu"/></Collection></VTKFile>'
    )
    mesh = pv.to_meshio(grid)
    mesh.write(folder / "chip.msh", file_format="gmsh")
    mesh.write(folder / "chip.med")
    mesh.write(folder / "chip.avs")
    mesh.write(folder / "chip.xdmf", data_format="XML")
    mesh.write(folder / "chip.inp")
    mesh.write(folder / "chip.dat", file_format="tecplot")
    rows = [f"{number + 1}, {value:.6g}" for number, value in enumerate(grid.point_data["NT11"])]
    (folder / "chip.csv").write_text("\n".join(["node, NT11", *rows]) + "\n")
    _d3plot(grid, folder)
    fields = {"Temperature": grid.point_data["NT11"]}
    write_cgns(folder / "chip.cgns", grid.points, grid.cells_dict[9], fields, {})
    _tecplot_binary(grid, folder / "chip.plt")


def _grid():
    x, y, z = np.meshgrid(np.linspace(0, 1, 10), np.linspace(0, 1, 7), [0.0])
    grid = pv.StructuredGrid(x, y, z).cast_to_unstructured_grid()
    grid.point_data["NT11"] = 400.0 + 500.0 * grid.points[:, 0]
    grid.point_data["V"] = np.tile((3.0, 1.0, 0.0), (grid.n_points, 1))
    grid.cell_data["PEEQ"] = np.arange(grid.n_cells) / grid.n_cells
    return grid


def _exodus(grid, folder):
    writer = vtkExodusIIWriter()
    writer.SetFileName(str(folder / "chip.e"))
    writer.SetInputData(grid)
    writer.Write()


def _ensight(grid, folder):
    copy = grid.copy()
    copy.cell_data["BlockId"] = np.ones(grid.n_cells, np.int32)
    writer = vtkEnSightWriter()
    writer.SetFileName(str(folder / "ensight"))
    writer.SetInputData(copy)
    writer.Write()
    writer.WriteCaseFile(1)
    next(folder.glob("ensight*.case")).rename(folder / "chip.case")


def _tecplot_binary(grid, path):
    """Two times of elements, the later with the positions of the first, and points in order."""
    x, y, _ = np.array(grid.points, np.float64).T
    quads, names = grid.cells_dict[9], ("X", "Y", "NT11", "PEEQ")
    values, strain = (np.array(grid[name], np.float64) for name in ("NT11", "PEEQ"))
    centred, shape = (False, False, False, True), (len(x), len(quads))
    first = ZoneOfFile([x, y, values, strain], shape, "quads", quads, centred, strand=1)
    shared = [("shared", 0), ("shared", 0), values.astype("f4"), "passive"]
    later = ZoneOfFile(shared, shape, "quads", 0, centred, strand=1, time=1.0)
    ordered = ZoneOfFile([x + 1.0, y, values, np.zeros(10 * 7)], (10, 7, 1), centred=centred)
    write_tecplot(path, names, [first, later, ordered], extras=extras_of_header())


def _d3plot(grid, folder):
    quads = grid.cells_dict[9]
    plot = D3plot()
    plot.arrays["node_coordinates"] = np.asarray(grid.points, np.float32)
    plot.arrays["timesteps"] = np.arange(2, dtype=np.float32)
    plot.arrays["node_displacement"] = np.tile(np.asarray(grid.points, np.float32), (2, 1, 1))
    temperature = np.asarray(grid.point_data["NT11"], np.float32)
    plot.arrays["node_temperature"] = np.tile(temperature, (2, 1))
    plot.arrays["element_shell_node_indexes"] = quads
    plot.arrays["element_shell_part_indexes"] = np.zeros(len(quads), np.int32)
    plot.write_d3plot(str(folder / "d3plot"))


def cloud_table() -> str:
    """Points as a table of text."""
    x, y = np.meshgrid(np.linspace(0.02, 0.98, 25), np.linspace(0.02, 0.98, 25))
    rows = zip(x.ravel(), y.ravel(), strict=True)
    lines = [f"{a:.4f},{b:.4f},{400 + 500 * a:.3f}" for a, b in rows]
    return "\n".join(["x,y,temperature", *lines]) + "\n"
