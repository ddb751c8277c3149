"""Formats of cameras' files: which they are, how they are recognised, and who reads them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Final

from chipglow.camera import Recording
from chipglow.camera.recording import SignalKind
from chipglow.io.cameras.cine import Cine
from chipglow.io.cameras.flir import Flir, has_packed_counts
from chipglow.io.cameras.hcc import Hcc
from chipglow.io.cameras.ptw import Ptw
from chipglow.io.cameras.stacks import Stated, read_stack, stack_times
from chipglow.io.sandbox import Sandbox
from chipglow.io.sources import SourceError
from chipglow.io.sources.file_names import files_of
from chipglow.io.sources.source import head_of, reading
from chipglow.quantities import Array, of_other_packages
from chipglow.text import check_regular

_HEAD: Final = 520
"""Bytes by which a kind of file is recognised: those of HDF5 may follow 512 of the user's."""

Begins = Callable[[bytes], bool]


@dataclass(frozen=True)
class CameraFormat:
    """A format of files."""

    description: str
    suffixes: tuple[str, ...]
    """Endings of such files' names."""
    begins: Begins | None = None
    """Whether a file is of this format, by its first bytes."""
    read: Callable[[Path, slice | None, float | None], Recording] | None = None
    """Reads frames of a file that says what was measured: its path, which frames, and the time
    between frames in s, instead of the file's own, or None. Without it the file holds an array,
    and the user says."""
    times: Callable[[Path, float | None], Array] | None = None
    """Returns the times of all frames in s without reading them. Without it they are read."""
    in_subprocess: Callable[[Path], bool] = lambda path: False
    """Whether libraries in C or C++ would unpack a file: they do so in a subprocess."""
    inside_hdf5: bool = False
    """Whether files begin as those of HDF5 may: the ending of the name says which it is."""

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


_OWN: Final[Mapping[str, CameraFormat]] = {
    "flir": CameraFormat(
        "FLIR radiometric JPEG, FFF, SEQ, CSQ",
        (".jpg", ".jpeg", ".fff", ".seq", ".csq"),
        _starts(b"FFF\0", b"\xff\xd8\xff"),
        Flir.recording,
        Flir.all_times,
        has_packed_counts,
    ),
    "ptw": CameraFormat(
        "FLIR PTW (Cedip, Altair)", (".ptw",), _starts(b"CED", b"AIO"), Ptw.recording, Ptw.all_times
    ),
    "hcc": CameraFormat(
        "Telops HCC",
        (".hcc",),
        lambda head: head[:2] == b"TC" and len(head) > 3 and 5 <= head[3] < 32,
        Hcc.recording,
        Hcc.all_times,
    ),
    "cine": CameraFormat(
        "Phantom CINE", (".cine",), _starts(b"CI\x2c\0"), Cine.recording, Cine.all_times
    ),
    "tiff": _array("TIFF, a stack or one file per frame", (".tif", ".tiff"), _starts(*_TIFF)),
    "png": _array("PNG, grey, one file per frame", (".png",), _starts(b"\x89PNG\r\n")),
    "npy": CameraFormat("NumPy array", (".npy",), _starts(b"\x93NUMPY")),
    "npz": _array("NumPy arrays, zipped", (".npz",)),
    "mat": _hdf5("MATLAB, versions 5 to 7.3", (".mat",), _starts(b"MATLAB ")),
    "netcdf": _hdf5("NetCDF", (".nc", ".nc4", ".cdf"), _starts(b"CDF\x01", b"CDF\x02", b"CDF\x05")),
    "hdf5": _hdf5(
        "HDF5", (".h5", ".hdf5", ".hdf", ".he5"), lambda head: _HDF5 in (head[:8], head[512:520])
    ),
    "zarr": _array("Zarr", (".zarr",)),
    "csv": _array("table of numbers in text, one file per frame", (".csv", ".txt", ".dat")),
}


@cache
def camera_formats() -> Mapping[str, CameraFormat]:
    """Return the formats that `read_recording` reads, by their names.

    Other packages add theirs by an entry point in the group ``chipglow.camera_file``.
    """
    return {**of_other_packages("chipglow.camera_file"), **_OWN}


