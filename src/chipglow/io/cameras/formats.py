"""Formats of cameras' files: which they are, how they are told, and who reads them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chipglow.camera import Recording
from chipglow.io.cameras.cine import is_cine, read_cine
from chipglow.io.cameras.flir import is_flir, packed_counts, read_flir
from chipglow.io.cameras.hcc import is_hcc, read_hcc
from chipglow.io.cameras.ptw import is_ptw, read_ptw
from chipglow.io.cameras.stacks import Told, read_stack
from chipglow.io.sources import SourceError
from chipglow.io.sources.arrays import matching_files

_HEAD: Final = 520
"""Bytes from which a kind of file is told: those of HDF5 may follow 512 of the user's."""


@dataclass(frozen=True)
class CameraFormat:
    """A format of files.

    Parameters
    ----------
    suffixes : tuple of str
        Endings of such files' names.
    description : str
        What it is, for people.
    tells_quantity : bool
        Whether such a file says what was measured, so that the user need not.
    """

    suffixes: tuple[str, ...]
    description: str
    tells_quantity: bool


CAMERA_FORMATS: Final[Mapping[str, CameraFormat]] = {
    "flir": CameraFormat(
        (".jpg", ".jpeg", ".fff", ".seq", ".csq"), "FLIR radiometric JPEG, FFF, SEQ, CSQ", True
    ),
    "ptw": CameraFormat((".ptw",), "FLIR PTW (Cedip, Altair)", True),
    "hcc": CameraFormat((".hcc",), "Telops HCC", True),
    "cine": CameraFormat((".cine",), "Phantom CINE", True),
    "tiff": CameraFormat((".tif", ".tiff"), "TIFF, a stack or a file a frame", False),
    "npy": CameraFormat((".npy",), "NumPy array", False),
    "npz": CameraFormat((".npz",), "NumPy arrays, zipped", False),
    "mat": CameraFormat((".mat",), "MATLAB, versions 5 to 7.3", False),
    "netcdf": CameraFormat((".nc", ".nc4", ".cdf"), "NetCDF", False),
    "hdf5": CameraFormat((".h5", ".hdf5", ".hdf", ".he5"), "HDF5", False),
    "zarr": CameraFormat((".zarr", ".zip"), "Zarr, a folder or zipped", False),
    "csv": CameraFormat(
        (".csv", ".txt", ".dat"), "table of numbers in text, a file a frame", False
    ),
}
"""The formats that `read_recording` reads, by their names."""

_OWN: Final[Mapping[str, tuple[Callable[[bytes], bool], Callable[..., Recording]]]] = {
    "flir": (is_flir, read_flir),
    "ptw": (is_ptw, read_ptw),
    "hcc": (is_hcc, read_hcc),
    "cine": (is_cine, read_cine),
}
_BEGINNINGS: Final = {
    b"\x93NUMPY": "npy",
    b"MATLAB ": "mat",
    b"\x89HDF\r\n\x1a\n": "hdf5",
    b"CDF\x01": "netcdf",
    b"CDF\x02": "netcdf",
    b"CDF\x05": "netcdf",
    b"II*\0": "tiff",
    b"MM\0*": "tiff",
    b"II+\0": "tiff",
    b"MM\0+": "tiff",
}
_INSIDE_HDF5: Final = {"hdf5", "netcdf", "mat"}
"""Formats that begin alike: the ending of the name says which it is."""


def find_format(path: Path) -> str:
    """Format of a file by how it begins, or else by the ending of its name.

    Raises
    ------
    SourceError
        If neither is known, or it is empty.
    OSError
        If it is missing or not accessible.
    """
    first = matching_files(str(path))[0]
    by_name = {suffix: name for name, one in CAMERA_FORMATS.items() for suffix in one.suffixes}.get(
        first.suffix.lower()
    )
    if first.is_dir():
        return "zarr"
    with first.open("rb") as stream:
        head = stream.read(_HEAD)
    if not head:
        raise SourceError(f"{first}: is empty")
    found = _by_content(head)
    if found is None or {found, by_name} <= _INSIDE_HDF5:
        found = by_name or found
    if found is None:
        raise SourceError(
            f"{first}: is of an unknown kind, expected one of {', '.join(CAMERA_FORMATS)}"
        )
    return found


def _by_content(head: bytes) -> str | None:
    for name, (begins, _) in _OWN.items():
        if begins(head):
            return name
    for beginning, name in _BEGINNINGS.items():
        if head.startswith(beginning) or (name == "hdf5" and head[512:].startswith(beginning)):
            return name
    return None


def through_libraries(path: Path, kind: str) -> bool:
    """Whether libraries in C or C++ would unpack the file."""
    return packed_counts(path) if kind == "flir" else kind not in _OWN and kind != "npy"


def read_here(path: Path, kind: str, frames: slice | None, told: Told) -> Recording:
    """Read frames in this process; see `read_recording`.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        One of `CAMERA_FORMATS`.
    frames : slice, optional
        Which frames to read.
    told : Told
        What the user says of it.
    """
    if kind in _OWN:
        return _OWN[kind][1](path, frames, told.interval)
    return read_stack(path, CAMERA_FORMATS[kind].suffixes[0], frames, told)
