"""Formats of cameras' files: which they are, how they are recognised, and who reads them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Final

from chipglow.camera import Recording
from chipglow.io.cameras.cine import is_cine, read_cine
from chipglow.io.cameras.flir import is_flir, packed_counts, read_flir
from chipglow.io.cameras.hcc import is_hcc, read_hcc
from chipglow.io.cameras.ptw import is_ptw, read_ptw
from chipglow.io.cameras.stacks import Stated, read_stack
from chipglow.io.sources import SourceError
from chipglow.io.sources.file_order import files_of
from chipglow.quantities import of_other_packages

_HEAD: Final = 520
"""Bytes by which a kind of file is recognised: those of HDF5 may follow 512 of the user's."""


Begins = Callable[[bytes], bool]
Read = Callable[[Path, slice | None, float | None], Recording]


def _no_subprocess(path: Path) -> bool:
    return False


@dataclass(frozen=True)
class CameraFormat:
    """A format of files.

    Parameters
    ----------
    description : str
        What it is, for people.
    suffixes : tuple of str
        Endings of such files' names.
    begins : callable, optional
        Whether a file is of this format, by its first bytes.
    read : callable, optional
        Reads frames of a file that says what was measured: its path, which frames, and the time
        between frames in s, in the place of the file's own, or None. It raises SourceError for a
        file that is damaged, cut short or of another kind, and OSError for one that is missing or
        not accessible. Without it the file holds an array, and the user says.
    in_subprocess : callable
        Whether libraries in C or C++ would unpack a file: they do so in a subprocess.
    inside_hdf5 : bool
        Whether files begin as those of HDF5 may: the ending of the name says which it is.
    """

    description: str
    suffixes: tuple[str, ...]
    begins: Begins | None = None
    read: Read | None = None
    in_subprocess: Callable[[Path], bool] = _no_subprocess
    inside_hdf5: bool = False

    @property
    def states_quantity(self) -> bool:
        """Whether such a file says what was measured, so that the user need not."""
        return self.read is not None


def _starts(*beginnings: bytes) -> Begins:
    return lambda head: head.startswith(beginnings)


_array: Final = partial(CameraFormat, in_subprocess=lambda path: True)
_hdf5: Final = partial(_array, inside_hdf5=True)
_HDF5: Final = b"\x89HDF\r\n\x1a\n"
_TIFF: Final = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_FLIR: Final = (".jpg", ".jpeg", ".fff", ".seq", ".csq")


def _is_hdf5(head: bytes) -> bool:
    return _HDF5 in (head[:8], head[512:520])


_OWN: Final[Mapping[str, CameraFormat]] = {
    "flir": CameraFormat(
        "FLIR radiometric JPEG, FFF, SEQ, CSQ", _FLIR, is_flir, read_flir, packed_counts
    ),
    "ptw": CameraFormat("FLIR PTW (Cedip, Altair)", (".ptw",), is_ptw, read_ptw),
    "hcc": CameraFormat("Telops HCC", (".hcc",), is_hcc, read_hcc),
    "cine": CameraFormat("Phantom CINE", (".cine",), is_cine, read_cine),
    "tiff": _array("TIFF, a stack or a file a frame", (".tif", ".tiff"), _starts(*_TIFF)),
    "npy": CameraFormat("NumPy array", (".npy",), _starts(b"\x93NUMPY")),
    "npz": _array("NumPy arrays, zipped", (".npz",)),
    "mat": _hdf5("MATLAB, versions 5 to 7.3", (".mat",), _starts(b"MATLAB ")),
    "netcdf": _hdf5("NetCDF", (".nc", ".nc4", ".cdf"), _starts(b"CDF\x01", b"CDF\x02", b"CDF\x05")),
    "hdf5": _hdf5("HDF5", (".h5", ".hdf5", ".hdf", ".he5"), _is_hdf5),
    "zarr": _array("Zarr, a folder or zipped", (".zarr", ".zip")),
    "csv": _array("table of numbers in text, a file a frame", (".csv", ".txt", ".dat")),
}


@cache
def camera_formats() -> Mapping[str, CameraFormat]:
    """The formats that `read_recording` reads, by their names.

    Other packages add theirs by an entry point in the group ``chipglow.camera_file``.
    """
    return {**of_other_packages("chipglow.camera_file"), **_OWN}


def find_format(path: Path) -> str:
    """Format of a file by how it begins, or else by the ending of its name.

    Raises
    ------
    SourceError
        If neither is known, or it is empty.
    OSError
        If it is missing or not accessible.
    """
    first = files_of(path)[0]
    by_name = {
        suffix: name for name, one in camera_formats().items() for suffix in one.suffixes
    }.get(first.suffix.lower())
    if first.is_dir():
        return "zarr"
    with first.open("rb") as stream:
        head = stream.read(_HEAD)
    if not head:
        raise SourceError(f"{first}: is empty")
    found = _by_content(head)
    if found is None or (
        by_name and all(camera_formats()[n].inside_hdf5 for n in (found, by_name))
    ):
        found = by_name or found
    if found is None:
        raise SourceError(
            f"{first}: is of an unknown kind, expected one of {', '.join(camera_formats())}"
        )
    return found


def _by_content(head: bytes) -> str | None:
    for name, one in camera_formats().items():
        if one.begins is not None and one.begins(head):
            return name
    return None


def read_here(path: Path, kind: str, frames: slice | None, stated: Stated) -> Recording:
    """Read frames of one of `camera_formats` in this process; see `read_recording`."""
    one = camera_formats()[kind]
    if one.read is not None:
        return one.read(path, frames, stated.interval)
    return read_stack(path, one.suffixes[0], frames, stated)
