"""Time to sample a mesh: the rasteriser beside VTK's probe.

``python benchmarks/rasterise.py`` prints a table; ``--file`` adds a whole frame of a million
elements from a VTK file. ``--coarse`` and ``--fine`` set the columns of elements of the meshes.
"""

import statistics
import tempfile
from pathlib import Path

import numpy as np
import pyvista
from common import arguments, print_head, print_row, timed

from chipglow.io.sources.meshes.mesh import MeshSource
from chipglow.io.sources.meshes.triangles import rasterise
from chipglow.scene import Raster

RASTER = Raster(left=0.0, top=810e-6, spacing=1e-6, rows=810, columns=900)


def mesh_of(columns, rows):
    """Triangles of an irregular mesh with a notch, as points and numbers of nodes."""
    random = np.random.default_rng(0)
    side = np.array((900e-6 / columns, 810e-6 / rows))
    across, down = np.meshgrid(np.arange(columns + 1), np.arange(rows + 1))
    points = np.stack((across, down), axis=-1).reshape(-1, 2) * side
    points += random.uniform(-0.3, 0.3, points.shape) * side
    number = np.arange(len(points)).reshape(rows + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    triangles = np.stack((a, b, c, a, c, d), axis=-1).reshape(-1, 3)
    middle = points[triangles].mean(axis=1)
    notch = (middle[:, 0] > 400e-6) & (middle[:, 0] < 450e-6) & (middle[:, 1] > 500e-6)
    return points, triangles[~notch]


def linear(points):
    return 300.0 + 1.234567e6 * points[..., 0] + 0.7654321e6 * points[..., 1]


def times_of(action, repeats=7):
    """Least and median time in ms; the first run, which may compile, does not count."""
    times = [1e3 * timed(action)[1] for _ in range(repeats + 1)][1:]
    return min(times), statistics.median(times)


def row(name, action, repeats=7):
    found = action()
    expected = linear(np.stack(np.meshgrid(RASTER.x, RASTER.y), axis=-1))
    error = np.nanmax(np.abs(found - expected))
    times = (f"{one:.1f}" for one in times_of(action, repeats))
    print_row(name, *times, f"{error:.1e}", f"{100 * np.isnan(found).mean():.2f} %")


def compare(points, triangles, peer):
    values = linear(points)
    fields = np.stack([values] * 5, axis=1)
    print(f"\n{len(triangles)} triangles on {RASTER.columns} x {RASTER.rows} samples\n")
    print_head("", "least / ms", "median / ms", "largest error / K", "void")
    row("rasterise, 1 field", lambda: rasterise(RASTER, points, triangles, values)[0][0])
    row("rasterise, 5 fields", lambda: rasterise(RASTER, points, triangles, fields)[0][0])
    if peer:
        row("VTK's probe, 1 field", lambda: probe(points, triangles, values), 2)


def surface(points, triangles):
    return pyvista.PolyData.from_regular_faces(np.pad(points, ((0, 0), (0, 1))), triangles)


def probe(points, triangles, values):
    mesh = surface(points, triangles)
    mesh.point_data["t"] = values
    grid = pyvista.ImageData(
        dimensions=(RASTER.columns, RASTER.rows, 1),
        spacing=(RASTER.spacing, RASTER.spacing, 1.0),
        origin=(RASTER.x[0], RASTER.y[-1], 0.0),
    )
    sampled = grid.sample(mesh)
    found = np.where(sampled.point_data["vtkValidPointMask"], sampled.point_data["t"], np.nan)
    return found.reshape(RASTER.shape)[::-1].astype(np.float32)


def whole_frame(points, triangles):
    grid = surface(points, triangles).cast_to_unstructured_grid()
    grid.point_data["temperature"] = linear(points)
    grid.point_data["velocity"] = np.ones((len(points), 3))
    grid.cell_data["peeq"] = np.ones(len(triangles))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.vtu"
        grid.save(path)
        source = MeshSource(path)
        size = path.stat().st_size / 1e6
        least, median = times_of(lambda: next(source.frames(RASTER)), 3)
        print(f"\nA frame of {len(triangles)} triangles from a file of {size:.0f} MB:")
        print(f"read and sampled {least:.0f} ms least, {median:.0f} ms median")


def main():
    given = arguments(__doc__, file=False, coarse=236, fine=745)
    fine = mesh_of(given.fine, round(given.fine * 674 / 745))
    compare(*mesh_of(given.coarse, round(given.coarse * 215 / 236)), peer=True)
    compare(*fine, peer=False)
    if given.file:
        whole_frame(*fine)


if __name__ == "__main__":
    main()
