"""Scenes in NetCDF-4 files: written frame by frame, read lazily."""

import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import lru_cache, partial
from importlib.metadata import version
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
from chipglow.io.atomic import KeptErrorFile, atomic_path
from chipglow.io.chunks import COMPRESSION, read_chunk, write_chunk
from chipglow.io.digest import append_digest, check_file
from chipglow.io.interrupts import uninterrupted
from chipglow.io.measurement_file import holds
from chipglow.io.packing import HOT, HOTTEST_PACKED, PACKING, Packing, packing_for
from chipglow.io.unfinished import (
    UnfinishedScene,
    checkpoint_path,
    has_checkpoint,
    write_checkpoint,
)
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
from chipglow.scene.scene import (
    FORCE_UNITS,
    HOTTEST_PLAUSIBLE,
    check_frame,
    raster_coordinates,
)
from chipglow.scene.splines import Lattice, SplineFrame
from chipglow.scene.tool_attributes import tool_attributes

SCENE_FORMAT: Final = 5
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


class SceneWriter:
    """Write a scene to a file, one frame after the other.

    A context manager. The file has a temporary name until the end; if the block raises, nothing
    is left of it unless there is a checkpoint to go on from.

    Parameters
    ----------
    path : path-like
        The file to write.
    raster : Raster
        Where the samples are.
    tool : Tool, optional
        The tool's outline.
    attributes : mapping, optional
        Attributes of the file, such as provenance: text and numbers.
    fields : sequence of str
        Names of the fields that the frames have; by default those of a cut.
    hottest : float
        Greatest temperature in K that the frames may have. Over the default, 1838.375 K,
        temperature takes 32 bits instead of 16 and reaches all that a scene may have.
    lattice : Lattice, optional
        Keep the splines of the frames instead of their samples; for frames that have them.
    resume : UnfinishedScene, optional
        Begin with the frames that an earlier writer of the same scene had at its last checkpoint.

    Notes
    -----
    One NetCDF-4 file, a chunk per field and frame. Temperature has steps of 25 mK from 200 K up,
    material coordinates steps of 20 nm; plastic strain, plastic strain rate and velocities are
    within 2⁻¹⁴, 2⁻¹² and 2⁻¹¹ of their value. Splines have the steps of `spline_file.STEPS`.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        raster: Raster,
        tool: Tool | None = None,
        attributes: Mapping[str, Any] | None = None,
        fields: Sequence[str] = CUT_FIELDS,
        *,
        hottest: float = HOTTEST_PACKED,
        lattice: Lattice | None = None,
        resume: UnfinishedScene | None = None,
    ) -> None:
        self.path = Path(path)
        self.raster = raster
        self._attributes = {**(attributes or {}), **(tool_attributes(tool) if tool else {})}
        units = {**FIELD_UNITS, **MATERIAL_COORDINATE_UNITS, QUALITY: "1"}
        self._units = {name: units[name] for name in fields}
        self._lattice = lattice
        self._chunked = spline_file.CHUNKED if lattice else tuple(self._units)
        self._packing = packing_for(hottest)
        self._stack = ExitStack()
        self._times: list[float] = []
        self._chunks: list[tuple[int, int, int]] = []
        self._resume = resume

    def __enter__(self) -> "SceneWriter":
        with ExitStack() as stack:
            with uninterrupted():
                self._open(stack)
            self._stack = stack.pop_all()
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
            if not self._times:
                raise SceneError(f"{self.path}: no frame was written, expected 1 or more")

    @uninterrupted()
    def append(self, frame: Frame) -> None:
        """Write the next frame."""
        if self._times and frame.time <= self._times[-1]:
            raise SceneError(
                f"scene: frame at {frame.time:.9g} s, expected later than {self._times[-1]:.9g} s"
            )
        check_frame(frame)
        packed = self._kept(frame)
        count = len(self._times)
        self._file.resize_dimension("time", count + 1)
        self._file.variables["time"][count] = frame.time
        for name, values in packed.items():
            write_chunk(self._hdf[name], count, values)
        self._sink.check(self.path)
        self._times.append(frame.time)

    @uninterrupted()
    def checkpoint(self, state: Mapping[str, NDArray[Any]], progress: float) -> Path:
        """Keep the frames so far, with a state to go on from, even if the process is killed."""
        self._hdf.flush()
        self._sink.check(self.path)
        os.fsync(self._sink.fileno())
        for frame in range(len(self._chunks) // len(self._chunked), len(self._times)):
            for name in self._chunked:
                dataset = self._dataset(name)
                at = dataset.get_chunk_info_by_coord((frame, *(0,) * (dataset.rank - 1)))
                self._chunks.append((at.byte_offset, at.size, at.filter_mask))
        write_checkpoint(self._part, state, progress, self._times, self._chunks)
        return checkpoint_path(self._part)

    @uninterrupted()
    def forces(
        self,
        times: ArrayLike,
        cutting: ArrayLike,
        thrust: ArrayLike,
        energies: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Write the force history, once, and the energy balance with it."""
        time = np.asarray(times, dtype=np.float64)
        units = {**FORCE_UNITS, **(ENERGY_UNITS if energies else {})}
        given = {"cutting_force": cutting, "thrust_force": thrust, **(energies or {})}
        if set(given) != set(units):
            raise SceneError(f"scene: energies {list(energies or {})}, expected {list(units)[2:]}")
        forces = {name: np.asarray(given[name], dtype=np.float64) for name in units}
        if time.ndim != 1 or (np.diff(time) <= 0).any() or not np.isfinite(time).all():
            raise SceneError("scene: force_time must be one finite, ascending row of times")
        for name, values in forces.items():
            if values.shape != time.shape or not np.isfinite(values).all():
                raise SceneError(f"scene: {name!r} must be finite and have shape {time.shape}")
        self._file.dimensions["force_time"] = time.size
        for name, unit, values in (
            ("force_time", "s", time),
            *((name, units[name], values) for name, values in forces.items()),
        ):
            variable = self._file.create_variable(name, ("force_time",), data=values, **COMPRESSION)
            variable.attrs["units"] = unit
            variable.attrs["long_name"] = _LONG_NAMES.get(name, "time of the force history")

    def _open(self, stack: ExitStack) -> None:
        stack.push(self._drop_checkpoint)
        self._part = stack.enter_context(atomic_path(self.path, has_checkpoint))
        self._sink = stack.enter_context(KeptErrorFile(self._part))
        stack.callback(self._sink.check, self.path)
        stack.callback(append_digest, self._sink)
        self._hdf = stack.enter_context(
            h5py.File(self._sink, "w", track_order=True, libver=_VERSION)
        )
        self._file = stack.enter_context(h5netcdf.File(self._hdf, "w"))
        self._create_variables()
        if self._resume is not None:
            self._take_over(self._resume)

    def _take_over(self, unfinished: UnfinishedScene) -> None:
        """Copy the frames of a checkpoint, as they are compressed.

        HDF5 cannot open a file whose writer was killed, but a chunk once written stays in place.
        """
        times, chunks = unfinished.frames()
        self._file.resize_dimension("time", len(times))
        with unfinished.part.open("rb") as source:
            for index, (offset, size, filters) in enumerate(chunks.tolist()):
                frame, field = divmod(index, len(self._chunked))
                source.seek(offset)
                dataset = self._dataset(self._chunked[field])
                corner = (frame, *(0,) * (dataset.rank - 1))
                dataset.write_direct_chunk(corner, source.read(size), filters)
                self._sink.check(self.path)
        self._file.variables["time"][...] = times
        self._times = times.tolist()

    def _dataset(self, name: str) -> Any:
        return self._hdf[name].id

    def _drop_checkpoint(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            checkpoint_path(self._part).unlink(missing_ok=True)

    def _create_variables(self) -> None:
        rows, columns = self.raster.shape
        self._file.dimensions = {"time": None, "y": rows, "x": columns}
        for name, value in self._attributes.items():
            self._file.attrs[name] = value
        self._file.attrs["Conventions"] = "CF-1.11"
        self._file.attrs["chipglow_version"] = version("chipglow")
        self._file.attrs["chipglow_format"] = SCENE_FORMAT
        coordinates = raster_coordinates(self.raster, np.empty(0))
        for name, (dimension, values, attributes) in coordinates.items():
            variable = self._file.create_variable(name, (dimension,), np.float64, **COMPRESSION)
            if values.size:
                variable[...] = values
            variable.attrs.update(attributes)
        if self._lattice is not None:
            spline_file.create(self._file, self._lattice)
            return
        for name in self._units:
            self._create_field(name)

    def _create_field(self, name: str) -> None:
        packing = self._packing[name]
        variable = self._file.create_variable(
            name,
            ("time", "y", "x"),
            packing.dtype,
            chunks=(1, *self.raster.shape),
            **COMPRESSION,
        )
        variable.attrs.update(
            units=self._units[name], long_name=_LONG_NAMES[name], **packing.attributes
        )

    def _kept(self, frame: Frame) -> dict[str, NDArray[Any]]:
        """What the file keeps of a frame, by variable."""
        if self._lattice is None:
            return {name: self._packed(name, frame) for name in self._units}
        if frame.splines is None or frame.splines.nodes.shape != self._lattice.shape:
            raise SceneError(
                f"scene: the frame at {frame.time:.9g} s has no splines of shape "
                f"{self._lattice.shape}, expected those of the lattice"
            )
        return dict(spline_file.rounded(frame.splines))

    def _packed(self, name: str, frame: Frame) -> NDArray[Any]:
        values = getattr(frame, name)
        if values is None or values.shape != self.raster.shape:
            found = "missing" if values is None else f"of shape {values.shape}"
            raise SceneError(
                f"scene: {name!r} is {found} at {frame.time:.9g} s, expected {self.raster.shape}"
            )
        try:
            return self._packing[name].pack(values)
        except ValueError as error:
            raise SceneError(f"scene: {name!r} at {frame.time:.9g} s: {error}") from None


class StoredScene(Scene):
    """A scene in a file, read frame by frame; opened by `open_scene`.

    Fields that are packed as `SceneWriter` packs them are read without the way through xarray,
    in half the time; what was read last stays in memory, up to `CACHED_BYTES`. `lattice` says
    where the nodes are if the file holds splines, None if it holds samples.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = h5py.File(path, "r")
        names = (*PACKING, *spline_file.CHUNKED)
        self._datasets = {name: self._file[name] for name in names if name in self._file}
        self._direct = {
            name: packing
            for name, packing in (*PACKING.items(), ("temperature", HOT))
            if self._is_packed(name, packing)
        }
        data = xr.open_dataset(path, engine="h5netcdf", decode_times=False, phony_dims="access")
        self.lattice = spline_file.stored_lattice(self._file, data)
        if self.lattice is not None:
            data = spline_file.with_samples(data, self._read, _LONG_NAMES)
        shape = self.lattice.shape if self.lattice else tuple(data.sizes.get(n, 1) for n in "yx")
        chunks = CACHED_BYTES // max(prod(shape) * np.dtype(np.float32).itemsize, 1)
        self._chunk = lru_cache(chunks)(partial(_read_chunk, path, self._datasets))
        super().__init__(data)

    def coarser(self, step: int, every: int = 1) -> Scene:
        """The same scene with fewer samples, for a quick look.

        Parameters
        ----------
        step : int
            How many samples, in either direction, become one.
        every : int
            One of so many frames that follow one another is kept, the first after each gap.

        Raises
        ------
        ValueError
            If the file holds no splines, or too few samples remain.
        """
        if self.lattice is None:
            raise ValueError(f"{self.path}: has samples, expected splines")
        kept = [index for block in self.blocks for index in block[::every]]
        return _CoarserScene(self, self.lattice.coarser(step), kept)

    @property
    def hottest(self) -> float:
        """Temperature in K over which the file can have none."""
        narrow = self._direct.get("temperature") == PACKING["temperature"]
        return HOTTEST_PACKED if narrow else HOTTEST_PLAUSIBLE

    @property
    def compression(self) -> str:
        """HDF5 filters of temperature or splines: ``shuffle, deflate``; ``none``."""
        kept = "temperature" if self.lattice is None else spline_file.SPLINES
        settings = self._file[kept].id.get_create_plist()
        filters = [settings.get_filter(i) for i in range(settings.get_nfilters())]
        return ", ".join(name.decode() or str(code) for code, _, _, name in filters) or "none"

    def _is_packed(self, name: str, packing: Packing) -> bool:
        stored = self._file.get(name)
        if not isinstance(stored, h5py.Dataset) or stored.dtype != packing.dtype:
            return False
        names = ("scale_factor", "add_offset", "_FillValue", "missing_value", "_Unsigned")
        return {key: stored.attrs[key] for key in names if key in stored.attrs} == dict(
            packing.attributes
        )

    def _unchecked(self, index: int, names: Collection[str] | None) -> Frame:
        splines = self.splines(index)
        return splines.frame(names) if splines else super()._unchecked(index, names)

    def splines(self, index: int) -> SplineFrame | None:
        """The splines of one frame; None if the file has samples."""
        if self.lattice is None:
            return None
        index = range(len(self.times))[index]
        nodes, limits = (self._chunk(name, index) for name in spline_file.CHUNKED)
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
        packed = self._chunk(name, index)
        values = self._direct[name].unpack(packed)
        return values.copy() if values is packed else values


def _read_chunk(
    path: Path, datasets: Mapping[str, h5py.Dataset], name: str, index: int
) -> NDArray[Any]:
    with _telling(path, name, index):
        return read_chunk(datasets[name], index)


@contextmanager
def _telling(path: Path, name: str, index: int) -> Iterator[None]:
    """Say of what cannot be read where it is."""
    try:
        yield
    except OSError as error:
        raise SceneError(
            f"{path}: {name!r} of frame {index} cannot be read: {_first_line(error)}"
        ) from error


class _CoarserScene(Scene):
    """A stored scene of splines on fewer samples; see `StoredScene.coarser`."""

    def __init__(self, stored: StoredScene, lattice: Lattice, kept: Sequence[int]) -> None:
        self._stored, self._lattice, self._kept = stored, lattice, kept
        places = raster_coordinates(lattice.raster, stored.times[kept])
        empty = xr.Dataset(coords=places, attrs=stored.data.attrs)
        super().__init__(spline_file.with_samples(empty, self._read, _LONG_NAMES))

    def splines(self, index: int) -> SplineFrame:
        """The splines of one frame."""
        found = self._stored.splines(self._kept[index])
        assert found is not None
        return SplineFrame(self._lattice, found.time, found.nodes, found.limits)

    def _unchecked(self, index: int, names: Collection[str] | None) -> Frame:
        return self.splines(index).frame(names)

    def _read(self, name: str, index: int) -> NDArray[Any]:
        frame = self.splines(index)
        material = frame.material()
        return material if name == "material" else frame.values(name, material)


def open_scene(path: str | os.PathLike[str]) -> StoredScene:
    """Open a scene's file; frames are read when they are asked for.

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
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file, expected a scene")
    try:
        check_file(path)
        return StoredScene(path)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from error
    except (OSError, ValueError, KeyError, RuntimeError) as error:
        raise SceneError(
            f"{path}: not a scene, or cut short, expected a NetCDF-4 file: {_first_line(error)}"
        ) from error


def is_scene(path: str | os.PathLike[str]) -> bool:
    """Whether a file is one that `SceneWriter` or `write_scene` wrote, or like it."""
    return holds(path, ("temperature",)) or holds(path, (spline_file.SPLINES,))


def write_scene(scene: Scene, path: str | os.PathLike[str], *, samples: bool = False) -> None:
    """Write a whole scene to a file: fields, tool, attributes and forces.

    Parameters
    ----------
    scene : Scene
        What to write; read and written frame by frame.
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
        hottest=stored.hottest if stored is not None else HOTTEST_PLAUSIBLE,
        lattice=stored.lattice if stored is not None and not samples else None,
    ) as writer:
        for frame in scene.frames():
            writer.append(frame)
        if "cutting_force" in scene.data:
            time, cutting, thrust = (
                scene.data[name].values for name in ("force_time", *FORCE_UNITS)
            )
            known = [name for name in ENERGY_UNITS if name in scene.data]
            writer.forces(time, cutting, thrust, {name: scene.data[name].values for name in known})


def _first_line(error: BaseException) -> str:
    return str(error).split("\n", 1)[0]
