"""A digest at the end of the HDF5 files that chipglow writes: damage is found before HDF5 reads it.

HDF5 ignores what follows its own data, and programs that change a file cut it off.
"""

import subprocess
import sys
from hashlib import file_digest, sha256
from io import FileIO
from pathlib import Path
from typing import Final

import h5py

from chipglow.io import examine
from chipglow.text import check_own_data

PATIENCE: Final = 30.0
"""How long HDF5 may take to find its way through the smallest file, in s; it takes 0.2 s."""

PATIENCE_PER_BYTE: Final = 1e-6
"""How much longer for each byte, in s; it reads 200 MB/s."""

_MARK: Final = b"\nchipglow sha256:"
_LENGTH: Final = len(_MARK) + sha256().digest_size
_BLOCK: Final = 1 << 20


def append_digest(file: FileIO) -> None:
    """Append the digest of a file, open for reading and writing, to it."""
    file.seek(0)
    digest = file_digest(file, "sha256").digest()
    file.write(_MARK + digest)


def is_intact(path: Path) -> bool | None:
    """Whether a file is as it was when its digest was appended; None if it has no digest."""
    size = path.stat().st_size - _LENGTH
    if size < 0:
        return None
    computed = sha256()
    with path.open("rb") as file:
        file.seek(size)
        end = file.read()
        if not end.startswith(_MARK):
            return None
        file.seek(0)
        for start in range(0, size, _BLOCK):
            computed.update(file.read(min(_BLOCK, size - start)))
    return end == _MARK + computed.digest()


def check_file(path: Path) -> None:
    """Check an HDF5 file before it is read in this process.

    A file without a digest, or with one that does not match, is examined in a subprocess, as HDF5
    can loop for ever at a damaged file.

    Raises
    ------
    ValueError
        If the file is damaged, which names the dataset where that is known, if HDF5 takes too long
        or if the file takes data from other files.
    """
    intact = is_intact(path)
    if not intact and h5py.is_hdf5(path):
        _examine(path, "places" if intact is None else "whole")
    if intact is False:
        raise ValueError("the file is damaged: its digest does not match")
    check_own_data(path)


def _examine(path: Path, what: str) -> None:
    patience = PATIENCE + PATIENCE_PER_BYTE * path.stat().st_size
    command = [sys.executable, "-P", examine.__file__, str(path), what]
    try:
        done = subprocess.run(command, capture_output=True, timeout=patience, check=False)
    except subprocess.TimeoutExpired:
        raise ValueError(f"HDF5 had not read the file after {patience:.0f} s") from None
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        raise ValueError(said[-1] if said else f"HDF5 ended with code {done.returncode}")
