"""Output that is written completely or not at all."""

import ctypes
import errno
import os
import secrets
import shutil
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from glob import escape
from pathlib import Path
from threading import current_thread, main_thread
from types import MappingProxyType
from typing import Final

MANIFEST: Final = ".chipglow-files"
"""File in a folder of results that lists the files that chipglow wrote there, one a line."""

TOKEN: Final = "[0-9a-f]" * 8
"""Pattern of the random part of temporary names."""

_OF_THE_SYSTEM: Final = {MANIFEST, ".DS_Store", "Thumbs.db", "desktop.ini"}
_NO_ROOM: Final = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}

_AT_FDCWD: Final = -100
"""Argument of Linux's renameat2: paths are relative to the working folder."""

_RENAME_EXCHANGE: Final = 2
"""Flag of Linux's renameat2: exchange both."""

_INPUTS: ContextVar[Mapping[tuple[int, int], Path]] = ContextVar(
    "inputs", default=MappingProxyType({})
)
"""Files that no output replaces, by device and inode."""


@contextmanager
def preserved(inputs: Iterable[Path]) -> Iterator[None]:
    """Refuse each output that would replace one of these files while the block runs."""
    known = {(status.st_dev, status.st_ino): path for path in inputs if (status := path.stat())}
    token = _INPUTS.set(known)
    try:
        yield
    finally:
        _INPUTS.reset(token)


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Write a file under a temporary name in the same folder; move it into place at the end.

    An existing file is replaced; of a symbolic link the target. If the block raises, `path` stays
    as it was, and the temporary file is removed.
    """
    path = check_output(Path(path))
    with _temporary(path, Path.touch) as temporary:
        yield temporary
        temporary.replace(path)


@contextmanager
def atomic_folder(path: str | os.PathLike[str], force: bool = False) -> Iterator[Path]:
    """Fill a folder of results under a temporary name; move it into place at the end.

    Files that chipglow wrote there earlier are replaced. A folder with other files is refused; with
    `force` it keeps them. If the block raises, `path` stays as it was.
    """
    path = check_output_folder(Path(path), force)
    with _temporary(path, Path.mkdir) as temporary:
        yield temporary
        _write_manifest(temporary, _files(temporary))
        check_output_folder(path, force)
        with uninterrupted():
            _replace_folder(temporary, path)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold signals back that would raise an exception; they are sent again when the block ends."""
    if current_thread() is not main_thread():  # where no signal is handled
        yield
        return
    held: list[int] = []
    handlers = {
        number: signal.getsignal(number)
        for number in (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))
        if callable(signal.getsignal(number))
    }
    for number in handlers:
        signal.signal(number, lambda number, frame: held.append(number))
    try:
        yield
    except KeyboardInterrupt:
        held.clear()  # what it would tell is under way
        raise
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if held:
            signal.raise_signal(held[0])


def check_output(path: Path) -> Path:
    """Check that a file can be written; return it or, if it is a symbolic link, its target."""
    target = _checked_target(path)
    if target.is_dir():
        raise IsADirectoryError(f"{path}: is a folder, expected the name of a file")
    if target.exists() and not target.is_file():
        raise OSError(f"{path}: is a device or another special file, expected a regular file")
    if target.exists():
        status = target.stat()
        if other := _INPUTS.get().get((status.st_dev, status.st_ino)):
            raise ValueError(f"{path}: is also an input ({other}), expected another file")
    return target


def check_output_folder(path: Path, force: bool = False) -> Path:
    """Check that a folder of results can be written; return it or, of a link, its target."""
    target = _checked_target(path)
    if not target.exists():
        return target
    if not target.is_dir():
        raise NotADirectoryError(f"{path}: is not a folder")
    _check_writable(path, target)
    ours = written_files(target)
    place = Path(os.path.realpath(target))
    replaceable = {place / name for name in ours}
    for other in _INPUTS.get().values():
        inside = Path(os.path.realpath(other))
        if inside.is_relative_to(place) and inside not in replaceable:
            raise ValueError(f"{path}: holds the input {other}, expected another folder")
    foreign = sorted(_files(target) - ours)
    if foreign and not force:
        raise FileExistsError(
            f"{path}: holds {foreign[0]}, which chipglow did not write; choose a new or empty "
            "folder, or pass --force to keep it there"
        )
    return target


def written_files(folder: Path) -> set[str]:
    """Return the files in a folder that chipglow wrote, relative to it."""
    try:
        listed = (folder / MANIFEST).read_text(encoding="utf-8").splitlines()
    except (OSError, ValueError):
        return set()
    return _files(folder).intersection(listed)


