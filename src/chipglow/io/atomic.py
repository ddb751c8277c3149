"""Output that is there whole or not at all."""

import errno
import io
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from chipglow.io.unfinished import hold

RESULT_MARK: Final = "summary.json"
"""The file by which a folder of results is known."""

_NO_ROOM: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


@contextmanager
def atomic_path(
    path: str | os.PathLike[str], keep: Callable[[Path], bool] = lambda _: False
) -> Iterator[Path]:
    """Write a file under a temporary name; move it into place at the end.

    Parameters
    ----------
    path : path-like
        The file to write; one that is there is replaced.
    keep : callable, optional
        Told the temporary name if the block raises: whether to leave that file where it is.

    Yields
    ------
    pathlib.Path
        Temporary name in the same folder, with the same suffix. If the block raises, the file of
        this name is removed, or kept, and `path` stays as it was.

    Raises
    ------
    FileNotFoundError
        If the folder does not exist.
    IsADirectoryError
        If `path` is a folder.
    OSError
        If nothing can be written there; the message names `path`.
    """
    path = Path(path)
    if path.is_dir():
        raise IsADirectoryError(f"{path}: is a folder, expected the name of a file")
    temporary = _temporary_beside(path)
    try:
        with _errors_name(path, temporary):
            yield temporary
            temporary.replace(path)
    finally:
        if not keep(temporary):
            temporary.unlink(missing_ok=True)


@contextmanager
def atomic_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Fill a folder of results under a temporary name; move it into place at the end.

    Parameters
    ----------
    path : path-like
        The folder to write. One that is there is replaced if it is empty or holds earlier results.

    Yields
    ------
    pathlib.Path
        Temporary folder beside it. If the block raises, it is removed and `path` stays as it was.

    Raises
    ------
    FileNotFoundError
        If the folder in which it shall be does not exist.
    FileExistsError
        If `path` is there and is neither empty nor a folder of results.
    OSError
        If nothing can be written there; the message names `path`.
    """
    path = Path(path)
    _check_replaceable(path)
    temporary = _temporary_beside(path)
    try:
        with _errors_name(path, temporary):
            temporary.mkdir()
            yield temporary
        _check_replaceable(path)
        _replace_folder(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


class KeptErrorFile(io.FileIO):
    """A file to write that keeps its first error, for the writer to raise.

    HDF5 loses the errors of what it writes late, and a process that closes an HDF5 file on a full
    disk can crash. Here HDF5 sees no error; whoever writes asks for it with `check`. The file is
    held until it is closed, so that others see that it is being written.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path, "w+")
        self._error: OSError | None = None
        hold(self)

    def write(self, data: Any) -> int:
        """Write all the data, or keep the error; after an error write nothing more."""
        view = memoryview(data).cast("B")
        written = 0
        try:
            while self._error is None and written < len(view):
                written += super().write(view[written:])
        except OSError as error:
            self._error = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or keep the error."""
        try:
            return super().truncate(size)
        except OSError as error:
            self._error = self._error or error
            return size or 0

    def check(self, path: Path) -> None:
        """Raise the error that was kept, naming `path`."""
        if self._error is not None:
            raise OSError(f"{path}: could not be written: {self._error.strerror}") from self._error


def check_folder(path: Path) -> None:
    """Raise FileNotFoundError unless the folder is there in which a file shall be written."""
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")


@contextmanager
def _errors_name(path: Path, temporary: Path) -> Iterator[None]:
    """Let errors of writing under a temporary name bear the name that was asked for.

    Those of `write` bear none, and those of `shutil.copyfile` first that of the file it read.
    """
    try:
        yield
    except OSError as error:
        names = [name for name in (error.filename, error.filename2) if isinstance(name, str | Path)]
        ours = any(Path(name).is_relative_to(temporary) for name in names)
        if ours or (not names and error.errno in _NO_ROOM):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise


def _temporary_beside(path: Path) -> Path:
    check_folder(path)
    return path.with_name(f".{path.stem}.{secrets.token_hex(4)}.part{path.suffix}")


def _check_replaceable(path: Path) -> None:
    if not path.exists() or (path.is_dir() and (path / RESULT_MARK).is_file()):
        return
    if not path.is_dir() or any(path.iterdir()):
        raise FileExistsError(
            f"{path}: holds something that is not a result of chipglow (no {RESULT_MARK}), "
            "expected a new or empty folder or earlier results"
        )


def _replace_folder(new: Path, path: Path) -> None:
    if not path.exists():
        new.replace(path)
        return
    old = _temporary_beside(path)
    path.replace(old)
    try:
        new.replace(path)
    except BaseException:
        old.replace(path)
        raise
    shutil.rmtree(old)
