"""Files that can be read more than once: no pipes, sockets or devices."""

import stat
from pathlib import Path
from typing import Final

_SPECIAL: Final = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def check_regular(path: Path) -> None:
    """Refuse a pipe, socket or device, which could make a reader wait for ever.

    Readers open a file several times, so that not even a pipe with data can be read.
    """
    try:
        kind = stat.S_IFMT(path.stat().st_mode)
    except OSError:  # the reader says what is wrong
        return
    if kind in _SPECIAL:
        raise ValueError(f"{path}: is {_SPECIAL[kind]}, expected a regular file")
