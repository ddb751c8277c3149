"""Whole files to damage: of every format that is read, small, some made by other programs."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import scipy.io
import xarray as xr
from foam_case import PARTS, write_foam
from mesh_seeds import WRITTEN, cloud_table, write_meshes

from chipglow.io.sources import Source
from chipglow.io.sources.cloud import CloudSource
from chipglow.io.sources.grid import GridSource
from chipglow.io.sources.mesh import MeshSource
from chipglow.io.sources.movie import FieldMovie, MovieSource

ROWS, COLUMNS, FRAMES = 24, 32, 3


@dataclass(frozen=True)
class Seed:
    """A whole file, and the source that reads it or a damaged copy of it.

    A part of a folder stands there among the other parts, which are whole.
    """

    name: str
    content: bytes
    source: Callable[[Path], Source]

    @property
    def is_part(self) -> bool:
        """Whether it is a file of a folder that is read as one."""
        return len(Path(self.name).parts) > 1

    @property
    def suffix(self) -> str:
        """How the name ends, of a part that of its folder."""
        return Path(Path(self.name).parts[0]).suffix

    def written(self, folder: Path) -> Path:
        """The file, written into a folder."""
        path = folder / self.name
        path.write_bytes(self.content)
        return path


def seeds(folder: Path) -> list[Seed]:
    """All files; those that only a library can write are written into the folder first."""
    found = [*_grids(folder), *_movies(folder), *_meshes(folder), *_clouds(folder)]
    for seed in found:
        if not seed.is_part:
            (folder / seed.name).unlink(missing_ok=True)
    return found


def _temperature():
    y, x = np.mgrid[:ROWS, :COLUMNS].astype(np.float32)
    return np.stack([400.0 + 10.0 * x + 5.0 * y + 20.0 * t for t in range(FRAMES)]).astype("f4")


def _grid(path: Path) -> GridSource:
    return GridSource(str(path), spacing=0.03, top=1.0, interval=1e-6)


def _grids(folder: Path) -> list[Seed]:
    values = _temperature()
    with h5py.File(folder / "grid.h5", "w") as file:
        file.create_dataset("temperature", data=values, chunks=(1, ROWS, COLUMNS), compression=4)
    scipy.io.savemat(folder / "five.mat", {"temperature": values})
    np.save(folder / "grid.npy", values)
    np.savez_compressed(folder / "grid.npz", temperature=values)
    data = xr.Dataset(
        {"temperature": (("time", "y", "x"), values, {"units": "K"})},
        coords={
            "time": ("time", 1e-6 * np.arange(FRAMES), {"units": "s"}),
            "y": ("y", 1.0 - 0.03 * np.arange(ROWS), {"units": "m"}),
            "x": ("x", 0.03 * np.arange(COLUMNS), {"units": "m"}),
        },
    )
    data.to_netcdf(folder / "four.nc", engine="h5netcdf")
    data.to_netcdf(folder / "three.nc", engine="scipy", format="NETCDF3_64BIT")
    np.savetxt(folder / "grid.csv", values[0], delimiter=",", fmt="%.2f")
    written = ["grid.h5", "five.mat", "grid.npy", "grid.npz", "four.nc", "three.nc", "grid.csv"]
    return [
        *(Seed(name, (folder / name).read_bytes(), _grid) for name in written),
        Seed("grid.tif", _tiff(values), _grid),
        *(seed for version in (2, 3) for seed in _zarr(folder, values, version)),
    ]


def _zarr(folder: Path, values, version: int) -> list[Seed]:
    import zarr

    store = folder / f"{version}.zarr"
    group = zarr.open_group(store, mode="w", zarr_format=version)
    array = group.create_array("temperature", shape=values.shape, dtype="f4")
    array[:] = values
    parts = sorted(path for path in store.rglob("*") if path.is_file())
    return [
        Seed(str(path.relative_to(folder)), path.read_bytes(), lambda _: _grid(store))
        for path in parts
    ]


def _tiff(values) -> bytes:
    import tifffile

    file = io.BytesIO()
    tifffile.imwrite(file, values, compression="zlib", photometric="minisblack")
    return file.getvalue()


def _mesh(path: Path) -> MeshSource:
    return MeshSource(path)


def _meshes(folder: Path) -> list[Seed]:
    write_meshes(folder)
    case = write_foam(folder / "case.foam")
    return [
        *(Seed(name, (folder / name).read_bytes(), _mesh) for name in WRITTEN),
        *(
            Seed(f"case.foam/{part}", (case.parent / part).read_bytes(), lambda _: _cut(case))
            for part in PARTS
        ),
    ]


def _cut(path: Path) -> MeshSource:
    return MeshSource(path, section=0.5)


def _cloud(path: Path) -> CloudSource:
    return CloudSource(str(path), interval=1e-6)


def _clouds(folder: Path) -> list[Seed]:
    y, x = np.mgrid[0.02:0.98:25j, 0.02:0.98:25j].reshape(2, -1)
    np.savez(folder / "points.npz", x=x, y=y, temperature=400.0 + 500.0 * x)
    return [
        Seed("points.csv", cloud_table().encode(), _cloud),
        Seed("points.npz", (folder / "points.npz").read_bytes(), _cloud),
    ]


def _movie(path: Path) -> MovieSource:
    movie = FieldMovie(str(path), 293.15, 1400.0, "jet")
    return MovieSource(movie, pixel=1.0 / 64, origin=(0.0, 64.0), interval=1e-6)


def _movies(folder: Path) -> list[Seed]:
    kinds = (("mjpeg", "yuvj420p", "mjpeg.avi"), ("h264", "yuv420p", "h264.mp4"),
             ("ffv1", "bgr0", "ffv1.mkv"), ("rawvideo", "rgb24", "raw.avi"),
             ("gif", "rgb8", "movie.gif"))  # fmt: skip
    return [_movie_seed(folder, *kind) for kind in kinds]


def _movie_seed(folder: Path, codec: str, pixels: str, name: str) -> Seed:
    import av
    from matplotlib import colormaps

    fraction = np.linspace(0.0, 1.0, 64)[None, :] * np.ones((64, 1))
    picture = (colormaps["jet"](fraction)[..., :3] * 255).round().astype(np.uint8)
    with av.open(str(folder / name), "w") as container:
        stream = container.add_stream(codec, rate=10)
        stream.width = stream.height = 64
        stream.pix_fmt = pixels
        for index in range(FRAMES):
            frame = av.VideoFrame.from_ndarray(np.roll(picture, 4 * index, axis=0), format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return Seed(name, (folder / name).read_bytes(), _movie)