def find_format(path: Path) -> str:
    """Return the format of a file by how it begins, or else by the ending of its name."""
    first = files_of(path)[0]
    if first.is_dir():
        return "zarr"
    if not (head := head_of(first, _HEAD)):
        raise SourceError(f"{first}: is empty")
    formats = camera_formats()
    suffix = first.suffix.lower()
    by_name = next((name for name, one in formats.items() if suffix in one.suffixes), None)
    found = next((name for name, one in formats.items() if one.begins and one.begins(head)), None)
    if found and by_name and formats[found].inside_hdf5 and formats[by_name].inside_hdf5:
        found = by_name
    if kind := found or by_name:
        return kind
    raise SourceError(f"{first}: is of an unknown kind, expected one of {', '.join(formats)}")


def read_recording(
    path: str | Path,
    frames: slice | None = None,
    format: str | None = None,
    *,
    quantity: SignalKind | None = None,
    unit: str | None = None,
    interval: float | None = None,
    dataset: str | None = None,
    axes: Sequence[str] | None = None,
    scale: float | None = None,
    offset: float | None = None,
    void_value: float | None = None,
) -> Recording:
    """Read frames of a camera file.

    Parameters
    ----------
    path : str or Path
        The file. For TIFF, PNG and tables also a pattern with ``*``: one file per frame.
    frames : slice, optional
        Which frames to read, all by default; the others are not read.
    format : str, optional
        One of `camera_formats`; found by the file's content and name by default.
    quantity : {"counts", "radiance", "temperature"}, optional
        Measured quantity, for files that do not state it.
    unit : str, optional
        Unit of the samples, instead of the one that the file states: ``counts``, or a unit of
        temperature or radiance such as ``K``, ``degC``, ``degF``, ``cK``, ``0.01 K``, ``W/m2/sr``.
    interval : float, optional
        Time between frames in s, for files that omit it or are wrong.
    dataset : str, optional
        Which array of the file, if it has several.
    axes : sequence of str, optional
        Axes: ``time``, ``y`` and ``x`` in their order.
    scale, offset : float, optional
        The temperature or radiance is ``scale`` times the number in the file plus ``offset``, in
        the unit: 1 and 0 by default.
    void_value : float, optional
        Number in the file that stands for no value; it becomes NaN, as those do that the file
        declares missing.

    Returns
    -------
    Recording
        The frames; times count from the first frame of the file. By coordinates ``y`` and ``x`` of
        the file, the upper row and the left column come first, and the pitch and the position of
        the image are known; without ``y``, row 0 of the file is the upper one.

    Raises
    ------
    ValueError
        If the file is damaged, truncated or of an unknown kind (`SourceError`), what it does not
        say is not given, or what is given is impossible.
    OSError
        If it is missing or not accessible.
    """
    stated = Stated(
        quantity=quantity,
        unit=unit,
        interval=interval,
        dataset=dataset,
        axes=None if axes is None else tuple(axes),
        scale=scale,
        offset=offset,
        void_value=void_value,
    )
    path = Path(path)
    check_regular(path)
    if format is not None and format not in camera_formats():
        raise ValueError(f"format: is {format!r}, expected one of {', '.join(camera_formats())}")
    kind = format or find_format(path)
    one = camera_formats()[kind]
    if one.states_quantity and stated != Stated(interval=interval):
        raise ValueError(
            f"{path}: is {one.description}, which states itself what was measured: "
            "expected no quantity, unit, scale, offset, void_value, dataset or axes"
        )
    read = partial(read_here, path, kind, frames, stated)
    return Sandbox(str(path)).answer(read) if one.in_subprocess(path) else read()


def read_here(path: Path, kind: str, frames: slice | None, stated: Stated) -> Recording:
    """Read frames of one of `camera_formats` in this process; see `read_recording`."""
    one = camera_formats()[kind]
    with reading(path):
        if one.read is not None:
            return one.read(path, frames, stated.interval)
        return read_stack(path, one.suffixes[0], frames, stated)


def recording_times(path: Path, format: str | None = None, stated: Stated | None = None) -> Array:
    """Return the times of all frames of a camera file in s; see `read_recording`."""
    check_regular(path)
    kind = format or find_format(path)
    read = partial(_times_here, path, kind, stated or Stated())
    return Sandbox(str(path)).answer(read) if camera_formats()[kind].in_subprocess(path) else read()


def _times_here(path: Path, kind: str, stated: Stated) -> Array:
    one = camera_formats()[kind]
    with reading(path):
        if one.times is not None:
            return one.times(path, stated.interval)
        if one.read is not None:
            return one.read(path, None, stated.interval).times
        return stack_times(path, one.suffixes[0], stated)


def load_libraries() -> list[str]:
    """Import the libraries of frequent formats, which takes seconds, and return their names."""
    import h5py
    import tifffile

    return [h5py.__name__, tifffile.__name__]
