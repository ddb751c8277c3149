"""Time to sample a mesh: the rasteriser beside VTK's probe and SciPy's interpolator.

``python benchmarks/rasterise.py`` prints a table; ``--file`` adds a whole frame of a million
elements from a VTK file. ``--coarse`` and ``--fine`` set the columns of elements of the meshes.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator

from chipglow.io.sources.mesh import MeshSource
from chipglow.io.sources.triangles import rasterise
from chipglow.scene import Raster

RASTER = Raster(left=0.0, top=810e-6, spacing=1e-6, rows=810, columns=900)
REPEATS = 7


def mesh_of(columns: int, rows: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
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


def linear(points: NDArray[np.float64]) -> NDArray[np.float64]:
    return 300.0 + 1.234567e6 * points[..., 0] + 0.7654321e6 * points[..., 1]


def timed(action: Callable[[], Any], repeats: int = REPEATS) -> tuple[Any, float, float]:
    """Result, least and median time in ms; the first run, which may compile, does not count."""
    found = action()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        action()
        times.append(1e3 * (time.perf_counter() - start))
    return found, min(times), statistics.median(times)


def row(name: str, action: Callable[[], NDArray[np.float32]], repeats: int = REPEATS) -> None:
    found, least, median = timed(action, repeats)
    expected = linear(np.stack(np.meshgrid(RASTER.x, RASTER.y), axis=-1))
    error = np.nanmax(np.abs(found - expected))
    void = np.isnan(found).mean()
    print(f"| {name} | {least:.1f} | {median:.1f} | {error:.1e} | {100 * void:.2f} % |")


def compare(points: NDArray[np.float64], triangles: NDArray[np.int64], peers: bool) -> None:
    values = linear(points)
    fields = np.stack([values] * 5, axis=1)
    print(f"\n{len(triangles)} triangles on {RASTER.columns} x {RASTER.rows} samples\n")
    print("| | least / ms | median / ms | largest error / K | void |")
    print("|---|---|---|---|---|")
    row("rasterise, 1 field", lambda: rasterise(RASTER, points, triangles, values).fields[0])
    row("rasterise, 5 fields", lambda: rasterise(RASTER, points, triangles, fields).fields[0])
    if not peers:
        return
    row("VTK's probe, 1 field", lambda: probe(points, triangles, values), 2)
    row("SciPy, 1 field", lambda: interpolate(points, values), 1)


def probe(
    points: NDArray[np.float64], triangles: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.float32]:
    mesh = pyvista.PolyData.from_regular_faces(np.pad(points, ((0, 0), (0, 1))), triangles)
    mesh.point_data["t"] = values
    grid = pyvista.ImageData(
        dimensions=(RASTER.columns, RASTER.rows, 1),
        spacing=(RASTER.spacing, RASTER.spacing, 1.0),
        origin=(RASTER.x[0], RASTER.y[-1], 0.0),
    )
    sampled = grid.sample(mesh)
    found = np.where(sampled.point_data["vtkValidPointMask"], sampled.point_data["t"], np.nan)
    return found.reshape(RASTER.shape)[::-1].astype(np.float32)


def interpolate(points: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float32]:
    x, y = np.meshgrid(RASTER.x, RASTER.y)
    found: NDArray[np.float32] = LinearNDInterpolator(points, values)(x, y).astype(np.float32)
    return found


def whole_frame(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> None:
    """A frame from file to samples: triangles with four fields."""
    mesh = pyvista.PolyData.from_regular_faces(np.pad(points, ((0, 0), (0, 1))), triangles)
    grid = mesh.cast_to_unstructured_grid()
    grid.point_data["temperature"] = linear(points)
    grid.point_data["velocity"] = np.ones((len(points), 3))
    grid.cell_data["peeq"] = np.ones(len(triangles))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.vtu"
        grid.save(path)
        source = MeshSource(path)
        size = path.stat().st_size / 1e6
        _, least, median = timed(lambda: next(source.frames(RASTER)), 3)
        print(f"\nA frame of {len(triangles)} triangles from a file of {size:.0f} MB:")
        print(f"read and sampled {least:.0f} ms least, {median:.0f} ms median")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--file", action="store_true", help="a frame from a file too")
    arguments.add_argument("--coarse", type=int, default=236, help="columns of the peers' mesh")
    arguments.add_argument("--fine", type=int, default=745, help="columns of the fine mesh")
    chosen = arguments.parse_args()
    fine = mesh_of(chosen.fine, round(chosen.fine * 674 / 745))
    compare(*mesh_of(chosen.coarse, round(chosen.coarse * 215 / 236)), peers=True)
    compare(*fine, peers=False)
    if chosen.file:
        whole_frame(*fine)


if __name__ == "__main__":
    main()