def _checked_target(path: Path) -> Path:
    target = Path(os.path.realpath(path)) if path.is_symlink() else path
    if target.is_symlink():
        raise OSError(f"{path}: is a loop of links, expected the name of a file or folder")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {target.parent}")
    _check_writable(path, target.parent)
    return target


def _check_writable(path: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK):
        raise PermissionError(f"{path}: the folder {folder} is not writable")


@contextmanager
def errors_name(path: Path, temporary: Path) -> Iterator[None]:
    """Let errors of writing under a temporary name bear the name that was asked for.

    Errors of `write` have none; errors of `shutil.copyfile` first name the file that was read.
    """
    try:
        yield
    except OSError as error:
        names = [name for name in (error.filename, error.filename2) if isinstance(name, str | Path)]
        ours = any(Path(name).is_relative_to(temporary) for name in names)
        if ours or (not names and error.errno in _NO_ROOM):
            raise OSError(error.errno, error.strerror, str(path)) from error
        raise


@contextmanager
def _temporary(path: Path, create: Callable[[Path], None]) -> Iterator[Path]:
    """Hold a new file or folder next to `path`; remove it, and before it what ended runs left."""
    place = path.absolute()  # "." has no name
    for left in place.parent.glob(f".{escape(place.stem)}.{TOKEN}.part{escape(place.suffix)}"):
        if (lock := _lock(left)) is not None:
            _remove(left)
            os.close(lock)
    temporary = place.with_name(f".{place.stem}.{secrets.token_hex(4)}.part{place.suffix}")
    lock = None
    try:
        with errors_name(path, temporary):
            create(temporary)
            lock = _lock(temporary)
            yield temporary
    finally:
        _remove(temporary)
        if lock is not None:
            os.close(lock)


def _remove(part: Path) -> None:
    if part.is_dir():
        shutil.rmtree(part, ignore_errors=True)
    else:
        part.unlink(missing_ok=True)


def _lock(part: Path) -> int | None:
    """Hold a file or folder until the descriptor is closed; None if that is not possible."""
    if sys.platform == "win32":  # where an open file cannot be moved
        return None
    try:
        descriptor = os.open(part, os.O_RDONLY)
    except OSError:
        return None
    if hold(descriptor):
        return descriptor
    os.close(descriptor)
    return None


@contextmanager
def exclusive(folder: Path, refusal: str) -> Iterator[None]:
    """Hold a folder for this process while the block runs.

    Raises a ValueError with the text `refusal` if it is held already. Systems and file systems
    without locks hold nothing.
    """
    if sys.platform == "win32":
        yield
        return
    import fcntl

    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(refusal) from None
        except OSError:  # a file system without locks
            pass
        yield
    finally:
        os.close(descriptor)


def hold(descriptor: int) -> bool:
    """Lock a file until it is closed or the process ends; False if someone else holds it."""
    if sys.platform == "win32":  # which keeps an open file from being deleted by itself
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _files(folder: Path) -> set[str]:
    """Return all files and links in a folder, relative to it."""
    found = (entry for entry in folder.rglob("*") if entry.is_symlink() or not entry.is_dir())
    return {
        entry.relative_to(folder).as_posix() for entry in found if entry.name not in _OF_THE_SYSTEM
    }


def _write_manifest(folder: Path, names: Iterable[str]) -> None:
    text = "".join(f"{name}\n" for name in sorted(names))
    (folder / MANIFEST).write_text(text, encoding="utf-8")


def _replace_folder(new: Path, path: Path) -> None:
    """Move new results to their place; `path` holds results, the old or the new, at any time."""
    if not path.exists():
        new.replace(path)
        return
    only_ours = _files(path) == written_files(path)
    # A process in an exchanged folder would stay in the old one.
    around_us = Path.cwd().is_relative_to(path.resolve())
    if not only_ours or around_us or not _exchange(new, path):
        _replace_files(new, path)


def _exchange(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system cannot."""
    if sys.platform != "linux":
        return False
    try:
        rename = ctypes.CDLL(None).renameat2
    except (OSError, AttributeError):
        return False
    names = (_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(other))
    return bool(rename(*names, _RENAME_EXCHANGE) == 0)


def _replace_files(new: Path, path: Path) -> None:
    """Move new results to their place file by file; other files stay."""
    before, names = written_files(path), _files(new)
    if taken := names & (_files(path) - before):
        raise FileExistsError(f"{path}: holds {min(taken)}, which chipglow did not write")
    _write_manifest(path, before | names)
    for name in names:
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (new / name).replace(path / name)
    for name in before - names:
        (path / name).unlink()
    _write_manifest(path, names)
