"""Measurements in NetCDF-4 files."""

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Final, Literal, TypeAlias, TypeVar

import h5py
import numpy as np
import xarray as xr

from chipglow.camera import Measurement
from chipglow.camera.measurement import MEASUREMENT_UNITS
from chipglow.io.digest import check_file, is_intact, write_hdf5
from chipglow.io.packing import COMPRESSION
from chipglow.text import HDF5_ERRORS, MemoryLimitError, check_regular

Made = TypeVar("Made")

OwnKind: TypeAlias = Literal["scene", "measurement", "correction", "emissivity", "psf", "analysis"]
"""Content of a file that chipglow wrote."""

_VARIABLES: Final[Mapping[OwnKind, frozenset[str]]] = {
    "measurement": frozenset(MEASUREMENT_UNITS),
    "correction": frozenset({"temperature", "standard_uncertainty", "effect", "flags"}),
    "emissivity": frozenset({"emissivity", "region_mean"}),
    "psf": frozenset({"kernel", "edge1_esf"}),
    "analysis": frozenset({"reading", "measured"}),
}
"""Variables that only files of a kind have."""

USE_OF_RESULTS: Final = (
    "see report.html beside results.nc, open the folder by chipglow app, or write the scene by "
    "chipglow cut study.yaml --out scene.nc"
)
"""What an analysis serves for, where a scene is expected."""


def write_measurement(measurement: Measurement, path: str | os.PathLike[str]) -> None:
    """Write a measurement to a file: variables, flags and what its attributes state.

    Parameters
    ----------
    measurement : Measurement
        The measurement.
    path : path-like
        The file to write; one that is there is replaced at the end. It loses nothing.
    """
    write_dataset(measurement.data, path)


def write_dataset(data: xr.Dataset, path: str | os.PathLike[str]) -> None:
    """Write a dataset of moderate size to a NetCDF-4 file, compressed without loss.

    Images over time are kept together by frame, so that one frame is read without the others.
    """
    encoding = {
        str(name): {**COMPRESSION, **_by_frame(variable)}
        for name, variable in data.variables.items()
        if variable.ndim and np.issubdtype(variable.dtype, np.number)
    }
    # HDF5 reads back what it wrote, which a full disk may not have taken: it writes to memory.
    stored = data.drop_encoding().to_netcdf(engine="h5netcdf", encoding=encoding)
    with memoryview(stored) as content:  # Python cannot free memory that an error still views
        del stored
        write_hdf5(Path(path), lambda sink: sink.write(content))


def _by_frame(variable: xr.Variable) -> dict[str, tuple[int, ...]]:
    if variable.dims != ("time", "y", "x") or 0 in variable.shape:
        return {}
    return {"chunksizes": (1, *variable.shape[1:])}


def read_measurement(path: str | os.PathLike[str]) -> Measurement:
    """Read a measurement from a file into memory.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If the file is truncated or not a measurement; the message names the file.
    """
    return read_dataset(Path(path), Measurement, "a measurement", "a NetCDF-4 file")


def open_measurement(path: str | os.PathLike[str]) -> Measurement:
    """Open a measurement whose frames are read when they are asked for; see `read_measurement`."""
    return read_dataset(Path(path), Measurement, "a measurement", "a NetCDF-4 file", by_frame=True)


def read_dataset(
    path: Path, made_of: Callable[[xr.Dataset], Made], what: str, kind: str, by_frame: bool = False
) -> Made:
    """Return `made_of` the data of a NetCDF-4 file, which should be `what` in a file of `kind`.

    The data are in memory, or with `by_frame` in the file until they are used.
    """
    check_regular(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there is no such file, expected {what}")
    try:
        check_file(path, by_frame)
        read = xr.open_dataset if by_frame else xr.load_dataset
        data = read(path, engine="h5netcdf", decode_times=False, phony_dims="access")
        return made_of(data)
    except MemoryLimitError as error:
        raise ValueError(f"{path}: {error}") from None
    except HDF5_ERRORS as error:
        reason = str(error).split("\n", 1)[0]
        raise ValueError(f"{path}: not {what}, or truncated, expected {kind}: {reason}") from error


def holds(path: str | os.PathLike[str], names: Iterable[str]) -> bool:
    """Return whether a file is HDF5, whole enough to be opened, and has all these at its root."""
    return (found := _root(path)) is not None and set(names) <= found[0]


def own_kind(path: str | os.PathLike[str]) -> OwnKind | None:
    """Return what chipglow wrote to a file; None if it is a file of others or does not exist."""
    if (found := _root(path)) is None:
        return None
    variables, attributes = found
    if "chipglow_format" in attributes:
        return "scene"
    return next((kind for kind, own in _VARIABLES.items() if own <= variables), None)


def _root(path: str | os.PathLike[str]) -> tuple[set[str], set[str]] | None:
    """Return the names of variables and of attributes of a file; None if it is not HDF5.

    A file of chipglow that is damaged is a ValueError.
    """
    path = Path(path)
    check_regular(path)
    if not path.is_file() or not h5py.is_hdf5(path):
        return None
    if is_intact(path) is False:
        try:
            check_file(path)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None
    try:
        with h5py.File(path, "r") as file:
            return set(file), set(file.attrs)
    except HDF5_ERRORS:
        return None
