"""Scenes in NetCDF-4 files: written frame by frame, read lazily."""

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
from importlib.metadata import version
from importlib.resources import files
from math import prod
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import h5netcdf
import h5py
import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from chipglow.io import spline_file
from chipglow.io.atomic import uninterrupted
from chipglow.io.digest import HDF5Sink, check_file, write_hdf5
from chipglow.io.measurement_file import USE_OF_RESULTS, own_kind
from chipglow.io.packing import COMPRESSION, chunk_of, read_chunk, rounded
from chipglow.io.spool import UnfinishedScene, spooled
from chipglow.scene import (
    ENERGY_UNITS,
    FIELD_UNITS,
    MATERIAL_COORDINATE_UNITS,
    QUALITY,
    Frame,
    Raster,
    Scene,
    SceneError,
    Tool,
)
from chipglow.scene.scene import FORCE_UNITS, OVERVIEW_FIELDS, check_frame, raster_coordinates
from chipglow.scene.splines import Lattice, SplineFrame, SplineSamples
from chipglow.scene.tool_outline import tool_attributes
from chipglow.text import HDF5_ERRORS, MemoryLimitError

SCENE_FORMAT: Final = 6
"""Changes when the same scene is written to a file in another way."""

_LONG_NAMES: Final[Mapping[str, str]] = {
    "temperature": "true temperature",
    "plastic_strain": "equivalent plastic strain",
    "plastic_strain_rate": "equivalent plastic strain rate",
    "velocity_x": "velocity along the cut",
    "velocity_y": "velocity upward",
    "material": "material: 0 void, 1 workpiece, 2 tool",
    "material_x": "position along the cut before the cut",
    "material_y": "height above the cut surface before the cut",
    "quality": "0 to 254: distance from the colour scale in CIE L*a*b*; 255: filled",
    "cutting_force": "cutting force per width of cut",
    "thrust_force": "thrust force per width of cut",
    "chip_thickness": "thickness of the chip on a line normal to the rake face",
    "drive_work": "work of the drive since the start",
    "contact_work": "work of the tool's normal force since the start",
    "kinetic_energy": "change of the kinetic energy, of the scaled mass",
    "elastic_energy": "change of the elastic energy",
    "plastic_work": "plastic work since the start",
    "friction_work": "friction work since the start",
    "sharing_loss": "elastic energy lost by sharing dilation since the start",
    "expansion_work": "elastic energy got from heat by thermal expansion since the start",
    "moduli_loss": "elastic energy lost as the moduli fell with the temperature since the start",
    "lost_heat": "heat lost to the surroundings since the start",
}
# The first version of HDF5 with checksums of all metadata. "latest" may be one that no other
# program reads yet.
_VERSION: Final = "v110"

CACHED_BYTES: Final = 512 * 1024**2
"""Size of the part of a scene that stays decompressed in memory: of a cut's splines all of it."""

CUT_FIELDS: Final = (*FIELD_UNITS, *MATERIAL_COORDINATE_UNITS)
"""The fields that the cutting simulation knows."""


