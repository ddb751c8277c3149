"""HDF5 files with a digest at their end: damage is found before HDF5 reads them.

HDF5 ignores what follows its own data, and programs that change a file cut it off.
"""

from collections.abc import Callable
from functools import partial
from hashlib import file_digest, sha256
from io import FileIO
from pathlib import Path
from typing import Any, Final

import h5py
import numpy as np

from chipglow.io.atomic import atomic_path, uninterrupted
from chipglow.io.sandbox import Sandbox
from chipglow.io.sources import SourceError
from chipglow.io.sources.source import naming
from chipglow.text import HDF5_ERRORS, check_bounds, check_own_data

PATIENCE: Final = 30.0
"""Time limit of HDF5 for the smallest file in s; it takes 0.2 s."""

PATIENCE_PER_BYTE: Final = 1e-6
"""Additional time limit per byte in s; HDF5 reads 200 MB/s."""

_MARK: Final = b"\nchipglow sha256:"
_LENGTH: Final = len(_MARK) + sha256().digest_size


class HDF5Sink(FileIO):
    """A file that HDF5 writes, which keeps its first error for `check` to raise.

    HDF5 loses errors of delayed writes, and a process that closes an HDF5 file on a full
    disk can crash. Here HDF5 sees no error.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self._error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all the data, or keep the error; after an error write nothing more."""
        view = memoryview(data).cast("B")
        written = 0
        try:
            while self._error is None and written < len(view):
                written += super().write(view[written:])
        except OSError as error:
            self._keep(error)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._keep(error)
            return size or 0

    def _keep(self, error: OSError) -> None:
        # Its traceback would keep a view of the data, which Python could not free.
        self._error = self._error or error.with_traceback(None)

    def check(self) -> None:
        """Raise the error that was kept."""
        if self._error is not None:
            raise OSError(self._error.errno, self._error.strerror, self.name) from self._error


@uninterrupted()
def write_hdf5(path: Path, write: Callable[[HDF5Sink], object]) -> None:
    """Write an HDF5 file by a function of the file to write; it is whole or not there.

    HDF5 calls back into Python: an exception that a signal raises there could end the process.
    """
    with atomic_path(path) as part, HDF5Sink(part) as sink:
        try:
            write(sink)
            sink.seek(0)
            sink.write(_MARK + file_digest(sink, "sha256").digest())
        finally:
            sink.check()  # the cause of what HDF5 says


def content_digest(path: str | Path) -> str:
    """Return the digest of a file's content, whatever its name and time."""
    with Path(path).open("rb") as file:
        return file_digest(file, "sha256").hexdigest()


def is_intact(path: Path) -> bool | None:
    """Return whether a file is as it was when its digest was appended; None if it has no digest."""
    size = path.stat().st_size - _LENGTH
    if size < 0:
        return None
    content = np.memmap(path, np.uint8, "r")
    end = content[size:].tobytes()
    if not end.startswith(_MARK):
        return None
    return end == _MARK + sha256(content[:size].data).digest()


def check_file(path: Path, by_frame: bool = False) -> None:
    """Refuse an HDF5 file that is damaged, takes data from other files or exceeds the memory.

    A file without a digest, or with one that does not match, is examined in a subprocess, as HDF5
    can loop for ever at a damaged file.
    """
    intact = is_intact(path)
    if not h5py.is_hdf5(path):
        if intact is False:
            raise ValueError("the file is damaged: its digest does not match")
        return
    if not intact:
        patience = PATIENCE + PATIENCE_PER_BYTE * path.stat().st_size
        Sandbox("HDF5", patience).answer(partial(_read_all, str(path), intact is False, by_frame))
    if intact is False:
        raise ValueError("the file is damaged: its digest does not match")
    check_bounds(path, by_frame)
    check_own_data(path)


def _read_all(path: str, whole: bool, by_frame: bool) -> None:
    """Read all attributes and places of the data of a file and, if `whole`, its data."""
    with naming("HDF5"):
        check_bounds(Path(path), by_frame)
    with h5py.File(path, "r") as file:
        names = ["/"]
        file.visit(names.append)
        for name in names:
            try:
                _read(file[name], whole)
            except HDF5_ERRORS as error:
                raise SourceError(f"{name!r} is damaged: {error}") from None


def _read(item: Any, whole: bool) -> None:
    dict(item.attrs)
    if isinstance(item, h5py.Dataset):
        if item.chunks is not None:
            item.id.get_num_chunks()
        if whole:
            for part in range(item.shape[0]) if item.ndim else ((),):
                item[part]
