"""Whole files to damage: of every format that is read, small, some made by other programs."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pyvista as pv
import scipy.io
import tifffile
import xarray as xr
import zarr
from cgns_file import write_cgns
from foam_case import PARTS, write_foam
from lasso.dyna import D3plot
from PIL import Image
from tecplot_file import ZoneOfFile, extras_of_header, write_tecplot
from vtkmodules.vtkIOExodus import vtkExodusIIWriter
from vtkmodules.vtkIOParallel import vtkEnSightWriter

from chipglow.io.sources.grids.grid import GridSource
from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.movies.movie import FieldMovie, MovieSource
from chipglow.io.sources.points.cloud import CloudSource

sys.path.insert(0, str(Path(__file__).parents[1]))
from movies import CODECS, GIF, NamedMap, drawn, encode, known_field

GRIDS = (
    "grid.h5", "five.mat", "grid.npy", "grid.npz", "four.nc", "three.nc", "grid.csv", "grid.tif",
    "grid.png", "2.zarr", "3.zarr",
)  # fmt: skip
CLOUDS = ("points.csv", "points.npz")
MOVIES = {
    "mjpeg.avi": CODECS[3], "h264.mp4": CODECS[8], "ffv1.mkv": CODECS[1], "raw.avi": CODECS[0],
    "movie.gif": GIF,
}  # fmt: skip
MESHES = (
    "chip.vtu", "chip.vtk", "chip.vtp", "chip.vtm", "chip.vtkhdf", "chip.e", "chip.case",
    "chip.xdmf", "chip.pvd", "chip.msh", "chip.med", "chip.avs", "chip.dat", "chip.inp", "d3plot",
    "chip.cgns", "chip.plt",
)  # fmt: skip


def write_seeds(folder):
    """Write all files; the names of those to damage, relative to the folder."""
    write_grids(folder)
    write_meshes(folder)
    write_foam(folder / "case.foam")
    for name, codec in MOVIES.items():
        pictures = (drawn(known_field(number, (64, 64)), NamedMap("jet")) for number in range(3))
        encode(folder / name, pictures, codec)
    y, x = np.mgrid[0.02:0.98:25j, 0.02:0.98:25j].reshape(2, -1)
    points = {"x": x, "y": y, "temperature": 400.0 + 500.0 * x}
    np.savez(folder / "points.npz", **points)
    table = np.stack(list(points.values()), axis=1)
    np.savetxt(folder / "points.csv", table, "%.4f", ",", header=",".join(points), comments="")
    stores = (path for name in GRIDS if "zarr" in name for path in (folder / name).rglob("*"))
    return [
        *(name for name in (*GRIDS, *MOVIES, *MESHES, *CLOUDS) if "zarr" not in name),
        *sorted(str(path.relative_to(folder)) for path in stores if path.is_file()),
        *(f"case.foam/{part}" for part in PARTS),
    ]


def source_of(folder, name):
    """The source that reads a file, or the folder that the file is a part of."""
    name = Path(name).parts[0]
    path = folder / name
    if name in GRIDS:
        axes = ("time", "y", "x") if name == "five.mat" else None
        return GridSource(str(path), axes=axes, spacing=0.03, top=1.0, interval=1e-6)
    if name in CLOUDS:
        return CloudSource(str(path), interval=1e-6)
    if name in MOVIES:
        movie = FieldMovie(str(path), 293.15, 1400.0, "jet")
        return MovieSource(movie, pixel=1.0 / 64, origin=(0.0, 64.0), interval=1e-6)
    return MeshSource(path / name, section=0.5) if name == "case.foam" else MeshSource(path)


def write_grids(folder):
    t, y, x = np.mgrid[:3, :24, :32].astype(np.float32)
    values = 400.0 + 10.0 * x + 5.0 * y + 20.0 * t
    with h5py.File(folder / "grid.h5", "w") as file:
        file.create_dataset("temperature", data=values, chunks=(1, 24, 32), compression=4)
    scipy.io.savemat(folder / "five.mat", {"temperature": values})
    np.save(folder / "grid.npy", values)
    np.savez_compressed(folder / "grid.npz", temperature=values)
    Image.fromarray(values[0].astype(np.uint16)).save(folder / "grid.png", compress_level=0)
    np.savetxt(folder / "grid.csv", values[0], delimiter=",", fmt="%.2f")
    tifffile.imwrite(folder / "grid.tif", values, compression="zlib", photometric="minisblack")
    coords = {
        "time": ("time", 1e-6 * np.arange(3), {"units": "s"}),
        "y": ("y", 1.0 - 0.03 * np.arange(24), {"units": "m"}),
        "x": ("x", 0.03 * np.arange(32), {"units": "m"}),
    }
    data = xr.Dataset({"temperature": (("time", "y", "x"), values, {"units": "K"})}, coords)
    data.to_netcdf(folder / "four.nc", engine="h5netcdf")
    data.to_netcdf(folder / "three.nc", engine="scipy", format="NETCDF3_64BIT")
    for version in (2, 3):
        group = zarr.open_group(folder / f"{version}.zarr", mode="w", zarr_format=version)
        group.create_array("temperature", shape=values.shape, dtype="f4")[:] = values


def write_meshes(folder):
    """A mesh in every format, with the files that one of them names."""
    x, y, z = np.meshgrid(np.linspace(0, 1, 10), np.linspace(0, 1, 7), [0.0])
    grid = pv.StructuredGrid(x, y, z).cast_to_unstructured_grid()
    grid.point_data["NT11"] = temperature = 400.0 + 500.0 * grid.points[:, 0]
    grid.point_data["V"] = np.tile((3.0, 1.0, 0.0), (grid.n_points, 1))
    grid.cell_data["PEEQ"] = strain = np.arange(grid.n_cells) / grid.n_cells
    for name in ("chip.vtu", "part.vtu", "chip.vtk", "chip.vtkhdf"):
        grid.save(folder / name)
    grid.extract_surface(algorithm=None).save(folder / "chip.vtp")
    pv.MultiBlock({"chip": grid}).save(folder / "chip.vtm")
    steps = "".join(f'<DataSet timestep="{time}" part="0" file="part.vtu"/>' for time in (0, 1))
    (folder / "chip.pvd").write_text(
        f'<VTKFile type="Collection" version="0.1"><Collection>{steps}</Collection></VTKFile>'
    )
    mesh = pv.to_meshio(grid)
    for name, options in {
        "chip.msh": {"file_format": "gmsh"}, "chip.med": {}, "chip.avs": {},
        "chip.xdmf": {"data_format": "XML"}, "chip.inp": {}, "chip.dat": {"file_format": "tecplot"},
    }.items():  # fmt: skip
        mesh.write(folder / name, **options)
    rows = [f"{number}, {value:.6g}" for number, value in enumerate(temperature, 1)]
    (folder / "chip.csv").write_text("\n".join(["node, NT11", *rows]) + "\n")
    quads, points = grid.cells_dict[9], np.array(grid.points, np.float64)
    write_cgns(folder / "chip.cgns", points, quads, {"Temperature": temperature}, {})
    write_tecplot_zones(folder / "chip.plt", points, quads, temperature, strain)
    write_d3plot(folder / "d3plot", points, quads, temperature)
    written_by(vtkExodusIIWriter(), folder / "chip.e", grid)
    grid.cell_data["BlockId"] = np.ones(grid.n_cells, np.int32)
    written_by(vtkEnSightWriter(), folder / "ensight", grid).WriteCaseFile(1)
    next(folder.glob("ensight*.case")).rename(folder / "chip.case")


def written_by(writer, path, grid):
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.Write()
    return writer


def write_tecplot_zones(path, points, quads, temperature, strain):
    """Two times of elements, the later with the positions of the first, and points in order."""
    x, y, _ = points.T
    centred, shape = (False, False, False, True), (len(x), len(quads))
    first = ZoneOfFile([x, y, temperature, strain], shape, "quads", quads, centred, strand=1)
    shared = [("shared", 0), ("shared", 0), temperature.astype("f4"), "passive"]
    later = ZoneOfFile(shared, shape, "quads", 0, centred, strand=1, time=1.0)
    ordered = ZoneOfFile([x + 1.0, y, temperature, np.zeros(70)], (10, 7, 1), centred=centred)
    names = ("X", "Y", "NT11", "PEEQ")
    write_tecplot(path, names, [first, later, ordered], extras=extras_of_header())


def write_d3plot(path, points, quads, temperature):
    plot = D3plot()
    plot.arrays["node_coordinates"] = points.astype(np.float32)
    plot.arrays["timesteps"] = np.arange(2, dtype=np.float32)
    plot.arrays["node_displacement"] = np.tile(points.astype(np.float32), (2, 1, 1))
    plot.arrays["node_temperature"] = np.tile(temperature.astype(np.float32), (2, 1))
    plot.arrays["element_shell_node_indexes"] = quads
    plot.arrays["element_shell_part_indexes"] = np.zeros(len(quads), np.int32)
    plot.write_d3plot(str(path))