@dataclass
class SceneWriter:
    """Write a scene to a file, one frame after the other.

    A context manager: frames lie in a `Spool` beside the file, which is written at the end. With a
    `lattice` the splines of the frames are kept instead of their samples. `resume` begins with the
    frames of the last checkpoint of an earlier writer.

    One NetCDF-4 file, a chunk per field and frame. Samples have the bits of `packing.KEPT_BITS`,
    splines the steps of `spline_file.STEPS`.
    """

    path: str | os.PathLike[str]
    raster: Raster
    tool: Tool | None = None
    attributes: Mapping[str, Any] | None = None
    fields: Sequence[str] = CUT_FIELDS
    _: KW_ONLY
    lattice: Lattice | None = None
    resume: UnfinishedScene | None = None

    def __post_init__(self) -> None:
        self._path = Path(self.path)
        units = {**FIELD_UNITS, **MATERIAL_COORDINATE_UNITS, QUALITY: "1"}
        self._units = {name: units[name] for name in self.fields}
        self._forces: dict[str, tuple[str, NDArray[np.float64]]] = {}
        self._overview: tuple[Frame, Raster] | None = None
        self._stack = ExitStack()

    def __enter__(self) -> "SceneWriter":
        self._spool = self._stack.enter_context(spooled(self._path, self.resume))
        return self

    @uninterrupted()
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._stack:
            if error is not None:
                raise error
            if not self._spool.times:
                raise SceneError(f"{self.path}: no frame was written, expected 1 or more")
            write_hdf5(self._path, self._write)

    def append(self, frame: Frame) -> None:
        """Write the next frame."""
        times = self._spool.times
        if times and frame.time <= times[-1]:
            raise SceneError(
                f"scene: frame at {frame.time:.9g} s, expected later than {times[-1]:.9g} s"
            )
        check_frame(frame)
        self._spool.append(frame.time, map(chunk_of, self._kept(frame)))

    def checkpoint(self, state: Mapping[str, NDArray[Any]], progress: float) -> Path:
        """Keep the frames so far, with a state to continue from, even if the process is killed."""
        return self._spool.checkpoint(state, progress)

    def forces(
        self,
        times: ArrayLike,
        cutting: ArrayLike,
        thrust: ArrayLike,
        thickness: ArrayLike,
        energies: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Write the history of forces and chip thickness, and the energy balance with it."""
        units = {"force_time": "s", **FORCE_UNITS, **ENERGY_UNITS}
        measured = dict(zip(FORCE_UNITS, (cutting, thrust, thickness), strict=True))
        history = {"force_time": times, **measured, **(energies or {})}
        self._forces = {
            name: (units[name], np.asarray(values, np.float64)) for name, values in history.items()
        }

    def overview(self, frame: Frame, raster: Raster) -> None:
        """Write the whole chip at one time, with separate samples."""
        check_frame(frame)
        self._overview = frame, raster

    def _kept(self, frame: Frame) -> list[NDArray[Any]]:
        """Return what the file keeps of a frame, in the order of the variables."""
        if self.lattice is None:
            return [self._packed(name, frame) for name in self._units]
        splines = frame.splines if isinstance(frame, SplineSamples) else None
        if splines is None or splines.nodes.shape != self.lattice.shape:
            raise SceneError(
                f"scene: the frame at {frame.time:.9g} s has no splines of shape "
                f"{self.lattice.shape}, the shape of the lattice"
            )
        kept = spline_file.rounded(splines)
        return [np.asarray(kept[name], np.float32) for name in spline_file.CHUNKED]

    def _packed(self, name: str, frame: Frame) -> NDArray[Any]:
        values = getattr(frame, name)
        if values is None or values.shape != self.raster.shape:
            found = "missing" if values is None else f"of shape {values.shape}"
            raise SceneError(
                f"scene: {name!r} is {found} at {frame.time:.9g} s, expected {self.raster.shape}"
            )
        return rounded(name, values)

    def _write(self, sink: HDF5Sink) -> None:
        with (
            h5py.File(sink, "w", track_order=True, libver=_VERSION) as hdf,
            h5netcdf.File(hdf, "w") as file,
        ):
            self._create_variables(file)
            chunked = spline_file.CHUNKED if self.lattice else tuple(self._units)
            for index, chunk in enumerate(self._spool.chunks()):
                frame, place = divmod(index, len(chunked))
                dataset = hdf[chunked[place]].id
                dataset.write_direct_chunk((frame, *(0,) * (dataset.rank - 1)), chunk)
                sink.check()

    def _create_variables(self, file: h5netcdf.File) -> None:
        rows, columns = self.raster.shape
        times = np.array(self._spool.times)
        file.dimensions = {"time": times.size, "y": rows, "x": columns}
        file.attrs.update(
            {
                **(self.attributes or {}),
                **(tool_attributes(self.tool) if self.tool else {}),
                "Conventions": "CF-1.11",
                "chipglow_version": version("chipglow"),
                "chipglow_format": SCENE_FORMAT,
            }
        )
        for name, (dimension, values, attributes) in raster_coordinates(self.raster, times).items():
            variable = file.create_variable(name, (dimension,), data=values, **COMPRESSION)
            variable.attrs.update(attributes)
        if self.lattice is not None:
            spline_file.create(file, self.lattice)
        else:
            self._create_fields(file)
        if self._overview is not None:
            self._create_overview(file, *self._overview)
        if self._forces:
            file.dimensions["force_time"] = self._forces["force_time"][1].size
        for name, (unit, values) in self._forces.items():
            variable = file.create_variable(name, ("force_time",), data=values, **COMPRESSION)
            long_name = _LONG_NAMES.get(name, "time of the force history")
            variable.attrs.update(units=unit, long_name=long_name)

    def _create_overview(self, file: h5netcdf.File, frame: Frame, raster: Raster) -> None:
        coordinates = raster_coordinates(raster, np.array([frame.time]))
        for name in ("y", "x"):
            dimension = f"overview_{name}"
            file.dimensions[dimension] = coordinates[name][1].size
            variable = file.create_variable(dimension, (dimension,), data=coordinates[name][1])
            variable.attrs.update(coordinates[name][2])
        time = file.create_variable("overview_time", (), data=np.float64(frame.time))
        time.attrs.update(coordinates["time"][2])
        for name in OVERVIEW_FIELDS:
            variable = file.create_variable(
                f"overview_{name}",
                ("overview_y", "overview_x"),
                data=getattr(frame, name),
                **COMPRESSION,
            )
            variable.attrs.update(units=FIELD_UNITS[name], long_name=_LONG_NAMES[name])

    def _create_fields(self, file: h5netcdf.File) -> None:
        chunks = (1, *self.raster.shape)
        for name, unit in self._units.items():
            dtype = np.uint8 if name in ("material", QUALITY) else np.float32
            variable = file.create_variable(
                name, ("time", "y", "x"), dtype, chunks=chunks, **COMPRESSION
            )
            variable.attrs.update(units=unit, long_name=_LONG_NAMES[name])


class StoredScene(Scene):
    """A scene in a file, read frame by frame; opened by `open_scene`.

    Fields that are stored as `SceneWriter` stores them are read without the way through xarray,
    in half the time; what was read last stays in memory, up to `CACHED_BYTES`. `lattice` states
    where the nodes are if the file holds splines, None if it holds samples; `coarser` gives it
    another one, and some of the frames.
    """

    def __init__(
        self, path: Path, lattice: Lattice | None = None, kept: Sequence[int] | None = None
    ) -> None:
        self.path = path
        self._file = h5py.File(path, "r")
        data = xr.open_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="access")
        self.lattice = lattice or spline_file.stored_lattice(self._file, data)
        self._kept = range(data.sizes.get("time", 0)) if kept is None else kept
        fields = (*CUT_FIELDS, QUALITY) if self.lattice is None else spline_file.CHUNKED
        datasets = {name: self._file[name] for name in fields if name in data}
        self._direct = {name for name, dataset in datasets.items() if _is_plain(dataset)}
        if lattice is not None:
            places = raster_coordinates(lattice.raster, data["time"].values[self._kept])
            data = xr.Dataset(coords=places, attrs=data.attrs)
        if self.lattice is not None:
            data = spline_file.with_samples(data, self._read, _LONG_NAMES)
        shape = self.lattice.shape if self.lattice else tuple(data.sizes.get(n, 1) for n in "yx")
        chunks = CACHED_BYTES // max(prod(shape) * np.dtype(np.float32).itemsize, 1)

        @lru_cache(chunks)
        def chunk(name: str, index: int) -> NDArray[Any]:
            with _telling(path, name, index):
                return read_chunk(datasets[name], index)

        self._chunk = chunk
        super().__init__(data)

    def coarser(self, step: int, every: int = 1) -> "StoredScene":
        """Return the scene of splines with one of `step` samples either way, of `every` frames."""
        if self.lattice is None:
            raise ValueError(f"{self.path}: has samples, expected splines")
        kept = [index for block in self.blocks for index in block[::every]]
        return StoredScene(self.path, self.lattice.coarser(step), kept)

    @property
    def compression(self) -> str:
        """HDF5 filters of temperature or splines: ``shuffle, deflate``; ``none``."""
        kept = "temperature" if self.lattice is None else spline_file.SPLINES
        settings = self._file[kept].id.get_create_plist()
        filters = [settings.get_filter(i) for i in range(settings.get_nfilters())]
        return ", ".join(name.decode() or str(code) for code, _, _, name in filters) or "none"

    def _unchecked(self, index: int, names: Collection[str] | None) -> Frame:
        splines = self.splines(index)
        return splines.frame(names) if splines else super()._unchecked(index, names)

    def splines(self, index: int) -> SplineFrame | None:
        """Return the splines of one frame; None if the file has samples."""
        if self.lattice is None:
            return None
        nodes, limits = (self._chunk(name, self._kept[index]) for name in spline_file.CHUNKED)
        frame = SplineFrame(self.lattice, float(self.times[index]), nodes, limits)
        spline_file.check(frame)
        return frame

    def _read(self, name: str, index: int) -> NDArray[Any]:
        splines = self.splines(index)
        if splines is not None:
            material = splines.material()
            return material if name == "material" else splines.values(name, material)
        index = range(len(self.times))[index]
        if name not in self._direct:
            with _telling(self.path, name, index):
                return super()._read(name, index)
        return self._chunk(name, index).copy()


def _is_plain(dataset: h5py.Dataset) -> bool:
    """Return whether a dataset holds the values themselves, as files of other programs need not."""
    encoded = ("scale_factor", "add_offset", "_FillValue", "missing_value", "_Unsigned")
    return dataset.dtype in (np.float32, np.uint8) and not any(
        map(dataset.attrs.__contains__, encoded)
    )


@contextmanager
def _telling(path: Path, name: str, index: int) -> Iterator[None]:
    """Name the place of what cannot be read."""
    try:
        yield
    except OSError as error:
        raise SceneError(
            f"{path}: {name!r} of frame {index} cannot be read: {_first_line(error)}"
        ) from error


def open_scene(path: str | os.PathLike[str]) -> StoredScene:
    """Open a scene file; frames are read on demand.

    Parameters
    ----------
    path : path-like
        A NetCDF-4 file, written by `SceneWriter` or by anyone who keeps the contract of `Scene`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    SceneError
        If the file is damaged, not a scene, or breaks the contract of a scene; the message
        names the file.
    """
    path = Path(path)
    results = path / "results.nc" if path.is_dir() else path
    if own_kind(results) == "analysis":
        raise SceneError(f"{path}: results of an analysis, expected a scene: {USE_OF_RESULTS}")
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file, expected a scene")
    try:
        check_file(path, by_frame=True)
        return StoredScene(path)
    except (SceneError, MemoryLimitError) as error:
        raise SceneError(f"{path}: {error}") from error
    except HDF5_ERRORS as error:
        raise SceneError(
            f"{path}: not a scene, or truncated, expected a NetCDF-4 file: {_first_line(error)}"
        ) from error


def example_scene() -> StoredScene:
    """Open a chip to try things with: 43 µs of the quick study, in which a shear band develops.

    Returns
    -------
    StoredScene
        44 frames, 1 µs apart, of 520 × 460 samples of 1.5 µm: the cut of Heigel and Whitenton
        (2010) on cells of 20 µm, which is coarse for a shear band. Its numbers are for a first
        look; those to rely on are the full study's.
    """
    return open_scene(Path(str(files("chipglow.io").joinpath("example-scene.nc"))))


def write_scene(scene: Scene, path: str | os.PathLike[str], *, samples: bool = False) -> None:
    """Write a whole scene to a file: fields, tool, attributes and forces.

    Parameters
    ----------
    scene : Scene
        The scene; read and written frame by frame.
    path : path-like
        The file to write; one that is there is replaced at the end.
    samples : bool
        Write the samples of a cut's scene instead of its splines, for other programs.
    """
    stored = scene if isinstance(scene, StoredScene) else None
    with SceneWriter(
        path,
        scene.raster,
        attributes=scene.data.attrs,
        fields=scene.fields,
        lattice=stored.lattice if stored is not None and not samples else None,
    ) as writer:
        for frame in scene.frames():
            writer.append(frame)
        if scene.overview is not None:
            writer.overview(scene.overview.frame(0), scene.overview.raster)
        if "cutting_force" in scene.data:
            time, cutting, thrust, thickness = (
                scene.data[name].values for name in ("force_time", *FORCE_UNITS)
            )
            known = {name: scene.data[name].values for name in ENERGY_UNITS if name in scene.data}
            writer.forces(time, cutting, thrust, thickness, known)


def _first_line(error: BaseException) -> str:
    return str(error).split("\n", 1)[0]
